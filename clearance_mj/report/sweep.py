"""Figures and page of a sweep: its results over the varied parameters, its FRFs, and where the spread comes from."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from ..core.files import write_text
from ..statistics.sobol import Sensitivity
from ..sweep.design import Vary
from ..sweep.sensitivity import quantities
from . import html
from .style import COLOURS, FONT, Drawing, canvas, decibel, key, phase, tidy

__all__ = ["draw_frfs", "draw_results", "draw_sensitivity", "write_page"]

FIRST_BARS: dict[str, Any] = {"color": COLOURS[0], "label": "first order", "hatch": ""}
TOTAL_BARS: dict[str, Any] = {"color": COLOURS[5], "label": "total", "hatch": "////"}
UNITS = {
    **dict.fromkeys(("position", "gap", "length", "diameter", "width", "height", "film_height", "amplitude"), "m"),
    **dict.fromkeys(("stiffness", "k"), "N/m"),
    **dict.fromkeys(("damping", "c"), "N s/m"),
    **dict.fromkeys(("rms", "start_rms", "end_rms", "peak"), "m/s² or N"),
    **dict.fromkeys(("t", "release", "duration", "period"), "s"),
    **{"mass": "kg", "young_modulus": "Pa", "density": "kg/m³", "restitution": "1", "elastic_ratio": "1", "seed": "1"},
}  # of a field by its name; others are said to be in SI units
TABLES = ("rig", "law", "excitation")  # of a plan, with which its paths begin
LONGEST_TITLE = 26  # characters of a line
MAX_ROWS = 8  # results that are drawn
MAX_FRFS = 12  # cases whose FRFs are drawn, of the first `MAX_KEPT` sensors
MAX_KEPT = 4


def draw_results(results: xr.Dataset, varied: tuple[Vary, ...]) -> Drawing | None:
    """Draw what came out over each varied parameter; None if all cases gave the same, or nothing."""
    if not (spread := _select_results(quantities(results))):
        return None
    shape = len(spread), len(varied)
    figure = canvas(0.7 + 1.15 * shape[0])
    axes = figure.subplots(*shape, squeeze=False, sharex="col", sharey="row")
    for row, (name, values) in zip(axes, spread.items()):
        for ax, vary, parameter in zip(row, varied, results["parameter"].values.T):
            ax.plot(parameter, values, ".", color=COLOURS[0], ms=3, alpha=0.5, mew=0, rasterized=True)
            ax.set_xscale(vary.scale)
            tidy(ax)
        row[0].set_ylabel(_folded(name), fontsize=FONT)
    for ax, vary in zip(axes[-1], varied):
        ax.set_xlabel(_with_unit(vary.path), fontsize=FONT)
        _set_end_ticks(ax, vary.values or (vary.low or 0.0, vary.high or 0.0))
    caption = f"Every case of the sweep ({results.sizes['case']}): results over the varied parameters, SI units."
    return Drawing("sweep", figure, caption, "Scatter of results over the varied parameters.", sharp=False, chart=True)


def draw_frfs(results: xr.Dataset) -> Drawing | None:
    """Draw FRFs that the sweep kept, of cases from its first to its last; None if it kept none."""
    if "frf" not in results:
        return None
    known = np.flatnonzero(np.isfinite(results["frf"].values).all(axis=(1, 2, 3)))
    if not known.size:
        return None
    cases = known[np.unique(np.linspace(0, known.size - 1, MAX_FRFS).round().astype(int))]
    kept = [str(name) for name in results["kept"].values[:MAX_KEPT]]
    colours = matplotlib.colormaps["cividis"](np.linspace(0, 0.9, cases.size))
    figure = canvas(2.6 * len(kept) + 0.3 * -(-cases.size // 3))
    axes = figure.subplots(2 * len(kept), 1, squeeze=False, sharex=True, height_ratios=[2, 1] * len(kept))[:, 0]
    frequency = results["frequency"].values
    for i, sensor in enumerate(kept):
        for case, colour in zip(cases, colours):
            value = results["frf"].values[case, i] @ np.array([1, 1j])
            for ax, shown in zip(axes[2 * i :], (decibel(value), phase(value))):
                ax.plot(frequency, shown, color=colour, lw=0.9, label=_case_label(results, case))
        unit = results["frf"].attrs.get("units", "1")
        tidy(axes[2 * i], sensor, f"|H| (dB re {unit})")
        tidy(axes[2 * i + 1], "", "Phase (°)", "Frequency (Hz)" if i == len(kept) - 1 else "")
        axes[2 * i + 1].set(ylim=(-190, 190), yticks=(-180, 0, 180))
    axes[0].set_xlim(frequency[0], frequency[-1])
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=FONT - 1.5,
                  frameon=False)  # fmt: skip
    caption = f"FRFs of {cases.size} of the sweep's {results.sizes['case']} cases at the sensors it kept."
    return Drawing("sweep_frf", figure, caption, "FRF magnitude and phase of cases of the sweep.", chart=True)


def _case_label(results: xr.Dataset, case: int) -> str:
    """Return a case in words: its number and its parameters."""
    fields = [str(path).rpartition(".")[2] for path in results["varied"].values]
    values = (f"{field} {value:.4g}" for field, value in zip(fields, results["parameter"].values[case]))
    return f"case {results['case'].values[case]}: {', '.join(values)}"


def write_page(drawings: Sequence[Drawing], folder: Path, n_cases: int) -> Path:
    """Write ``sweep.html`` with the drawings of a sweep of ``n_cases`` and return its path."""
    path, figures = folder / "sweep.html", html.PageSection("figures", "Figures", html.figures(drawings))
    write_text(path, html.page(f"Sweep of {n_cases} cases", [figures]))
    return path


def _set_end_ticks(ax: Axes, values: Sequence[float]) -> None:
    """Set ticks at the ends of a narrow axis, linear or log, whose labels stay within it."""
    ends = min(values), max(values)
    words = [np.format_float_positional(value, precision=3, fractional=False, trim="-") for value in ends]
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks(ends, words, fontsize=FONT - 1.5)
    for label, side in zip(ax.get_xticklabels(), ("left", "right")):
        label.set(horizontalalignment=side)


def draw_sensitivity(sensitivity: Sensitivity) -> Drawing:
    """Draw Sobol indices, with their 95 % intervals."""
    n = len(sensitivity.quantity)
    columns = min(n, 4)
    rows = -(-n // columns)
    figure = canvas(0.55 + rows * (0.5 + 0.22 * len(sensitivity.parameter)))
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    places = np.arange(len(sensitivity.parameter))
    for ax in axes.ravel()[n:]:
        ax.set_axis_off()
    for i, (ax, quantity) in enumerate(zip(axes.ravel(), sensitivity.quantity)):
        for at, name, look in ((places - 0.19, "first", FIRST_BARS), (places + 0.19, "total", TOTAL_BARS)):
            ax.barh(at, getattr(sensitivity, name)[i], 0.36, edgecolor="white", linewidth=0.3, **look)
            ax.hlines(at, *getattr(sensitivity, f"{name}_interval")[:, i], color="black", lw=0.9)
        ax.set_yticks(places, [_short_label(path) for path in sensitivity.parameter])
        last = i + columns >= n
        tidy(ax, textwrap.fill(quantity, LONGEST_TITLE), "", "Sobol index (1)" if last else "")
        ax.tick_params(labelbottom=last)
    axes[0, 0].invert_yaxis()
    axes[0, 0].set_xlim(-0.15, 1.15)
    key(figure, axes[0, 0].get_legend_handles_labels()[0], 2)
    caption = (
        "Sobol indices: the share of each result's variance that comes from a parameter alone (first order), and with "
        "its interactions (total). Lines: 95 % intervals of a bootstrap over the samples, cut at -0.15 and 1.15."
    )
    return Drawing("sensitivity", figure, caption, "Bars of Sobol indices by result and parameter.")


def _select_results(spread: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the results that vary; if too many, one of each kind after the other."""
    spread = {name: values for name, values in spread.items() if np.unique(values[np.isfinite(values)]).size > 1}
    number = {name: "".join(c for c in name if c.isdigit()) for name in spread}
    kept = sorted(spread, key=lambda name: number[name])[:MAX_ROWS]
    return {name: values for name, values in spread.items() if name in kept}


def _short_label(path: str) -> str:
    """Return a path without the table's name, a long one on two lines; those of a group on separate lines."""
    if ", " in path:
        return "\n".join(path.split(", "))
    table, _, name = path.partition(".")
    head, dot, tail = (name if table in TABLES else path).rpartition(".")
    return f"{head}\n{tail}" if dot and len(head + tail) > 14 else head + dot + tail


def _with_unit(path: str) -> str:
    inner, field = path.partition(".")[2], path.rpartition(".")[2].partition("[")[0]
    return f"{inner.replace('.', chr(10))} ({UNITS.get(field, 'SI unit')})"


def _folded(name: str) -> str:
    words, _, unit = name.rpartition(" (")
    head, _, tail = words.rpartition(" of ")
    return f"{head} of\n{tail} ({unit}" if head else f"{words.replace(' ', chr(10), 1)} ({unit}"
