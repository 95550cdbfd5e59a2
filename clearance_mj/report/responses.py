"""Periodic vibrations over frequency, level, loads, gaps or spin: figure, rows for CSV, folds and jumps in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ..periodic import Backbone, Branch
from ..periodic.axes import parameter_axis
from ..periodic.branch import MARKERS
from ..periodic.summaries import is_cut, jumps, parameter_title, stable_points, unit
from ..rig import Rig
from ..signals.stepped_sines import SineSteps
from .style import FONT, TEST, WIDE, Drawing, at_bushings, frequency_axis, letters, sensor_title, sheet, tidy

__all__ = ["amplitude_columns", "draw", "frequency_range_words", "rows", "summary_lines"]

WAYS = {True: "^", False: "v"}  # markers of stepped sines, upwards or not
STEPS_WORDS = " Triangles: the {} under a stepped sine, the end of every step, upwards and downwards."
PANEL = 1.9  # in, height
PARAMETER_WORDS = {"load": "the share of the constant loads", "gap": "the share of the gaps"}  # that branches are over


def summary_lines(branch: Branch) -> list[str]:
    """Yield lines on a branch: folds and jumps, changes of stability, whether it ends early."""
    x, stable = branch.parameter, stable_points(branch)
    _, measure = parameter_axis(branch.over, branch.kind)
    again = f", repeats after {branch.periods} periods" if branch.periods > 1 else ""
    span = f"{x.size} points from {x[0]:.6g} to {x[-1]:.6g} {measure}"
    said = [f"{_fixed_words(branch)}{again}: {span}, {np.sum(~stable)} of them not stable"]
    leaves = {jump.at: jump for jump in jumps(branch)}
    for point in branch.special:
        line = f"{point.kind} at {x[point.index]:.6g} {measure}"
        if jump := leaves.get(float(x[point.index])) if point.kind == "fold" else None:
            line += f": {'upwards' if jump.upwards else 'downwards'} the vibration jumps"
            if jump.after:
                to = " or ".join(f"{1e3 * value:.4g}" for value in jump.after)
                line += f" from {1e3 * jump.before:.4g} to {to} mm at {branch.clearances[jump.clearance]}"
        said.append(line)
    return [*said, branch.ended] if branch.ended else said


def frequency_range_words(low: float, high: float) -> str:
    """Return a range of frequencies, Hz, in words; it may be one-sided."""
    if low == 0:
        return f"up to {high:.4g} Hz"
    return f"from {low:.4g} Hz on" if high == np.inf else f"from {low:.4g} to {high:.4g} Hz"


def rows(branches: Sequence[Branch]) -> pd.DataFrame:
    """Return a row per point: amplitudes, and the excitation's harmonic, at all sensors and clearances; SI units."""
    return pd.concat([_rows(branch, number) for number, branch in enumerate(branches, 1)], ignore_index=True)


def _rows(branch: Branch, number: int) -> pd.DataFrame:
    special = np.full(branch.frequency.size, "", dtype=object)
    for point in branch.special:
        special[point.index] = point.kind
    columns: dict[str, Any] = {
        "branch": number, "periods": branch.periods, "level": np.abs(branch.level[:, 0]), "level_unit": unit(branch),
        "frequency_hz": branch.frequency, **({} if branch.spin is None else {"spin_rad_s": branch.spin}),
        **({} if branch.share is None else {f"share_of_{branch.over}s": branch.share}),
        "stable": stable_points(branch), "special": special,
    }  # fmt: skip
    return pd.DataFrame(columns | amplitude_columns(branch, branch.periods, True))


