"""Figure 2: damping and stiffness that step at 2 s, identified from a free decay (working condition 1)."""

import argparse
import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from clearance_mj.identify.oscillator import CONDITIONS, free_decay, rms_error, sdof

SNRS = (100, 20)  # dB
BAND = (50.0, 110.0)  # Hz
FORMS = {
    "corrected": {},
    "Eq. 12 as printed": {"correction": "none"},
    "Eq. 17 as printed": {"damping": "as-printed"},
}
COLOURS = ("#0072b2", "#e69f00", "#d55e00")


def identify(decay) -> dict:
    return {form: sdof(decay.signal, decay.fs, decay.mass, BAND, **options) for form, options in FORMS.items()}


def errors(clean, found) -> dict:
    """{(quantity, form): largest RMS error of what was found, %}"""
    return {
        (name, form): 100 * max(rms_error(getattr(r[form], name), getattr(clean, name), r[form].valid) for r in found)
        for name in ("k", "c")
        for form in FORMS
    }


def draw(clean, results, errors) -> Figure:
    figure = Figure(figsize=(7.5, 5.4), layout="constrained")
    axes = figure.subplots(2, len(SNRS), sharex=True, sharey="row")
    rows = (("c", "damping c (N s/m)"), ("k", "stiffness k (N/m)"))
    for row, (name, label) in zip(axes, rows):
        for ax, snr in zip(row, SNRS):
            for form, colour in zip(FORMS, COLOURS):
                legend = f"{form}: {errors[snr][name, form]:.3g} %"
                ax.plot(clean.time, getattr(results[snr][form], name), color=colour, lw=1.2, label=legend)
            ax.plot(clean.time, getattr(clean, name), "k:", lw=1, label="known")
            ax.set_title(f"SNR {snr} dB", fontsize=9, loc="left")
            ax.legend(fontsize=7, title="largest RMS error over seeds", title_fontsize=7, frameon=False)
            ax.grid(alpha=0.3)
        row[0].set_ylabel(label)
    for ax in axes[-1]:
        ax.set_xlabel("time (s)")
    return figure


def main(number: int, name: str) -> None:
    """Identify one working condition and write NAME.png, NAME.csv (the curves) and NAME_errors.csv."""
    parser = argparse.ArgumentParser(description=f"Working condition {number} of the article, identified")
    parser.add_argument("--out", type=Path, default=Path("results/figures"), help="folder for PNG and CSV")
    parser.add_argument("--seeds", type=int, default=5, help="noises for the errors")
    arguments = parser.parse_args()
    out, seeds = arguments.out, range(arguments.seeds)
    out.mkdir(parents=True, exist_ok=True)
    clean = free_decay(CONDITIONS[number])
    found = {snr: [identify(clean.with_noise(snr, seed)) for seed in seeds] for snr in SNRS}
    results = {snr: found[snr][0] for snr in SNRS}
    scores = {snr: errors(clean, found[snr]) for snr in SNRS}
    draw(clean, results, scores).savefig(out / f"{name}.png", dpi=150)

    curves = {"time_s": clean.time, "k_known": clean.k, "c_known": clean.c}
    for snr in SNRS:
        for form, result in results[snr].items():
            curves |= {f"{q} {form}, {snr} dB": getattr(result, q) for q in ("k", "c")}
    rows = np.transpose(list(curves.values()))[::8]
    write(out / f"{name}.csv", curves, ([f"{value:.7g}" for value in row] for row in rows))
    table = [(snr, *key, f"{value:.3g}") for snr in SNRS for key, value in scores[snr].items()]
    write(out / f"{name}_errors.csv", ("snr_db", "quantity", "form", "largest_rms_error_percent"), table)
    for row in table:
        print("SNR {:3d} dB  {}  {:18s} {:>8s} %".format(*row))


def write(path, header, rows) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([header, *rows])


if __name__ == "__main__":
    main(1, "figure_02")
