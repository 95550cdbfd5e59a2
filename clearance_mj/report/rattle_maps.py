"""Rattle maps: figure, rows for CSV, and in words where a rig begins to rattle and where it jumps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..periodic import ImpactMap, RattleMap
from ..periodic.summaries import frequency_title, level_title, unit
from .style import COLOURS, REPEAT, TEST, Drawing, canvas, colour_bar, frequency_ends, key, tidy

__all__ = ["draw", "rows", "summary_lines", "sweep_columns"]

COLUMNS = {"contact_share": "", "penetration": "_m", "contact_force": "_n", "displacement": "_m"}
"""quantities at the clearances, and the ends of their columns' names"""
JUMPS = {"up": "^", "down": "v"}  # markers
_COLOURS = ListedColormap(np.vstack(([1, 1, 1, 1], matplotlib.colormaps["YlOrRd"](np.linspace(0.1, 0.9, 40)))))


def draw(grid: RattleMap) -> Drawing:
    """Draw the fraction of time in contact over frequency and level, a panel for each gap."""
    count = len(grid.gap)
    figure = canvas(2.9 * -(-count // 2))
    axes = np.ravel(figure.subplots(-(-count // 2), min(count, 2), sharex=True, sharey=True, squeeze=False))
    contact = np.nanmax(np.where(np.isnan(grid.contact_share), 0, grid.contact_share), axis=(0, -1))
    for i, ax in enumerate(axes[:count]):
        image = ax.pcolormesh(grid.frequency, grid.level, contact[i], cmap=_COLOURS, vmin=0, vmax=1, shading="nearest")
        grid.mark(ax, i)
        last_row = i >= count - 2
        tidy(ax, _gap_words(grid, i), level_title(grid) if i % 2 == 0 else "")
        ax.grid(False)
        if grid.level.size > 2 and np.ptp(np.diff(np.log(grid.level))) < 1e-6:  # each a multiple of the last
            ax.set_yscale("log")
        if grid.level.size > 1:
            ax.set_ylim(grid.level[0], grid.level[-1])
        frequency_ends(ax, grid.frequency, frequency_title(grid), last_row)
    for ax in axes[count:]:
        ax.set_axis_off()
    colour_bar(figure, image, axes, "Time in contact over the period (1)", pad=0.01, aspect=30)
    key(figure, _handles(grid))
    amplitude = "unbalance" if grid.kind == "unbalance" else "amplitude of a sine"
    caption = (
        f"Rattle map of rig “{grid.model.rig.name}”: share of a period in which the clearance that touches most does, "
        f"over frequency and {amplitude}, the larger one of sweeps up and down. Line: first contact in a sweep "
        "over level. Hatched: more than one vibration, of which the direction of a sweep decides."
    )
    return Drawing("rattle_map", figure, caption, "Share of time in contact over frequency and level.", False)


def _handles(grid: RattleMap) -> list[Artist]:
    handles: list[Artist] = [Line2D([], [], color=TEST, lw=0.9, label="first contact")]
    for sweep, marker in JUMPS.items():
        if any(jump.sweep == sweep for jump in grid.jumps):
            look: dict[str, Any] = {"ls": "", "marker": marker, "color": COLOURS[0], "ms": 4.5, "mew": 0}
            handles.append(Line2D([], [], label=f"jump in a sweep {sweep}", **look))
    if np.any(grid.vibrations > 1):
        handles.append(Patch(facecolor="white", edgecolor=TEST, hatch="//////", lw=0.3, label="several vibrations"))
    if grid.unknown:
        handles.append(Patch(facecolor=REPEAT, lw=0, label="none was found"))
    return handles


def _gap_words(grid: RattleMap, gap: int) -> str:
    return "gap " + ", ".join(f"{1e3 * value:.4g}" for value in np.unique(np.round(grid.gap[gap], 7))) + " mm"


def rows(grid: RattleMap) -> pd.DataFrame:
    """Return a row per gap, level, frequency and direction of a sweep, SI units; empty without a solution."""
    gap, swept = sweep_columns(grid)
    columns = {f"gap_{label}_m": grid.gap[gap, j] for j, label in enumerate(grid.clearances)} | swept
    for quantity, ending in COLUMNS.items():
        values = getattr(grid, quantity).reshape(-1, len(grid.clearances))
        columns |= {f"{quantity}_{label}{ending}": values[:, j] for j, label in enumerate(grid.clearances)}
    return pd.DataFrame(columns)


def sweep_columns(level_map: RattleMap | ImpactMap) -> tuple[np.ndarray, dict[str, Any]]:
    """Return the number of the gap or load of each row of a map's table, and columns that say where in sweeps it is."""
    sweep, varied, level, frequency = (index.ravel() for index in np.indices((2, *level_map.vibrations.shape)))
    return varied, {
        "level": level_map.level[level], "level_unit": unit(level_map), "frequency_hz": level_map.frequency[frequency],
        "sweep": np.array(["up", "down"])[sweep], "vibrations": level_map.vibrations[varied, level, frequency],
    }  # fmt: skip


def summary_lines(grid: RattleMap) -> Iterator[str]:
    """Yield lines, for each gap, on first contact, the fraction of the map that rattles, its forces, and jumps."""
    for i in range(len(grid.gap)):
        force, depth = (np.nanmax(each[:, i], initial=0.0) for each in (grid.contact_force, grid.penetration))
        most = f", with up to {force:.3g} N and {1e3 * depth:.2g} mm deep in a wall" if depth > 0 else ""
        rattling = f"{100 * np.mean(grid.rattles[i]):.0f} % of the map"
        verb = "touches" if np.all(grid.first_contact[i] == 0) else "rattles"
        yield f"{_gap_words(grid, i)}: {_first_contact_words(grid, i)}; {verb} in {rattling}{most}"
        for sweep in ("up", "down"):
            if jumps := [jump for jump in grid.jumps if jump.gap == i and jump.sweep == sweep]:
                count = "1 jump" if len(jumps) == 1 else f"{len(jumps)} jumps"
                yield f"{count} in sweeps {sweep}: {_jump_range(jumps, unit(grid))}"
    if grid.unknown:
        others = f", and {len(grid.ended) - 1} more" if len(grid.ended) > 1 else ""
        reason = f" ({grid.ended[0]}{others})" if grid.ended else ""
        yield f"no vibration was found in {100 * grid.unknown:.3g} % of the map{reason}"


def _first_contact_words(grid: RattleMap, gap: int) -> str:
    first = grid.first_contact[gap]
    if not np.isfinite(first).any() or np.nanmin(first) > grid.level[-1]:
        return "touches no wall"
    least = int(np.nanargmin(first))
    if first[least] == 0:
        return "rests on a wall"
    if first[least] == grid.level[0]:
        return f"touches already at the lowest level, at {grid.frequency[least]:.5g} Hz"
    return f"touches first from {first[least]:.3g} {unit(grid)} on, at {grid.frequency[least]:.5g} Hz"


def _jump_range(jumps: list, unit: str) -> str:
    low, high = (pick(jumps, key=lambda jump: jump.level) for pick in (min, max))
    first = f"at {low.level:.3g} {unit} and {low.frequency:.5g} Hz"
    return first if len(jumps) == 1 else f"{first} to {high.level:.3g} {unit} and {high.frequency:.5g} Hz"
