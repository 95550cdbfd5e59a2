"""Figures of an updated rig: measured and fitted spectra of its longest record, parameters before and after."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from ..estimate.estimates import Estimates
from ..identify import RigUpdate
from .style import COLOURS, FONT, REPEAT, TEST, Drawing, canvas, decibel, frequency_axis, tidy

__all__ = ["draw", "draw_parameters", "draw_spectra"]

START, FOUND = "#e69f00", COLOURS[0]
MAX_CHANNELS = 4  # spectra that are drawn
ROW = 0.13  # in, of a parameter


def draw(update: RigUpdate) -> Drawing:
    """Draw spectra of the longest record, and every parameter in prior standard deviations."""
    count = len(update.estimates.names)
    figure = canvas(4.2 + ROW * count)
    upper, lower = np.asarray(figure.subfigures(2, 1, height_ratios=(4.2, ROW * count))).tolist()
    spectra_words = _plot(upper, update)
    _draw_parameters(lower.subplots(), update.estimates)
    caption = f"{spectra_words} Below, {PARAMETER_WORDS}"
    return Drawing("updated_rig", figure, caption, f"Updated rig {update.rig.name}: spectra and {count} parameters.")


def draw_spectra(update: RigUpdate) -> Drawing:
    """Draw spectra of the longest record, measured and of the rig before and after."""
    figure = canvas(4.2)
    caption = f"{_plot(figure, update)} Each rig is under the forces in its clearances that meet all sensors best."
    alt = f"Spectra of record and updated rig {update.rig.name} at some channels."
    return Drawing("spectra", figure, caption, alt, chart=True)


def draw_parameters(estimates: Estimates) -> Drawing:
    """Draw every parameter in prior standard deviations."""
    figure = canvas(1.0 + ROW * len(estimates.names))
    _draw_parameters(figure.subplots(), estimates)
    words = f"{PARAMETER_WORDS[0].upper()}{PARAMETER_WORDS[1:]}"
    return Drawing("parameters", figure, words, f"{len(estimates.names)} parameters before and after the records.")


PARAMETER_WORDS = (
    "every parameter with its standard deviation, from where it was, in prior standard deviations: grey what was known "
    "before."
)


def _plot(figure: FigureBase, update: RigUpdate) -> str:
    """Draw and return what it shows."""
    piece = max(update.misfit, key=lambda m: (m.is_whole, m.duration))
    shown = np.unique(np.linspace(0, len(update.channels) - 1, MAX_CHANNELS).astype(int))
    axes = np.atleast_1d(figure.subplots(-(-len(shown) // 2), 2, sharex=True)).ravel()
    looks = (("measured", piece.measured, TEST, 1.4), ("rig file", piece.before, START, 0.8),
             ("updated", piece.fitted, FOUND, 0.8))  # fmt: skip
    for ax, row in zip(axes, shown):
        for label, value, colour, width in looks:
            ax.plot(piece.frequency, decibel(value[row]), color=colour, lw=width, label=label)
        frequency_axis(ax, (float(piece.frequency[0]), float(piece.frequency[-1])), labelled=True)
        title = f"{update.channels[row]}, misfit {100 * piece.relative_error[row]:.1f} %"
        tidy(ax, title, "Spectrum (dB)", "Frequency (Hz)")
    axes[0].legend(fontsize=FONT - 1, frameon=False)
    return f"Record {piece.record}, {piece.duration:.1f} s: measured, of the rig file and of the updated rig."


def _draw_parameters(ax: Axes, fit: Estimates) -> None:
    width = np.array([p.known_std for p in fit.parameters])
    moved = np.array([p.to_varied(v) - p.to_varied(p.start) for p, v in zip(fit.parameters, fit.value)]) / width
    y = np.arange(moved.size)
    ax.errorbar(0 * moved, y, xerr=1.0, fmt="none", ecolor=REPEAT, elinewidth=4, alpha=0.4, label="prior")
    ax.errorbar(
        moved, y, xerr=fit.posterior_over_prior, fmt="o", color=FOUND, ms=3, elinewidth=1, label="with the records"
    )
    tidy(ax, "parameters", "", "From the prior's mean, in its standard deviations (1)")
    ax.set_yticks(y, fit.names, fontsize=FONT - 2)
    ax.set_ylim(moved.size - 0.5, -0.5)
    ax.legend(fontsize=FONT - 1, frameon=False)
