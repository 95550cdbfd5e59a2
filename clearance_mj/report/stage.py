"""The figure of an animation: the shafts in their bushings, drawn by matplotlib or from pictures, and contact forces.

Deflections and gaps are drawn many times larger than they are, the shaft's length and thickness as they are. A half of
a bushing is drawn as yielding by as much as the shaft goes beyond the gap: what the law calls penetration.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle

from ..structure import Support
from ..structure.base import is_rotation
from .clip import Clip
from .outline import outline, position_label
from .style import COLOURS, FONT, tidy

__all__ = ["CLAMP", "DPI", "HALF", "MASS", "PLATE", "STEEL", "WALL", "Pictures", "Stage"]

DPI, WIDTH = 100, 7.2
LEFT, RIGHT, TRACE, ABOVE, BETWEEN, BELOW = 0.62, 0.12, 1.1, 0.3, 0.62, 0.42
"""in: margins beside the drawing, height of the trace, room above, between and below the panels"""
ARROW, PLATE, WALL, MIN_HEIGHT = 0.1, 0.015, 0.06, 0.15
"""length of the arrow of the largest force, thickness of a bushing's halves, half height of the clamp, least half
height of the picture, as shares of the shafts' length"""
STEEL, MASS, HALF, CLAMP = "#8a949f", "#4d5660", "#3b3b3b", "#d0d0d0"


class Pictures(ABC):
    """A figure that becomes one picture after the other, by what moves on it."""

    def __init__(self, shown: Clip):
        self.shown, self.shafts = shown, shown.rig.linear.shafts
        self.edges = [outline(shaft) for shaft in self.shafts]
        self.numbers = [shown.shaft == i for i in range(len(self.shafts))]
        radii = [np.interp(shown.position[on], *edges[:2]) for on, edges in zip(self.numbers, self.edges)]
        self.radii, self.figure = np.concatenate(radii), Figure(facecolor="white", dpi=DPI)

    def begin(self, moving: Sequence[Artist]) -> None:
        """Begin with what moves, in the order in which it is drawn."""
        self.canvas, self.background, self.moving = FigureCanvasAgg(self.figure), None, list(moving)

    def trace_of(self, ax: Axes, width: float) -> Line2D:
        """Draw the contact forces over time with lines of a width; return the line of the picture's time.

        Where some are torques, each is drawn over its largest.
        """
        turns = any(is_rotation(b.position) for b in self.shown.rig.bushings)
        for j, force in enumerate(self.shown.trace.T):
            scale = max(np.abs(force).max(), 1e-12) if turns else 1.0
            look: dict[str, Any] = {"color": COLOURS[j % len(COLOURS)], "lw": width, "label": f"bushing {j + 1}"}
            ax.plot(self.shown.trace_time, force / scale, **look)
        tidy(ax, ylabel="Force over its largest" if turns else "Contact force (N)", xlabel="Time (s)")
        ax.set_xlim(*self.shown.trace_time[[0, -1]])
        return ax.axvline(0, color="black", lw=0.8)

    def picture(self, i: int) -> np.ndarray:
        """Return (height, width, 3) pixels of one picture. Only what moves is drawn anew."""
        if self.background is None:
            for artist in self.moving:
                artist.set_animated(True)
            self.canvas.draw()
            self.background = self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self.background)
        self._move(i)
        for artist in self.moving:
            self.figure.draw_artist(artist)
        return np.array(self.canvas.buffer_rgba())[..., :3]

    @abstractmethod
    def _move(self, i: int) -> None:
        """Move everything to where it is in one picture."""