def amplitude_columns(curve: Branch | Backbone, order: int, phases: bool) -> dict[str, np.ndarray]:
    """Return the columns of a table: amplitudes by sensor and clearance, and their harmonic of an order."""
    columns: dict[str, np.ndarray] = {}
    for quantity, labels, values in (
        ("acceleration", curve.responses, "m_s2"), ("clearance_displacement", curve.clearances, "m"),
        ("contact_force", curve.clearances, "n"),
    ):  # fmt: skip
        amplitude, first = curve.amplitude(quantity), getattr(curve, quantity)[..., order]
        for i, label in enumerate(labels):
            columns[f"{quantity}_{label}_amplitude_{values}"] = amplitude[:, i]
            columns[f"{quantity}_{label}_fundamental_{values}"] = np.abs(first[:, i])
            if phases:
                columns[f"{quantity}_{label}_fundamental_phase_deg"] = np.degrees(np.angle(first[:, i]))
    return columns


def draw(
    branches: Sequence[Branch], sensors: Sequence[int] | None = None, measured: Sequence[SineSteps] = (),
    test: str = "test",
) -> Drawing:  # fmt: skip
    """Draw amplitudes of sensors (rows; default: those at the bushings) and clearances over frequency or level.

    Steps of stepped sines, of what ``test`` names, are drawn over branches over frequency.
    """
    rig = branches[0].model.rig
    shown = list((at_bushings(rig) or [len(rig.sensors) - 1]) if sensors is None else sensors)
    panels: list[tuple[str, int]] = [("acceleration", row) for row in shown]
    panels += [("clearance_displacement", j) for j in range(len(rig.bushings))]
    colours = _line_colours(branches)
    height = -(-len(panels) // 2)
    figure = sheet(PANEL * height + 0.3 * (height - 1), _key(branches, colours, measured))
    axes = figure.subplots(height, 2, squeeze=False, gridspec_kw={"hspace": 0.26, "wspace": 0.24}).ravel()
    for ax in axes[len(panels) :]:
        ax.axis("off")
    for i, (ax, letter, (quantity, row)) in enumerate(zip(axes, letters(len(panels)), panels)):
        for branch, colour in zip(branches, colours):
            _draw_curve(ax, branch, quantity, row, colour)
        for steps in measured:
            _steps(ax, steps, rig, quantity, row)
        if quantity == "acceleration":
            tidy(ax, f"{letter} {sensor_title(rig, row)}", "Acceleration (m/s²)")
        else:
            tidy(ax, f"{letter} clearance {row + 1}", "Displacement / gap (1)")
            ax.axhline(1.0, color=TEST, lw=0.6)
        ax.set_yscale("log")
        _abscissa(ax, branches, i >= len(panels) - 2)
    figure.align_ylabels(axes[: len(panels)])
    alt = f"Amplitudes of periodic vibrations over {PARAMETER_WORDS.get(branches[0].over, branches[0].over)}."
    return Drawing("response", figure, _caption(branches) + (STEPS_WORDS.format(test) if measured else ""), alt)


def _steps(ax: Axes, steps: SineSteps, rig: Rig, quantity: str, row: int) -> None:
    """Draw the steps of a stepped sine, up and down."""
    if (values := steps.acceleration if quantity == "acceleration" else steps.displacement) is None:
        return
    y = values[:, row] / (1.0 if quantity == "acceleration" else rig.bushings[row].gap)
    for upwards, marker in WAYS.items():
        at = steps.upwards == upwards
        ax.plot(steps.frequency[at], y[at], marker, color=TEST, mfc="none", ms=3.5, mew=0.6)


def _draw_curve(ax: Axes, branch: Branch, quantity: str, row: int, colour: Any) -> None:
    x = branch.parameter
    if quantity == "clearance_displacement":
        scale = x if branch.over == "gap" else 1.0
        y = branch.excursion()[:, row] / (branch.model.rig.bushings[row].gap * scale)
    else:
        y = branch.amplitude(quantity)[:, row]
    ax.plot(x, y, ls=(0, (3, 1.5)), color=colour, lw=0.8)
    ax.plot(x, np.where(stable_points(branch), y, np.nan), color=colour, lw=1.1)
    for kind, marker in MARKERS.items():
        at = [point.index for point in branch.special if point.kind == kind]
        ax.plot(x[at], y[at], marker, color=TEST, mfc="white", ms=3.5, mew=0.7)
    if is_cut(branch):
        ax.plot(x[-1], y[-1], "x", color=TEST, ms=4.5, mew=0.9)


def _abscissa(ax: Axes, branches: Sequence[Branch], labelled: bool) -> None:
    ends = [float(end) for branch in branches for end in (branch.parameter.min(), branch.parameter.max())]
    low, high = min(ends), max(ends)
    if branches[0].over == "frequency" and high >= WIDE * low:
        frequency_axis(ax, (low, high), labelled)
    else:
        ax.set_xlim(low, high)
    ax.set_xlabel(parameter_title(branches[0]) if labelled else "", fontsize=FONT)


def _line_colours(branches: Sequence[Branch]) -> list[Any]:
    """Return the colours of levels or frequencies; branches of one have the same."""
    known = sorted({_fixed_values(branch) for branch in branches})
    shades = matplotlib.colormaps["viridis"](np.linspace(0, 0.85, len(known)))
    return [shades[known.index(_fixed_values(branch))] for branch in branches]


def _fixed_values(branch: Branch) -> tuple[float, ...]:
    """Return the level and frequency that are constant along a branch."""
    level, frequency = float(abs(branch.level[0, 0])), float(branch.frequency[0])
    return {"frequency": (level,), "level": (frequency,)}.get(branch.over, (level, frequency))


def _fixed_words(branch: Branch) -> str:
    units = {"frequency": (unit(branch),), "level": ("Hz",)}.get(branch.over, (unit(branch), "Hz"))
    return " at ".join(f"{value:g} {symbol}" for value, symbol in zip(_fixed_values(branch), units))


def _key(branches: Sequence[Branch], colours: Sequence[Any], measured: Sequence[SineSteps]) -> list[Artist]:
    named = {_fixed_values(branch): (_fixed_words(branch), colour) for branch, colour in zip(branches, colours)}
    handles = [Line2D([], [], color=colour, label=name) for _, (name, colour) in sorted(named.items())]
    if not all(stable_points(branch).all() for branch in branches):
        handles.append(Line2D([], [], color="#555555", ls=(0, (3, 1.5)), lw=0.8, label="not stable"))
    kinds = {point.kind for branch in branches for point in branch.special}
    look: dict[str, Any] = {"ls": "", "color": TEST, "mfc": "white", "ms": 4, "mew": 0.7}
    handles += [Line2D([], [], marker=mark, label=kind, **look) for kind, mark in MARKERS.items() if kind in kinds]
    if any(is_cut(branch) for branch in branches):
        handles.append(Line2D([], [], marker="x", ls="", color=TEST, ms=4.5, mew=0.9, label="not found further"))
    if measured:
        handles += [
            Line2D([], [], marker=marker, label=f"stepped {'up' if upwards else 'down'}", **look | {"mfc": "none"})
            for upwards, marker in WAYS.items()
        ]
    return list(handles)


def _caption(branches: Sequence[Branch]) -> str:
    first = branches[0]
    others = {"level": " at several frequencies", "frequency": " at several levels"}.get(first.over, "")
    varied = PARAMETER_WORDS.get(first.over, first.over) + others * (
        len({_fixed_values(branch) for branch in branches}) > 1
    )
    excited = {"base": "a shaken base", "unbalance": "unbalance"}.get(first.kind, "a force")
    extents = ", of a round clearance half of the largest extent of the orbit" if first.model.rig.moves_across else ""
    return (
        f"Periodic vibrations of rig “{first.model.rig.name}” under {excited} over {varied}: half of the way from the "
        f"lowest to the highest value of a period{extents}. Dashed vibrations are not stable: a test does not meet "
        f"them. Levels are {'factors of the rig’s unbalance' if first.kind == 'unbalance' else 'amplitudes'}."
    )
