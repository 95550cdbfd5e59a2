"""Symbols of supports and springs in a drawing of a rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Rectangle

from ...structure import Support
from ..style import COLOURS, FONT

BLOCK, CLAMP, GROUND = 0.22, 0.9, 0.06
"""height of a bushing's halves, of a clamp, of the hatched ground under a support"""
GREY, DARK, LIGHT = "#777777", "#333333", "#eeeeee"
BEHIND_WORDS = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
SENSOR = {"boxstyle": "square,pad=0.25", "facecolor": "white", "edgecolor": COLOURS[0], "linewidth": 0.9}
"""of the box around a sensor's number"""
SHAKEN = {"arrowstyle": "<->", "color": COLOURS[1], "linewidth": 1.4}
"""of the arrow of what the shaker moves"""


@dataclass(frozen=True)
class Pen:
    """The axes to draw on, and the drawing's proportions."""

    ax: Axes
    inch: float  #: m along the shaft that are drawn as long as 1 across it
    plate: float  #: height of the base plate

    def post(self, x: float, top: float) -> None:
        """Draw what stands on the base plate."""
        self.ax.plot([x, x], [top, self.plate], color=GREY, linewidth=2.5, zorder=0)

    def hatched(self, left: float, bottom: float, width: float, height: float) -> None:
        """Draw a piece of ground."""
        self.ax.add_patch(Rectangle((left, bottom), width, height, facecolor=LIGHT, edgecolor="#444444", hatch="////"))

    def ground(self, x: float, top: float, half: float = 0.17) -> None:
        """Draw the ground under a support, on a post."""
        self.ax.plot([x - half * self.inch, x + half * self.inch], [top, top], color=DARK, lw=1)
        look: dict[str, Any] = {"facecolor": "white", "edgecolor": "#444444", "hatch": "//////", "lw": 0}
        self.ax.add_patch(Rectangle((x - half * self.inch, top - GROUND), 2 * half * self.inch, GROUND, **look))
        self.post(x, top - GROUND)


def draw_support(pen: Pen, support: Support, y: float, half: float, side: int) -> None:
    """Draw a support of a shaft at a height; ``side``: -1 at its start, 1 at its end, 0 between."""
    x = support.position
    if support.kind == "clamped":
        _draw_clamp(pen, x, y, half, side)
    elif support.kind == "guided":
        _draw_guide(pen, x, y, half, side or 1)
    elif support.kind == "pinned":
        corners = [(x, y - half), (x - 0.11 * pen.inch, y - half - 0.2), (x + 0.11 * pen.inch, y - half - 0.2)]
        pen.ax.add_patch(Polygon(corners, facecolor="white", edgecolor=DARK, lw=1))
        pen.ground(x, y - half - 0.2)
    if support.translation or support.translation_damping:
        draw_spring(pen, x, y - half, y - half - 0.42, bool(support.translation_damping), bool(support.translation))
        pen.ground(x, y - half - 0.42)
        numbers = {"N/m": support.translation, "N s/m": support.translation_damping}
        _draw_text(pen, x + 0.14 * pen.inch, y - half - 0.2, numbers)
    if support.rotation or support.rotation_damping:
        _draw_spiral(pen, x, y)
        numbers = {"N m/rad": support.rotation, "N m s/rad": support.rotation_damping}
        away = -1 if side == 1 else 1
        _draw_text(pen, x + 0.18 * away * pen.inch, y + half + 0.12, numbers, "left" if away > 0 else "right")


def draw_spring(pen: Pen, x: float, start: float, end: float, damped: bool = False, sprung: bool = True) -> None:
    """Draw a spring and a parallel dashpot between two heights."""
    shift = 0.07 * pen.inch * (damped and sprung)
    if sprung:
        y = np.concatenate(([start], np.linspace(start + 0.2 * (end - start), end - 0.2 * (end - start), 9), [end]))
        zigzag = 0.05 * pen.inch * np.array([0, 0, 1, -1, 1, -1, 1, -1, 1, 0, 0])
        pen.ax.plot(x - shift + zigzag, y, color=DARK, lw=0.9, zorder=1.5)
    if damped:
        middle, cup, at = (start + end) / 2, 0.05 * pen.inch, x + shift
        deep = 0.1 * np.sign(end - start)
        pen.ax.plot([at, at], [start, middle], color=DARK, lw=0.9, zorder=1.5)
        pen.ax.plot([at - 0.7 * cup, at + 0.7 * cup], [middle, middle], color=DARK, lw=1.6, zorder=1.5)
        pen.ax.plot([at - cup, at - cup, at + cup, at + cup],
                    [middle - deep, middle + deep, middle + deep, middle - deep], color=DARK, lw=0.9)  # fmt: skip
        pen.ax.plot([at, at], [middle + deep, end], color=DARK, lw=0.9, zorder=1.5)


def _draw_clamp(pen: Pen, x: float, y: float, half: float, side: int) -> None:
    wide = 0.29 * pen.inch
    if side:
        pen.hatched(min(x, x + side * wide), y - CLAMP / 2, wide, CLAMP)
        pen.post(x + side * wide / 2, y - CLAMP / 2)
        return
    for bottom in (half, -CLAMP / 2):
        pen.hatched(x - wide / 2, y + bottom, wide, CLAMP / 2 - half)
    pen.post(x, y - CLAMP / 2)


def _draw_guide(pen: Pen, x: float, y: float, half: float, side: int) -> None:
    """Draw a plate fixed to the shaft that rolls along a wall."""
    tall, wide, roller = half + 0.25, 0.16 * pen.inch, 0.1 * pen.inch
    pen.ax.plot([x, x], [y - tall, y + tall], color=DARK, lw=2)
    pen.ax.plot([x + side * roller / 2] * 2, [y - 0.6 * tall, y + 0.6 * tall], "o", mfc="white", mec=DARK, ms=6)
    pen.hatched(min(x + side * roller, x + side * (roller + wide)), y - tall, wide, 2 * tall)
    pen.post(x + side * (roller + wide / 2), y - tall)


def _draw_spiral(pen: Pen, x: float, y: float) -> None:
    turn = np.linspace(0, 4.5 * np.pi, 120)
    radius = 0.03 + 0.1 * turn / turn[-1]
    pen.ax.plot(x + pen.inch * radius * np.cos(turn), y + radius * np.sin(turn), color="#882255", lw=1, zorder=3)


def _draw_text(pen: Pen, x: float, y: float, numbers: Mapping[str, float | None], ha: str = "left") -> None:
    """Write the numbers that are not zero, with their units."""
    words = "\n".join(f"{value:.3g} {unit}" for unit, value in numbers.items() if value)
    pen.ax.text(x, y, words, ha=ha, va="center", fontsize=FONT - 1, color=DARK, bbox=BEHIND_WORDS)
