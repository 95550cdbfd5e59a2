"""Figures of geometries, for `Geometry.plot`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..core.drawing import COLOURS, FONT, REPEAT, canvas

__all__ = ["geometry_figure"]

THINNEST = 0.3  # least fraction of the largest extent along every axis
MOST_NAMED = 40  # nodes beyond which their numbers would hide the figure


def geometry_figure(
    numbers: Sequence[int], places: np.ndarray, edges: Sequence[tuple[int, int]], moved: np.ndarray | None = None,
    title: str = "",
) -> Figure:  # fmt: skip
    """Draw nodes at ``places`` (n_nodes, 3) and their edges, grey where ``moved`` has displaced positions."""
    figure = canvas(5.0)
    ax = figure.add_subplot(projection="3d")
    rows = {number: row for row, number in enumerate(numbers)}
    pairs = np.array([(rows[a], rows[b]) for a, b in edges], dtype=int).reshape(-1, 2)
    shown = [(places, COLOURS[0])] if moved is None else [(places, REPEAT), (moved, COLOURS[1])]
    for position, colour in shown:
        ends = np.insert(position[pairs], 2, np.nan, axis=1).reshape(-1, 3)  # each edge, then a gap
        ax.plot(*ends.T, color=colour, lw=0.9)
        ax.scatter(*position.T, color=colour, s=6, depthshade=False)
    if len(numbers) <= MOST_NAMED:
        for number, place in zip(numbers, shown[-1][0]):
            ax.text(*place, f" {number}", fontsize=FONT - 1)
    everything = np.vstack([position for position, _ in shown])
    if len(everything):
        low, high = everything.min(axis=0), everything.max(axis=0)
        half = 0.55 * np.maximum(high - low, THINNEST * float((high - low).max() or 1.0))
        ax.set_box_aspect(half)  # one scale along all axes
        for limits, centre, reach in zip((ax.set_xlim, ax.set_ylim, ax.set_zlim), (low + high) / 2, half):
            limits(centre - reach, centre + reach)
        for axis, reach in zip((ax.xaxis, ax.yaxis, ax.zaxis), half):
            axis.set_major_locator(MaxNLocator(max(2, round(6 * reach / half.max()))))
    for name, label in zip("xyz", (ax.set_xlabel, ax.set_ylabel, ax.set_zlabel)):
        label(f"{name} (m)", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    ax.set_title(title, fontsize=FONT)
    return figure
