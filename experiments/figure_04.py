"""Figure 4: damping identified at single scales, in three sequences, and what each scale costs."""

import argparse
from pathlib import Path

import numpy as np
from figure_02 import write
from matplotlib.figure import Figure

from clearance_mj.identify.oscillator import SCALE_CONDITION, SCALE_SEQUENCES, free_decay, scale_study

SNRS = (100, 40, 20)  # dB
FS = 1024.0  # Hz
PRINTED = {-6.0: 3200, -6.25: 3800, -6.5: 4400, -6.75: 5200, -7.0: 6400}
HEADER = (
    "sequence", "log2_scale", "points", "points_printed", "products", "seconds", "k_error_percent",
    *(f"c_error_percent_{snr}dB_median" for snr in SNRS),
)  # fmt: skip


def draw(study, error, known) -> Figure:
    figure = Figure(figsize=(10, 6.4), layout="constrained")
    axes = figure.subplots(2, 3)
    for column, sequence in zip(axes.T, SCALE_SEQUENCES):
        exponents = [exponent(scale) for scale in sequence]
        for scale in sequence:
            column[0].plot(study[scale].time, study[scale].c, lw=1, ls="--", label=f"2^{exponent(scale):g}")
        column[0].plot(known.time, known.c, "k", lw=1, label="known")
        column[0].set(xlabel="time (s)", ylabel="damping c (N s/m), SNR 40 dB", ylim=(0, 0.12))
        column[0].legend(fontsize=7, ncols=2)
        for snr, marker in zip(SNRS, "os^"):
            column[1].semilogy(exponents, [error[snr, scale] for scale in sequence], marker, ls="-", label=f"{snr} dB")
        column[1].axvline(exponent(5.0 / np.sqrt(8000 / known.mass)), color="k", ls=":", lw=1, label="ω0/ω")
        column[1].set(xlabel="log2 of the scale (s)", ylabel="RMS error of c (%), median over seeds")
        column[1].legend(fontsize=7)
    return figure


def exponent(scale) -> float:
    return float(np.round(np.log2(scale), 3))


def main() -> None:
    parser = argparse.ArgumentParser(description="Scale study of the article's Figure 4")
    parser.add_argument("--out", type=Path, default=Path("results/figures"), help="folder for PNG and CSV")
    parser.add_argument("--seeds", type=int, default=20, help="noises for each scale")
    arguments = parser.parse_args()
    out, seeds = arguments.out, range(arguments.seeds)
    out.mkdir(parents=True, exist_ok=True)
    known = free_decay(SCALE_CONDITION, duration=4.55, fs=FS)
    scales = sorted({scale for sequence in SCALE_SEQUENCES for scale in sequence})
    runs = {snr: [scale_study(known.with_noise(snr, seed), scales) for seed in seeds] for snr in SNRS}
    error = {
        (snr, scale): 100 * float(np.median([run[i].c_error for run in runs[snr]]))
        for snr in SNRS
        for i, scale in enumerate(scales)
    }
    study = dict(zip(scales, runs[40][0]))
    draw(study, error, known).savefig(out / "figure_04.png", dpi=150)
    rows = [
        (number, exponent(scale), study[scale].points, PRINTED.get(exponent(scale), ""), study[scale].products,
         f"{study[scale].seconds:.3f}", f"{100 * study[scale].k_error:.3g}", *(f"{error[s, scale]:.3g}" for s in SNRS))
        for number, sequence in enumerate(SCALE_SEQUENCES, 1)
        for scale in sequence
    ]  # fmt: skip
    write(out / "figure_04.csv", HEADER, rows)
    for row in (HEADER, *rows):
        print("  ".join(f"{item!s:>8s}" for item in row))
    for snr in SNRS:
        best = min(scales, key=lambda scale: error[snr, scale])
        print(f"SNR {snr} dB: least error of c at 2^{exponent(best):g}, {error[snr, best]:.3g} %")


if __name__ == "__main__":
    main()
