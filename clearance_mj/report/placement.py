"""Figure of a sensor layout: the shaft with its mode shapes, each sensor's contribution, the cost of its loss."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ..beam import mode_shapes
from ..placement import Candidates, Placement
from ..rig import Rig
from .outline import position_label
from .style import FONT, REPEAT, TEST, Drawing, canvas, tidy, write_numbers

__all__ = ["draw"]

MODES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2.5)))
BOX = {"boxstyle": "square,pad=0.2", "facecolor": "white", "edgecolor": TEST, "linewidth": 0.8}  # of a sensor's number
MAX_GROWTH = 10.0  # of a standard deviation that is drawn


def draw(rig: Rig, places: Candidates, layout: Placement, modes: Sequence[int]) -> Drawing:
    """Draw a layout for the modes of these numbers, and where its sensors might have sat."""
    figure = canvas(5.6)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1))
    on_one_shaft = len(rig.linear.shafts) == 1 and places.position.dtype == float
    (_draw_shaft if on_one_shaft else _draw_points)(figure.add_subplot(grid[0, :]), rig, places, layout, modes)
    _draw_contributions(figure.add_subplot(grid[1, 0]), layout)
    _draw_growth(figure.add_subplot(grid[1, 1]), layout, modes)
    caption = (
        f"{len(layout.chosen)} sensors (numbered) for modes {', '.join(map(str, modes))} of rig “{rig.name}”; ticks: "
        f"candidates{'; grey: bushings' * on_one_shaft}. Below: the fraction of the information that is lost "
        "without each sensor, and the factor by which the least standard deviation of each mode then grows."
    )
    alt = f"Layout of {len(layout.chosen)} sensors{' along the shaft' * on_one_shaft}."
    return Drawing("placement", figure, caption, alt)


def _draw_shaft(ax: Axes, rig: Rig, places: Candidates, layout: Placement, modes: Sequence[int]) -> None:
    shaft = rig.linear.shafts[0]
    start, end = shaft.start, shaft.end
    length = end - start
    for bushing in rig.bushings:
        left = rig.linear.place(bushing.position)[1] - bushing.length / 2
        ax.add_patch(Rectangle((left, -1.25), bushing.length, 2.5, facecolor="#dddddd", edgecolor="none"))
    for support in shaft.supports:
        if support.kind == "clamped":
            left = support.position - 0.02 * length * (1 - (support.position - start) / length)
            ax.add_patch(Rectangle((left, -1.25), 0.02 * length, 2.5, fc="#eeeeee", ec="#444444", hatch="////"))
        else:
            ax.plot([support.position], [-0.13], "^" if support.kind == "pinned" else "s", ms=7, mfc="white", mec=TEST)
    ax.axhline(0, color="#444444", lw=3, alpha=0.4)
    x = np.linspace(start, end, 401)
    for i, shape in enumerate(mode_shapes(rig, x, max(modes))[:, np.array(modes) - 1].T):
        look: dict[str, Any] = {"color": MODES[i % 6], "ls": STYLES[i % 6], "lw": 1.2, "label": f"mode {modes[i]}"}
        ax.plot(x, shape / np.max(np.abs(shape)), **look)
    ax.plot(places.position, np.full(places.position.size, -1.32), "|", color=REPEAT, ms=6, label="candidates")
    row, previous, top = 0, -np.inf, 1.75
    for number, position in enumerate(layout.position, 1):
        row = (row + 1) % 2 if position - previous < 0.035 * length else 0
        previous, height = position, 1.35 + 0.3 * row
        top = max(top, height + 0.4)
        ax.plot([position] * 2, [0, height], color=TEST, lw=0.7, zorder=1)
        ax.plot(position, 0, "o", color=TEST, ms=4)
        ax.text(position, height, f"{number}", ha="center", va="bottom", fontsize=FONT - 1, bbox=BOX)
    tidy(ax, "", "Mode shape over its largest (1)", position_label(rig.linear.shafts))
    ax.set(xlim=(start - 0.02 * length, end + 0.02 * length), ylim=(-1.45, top), yticks=(-1, 0, 1))
    ax.legend(fontsize=FONT - 1, frameon=False, ncols=len(modes) + 1, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def _draw_points(ax: Axes, rig: Rig, places: Candidates, layout: Placement, modes: Sequence[int]) -> None:
    """Draw the modes at every candidate, side by side."""
    shapes, number = mode_shapes(rig, list(places.position), max(modes))[:, np.array(modes) - 1], len(places.position)
    for i, shape in enumerate((shapes / np.max(np.abs(shapes), axis=0)).T):
        ax.plot(shape, color=MODES[i % 6], ls=STYLES[i % 6], lw=1.0, marker=".", label=f"mode {modes[i]}")
    for order, i in enumerate(layout.chosen, 1):
        ax.axvline(i, color=TEST, lw=0.7, zorder=1)
        ax.text(i, 1.15, f"{order}", ha="center", va="bottom", fontsize=FONT - 1, bbox=BOX)
    tidy(ax, "", "Mode shape over its largest (1)", "Candidate")
    ax.set_xticks(range(number), [str(point) for point in places.position], rotation=90 if number > 8 else 0)
    ax.tick_params(axis="x", labelsize=FONT - 2)
    ax.set_ylim(-1.15, 1.55)
    ax.legend(fontsize=FONT - 1, frameon=False, ncols=len(modes), loc="lower center", bbox_to_anchor=(0.5, 1.0))


def _labels(layout: Placement) -> list[str]:
    texts = (x if isinstance(x, str) else f"{x:.3g}" for x in layout.position.tolist())
    return [f"{i}\n{text}" for i, text in enumerate(texts, 1)]


def _draw_contributions(ax: Axes, layout: Placement) -> None:
    places = np.arange(len(layout.chosen))
    ax.bar(places - 0.2, layout.contribution, 0.4, color="#0072b2", label="contribution E")
    ax.bar(places + 0.2, layout.determinant_after_loss, 0.4, color="#e69f00", hatch="///", edgecolor="white",
           label="determinant left without it")  # fmt: skip
    tidy(ax, "what each sensor carries", "Share (1)", "Sensor, position (m)")
    ax.set_xticks(places, _labels(layout), fontsize=FONT - 1)
    ax.set_ylim(0, 1.32)
    ax.legend(fontsize=FONT - 1, frameon=False, loc="upper left", ncols=2)


def _draw_growth(ax: Axes, layout: Placement, modes: Sequence[int]) -> None:
    growth = np.minimum(layout.std_growth, MAX_GROWTH).T
    image = ax.imshow(growth, cmap="viridis_r", aspect="auto", vmin=1, vmax=max(2.0, growth.max()))
    tidy(ax, "standard deviation without it, over that with it (1)", "Mode (number)", "Sensor, position (m)")
    write_numbers(
        ax, growth, lambda value: f"{value:.2f}" if value < MAX_GROWTH else f"> {MAX_GROWTH:g}",
        lambda value: float(np.asarray(image.norm(value))) > 0.5,
    )  # fmt: skip
    ax.set_xticks(np.arange(len(layout.chosen)), _labels(layout), fontsize=FONT - 1)
    ax.set_yticks(np.arange(len(modes)), [str(mode) for mode in modes])