class Stage(Pictures):
    """The figure that becomes one picture after the other: the shafts above, the trace of contact forces below.

    Above, x is in m and y in mm, with the aspect that the exaggeration makes: what MuJoCo draws to the same scale
    lies under the same axes. Several shafts are drawn one above another, each at a level of its own.
    """

    def __init__(self, shown: Clip):
        super().__init__(shown)
        self.length, self.radius = shown.length, max(float(edges[1].max()) for edges in self.edges)
        self.images: list[np.ndarray] = []
        self.places = [shown.rig.linear.place(b.position) for b in shown.rig.bushings]
        self.at_bushings = [np.interp(x, *self.edges[i][:2]) for i, x in self.places]
        self.level = np.zeros(len(self.shafts))
        highest = shown.exaggeration * max(np.abs(shown.lift[:, 1]).max(), *(b.gap for b in shown.rig.bushings))
        self.per_newton = ARROW * self.length / max(np.abs(shown.trace).max(), 1e-12)
        lane = max(MIN_HEIGHT * self.length, 1.1 * highest, 1.05 * np.nanmax(np.abs(self.arrows()[..., 1])))
        self.level = lane * np.arange(len(self.shafts) - 1.0, -len(self.shafts), -2.0)
        self.half_height = lane * len(self.shafts)
        first, last = shown.rig.linear.span
        self.left, self.right = first - 0.04 * self.length, last + 0.03 * self.length
        across = WIDTH - LEFT - RIGHT
        self.size = across, across * 2 * self.half_height / (self.right - self.left)
        self.above, below = self._axes()
        self._label(self.above)
        self.cursor = self.trace_of(below, 1)
        below.legend(fontsize=FONT - 1, frameon=False, loc="lower right", bbox_to_anchor=(1, 0.97), ncols=4)
        self.figure.align_ylabels()
        self.words = self.above.set_title("", fontsize=FONT, loc="left", pad=4)
        self.begin([self.cursor, self.words, *self._gaps(self.above)])

    def _axes(self) -> tuple[Axes, Axes]:
        whole = BELOW + TRACE + BETWEEN + self.size[1] + ABOVE
        self.figure.set_size_inches(WIDTH, whole)
        across = LEFT / WIDTH, self.size[0] / WIDTH
        below = self.figure.add_axes((across[0], BELOW / whole, across[1], TRACE / whole))
        place = (across[0], (BELOW + TRACE + BETWEEN) / whole, across[1], self.size[1] / whole)
        return self.figure.add_axes(place), below

    def _label(self, ax: Axes) -> None:
        tidy(ax, ylabel="Lift (mm)", xlabel=position_label(self.shafts))
        ax.grid(False)
        ax.set_xlim(self.left, self.right)
        height = self.millimetres(self.half_height)
        ax.set_ylim(-height, height)
        if len(self.shafts) > 1:  # each shaft has a scale of its own about its level
            tick = float(f"{0.6 * height / len(self.shafts):.1g}")
            levels, ticks = self.millimetres(self.level), np.array([-tick, 0.0, tick])
            ax.set_yticks(np.add.outer(levels, ticks).ravel(), [f"{t:g}" for t in ticks] * len(levels))
            for level, shaft in zip(levels, self.shafts):
                y = level - 0.8 * height / len(self.shafts)
                ax.text(self.right, y, f"{shaft.name} ", ha="right", va="center", fontsize=FONT, style="italic")
        words = f"lifts and gaps drawn {self.shown.exaggeration:.3g} times larger; relative to the base"
        ax.set_title(words, fontsize=FONT, loc="right", pad=4)

    def _gaps(self, ax: Axes) -> Iterator[Artist]:
        """Lines where the shaft's surface touches a bushing that stands on the base."""
        for bushing, (i, x), radius in zip(self.shown.rig.bushings, self.places, self.at_bushings):
            if bushing.to is None:
                reach = bushing.length / 2 + 0.015 * self.length
                touch = 1e3 * np.array(bushing.walls) + self.millimetres(self.level[i] + radius * np.array([-1, 1]))
                yield ax.hlines(touch[np.isfinite(touch)], x - reach, x + reach, color=HALF, lw=0.7)

    def millimetres(self, drawn: Any) -> Any:
        """Return what a drawn height in m stands for, in mm."""
        return 1e3 * drawn / self.shown.exaggeration

    def height(self) -> np.ndarray:
        """Return (n, n_x) drawn height of the shafts' lines, m."""
        return self.level[self.shown.shaft] + self.shown.exaggeration * self.shown.lift[:, 1]

    def masses_on_shafts(self) -> list[tuple[float, np.ndarray]]:
        """Return the position of every point mass and disc, and its drawn height in every picture, (n,), m."""
        points = [m.position for m in self.shown.rig.masses]
        points += [f"{s.name}@{d.position!r}" if s.name else d.position for s in self.shafts for d in s.discs]
        lanes = [self.shown.rig.linear.place(point) for point in points]
        lifts = [self.shown.exaggeration * self.shown.lift_at(point)[:, 1] for point in points]
        return [(x, self.level[i] + lift) for (i, x), lift in zip(lanes, lifts)]

    def supports(self) -> list[tuple[Support, int, int]]:
        """Return the supports, the numbers of their shafts, and -1 at a shaft's start, 1 at its end, 0 between."""
        return [
            (support, i, int(support.position == shaft.end) - int(support.position == shaft.start))
            for i, shaft in enumerate(self.shafts)
            for support in shaft.supports
        ]

    def arrows(self) -> np.ndarray:
        """Return (n, n_bushings, 2, 2) where each arrow begins and ends: x and drawn height, m. It ends on its half."""
        shown = self.shown
        thickness = PLATE * self.length
        below, above = np.moveaxis(self.halves(), -1, 0)
        tip = np.where(shown.force > 0, above + thickness, below - thickness)
        tip = np.where(np.isfinite(tip), tip, self.level[[i for i, _ in self.places]])
        tail = tip + self.per_newton * shown.force
        along = np.broadcast_to([x for _, x in self.places], tip.shape)
        return np.stack((np.stack((along, tail), axis=-1), np.stack((along, tip), axis=-1)), axis=2)

    def halves(self) -> np.ndarray:
        """(n, n_bushings, 2) drawn height of the inner faces of the lower and the upper halves, m; infinite for none.

        A bushing on another shaft moves with it.
        """
        shown, faces = self.shown, []
        for bushing, (i, _), radius in zip(shown.rig.bushings, self.places, self.at_bushings):
            carried = 0.0 if bushing.to is None else shown.lift_at(bushing.to)[:, 1]
            moved = shown.lift_at(bushing.position)[:, 1] - carried
            lower, upper = bushing.walls
            pair = np.column_stack((np.minimum(moved, lower), np.maximum(moved, upper))) + np.reshape(carried, (-1, 1))
            faces.append(self.level[i] + shown.exaggeration * pair + radius * np.array([-1, 1]))
        return np.stack(faces, axis=1)

    def show_images(self, images: list[np.ndarray]) -> None:
        """Let pictures of MuJoCo, if there are any, be shown under the axes."""
        if images:
            edges = self.left, self.right, *self.above.get_ylim()
            self.images = images
            self.image = self.above.imshow(images[0], extent=edges, aspect="auto", interpolation="none")
            self.moving = [self.image, *self.above.spines.values(), *self.moving]

    def show_lines(self) -> None:
        """Let matplotlib draw the rig."""
        ax, rig, plate = self.above, self.shown.rig, self.millimetres(PLATE * self.length)
        for support, i, side in self.supports():
            self._draw_support(support, i, side)
        self.lines = [(on, ax.fill_between(self.shown.position[on], 0, 0, color=STEEL, lw=0)) for on in self.numbers]
        on_shafts = self.masses_on_shafts()
        self.of_masses = np.array([height for _, height in on_shafts]).reshape(len(on_shafts), self.shown.time.size)
        (self.masses,) = ax.plot([x for x, _ in on_shafts], [0] * len(on_shafts), "o", color=MASS, ms=9)
        self.plates = [
            [ax.add_patch(Rectangle((x - b.length / 2, 0), b.length, side * plate, facecolor=HALF, lw=0))
             for side in (-1, 1)]
            for b, (_, x) in zip(rig.bushings, self.places)
        ]  # fmt: skip
        look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.005, "minlength": 0}
        start = self.arrows()[0, :, 0]
        colours = [COLOURS[j % len(COLOURS)] for j in range(len(rig.bushings))]
        self.force = ax.quiver(*start.T, 0 * start[:, 0], 0 * start[:, 0], color=colours, **look)
        halves = (half for pair in self.plates for half in pair)
        self.moving += [*(line for _, line in self.lines), self.masses, *halves, self.force]

    def _draw_support(self, support: Support, i: int, side: int) -> None:
        """A wall at an end, blocks or a foot between."""
        ax, x, level = self.above, support.position, self.millimetres(self.level[i])
        wall, wide = self.millimetres(WALL * self.length), 0.02 * self.length
        radius = self.millimetres(np.interp(x, *self.edges[i][:2]))
        look: dict[str, Any] = {"facecolor": CLAMP, "hatch": "////", "lw": 0}
        if support.kind in ("clamped", "guided") and side:
            away = (0.004 * self.length if support.kind == "guided" else 0.0) * side
            edge = self.left if side < 0 else self.right
            ax.add_patch(Rectangle((x + away, level - wall), edge - x - away, 2 * wall, **look))
        elif support.kind == "clamped":
            for sign in (-1, 1):
                ax.add_patch(Rectangle((x - wide / 2, level + sign * radius), wide, sign * wall, **look))
        elif support.kind == "pinned":
            foot = level - radius - 0.7 * wall
            corners = [(x, level - radius), (x - wide / 2, foot), (x + wide / 2, foot)]
            ax.add_patch(Polygon(corners, facecolor=CLAMP, edgecolor=HALF, lw=0.7))
        elif support.translation:
            y = level - radius - wall * np.array([0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0])
            ax.plot(x + 0.2 * wide * np.array([0, 0, 1, -1, 1, -1, 1, 0, 0]), y, color=HALF, lw=0.8, zorder=0)
            ax.add_patch(Rectangle((x - wide / 2, y[-1]), wide, -0.2 * wall, **look))

    def _move(self, i: int) -> None:
        shown = self.shown
        self.words.set_text(f"t = {shown.time[i]:.4f} s, {shown.slow:g} times slower")
        self.cursor.set_xdata([shown.time[i]] * 2)
        if self.images:
            self.image.set_data(self.images[i])
            return
        middle, half = self.millimetres(self.height()[i]), self.millimetres(self.radii)
        for on, line in self.lines:
            line.set_data(shown.position[on], (middle - half)[on], (middle + half)[on])
        self.masses.set_ydata(self.millimetres(self.of_masses[:, i]))
        for pair, faces in zip(self.plates, self.millimetres(self.halves()[i])):
            for plate, face in zip(pair, faces):
                plate.set(y=face if np.isfinite(face) else 0.0, visible=bool(np.isfinite(face)))
        tail, tip = np.moveaxis(self.arrows()[i], 1, 0) * (1, self.millimetres(1))
        self.force.set_offsets(tail)
        self.force.set_UVC(*(tip - tail).T)
