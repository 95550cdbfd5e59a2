"""Figures of spectra: what `Spectra.plot` returns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..core.drawing import COLOURS, canvas, decibel, envelope, phase, tidy

__all__ = ["spectra_figure"]

ROW_HEIGHT = 1.9  # in, of one row of panels
LEVELS = ("auto spectrum", "cross spectrum", "power spectral density", "energy spectral density", "spectrum")


def spectra_figure(
    kind: str, functions: Sequence[tuple[str, str, np.ndarray]], abscissa: np.ndarray, along: str
) -> Figure:
    """Draw functions of a kind, label, unit and values each, two in a line, over an axis in words; phases below."""
    with_phase = any(np.iscomplexobj(value) for _, _, value in functions)
    columns = min(2, len(functions))
    figure = canvas((ROW_HEIGHT + 0.9 * with_phase) * -(-len(functions) // columns))
    cells = figure.subfigures(-(-len(functions) // columns), columns, squeeze=False)
    look = {"color": COLOURS[0], "lw": 0.9}
    marks = {"marker": "o"} if abscissa.size == 1 else {}
    for cell, (label, unit, value) in zip(cells.flat, functions):
        heights = (2, 1) if with_phase else (1,)
        axes = np.ravel(np.asarray(cell.subplots(len(heights), 1, sharex=True, height_ratios=heights)))
        drawn, words = _magnitude(value, kind, unit)
        axes[0].plot(*(abscissa, drawn) if marks else envelope(abscissa, drawn), **look, **marks)
        tidy(axes[0], label, words)
        if kind.endswith("coherence"):
            axes[0].set_ylim(0, 1.05)
        if with_phase:
            axes[1].plot(abscissa, phase(value), **look, **marks)
            tidy(axes[1], ylabel="Phase (°)")
            axes[1].set_yticks([-180, 0, 180])
        axes[-1].set_xlabel(along, fontsize=axes[-1].yaxis.label.get_size())
        cell.align_ylabels(axes)
    return figure


def _magnitude(value: np.ndarray, kind: str, unit: str) -> tuple[np.ndarray, str]:
    """Return what is drawn, and the words beside it: a level in dB, ten times the logarithm of powers."""
    if kind not in LEVELS:
        return np.abs(value) if np.iscomplexobj(value) else value, f"{kind.capitalize()}\n({unit or '1'})"
    level = decibel(value) if kind == "spectrum" else decibel(value) / 2
    return np.where(np.isfinite(level), level, np.nan), f"{kind.capitalize()}\n(dB re {f'1 {unit}' if unit else '1'})"
