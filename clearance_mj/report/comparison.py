"""Figures and page of two FRFs: overlaid with coherence, correlation over frequency, MAC matrix, measures by sensor."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D

from ..files import write_text
from ..signals.alignment import Alignment
from ..signals.comparison import Comparison
from ..signals.ema import Modes
from . import html
from .style import COLOURS, FONT, TEST, Drawing, canvas, decibel, phase, tidy
from .tables import Column, Table

__all__ = ["draw", "write_page"]

MODEL = COLOURS[1]
PER_PAGE = 6
"""sensors on one figure"""
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s²", "force": "N"}
MEASURES = {"rmse_db": "RMSE (dB)", "mre": "MRE (1)", "frac": "FRAC (1)", "csac": "CSAC (1)", "csf": "CSF (1)"}
SHARES = ("frac", "csac", "csf")
"""measures from 0 to 1"""


def draw(
    aligned: Alignment, comparison: Comparison, test_modes: Modes, model_modes: Modes, matrix: np.ndarray
) -> list[Drawing]:
    """Draw a comparison, with the MAC ``matrix`` (n_test, n_model) of the modes of both.

    Drawings: "frf_1" and so on, six sensors each; "correlation"; "sensors"; "mac" if both have modes and it is defined.
    """
    rows = np.arange(len(aligned.test.labels))
    pages = np.array_split(rows, -(-rows.size // PER_PAGE))
    drawings = [_frfs(aligned, page, number) for number, page in enumerate(pages, 1)]
    drawings += [_correlation(comparison), _sensors(comparison)]
    if np.isfinite(matrix).any():
        drawings.append(_mac(test_modes, model_modes, matrix))
    return drawings


def write_page(comparison: Comparison, drawings: Sequence[Drawing], notes: Sequence[str], folder: Path) -> Path:
    """Write ``comparison.html`` with the figures, the measures of sensors and modes, and notes; return its path."""
    figures = "".join(html.figure(drawing, number, drawing.svg()) for number, drawing in enumerate(drawings, 1))
    sensors = Table.of("sensors", "Measures by sensor", comparison.per_sensor, {
        "sensor": Column("Sensor"), "rmse_db": Column("RMSE", "dB", ".2f"), "mre": Column("MRE", "", ".3f"),
        **{name: Column(name.upper(), "", ".3f") for name in SHARES},
    })  # fmt: skip
    modes = Table.of("modes", "Modes", comparison.per_mode, {
        "mode": Column("Mode"), "test_hz": Column("Test", "Hz", ".3f"), "model_hz": Column("Model", "Hz", ".3f"),
        "mac": Column("MAC", "", ".3f"), "test_damping": Column("Damping, test", "", ".4f"),
        "model_damping": Column("Damping, model", "", ".4f"),
    })  # fmt: skip
    said = "".join(html.paragraph(str(escape(note)), "note") for note in notes)
    tables = html.table(sensors) + (html.table(modes) if len(comparison.per_mode) else "")
    sections = (html.Section("measures", "Measures", said + tables), html.Section("figures", "Figures", figures))
    path = folder / "comparison.html"
    write_text(path, html.page("FRFs of test and model", sections))
    return path


def _frfs(aligned: Alignment, rows: np.ndarray, number: int) -> Drawing:
    columns = min(2, rows.size)
    figure = canvas(0.35 + 2.8 * -(-rows.size // columns))
    handles = [Line2D([], [], color=TEST, lw=2.0, label="test"), Line2D([], [], color=MODEL, lw=1.1, label="model")]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=FONT, frameon=False)
    cells = figure.subfigures(-(-rows.size // columns), columns, squeeze=False)
    for cell, row in zip(cells.flat, rows):
        _overlay(cell, aligned, row)
    labels = ", ".join(aligned.test.labels[i] for i in rows)
    caption = (
        f"{aligned.test.quantity} to {', '.join(aligned.test.references)} at {labels}: magnitude, phase, coherence."
    )
    return Drawing(f"frf_{number}", figure, caption, f"FRFs of test and model at {labels}.", chart=True)


def _overlay(cell: SubFigure, aligned: Alignment, row: int) -> None:
    above, below = aligned.test.quantity.split("/")
    unit = "1" if above == below else f"1 {UNITS[above]}/{UNITS[below]}"
    axes = cell.subplots(3, 1, sharex=True, height_ratios=(3, 1.4, 1))
    for frf, style in ((aligned.test, {"color": TEST, "lw": 2.0, "label": "test"}),
                       (aligned.model, {"color": MODEL, "lw": 1.1, "label": "model"})):  # fmt: skip
        style |= _dots(frf.frequency)
        axes[0].plot(frf.frequency, decibel(frf.functions[row]), **style)
        axes[1].plot(frf.frequency, phase(frf.functions[row]), **style)
        if frf.coherence is not None:
            coherence = frf.coherence.swapaxes(0, 1)[frf.measured.T]
            axes[2].plot(frf.frequency, coherence[row], **style | {"lw": 0.8})
    tidy(axes[0], aligned.test.labels[row], f"Magnitude\n(dB re {unit})")
    tidy(axes[1], ylabel="Phase (°)")
    axes[1].set_ylim(-190, 190)
    axes[1].set_yticks([-180, 0, 180])
    tidy(axes[2], ylabel="Coh. (1)", xlabel="Frequency (Hz)")
    axes[2].set_ylim(0, 1.1)
    axes[2].set_yticks([0, 1])
    if aligned.test.coherence is None and aligned.model.coherence is None:
        axes[2].text(0.5, 0.5, "neither file has a coherence", transform=axes[2].transAxes, ha="center", va="center",
                     fontsize=FONT - 1)  # fmt: skip
    _from_first_to_last(axes[2], aligned.test.frequency)
    cell.align_ylabels(axes)


def _dots(frequency: np.ndarray) -> dict[str, Any]:
    """Style of a curve: one line alone would not show."""
    return {"marker": "o"} if frequency.size == 1 else {}


def _from_first_to_last(ax: Axes, frequency: np.ndarray) -> None:
    if frequency.size > 1:
        ax.set_xlim(*frequency[[0, -1]])


def _correlation(comparison: Comparison) -> Drawing:
    figure = canvas(2.6)
    ax = figure.subplots()
    for values, label, color, style in (
        (comparison.csac, "CSAC (shape)", COLOURS[0], "-"),
        (comparison.csf, "CSF (shape and level)", COLOURS[1], "--"),
    ):
        if np.isfinite(values).any():
            dots = _dots(comparison.frequency)
            ax.plot(comparison.frequency, values, lw=1.3, label=label, color=color, ls=style, **dots)
    for i, hz in enumerate(hz for hz in comparison.per_mode["test_hz"] if np.isfinite(hz)):
        ax.axvline(hz, color="#8c8c8c", lw=0.8, ls=":", label="mode of the test" if i == 0 else None)
    tidy(ax, ylabel="CSAC, CSF (1)", xlabel="Frequency (Hz)")
    ax.set_ylim(0, 1.05)
    _from_first_to_last(ax, comparison.frequency)
    figure.legend(loc="outside upper center", ncols=3, fontsize=FONT, frameon=False)
    caption = "Agreement over the responses at each line, 1 is perfect; dotted: natural frequencies of the test."
    return Drawing("correlation", figure, caption, "CSAC and CSF over frequency.", chart=True)


def _sensors(comparison: Comparison) -> Drawing:
    labels = comparison.per_sensor["sensor"]
    figure = canvas(max(2.9, 0.8 + 0.15 * len(labels)))
    for ax, (name, title) in zip(figure.subplots(1, len(MEASURES)), MEASURES.items()):
        ax.barh(np.arange(len(labels)), comparison.per_sensor[name], color=COLOURS[0])
        tidy(ax, xlabel=title)
        ax.set_yticks(np.arange(len(labels)), labels if ax.get_subplotspec().is_first_col() else [""] * len(labels))
        ax.invert_yaxis()
        if name in SHARES:
            ax.set_xlim(0, 1)
        if not np.isfinite(comparison.per_sensor[name]).any():
            ax.text(0.5, 0.5, "undefined", transform=ax.transAxes, ha="center", va="center", fontsize=FONT - 1)
    of_pairs = any("/" in label for label in labels)
    figure.axes[0].set_ylabel(f"Sensor{'/reference' if of_pairs else ''} (node:direction)", fontsize=FONT)
    caption = "Measures by sensor: RMSE and MRE are 0, FRAC, CSAC and CSF are 1 for equal FRFs."
    return Drawing("sensors", figure, caption, "Bars of the measures by sensor.")


def _mac(test_modes: Modes, model_modes: Modes, matrix: np.ndarray) -> Drawing:
    figure = canvas(3.4, 4.4)
    ax = figure.subplots()
    image = ax.imshow(matrix, cmap=matplotlib.colormaps["cividis"], vmin=0, vmax=1)
    for (i, j), value in np.ndenumerate(matrix):
        ax.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=FONT, color="w" if value < 0.5 else "k")
    tidy(ax, ylabel="Mode of the test (Hz)", xlabel="Mode of the model (Hz)")
    ax.grid(False)
    ax.set_xticks(np.arange(matrix.shape[1]), [f"{f:.4g}" for f in model_modes.frequency])
    ax.set_yticks(np.arange(matrix.shape[0]), [f"{f:.4g}" for f in test_modes.frequency])
    bar = figure.colorbar(image, ax=ax)
    bar.set_label("MAC (1)", fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
    caption = "Modal assurance criterion of each mode of the test with each of the model; 1 is one shape."
    return Drawing("mac", figure, caption, f"MAC matrix, {matrix.shape[0]} by {matrix.shape[1]} modes.")
