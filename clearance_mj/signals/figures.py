"""Figures of FRFs, spectra, comparisons and responses, for their `plot` methods and for reports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

from ..core.drawing import COLOURS, FONT, REPEAT, canvas, decibel, envelope, key, of_curves, phase, tidy
from ..core.errors import RecordError
from ..core.quantities import QUANTITIES

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "ROW_HEIGHT", "comparison_figure", "draw_correlation", "draw_functions", "draw_measures", "frf_figure",
    "measures_height", "response_figure", "spectra_figure",
]  # fmt: skip

ROW_HEIGHT = 2.8  # Inches, height of a function's magnitude, phase and coherence.
MEASURES = {"rmse_db": "RMSE (dB)", "mre": "MRE (1)", "frac": "FRAC (1)", "csac": "CSAC (1)", "csf": "CSF (1)"}
UNIT_MEASURES = ("frac", "csac", "csf")  # measures from 0 to 1
HISTORIES = (("displacement", "Displacement", "mm", 1e3),
             ("contact_force", "Contact force", "N", 1.0), ("grease_force", "Grease force", "N", 1.0))  # fmt: skip
Look = dict[str, Any]
Correlation = tuple[np.ndarray, np.ndarray, np.ndarray, Iterable[float]]
"""Lines (n,), Hz, CSAC and CSF (n,), and the natural frequencies of the test, Hz; nan where they are not known"""


# FRF and Response draw themselves with these functions, so their modules import this one.
Functions: TypeAlias = Any
"""An `FRF`"""
Histories: TypeAlias = Any
"""A `Response`"""


def frf_figure(frfs: Mapping[str, Functions], rows: Sequence[int]) -> Figure:
    """Draw magnitude, phase and coherence of functions, in each panel one curve of each of the named FRFs."""
    widths = np.linspace(1.8, 1.0, len(frfs)) if len(frfs) > 1 else [1.1]
    looks = [{"color": colour, "lw": width} for colour, width in zip(COLOURS * len(frfs), widths)]
    figure = canvas((0.35 if len(frfs) > 1 else 0.1) + ROW_HEIGHT * -(-len(rows) // 2))
    if len(frfs) > 1:
        key(figure, of_curves(dict(zip(frfs, looks))))
    draw_functions(figure, list(zip(frfs.values(), looks)), rows)
    return figure


def draw_functions(
    figure: Figure, curves: Sequence[tuple[Functions, Look]], rows: Sequence[int], error: np.ndarray | None = None
) -> None:
    """Draw magnitude, phase and coherence of functions of like FRFs, two functions in a line.

    ``error`` (n_functions, n_f), dB: half the width of a band about the magnitudes of the first.
    """
    columns = min(2, len(rows))
    cells = figure.subfigures(-(-len(rows) // columns), columns, squeeze=False)
    for cell, row in zip(cells.flat, rows):
        _draw_function(cell, curves, row)
        if error is not None:
            first = curves[0][0]
            middle = decibel(first.functions[row])
            limits = middle - error[row], middle + error[row]
            cell.axes[0].fill_between(first.frequency, *limits, color=REPEAT, alpha=0.4, lw=0)


def _draw_function(cell: FigureBase, curves: Sequence[tuple[Functions, Look]], row: int) -> None:
    axes = cell.subplots(3, 1, sharex=True, height_ratios=(3, 1.4, 1))
    first = curves[0][0]
    unit = first.units[row]
    for frf, look in curves:
        style = look | _dots(frf.frequency)
        axes[0].plot(frf.frequency, decibel(frf.functions[row]), **style)
        axes[1].plot(frf.frequency, phase(frf.functions[row]), **style)
        if frf.coherence is not None:
            axes[2].plot(frf.frequency, frf.coherence.swapaxes(0, 1)[frf.measured.T][row], **style | {"lw": 0.8})
    tidy(axes[0], first.labels[row], f"Magnitude\n(dB re {'1' if unit == '1' else f'1 {unit}'})")
    tidy(axes[1], ylabel="Phase (°)")
    axes[1].set(ylim=(-190, 190), yticks=[-180, 0, 180])
    tidy(axes[2], ylabel="Coh. (1)", xlabel="Frequency (Hz)")
    axes[2].set(ylim=(0, 1.1), yticks=[0, 1])
    if all(frf.coherence is None for frf, _ in curves):
        axes[2].text(0.5, 0.5, "no coherence is known", transform=axes[2].transAxes, ha="center", va="center",
                     fontsize=FONT - 1)  # fmt: skip
    _limit_to_lines(axes[2], first.frequency)
    cell.align_ylabels(axes)


def _dots(frequency: np.ndarray) -> Look:
    """Return the style of a curve: one line alone would not show."""
    return {"marker": "o"} if frequency.size == 1 else {}


def _limit_to_lines(ax: Axes, frequency: np.ndarray) -> None:
    if frequency.size > 1:
        ax.set_xlim(*frequency[[0, -1]])


def comparison_figure(correlation: Correlation, per_sensor: pd.DataFrame) -> Figure:
    """Draw agreement over frequency, and the measures by sensor below."""
    height = measures_height(per_sensor)
    figure = canvas(2.6 + height)
    upper, lower = np.ravel(np.asarray(figure.subfigures(2, 1, height_ratios=(2.6, height))))
    draw_correlation(upper, correlation)
    draw_measures(lower, per_sensor)
    return figure


def draw_correlation(figure: FigureBase, correlation: Correlation) -> None:
    """Draw CSAC and CSF over frequency, with the natural frequencies of the test."""
    ax, (frequency, csac, csf, modes) = figure.subplots(), correlation
    for values, label, color, style in (
        (csac, "CSAC (shape)", COLOURS[0], "-"),
        (csf, "CSF (shape and level)", COLOURS[1], "--"),
    ):
        if np.isfinite(values).any():
            ax.plot(frequency, values, lw=1.3, label=label, color=color, ls=style, **_dots(frequency))
    for i, hz in enumerate(hz for hz in modes if np.isfinite(hz)):
        ax.axvline(hz, color=REPEAT, lw=0.8, ls=":", label="mode of the test" if i == 0 else None)
    tidy(ax, ylabel="CSAC, CSF (1)", xlabel="Frequency (Hz)")
    ax.set_ylim(0, 1.05)
    _limit_to_lines(ax, frequency)
    key(figure, ax.get_legend_handles_labels()[0], 3)


def measures_height(per_sensor: pd.DataFrame) -> float:
    """Return the height, in, that bars of all sensors need."""
    return max(2.9, 0.8 + 0.15 * len(per_sensor))


def draw_measures(figure: FigureBase, per_sensor: pd.DataFrame) -> None:
    """Draw bars of the measures by sensor."""
    labels = per_sensor["sensor"]
    axes = figure.subplots(1, len(MEASURES))
    for ax, (name, title) in zip(axes, MEASURES.items()):
        ax.barh(np.arange(len(labels)), per_sensor[name], color=COLOURS[0])
        tidy(ax, xlabel=title)
        ax.set_yticks(np.arange(len(labels)), labels if ax is axes[0] else [""] * len(labels))
        ax.invert_yaxis()
        if name in UNIT_MEASURES:
            ax.set_xlim(0, 1)
        if not np.isfinite(per_sensor[name]).any():
            ax.text(0.5, 0.5, "undefined", transform=ax.transAxes, ha="center", va="center", fontsize=FONT - 1)
    of_pairs = any("/" in label for label in labels)
    axes[0].set_ylabel(f"Sensor{'/reference' if of_pairs else ''} (node:direction)", fontsize=FONT)


def response_figure(response: Histories, sensors: Sequence[int], time: tuple[float, float]) -> Figure:
    """Draw excitation, sensors by quantity, and motion and forces at the bushings, over a stretch of time, s."""
    part = slice(*np.searchsorted(response.time, (time[0], np.nextafter(time[1], np.inf))))
    instants = response.time[part]
    if not instants.size:
        raise RecordError(f"no sample from {time[0]:g} to {time[1]:g} s; the response ends at {response.time[-1]:g} s")
    panels: list[tuple[str, dict[str, np.ndarray]]] = []
    for kind in dict.fromkeys(response.kinds):
        rows = {dof: row for dof, k, row in zip(response.references, response.kinds, response.inputs) if k == kind}
        panels.append(("Base acc. (m/s²)" if kind == "base" else "Force (N)", rows))
    names = [*response.responses] or [f"row {i + 1}" for i in range(len(response.channels))]
    for quantity in dict.fromkeys(response.quantities[i] for i in sensors):
        unit, factor = QUANTITIES[quantity].in_figures
        drawn = {names[i]: factor * response.channels[i] for i in sensors if response.quantities[i] == quantity}
        panels.append((f"{quantity.capitalize()} ({unit})", drawn))
    for field, words, unit, factor in HISTORIES:
        if (values := getattr(response, field)) is not None and len(values):
            panels.append((f"{words} ({unit})", _rows_of_bushings(response, factor * values)))
    if response.spin is not None:
        panels.append(("Spin (rev/min)", {"shaft": 30 / np.pi * response.spin}))
    figure = canvas(0.4 + 1.5 * len(panels))
    axes = np.ravel(figure.subplots(len(panels), 1, sharex=True))
    for ax, (label, curves) in zip(axes, panels):
        for (name, values), colour in zip(curves.items(), COLOURS * len(curves)):
            ax.plot(*envelope(instants, values[part]), color=colour, lw=0.6, label=name)
        tidy(ax, ylabel=label)
        legend = ax.legend(loc="upper left", bbox_to_anchor=(1, 1.05), fontsize=FONT - 1, frameon=False, handlelength=1)
        for line in legend.get_lines():
            line.set_linewidth(2)
    axes[-1].set_xlabel("Time (s)", fontsize=FONT)
    axes[-1].set_xlim(instants[0], instants[-1] if instants.size > 1 else instants[0] + 1 / response.fs)
    figure.align_ylabels(axes)
    return figure


def _rows_of_bushings(response: Histories, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the rows of the bushings by their names."""
    rows_of_name: dict[str, np.ndarray] = {}
    for j, rows in enumerate(response.clearance_rows, 1):
        names = [f"bushing {j}"] if rows.stop - rows.start == 1 else [f"bushing {j}, {axis}" for axis in "yz"]
        rows_of_name |= dict(zip(names, values[rows]))
    return rows_of_name


