"""Figure of an updated rig: measured and fitted spectra of its quiet record, parameters before and after."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ..identify import RigUpdate
from .style import COLOURS, FONT, REPEAT, TEST, Drawing, canvas, decibel, frequency_axis, tidy

__all__ = ["draw"]

START, FOUND = "#e69f00", COLOURS[0]
MOST_CHANNELS = 4
"""spectra that are drawn"""


def draw(found: RigUpdate) -> Drawing:
    """Draw spectra of the longest quiet piece, and every parameter in prior standard deviations."""
    count = len(found.estimates.names)
    figure = canvas(4.2 + 0.13 * count)
    upper, lower = np.asarray(figure.subfigures(2, 1, height_ratios=(4.2, 0.13 * count))).tolist()
    piece = max(found.misfit, key=lambda m: m.duration)
    shown = np.unique(np.linspace(0, len(found.channels) - 1, MOST_CHANNELS).astype(int))
    axes = np.atleast_1d(upper.subplots(-(-len(shown) // 2), 2, sharex=True)).ravel()
    looks = (("measured", piece.measured, TEST, 1.4), ("rig file", piece.before, START, 0.8),
             ("updated", piece.fitted, FOUND, 0.8))  # fmt: skip
    for ax, row in zip(axes, shown):
        for label, value, colour, width in looks:
            ax.plot(piece.frequency, decibel(value[row]), color=colour, lw=width, label=label)
        frequency_axis(ax, (float(piece.frequency[0]), float(piece.frequency[-1])), labelled=True)
        tidy(
            ax,
            f"{found.channels[row]}, misfit {100 * piece.share[row]:.1f} %",
            "Spectrum (dB re any)",
            "Frequency (Hz)",
        )
    axes[0].legend(fontsize=FONT - 1, frameon=False)
    _parameters(lower.subplots(), found)
    caption = (
        f"Quiet beginning of record {piece.record}, {piece.duration:.1f} s: measured, of the rig file and of the "
        "updated rig. Below, every parameter with its standard deviation, from where it was, in prior standard "
        "deviations: grey what was known before."
    )
    return Drawing("updated_rig", figure, caption, f"Updated rig {found.rig.name}: spectra and {count} parameters.")


def _parameters(ax: Axes, found: RigUpdate) -> None:
    fit = found.estimates
    width = np.array([p.prior_std for p in fit.parameters])
    moved = np.array([p._forward(v) - p._forward(p.start) for p, v in zip(fit.parameters, fit.value)]) / width
    y = np.arange(moved.size)
    ax.errorbar(0 * moved, y, xerr=1.0, fmt="none", ecolor=REPEAT, elinewidth=4, alpha=0.4, label="prior")
    ax.errorbar(moved, y, xerr=found.told, fmt="o", color=FOUND, ms=3, elinewidth=1, label="with the records")
    tidy(ax, "parameters", "", "From the prior's mean, in its standard deviations (1)")
    ax.set_yticks(y, fit.names, fontsize=FONT - 2)
    ax.invert_yaxis()
    ax.legend(fontsize=FONT - 1, frameon=False)
