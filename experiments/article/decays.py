"""Stiffness and damping identified from free decays whose parameters are known: Figures 2 and 3."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.identify import sdof
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table

from .free_decays import CONDITIONS, Decay, free_decay, rms_error
from .result import BLACK, BLUE, FONT, ORANGE, VERMILION, Item, Result, panel, rounded, sheet, to_table

BAND = (50.0, 110.0)  # Hz
FORMS = {
    "corrected": {}, "Eq. 12 as printed": {"correction": "none"}, "Eq. 17 as printed": {"damping": "as-printed"},
}  # fmt: skip
QUANTITIES = {"c": "Damping c (N s/m)", "k": "Stiffness k (N/m)"}
THIN = 8  # Of so many samples the CSV holds one
PRIOR = {
    "corrected": "displacement, mass and a band for the frequency; c = 2m(-A'/A - ω'/(2ω))",
    "Eq. 12 as printed": "the same; c = -2m A'/A",
    "Eq. 17 as printed": "the same; c = 4mωζ",
}


def working_condition(item: Item, quick: bool, number: int, snrs: Sequence[float] = (100, 20), seeds: int = 5):
    """Identify one of the article's working conditions, 1 or 2, under noises of some signal-to-noise ratios, dB.

    The errors are the largest over ``seeds`` noises (quick: one); the first ratio is shown with every form.
    """
    clean = free_decay(CONDITIONS[number])
    noises = range(1 if quick else seeds)
    identified = {snr: [_identify(clean.with_noise(snr, seed)) for seed in noises] for snr in snrs}
    errors = _errors(clean, identified)
    first = {snr: runs[0] for snr, runs in identified.items()}
    caption = (
        f"(a), (b): corrected form at {' and '.join(f'{snr:g}' for snr in snrs)} dB; (c), (d): every form at "
        f"{snrs[0]:g} dB, where Eq. 17 as printed is twice the known damping. Curves of one noise."
    )
    alt = "Damping and stiffness over time, known and identified."
    return Result(
        method=(
            "A free decay of 0.025 kg is integrated with the known k(t) and c(t), white noise is added, and both are "
            f"identified from the Morlet ridge between {BAND[0]:g} and {BAND[1]:g} Hz. Errors are relative RMS over "
            f"the valid samples, the largest over the noises (noises: {len(noises)})."
        ),
        shows=_shows(errors, snrs),
        drawings=(Drawing(item.name, _draw(clean, first), caption, alt),),
        data={item.name: _curves(clean, first), f"{item.name}_errors": errors},
        tables=(_table(errors),),
        prior_information=PRIOR,
    )


def _identify(decay: Decay) -> dict:
    return {form: sdof(decay.signal, decay.fs, decay.mass, BAND, **options) for form, options in FORMS.items()}


def _errors(clean: Decay, identified: dict) -> pd.DataFrame:
    def worst(snr, quantity, form):
        results = [run[form] for run in identified[snr]]
        return 100 * max(rms_error(getattr(r, quantity), getattr(clean, quantity), r.valid) for r in results)

    return pd.DataFrame(
        {"snr_db": snr, "quantity": quantity, "form": form, "largest_rms_error_percent": worst(snr, quantity, form)}
        for snr in identified
        for quantity in QUANTITIES
        for form in FORMS
    )


def _table(errors: pd.DataFrame) -> Table:
    columns = (Column("SNR", "dB", "g"), Column("Quantity"), *(Column(form, "%", ".3g") for form in FORMS))
    value = errors.set_index(["snr_db", "quantity", "form"])["largest_rms_error_percent"]
    rows = [
        (snr, quantity, *(value[snr, quantity, form] for form in FORMS))
        for snr in errors["snr_db"].unique()
        for quantity in QUANTITIES
    ]
    return to_table("errors", "Largest relative RMS error over the noises", columns, rows)


def _curves(clean: Decay, first: dict) -> pd.DataFrame:
    columns = {"time_s": clean.time, "c_known": clean.c, "k_known": clean.k}
    for snr, results in first.items():
        columns |= {f"{q} {form}, {snr:g} dB": getattr(r, q) for form, r in results.items() for q in QUANTITIES}
    return rounded(pd.DataFrame(columns)[::THIN], 7)


def _draw(clean: Decay, first: dict) -> Figure:
    figure = sheet(4.6)
    axes, snr = figure.subplots(2, 2, sharex=True, sharey="col"), next(iter(first))
    upper = {f"SNR {level:g} dB": results["corrected"] for level, results in first.items()}
    for row, curves, colours in zip(axes, (upper, first[snr]), ((BLUE, ORANGE), (BLUE, ORANGE, VERMILION))):
        for ax, quantity in zip(row, QUANTITIES):
            ax.plot(clean.time, getattr(clean, quantity), color=BLACK, lw=2.2, alpha=0.35, label="known")
            for (label, result), colour in zip(reversed(curves.items()), colours[len(curves) - 1 :: -1]):
                style = "--" if label == "Eq. 12 as printed" else "-"
                ax.plot(clean.time, getattr(result, quantity), color=colour, lw=1.1, ls=style, label=label)
    titles = ("(a) damping", "(b) stiffness", f"(c) damping, {snr:g} dB", f"(d) stiffness, {snr:g} dB")
    for i, (ax, title, quantity) in enumerate(zip(axes.flat, titles, [*QUANTITIES] * 2)):
        panel(ax, title, "Time (s)" if i > 1 else "", QUANTITIES[quantity])
        if i % 2 == 0:
            ax.legend(fontsize=FONT - 1, frameon=False)
    for ax in axes[0]:
        ax.set_ylim(0, 1.25 * ax.get_ylim()[1])  # room for the legend; rows share it
    return figure


def _shows(errors: pd.DataFrame, snrs: Sequence[float]) -> str:
    value = errors.set_index(["snr_db", "quantity", "form"])["largest_rms_error_percent"]
    printed = " and ".join(f"{value[snrs[0], 'c', form]:.3g} % with {form}" for form in [*FORMS][1:])
    return f"At {snrs[0]:g} dB the damping is in error by {printed}."
