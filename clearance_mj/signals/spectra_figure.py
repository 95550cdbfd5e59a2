"""Figures of spectra: what `Spectra.plot` returns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from ..core.drawing import COLOURS, canvas, decibel, envelope, phase, tidy

__all__ = ["spectra_figure"]

ROW_HEIGHT = 1.9  # in, of one row of panels
LEVELS = ("auto spectrum", "cross spectrum", "power spectral density", "energy spectral density", "spectrum")


class Functions(Protocol):
    """Spectra."""

    @property
    def kind(self) -> str: ...
    @property
    def abscissa(self) -> np.ndarray: ...
    @property
    def value(self) -> np.ndarray: ...
    @property
    def units(self) -> tuple[str, ...]: ...
    @property
    def labels(self) -> tuple[str, ...]: ...
    @property
    def axis(self) -> str: ...
    @property
    def axis_unit(self) -> str: ...


def spectra_figure(spectra: Functions, rows: Sequence[int]) -> Figure:
    """Draw functions, two in a line; complex ones with their phase below."""
    with_phase = np.iscomplexobj(spectra.value)
    columns = min(2, len(rows))
    figure = canvas((ROW_HEIGHT + 0.9 * with_phase) * -(-len(rows) // columns))
    cells = figure.subfigures(-(-len(rows) // columns), columns, squeeze=False)
    along = f"{spectra.axis.capitalize()} ({spectra.axis_unit or '1'})"
    for cell, row in zip(cells.flat, rows):
        heights = (2, 1) if with_phase else (1,)
        axes = np.ravel(np.asarray(cell.subplots(len(heights), 1, sharex=True, height_ratios=heights)))
        value, look = spectra.value[row], {"color": COLOURS[0], "lw": 0.9}
        marks = {"marker": "o"} if spectra.abscissa.size == 1 else {}
        drawn, words = _magnitude(value, spectra.kind, spectra.units[row])
        axes[0].plot(*(spectra.abscissa, drawn) if marks else envelope(spectra.abscissa, drawn), **look, **marks)
        tidy(axes[0], spectra.labels[row], words)
        if spectra.kind.endswith("coherence"):
            axes[0].set_ylim(0, 1.05)
        if with_phase:
            axes[1].plot(spectra.abscissa, phase(value), **look, **marks)
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
