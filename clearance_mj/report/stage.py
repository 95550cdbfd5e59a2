"""The figure of an animation: the shaft in its bushings, drawn by matplotlib or from pictures, and contact forces.

Deflections and gaps are drawn many times larger than they are, the shaft's length and thickness as they are. A half of
a bushing is drawn as yielding by as much as the shaft goes beyond the gap: what the law calls penetration.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from .clip import Clip
from .style import COLOURS, FONT, tidy

__all__ = ["CLAMP", "DPI", "HALF", "MASS", "PLATE", "STEEL", "WALL", "Stage"]

DPI, WIDTH = 100, 7.2
LEFT, RIGHT, TRACE, ABOVE, BETWEEN, BELOW = 0.62, 0.12, 1.1, 0.3, 0.62, 0.42
"""in: margins beside the drawing, height of the trace, room above, between and below the panels"""
ARROW, PLATE, WALL, LEAST_HEIGHT = 0.1, 0.015, 0.06, 0.15
"""length of the arrow of the largest force, thickness of a bushing's halves, half height of the clamp, least half
height of the picture, as shares of the shaft's length"""
STEEL, MASS, HALF, CLAMP = "#8a949f", "#4d5660", "#3b3b3b", "#d0d0d0"


class Stage:
    """The figure that becomes one picture after the other: the shaft above, the trace of contact forces below.

    Above, x is in m and y in mm, with the aspect that the exaggeration makes: what MuJoCo draws to the same scale
    lies under the same axes.
    """

    def __init__(self, shown: Clip):
        self.shown = shown
        self.images: list[np.ndarray] = []
        rig, length = shown.rig, shown.rig.beam.length
        self.radius = (rig.beam.diameter or rig.beam.height or 0.0) / 2
        highest = shown.exaggeration * max(np.abs(shown.lift).max(), *(b.gap for b in rig.bushings))
        self.per_newton = ARROW * length / max(np.abs(shown.trace).max(), 1e-12)
        self.half_height = max(LEAST_HEIGHT * length, 1.1 * highest, 1.05 * np.abs(self.arrows()[..., 1]).max())
        self.left, self.right = -0.04 * length, 1.03 * length
        across = WIDTH - LEFT - RIGHT
        self.size = across, across * 2 * self.half_height / (self.right - self.left)
        self.figure = Figure(facecolor="white", dpi=DPI)
        self.canvas, self.background = FigureCanvasAgg(self.figure), None
        self.above, below = self._axes()
        self._label(self.above)
        self.cursor = self._trace(below)
        self.words = self.above.set_title("", fontsize=FONT, loc="left", pad=4)
        self.moving = [self.cursor, self.words, *self._gaps(self.above)]

    def _axes(self) -> tuple[Axes, Axes]:
        whole = BELOW + TRACE + BETWEEN + self.size[1] + ABOVE
        self.figure.set_size_inches(WIDTH, whole)
        across = LEFT / WIDTH, self.size[0] / WIDTH
        below = self.figure.add_axes((across[0], BELOW / whole, across[1], TRACE / whole))
        place = (across[0], (BELOW + TRACE + BETWEEN) / whole, across[1], self.size[1] / whole)
        return self.figure.add_axes(place), below

    def _label(self, ax: Axes) -> None:
        tidy(ax, ylabel="Lift (mm)", xlabel="Distance from the clamp (m)")
        ax.grid(False)
        ax.set_xlim(self.left, self.right)
        height = self.millimetres(self.half_height)
        ax.set_ylim(-height, height)
        words = f"lifts and gaps drawn {self.shown.exaggeration:.3g} times larger; relative to the base"
        ax.set_title(words, fontsize=FONT, loc="right", pad=4)

    def _gaps(self, ax: Axes) -> Iterator[Artist]:
        """Lines where the shaft's surface touches a bushing."""
        for bushing in self.shown.rig.bushings:
            ends = np.array(bushing.ends) + 0.015 * self.shown.rig.beam.length * np.array([-1, 1])
            touch = 1e3 * bushing.gap + self.millimetres(self.radius)
            yield ax.hlines([-touch, touch], *ends, color=HALF, lw=0.7)

    def millimetres(self, drawn: Any) -> Any:
        """What a drawn height in m stands for, in mm."""
        return 1e3 * drawn / self.shown.exaggeration

    def _trace(self, ax: Axes) -> Line2D:
        for j, force in enumerate(self.shown.trace.T):
            ax.plot(self.shown.trace_time, force, color=COLOURS[j % len(COLOURS)], lw=1, label=f"bushing {j + 1}")
        tidy(ax, ylabel="Contact force (N)", xlabel="Time (s)")
        ax.set_xlim(*self.shown.trace_time[[0, -1]])
        ax.legend(fontsize=FONT - 1, frameon=False, loc="lower right", bbox_to_anchor=(1, 0.97), ncols=4)
        self.figure.align_ylabels()
        return ax.axvline(0, color="black", lw=0.8)

    def arrows(self) -> np.ndarray:
        """(n, n_bushings, 2, 2) where each arrow begins and ends: x and drawn height, m. It ends on its half."""
        shown = self.shown
        thickness = PLATE * shown.rig.beam.length
        below, above = np.moveaxis(self.halves(), -1, 0)
        tip = np.where(shown.force > 0, above + thickness, below - thickness)
        tail = tip + self.per_newton * shown.force
        along = np.broadcast_to([b.position for b in shown.rig.bushings], tip.shape)
        return np.stack((np.stack((along, tail), axis=-1), np.stack((along, tip), axis=-1)), axis=2)

    def halves(self) -> np.ndarray:
        """(n, n_bushings, 2) drawn height of the inner faces of the lower and the upper halves, m."""
        shown = self.shown
        at, gap = np.array([(b.position, b.gap) for b in shown.rig.bushings]).T
        lift = np.array([np.interp(at, shown.position, lift) for lift in shown.lift])
        faces = np.stack((np.minimum(lift, -gap), np.maximum(lift, gap)), axis=-1)
        return shown.exaggeration * faces + self.radius * np.array([-1, 1])

    def show_images(self, images: list[np.ndarray]) -> None:
        """Let pictures of MuJoCo, if there are any, be shown under the axes."""
        if images:
            edges = self.left, self.right, *self.above.get_ylim()
            self.images = images
            self.image = self.above.imshow(images[0], extent=edges, aspect="auto", interpolation="none")
            self.moving = [self.image, *self.above.spines.values(), *self.moving]

    def show_lines(self) -> None:
        """Let matplotlib draw the rig."""
        ax, rig, length = self.above, self.shown.rig, self.shown.rig.beam.length
        wall, plate = self.millimetres(WALL * length), self.millimetres(PLATE * length)
        ax.add_patch(Rectangle((self.left, -wall), -self.left, 2 * wall, facecolor=CLAMP, hatch="////", lw=0))
        self.shaft = ax.fill_between(self.shown.position, 0, 0, color=STEEL, lw=0)
        (self.masses,) = ax.plot([m.position for m in rig.masses], [0] * len(rig.masses), "o", color=MASS, ms=9)
        self.plates = [
            [ax.add_patch(Rectangle((b.ends[0], 0), b.length, side * plate, facecolor=HALF, lw=0)) for side in (-1, 1)]
            for b in rig.bushings
        ]
        look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.005, "minlength": 0}
        start = self.arrows()[0, :, 0]
        colours = [COLOURS[j % len(COLOURS)] for j in range(len(rig.bushings))]
        self.force = ax.quiver(*start.T, 0 * start[:, 0], 0 * start[:, 0], color=colours, **look)
        self.moving += [self.shaft, self.masses, *(half for pair in self.plates for half in pair), self.force]

    def picture(self, i: int) -> np.ndarray:
        """(height, width, 3) pixels of one picture. Only what moves is drawn anew."""
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

    def _move(self, i: int) -> None:
        shown = self.shown
        self.words.set_text(f"t = {shown.time[i]:.4f} s, {shown.slow:g} times slower")
        self.cursor.set_xdata([shown.time[i]] * 2)
        if self.images:
            self.image.set_data(self.images[i])
            return
        line, half = 1e3 * shown.lift[i], self.millimetres(self.radius)
        self.shaft.set_data(shown.position, line - half, line + half)
        self.masses.set_ydata(np.interp(np.asarray(self.masses.get_xdata()), shown.position, line))
        for pair, faces in zip(self.plates, self.millimetres(self.halves()[i])):
            for half, face in zip(pair, faces):
                half.set(y=face)
        tail, tip = np.moveaxis(self.arrows()[i], 1, 0) * (1, self.millimetres(1))
        self.force.set_offsets(tail)
        self.force.set_UVC(*(tip - tail).T)
