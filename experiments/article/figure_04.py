"""Figure 4: damping identified at single scales, in three sequences, and what each scale costs."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table

from .free_decays import MASS, SCALE_CONDITION, SCALE_SEQUENCES, free_decay, scale_study
from .result import BLACK, BLUE, FONT, GREEN, ORANGE, PURPLE, SKY, VERMILION, Item, Result, panel, sheet, to_table

FS = 1024.0  # Hz
DURATION = 4.55  # s: the widest wavelet lies within it at the first and at the last of the article's 4 s
PRINTED = {-6.0: 3200, -6.25: 3800, -6.5: 4400, -6.75: 5200, -7.0: 6400}
"""Translations as the article prints them, by the exponent of the scale"""
COLOURS = (SKY, ORANGE, GREEN, VERMILION, BLUE, PURPLE)
SHOWN = 40  # dB, of the curves


def run(item: Item, quick: bool, snrs: Sequence[float] = (100, SHOWN, 20), seeds: int = 20) -> Result:
    """Identify the decay of Figure 4 at single scales; errors are medians over noises (quick: one, at one ratio)."""
    if quick:
        snrs, seeds = (SHOWN,), 1
    known = free_decay(SCALE_CONDITION, DURATION, FS)
    scales = sorted({scale for sequence in SCALE_SEQUENCES for scale in sequence})
    noises = range(seeds)
    runs = {snr: [scale_study(known.with_noise(snr, seed), scales) for seed in noises] for snr in snrs}
    study = dict(zip(scales, runs[SHOWN][0]))
    error = {
        (snr, scale): 100 * float(np.median([run[i].c_error for run in runs[snr]]))
        for snr in snrs
        for i, scale in enumerate(scales)
    }
    rows = _rows(study, error, snrs)
    caption = (
        f"Sequences 1 to 3 of scales a. (a)-(c): damping at each scale, SNR {SHOWN} dB; (d)-(f): its RMS error, median "
        f"of {len(noises)} noises, which is least near the ridge a = ω0/ω (dotted)."
    )
    alt = "Damping over time at single scales in three sequences, and its error over the scale."
    return Result(
        method=(
            "Translations b = a(16κ + 8), κ = 0 : 0.005 : T/(4a), on 4 s of the decay of 0.025 kg and 8000 N/m; Morlet "
            "wavelet with ω0 = 5; c = -2m A'/A from a local slope of ln A at every scale."
        ),
        shows=_shows(error, scales, snrs),
        drawings=(Drawing(item.name, _draw(study, error, known, snrs), caption, alt),),
        data={item.name: rows},
        tables=(_table(rows, snrs),),
        prior_information={"each scale": "displacement, mass and scale, not the frequency"},
    )


def _exponent(scale) -> float:
    return float(np.round(np.log2(scale), 3))


def _ridge_exponent() -> float:
    """Return the scale whose centre frequency is the decay's, at 8000 N/m and ω0 = 5."""
    return float(np.log2(5.0 / np.sqrt(8000.0 / MASS)))


def _rows(study, error, snrs) -> pd.DataFrame:
    rows = [
        {"sequence": number, "log2_scale": _exponent(scale), "points": study[scale].points}
        | {"points_printed": PRINTED.get(_exponent(scale)), "products": study[scale].products}
        | {"k_error_percent": 100 * study[scale].k_error}
        | {f"c_error_percent_{snr:g}dB_median": error[snr, scale] for snr in snrs}
        for number, sequence in enumerate(SCALE_SEQUENCES, 1)
        for scale in sequence
    ]
    return pd.DataFrame(rows).astype({"points_printed": "Int64"})


def _table(rows, snrs) -> Table:
    columns = (
        Column("Scale", "log2 s", "g"), Column("Translations", "", "d"), Column("as printed", "", "d"),
        *(Column(f"Error of c, {snr:g} dB", "%", ".3g") for snr in snrs),
    )  # fmt: skip
    shown = rows.drop_duplicates("log2_scale").sort_values("log2_scale")
    shown = shown.drop(columns=["sequence", "products", "k_error_percent"])
    return to_table("scales", "Translations and median error of each scale", columns, shown)


def _shows(error, scales, snrs) -> str:
    best = {snr: min(scales, key=lambda scale: error[snr, scale]) for snr in snrs}
    words = (f"at {snr:g} dB 2^{_exponent(scale):g} ({error[snr, scale]:.2g} %)" for snr, scale in best.items())
    return f"Least error of c: {', '.join(words)}. The ridge's scale ω0/ω is 2^{_ridge_exponent():.2f}."


def _draw(study, error, known, snrs) -> Figure:
    figure = sheet(5.0)
    axes = figure.subplots(2, 3, sharey="row")
    for i, (column, sequence) in enumerate(zip(axes.T, SCALE_SEQUENCES)):
        exponents = [_exponent(scale) for scale in sequence]
        column[0].plot(known.time, known.c, color=BLACK, lw=1, label="known")
        for scale, exponent, colour in zip(sequence, exponents, COLOURS):
            column[0].plot(
                study[scale].time, study[scale].c, color=colour, lw=1, ls="--", label=f"2$^{{{exponent:g}}}$"
            )
        for snr, marker, colour in zip(snrs, "os^", (BLUE, ORANGE, VERMILION)):
            values = [error[snr, scale] for scale in sequence]
            column[1].semilogy(exponents, values, marker, ls="-", lw=1, ms=4, color=colour, label=f"{snr:g} dB")
        column[1].axvline(_ridge_exponent(), color=BLACK, ls=":", lw=1)
        panel(column[0], f"({'abc'[i]}) sequence {i + 1}", "Time (s)", "" if i else "Damping c (N s/m)")
        panel(column[1], f"({'def'[i]})", "log$_2$ of scale a over 1 s", "" if i else "RMS error of c (%)")
        column[0].set_ylim(0, 0.12)
        column[0].legend(fontsize=FONT - 1.5, ncols=2, loc="upper left", edgecolor="none", framealpha=0.9)
    axes[1, 0].legend(fontsize=FONT - 1, frameon=False, title="SNR", title_fontsize=FONT - 1)
    return figure
