"""Figures of a calibration: measured against fitted values, the fit of every start, correlations."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.ticker import NullFormatter

from ..calibrate import Calibration, FRFTarget, ModalTarget
from .style import COLOURS, FONT, REPEAT, TEST, Drawing, canvas, decibel, tidy, write_numbers

__all__ = ["draw"]

START, FOUND = "#e69f00", COLOURS[0]
MAX_SENSORS = 4  # FRFs that are drawn
SYMBOLS = {"young_modulus": "E", "density": "ρ", "stiffness": "k", "damping": "c", "position": "x", "mass": "m"}


def _name(path: str) -> str:
    """Return the short name of a parameter, for an axis."""
    words = path.replace("grease.", "").replace("beam.", "").split(".")
    words[-1] = SYMBOLS.get(words[-1], words[-1])
    words[0] = words[0].replace("masses", "mass").replace("bushings[", "bushing[")
    return "\n".join(words)


def draw(calibration: Calibration) -> Drawing:
    """Draw a calibration: data and fit, the solutions of all starts, correlations."""
    n = len(calibration.estimates.names)
    figure = canvas(2.6 * len(calibration.targets) + 3.1)
    upper, lower = np.asarray(figure.subfigures(2, 1, height_ratios=(2.6 * len(calibration.targets), 3.1))).tolist()
    rows = np.atleast_1d(np.asarray(upper.subfigures(len(calibration.targets), 1))).tolist()
    for target, part in zip(calibration.targets, rows):
        _bars(part, calibration, target) if isinstance(target, ModalTarget) else _overlay(part, calibration, target)
    starts, correlation = lower.subplots(1, 2, width_ratios=(1.25, 1))
    _draw_starts(starts, calibration)
    _draw_correlation(correlation, calibration)
    caption = (
        "Calibration: measured and fitted; the values that each start ended with, over those of the best fit; "
        "correlation of the parameters’ logarithms."
    )
    return Drawing("calibration", figure, caption, f"Calibration of {n} parameters of rig {calibration.rig.name}.")


def _bars(part: SubFigure, calibration: Calibration, target: ModalTarget) -> None:
    error, shapes = part.subplots(1, 2)
    pairs = (("start", calibration.start, START, "s", -0.1), ("calibrated", calibration.rig, FOUND, "o", 0.1))
    test = None if target.shape is None else target.shape / np.linalg.norm(target.shape, axis=0)
    for name, rig, colour, marker, aside in pairs:
        frequency, shape = target.model(rig)
        look = {"color": colour, "marker": marker, "ls": "none", "ms": 5, "label": name}
        error.plot(target.mode + aside, 100 * (frequency / target.frequency - 1), **look)
        if test is not None:
            mac = np.sum(test * shape, axis=0) ** 2 / np.sum(shape**2, axis=0)
            shapes.semilogy(target.mode + aside, 1 - mac, **look)
    percent = 100 * target.std / target.frequency
    error.errorbar(target.mode, 0 * target.mode, percent, fmt="none", ecolor=TEST, capsize=3)
    error.axhline(0, color=TEST, lw=0.8, label="test ± std")
    error.set_yscale("symlog", linthresh=0.1)
    error.yaxis.set_major_formatter("{x:g}")
    error.margins(y=0.15)
    tidy(error, "natural frequencies", "Model over test - 1 (%)", "Mode (number)")
    part.legend(*error.get_legend_handles_labels(), fontsize=FONT - 1, frameon=False, loc="outside upper left", ncols=3)
    error.set_xticks(target.mode)
    if test is None:
        _draw_table(shapes, calibration, target)
        return
    tidy(shapes, "mode shapes", "1 - MAC with the test (1)", "Mode (number)")
    shapes.set_xticks(target.mode)
    shapes.yaxis.set_minor_formatter(NullFormatter())


def _draw_table(ax: Axes, calibration: Calibration, target: ModalTarget) -> None:
    ax.axis("off")
    columns = (target.frequency, target.model(calibration.start)[0], target.model(calibration.rig)[0])
    cells = [[f"{mode:.0f}", *(f"{v:.3f}" for v in row)] for mode, *row in zip(target.mode, *columns)]
    labels = ("mode", "test (Hz)", "start (Hz)", "calibrated (Hz)")
    table = ax.table(cells, colLabels=labels, loc="center", cellLoc="center", edges="horizontal")
    table.auto_set_font_size(False)
    table.set_fontsize(FONT)
    table.auto_set_column_width(range(4))


def _overlay(part: SubFigure, calibration: Calibration, target: FRFTarget) -> None:
    shown = np.unique(np.linspace(0, len(target.nodes) - 1, min(MAX_SENSORS, len(target.nodes))).astype(int))
    frfs = (("test", target.frf.functions, TEST, 1.5), ("start", target.model(calibration.start), START, 0.9),
            ("calibrated", target.model(calibration.rig), FOUND, 0.9))  # fmt: skip
    axes = part.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for ax, row in zip(axes, shown):
        for name, value, colour, width in frfs:
            ax.plot(target.frf.frequency, decibel(value[row]), color=colour, lw=width, label=name)
        tidy(ax, f"sensor {target.nodes[row]}", "", "Frequency (Hz)")
    unit = "dB re 1" if target.frf.quantity == "acceleration/acceleration" else "dB re 1 m/s²/N"
    axes[0].set_ylabel(f"|H| ({unit})", fontsize=FONT)
    axes[0].legend(fontsize=FONT - 1, frameon=False)


def _draw_starts(ax: Axes, result: Calibration) -> None:
    best, ticks = result.solutions[0], np.arange(len(result.estimates.names))
    for solution in reversed(result.solutions):
        fits = solution.chi2 <= best.chi2 + 1
        colour, width, marker = (FOUND, 1.2, "o") if fits else (REPEAT, 0.6, "x")
        ax.plot(ticks, solution.value / best.value, color=colour, lw=width, marker=marker, ms=4 if fits else 3)
    fitting = sum(s.chi2 <= best.chi2 + 1 for s in result.solutions)
    ax.plot([], [], color=FOUND, marker="o", ms=4, label=f"fits: {fitting} starts, {len(result.distinct)} different")
    short = f"stopped short: {len(result.solutions) - fitting} starts"
    ax.plot([], [], color=REPEAT, marker="x", ms=3, lw=0.6, label=short)
    ax.set_yscale("log")
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, 0.5), max(high, 2.0))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter(NullFormatter())
    tidy(ax, "every start", "Value over best fit (1)", "")
    ax.set_xticks(ticks, [_name(path) for path in result.estimates.names], fontsize=FONT - 1)
    ax.legend(fontsize=FONT - 1, frameon=False)


def _draw_correlation(ax: Axes, calibration: Calibration) -> None:
    ax.imshow(calibration.estimates.correlation, vmin=-1, vmax=1, cmap="PuOr")
    ticks = np.arange(len(calibration.estimates.names))
    tidy(ax, "correlation of the logarithms")
    write_numbers(ax, calibration.estimates.correlation, "{:.2f}".format, lambda value: abs(value) > 0.7)
    names = [_name(path) for path in calibration.estimates.names]
    ax.set_xticks(ticks, names, fontsize=FONT - 1)
    ax.set_yticks(ticks, names, fontsize=FONT - 1)