SPECTRUM_HEIGHT = 1.9  # in, of one row of panels
LEVELS = ("auto spectrum", "cross spectrum", "power spectral density", "energy spectral density", "spectrum")


def spectra_figure(
    kind: str, functions: Sequence[tuple[str, str, np.ndarray]], abscissa: np.ndarray, along: str
) -> Figure:
    """Draw functions of a kind, label, unit and values each, two in a line, over an axis in words; phases below."""
    with_phase = any(np.iscomplexobj(value) for _, _, value in functions)
    columns = min(2, len(functions))
    figure = canvas((SPECTRUM_HEIGHT + 0.9 * with_phase) * -(-len(functions) // columns))
    cells = figure.subfigures(-(-len(functions) // columns), columns, squeeze=False)
    look = {"color": COLOURS[0], "lw": 0.9}
    marks = {"marker": "o"} if abscissa.size == 1 else {}
    for cell, (label, unit, value) in zip(cells.flat, functions):
        heights = (2, 1) if with_phase else (1,)
        axes = np.ravel(np.asarray(cell.subplots(len(heights), 1, sharex=True, height_ratios=heights)))
        curve, words = _magnitude(value, kind, unit)
        axes[0].plot(*(abscissa, curve) if marks else envelope(abscissa, curve), **look, **marks)
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
    """Return the curve and its axis label: a level in dB, ten times the logarithm of powers."""
    if kind not in LEVELS:
        return np.abs(value) if np.iscomplexobj(value) else value, f"{kind.capitalize()}\n({unit or '1'})"
    level = decibel(value) if kind == "spectrum" else decibel(value) / 2
    return np.where(np.isfinite(level), level, np.nan), f"{kind.capitalize()}\n(dB re {f'1 {unit}' if unit else '1'})"
