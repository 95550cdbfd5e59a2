"""Figures and page of two FRFs: overlaid with coherence, correlation over frequency, MAC matrix, measures by sensor."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import escape

from ..core.files import write_text
from ..signals.alignment import Alignment
from ..signals.comparison import Comparison
from ..signals.ema import Modes
from ..signals.figures import ROW_HEIGHT, draw_correlation, draw_functions, draw_measures, measures_height
from ..signals.frf import FRF
from . import html
from .style import COLOURS, REPEAT, TEST, Drawing, canvas, colour_bar, key, of_curves, tidy, write_numbers
from .tables import Column, Table

__all__ = ["draw", "write_page"]

LOOKS: dict[str, dict[str, Any]] = {
    "test": {"color": TEST, "lw": 2.0}, "model": {"color": COLOURS[1], "lw": 1.1},
    "repeat": {"color": REPEAT, "lw": 0.9},
}  # fmt: skip
BESIDE = {"random_db": "random error of the test alone", "random_both_db": "of test and model",
          "repeat_db": "repeat of the test"}  # fmt: skip
PER_PAGE = 6  # sensors on one figure


def draw(
    aligned: Alignment, comparison: Comparison, test_modes: Modes, model_modes: Modes, matrix: np.ndarray,
    repeat: FRF | None = None,
) -> list[Drawing]:  # fmt: skip
    """Draw a comparison, with the MAC ``matrix`` (n_test, n_model) of the modes of both, and a repeat of the test.

    Drawings: "frf_1" and so on, six sensors each; "correlation"; "sensors"; "mac" if both have modes and it is defined.
    """
    rows = np.arange(len(aligned.test.labels))
    pages = np.array_split(rows, -(-rows.size // PER_PAGE))
    drawings = [_draw_frfs(aligned, comparison, repeat, page, number) for number, page in enumerate(pages, 1)]
    drawings += [_draw_correlation(comparison), _draw_sensors(comparison)]
    if np.isfinite(matrix).any():
        drawings.append(_draw_mac(test_modes, model_modes, matrix))
    return drawings


def write_page(comparison: Comparison, drawings: Sequence[Drawing], notes: Sequence[str], folder: Path) -> Path:
    """Write ``comparison.html`` with the figures, the measures of sensors and modes, and notes; return its path."""
    figures, per_sensor = html.PageSection("figures", "Figures", html.figures(drawings)), comparison.per_sensor
    sensors = Table.of("sensors", "Measures by sensor", per_sensor, {
        "sensor": Column("Sensor"), "rmse_db": Column("RMSE", "dB", ".2f"),
        **{name: Column(words, "dB", ".2f") for name, words in BESIDE.items() if per_sensor[name].notna().any()},
        **{name: Column(name.upper(), "", ".3f") for name in ("mre", "frac", "csac", "csf")},
    })  # fmt: skip
    modes = Table.of("modes", "Modes", comparison.per_mode[_valid_modes(comparison)], {
        "mode": Column("Mode"), "test_hz": Column("Test", "Hz", ".3f"), "model_hz": Column("Model", "Hz", ".3f"),
        "mac": Column("MAC", "", ".3f"), "test_damping": Column("Damping, test", "", ".4f"),
        "model_damping": Column("Damping, model", "", ".4f"), "why": Column("Not compared"),
    })  # fmt: skip
    said = "".join(html.paragraph(str(escape(note)), "note") for note in notes)
    difference = html.paragraph(str(escape(f"RMSE {comparison.summary()['rmse_db']:.2f} dB; {comparison.beside()}.")))
    tables = difference + html.table(sensors) + (html.table(modes) if _valid_modes(comparison).any() else "")
    measures = html.PageSection("measures", "Measures", said + tables)
    path = folder / "comparison.html"
    write_text(path, html.page("FRFs of test and model", (measures, figures)))
    return path


def _valid_modes(comparison: Comparison) -> np.ndarray:
    """Return which rows hold a mode (n_modes,)."""
    return np.isfinite(comparison.per_mode[["test_hz", "model_hz"]].to_numpy(float)).any(axis=1)


def _draw_frfs(
    aligned: Alignment, comparison: Comparison, repeat: FRF | None, rows: np.ndarray, number: int
) -> Drawing:  # fmt: skip
    figure = canvas(0.35 + ROW_HEIGHT * -(-rows.size // 2))
    frfs = {"test": aligned.test, "model": aligned.model} | ({"repeat": repeat} if repeat else {})
    key(figure, of_curves({name: LOOKS[name] for name in frfs}), len(frfs))
    curves = [(frf, LOOKS[name] | {"label": name}) for name, frf in frfs.items()]
    draw_functions(figure, curves, rows.tolist(), comparison.random_db)
    labels = ", ".join(aligned.test.labels[i] for i in rows)
    caption = (
        f"{aligned.test.quantity} to {', '.join(aligned.test.references)} at {labels}: magnitude, phase, coherence."
    )
    if comparison.random_db is not None:
        caption += " Band: the test’s magnitude ± the RMS of its random error."
    return Drawing(f"frf_{number}", figure, caption, f"FRFs of test and model at {labels}.", chart=True)


def _draw_correlation(comparison: Comparison) -> Drawing:
    figure = canvas(2.6)
    draw_correlation(figure, comparison.correlation)
    caption = "Agreement over the responses at each line, 1 is perfect; dotted: natural frequencies of the test."
    return Drawing("correlation", figure, caption, "CSAC and CSF over frequency.", chart=True)


def _draw_sensors(comparison: Comparison) -> Drawing:
    figure = canvas(measures_height(comparison.per_sensor))
    draw_measures(figure, comparison.per_sensor)
    caption = "Measures by sensor: RMSE and MRE are 0, FRAC, CSAC and CSF are 1 for equal FRFs."
    return Drawing("sensors", figure, caption, "Bars of the measures by sensor.")


def _draw_mac(test_modes: Modes, model_modes: Modes, matrix: np.ndarray) -> Drawing:
    figure = canvas(3.4, 4.4)
    ax = figure.subplots()
    image = ax.imshow(matrix, cmap="cividis", vmin=0, vmax=1)
    tidy(ax, ylabel="Mode of the test (Hz)", xlabel="Mode of the model (Hz)")
    write_numbers(ax, matrix, "{:.2f}".format, lambda value: value < 0.5)
    ax.set_xticks(np.arange(matrix.shape[1]), [f"{f:.4g}" for f in model_modes.frequency])
    ax.set_yticks(np.arange(matrix.shape[0]), [f"{f:.4g}" for f in test_modes.frequency])
    colour_bar(figure, image, [ax], "MAC (1)")
    caption = "Modal assurance criterion of each mode of the test with each of the model; 1 is one shape."
    return Drawing("mac", figure, caption, f"MAC matrix, {matrix.shape[0]} by {matrix.shape[1]} modes.")
