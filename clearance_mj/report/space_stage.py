"""The figure of an animation in space: shafts in their tubes seen from the side, orbits in the gaps, contact forces.

Displacements and gaps are drawn many times larger than they are, the shafts' length and thickness as they are: a tube's
bore is drawn as wide as the shaft and its exaggerated gap. Nothing is foreshortened (an orthographic view). A slot has
plates above and below the shaft, or before and behind it, and teeth or another play of its twist have two flanks.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from .clip import Clip
from .stage import CLAMP, HALF, MASS, STEEL, Pictures
from .style import COLOURS, FONT, TEST, tidy

__all__ = ["SpaceStage"]

WIDTH, LEFT, RIGHT, ABOVE, BETWEEN, BELOW, PANEL = 7.2, 0.62, 0.12, 0.3, 0.62, 0.42, 1.55
"""in: the figure's width, margins, room above, between and below the panels, height of the lower ones"""
SEEN_FROM = np.radians((32.0, 14.0))  # around the vertical, and from above
TURN = np.linspace(0.0, 2 * np.pi, 73)
TRAIL = 0.35  # share of the shown time that an orbit's trail lasts
MOST_ORBITS = 3  # panels beside the trace
LARGEST_DISC = 0.13  # radius of a disc as it is drawn, as a share of the shaft's length
DISC_RADII = 4.0  # radii of the shaft that a disc without a polar inertia has
DRAWN_TWIST, FLANK = 0.5, 5.0
"""rad, a clearance of twist as it is drawn; length of its flanks in radii of the shaft"""


def picture_of(x: Any, y: Any, z: Any) -> np.ndarray:
    """Return (2, ...) right and up in the picture of points, in the unit of x, y and z.

    x runs to the right and away, y towards the eye, z up.
    """
    (cos, up), (sin, tilt) = np.cos(SEEN_FROM), np.sin(SEEN_FROM)
    x, y, z = np.broadcast_arrays(*(np.asarray(part, dtype=float) for part in (x, y, z)))
    return np.array((x * cos + y * sin, z * up + (x * sin - y * cos) * tilt))


class SpaceStage(Pictures):
    """The figure that becomes one picture after the other."""

    def __init__(self, shown: Clip):
        super().__init__(shown)
        self.rows = shown.rig.clearance_rows
        self.axes = [shown.rig.row_axes[rows.stop - 1] for rows in self.rows]  # of a round one z, its second
        self.discs = self._discs()
        self.moving: list[Artist] = []
        self.above, self.orbits, below = self._axes()
        self._draw_above(self.above)
        self.trails = [self._draw_orbit(ax, j) for j, ax in enumerate(self.orbits)]
        self.cursor = self.trace_of(below, 0.9)
        self.begin(sorted([*self.moving, self.cursor, self.words], key=lambda artist: artist.get_zorder()))

    def _axes(self) -> tuple[Axes, list[Axes], Axes]:
        corners = self._reach()
        low, high = corners.min(axis=1), corners.max(axis=1)
        wide, high_in = WIDTH - LEFT - RIGHT, (high - low)[1] / (high - low)[0]
        height = max(wide * high_in, 1.8)
        whole = BELOW + PANEL + BETWEEN + height + ABOVE
        self.figure.set_size_inches(WIDTH, whole)
        above = self.figure.add_axes((LEFT / WIDTH, 1 - (ABOVE + height) / whole, wide / WIDTH, height / whole))
        above.set_xlim(low[0], high[0])
        middle, half = low[1] / 2 + high[1] / 2, (high - low)[0] * height / wide / 2
        above.set_ylim(middle - half, middle + half)
        panels = []
        count = min(len(self.shown.rig.bushings), MOST_ORBITS)
        for j in range(count):
            panels.append(self.figure.add_axes(self._inches(LEFT + j * (PANEL + 0.12), PANEL, whole)))
        start = LEFT + count * (PANEL + 0.12) + 0.62
        return above, panels, self.figure.add_axes(self._inches(start, WIDTH - RIGHT - start, whole))

    @staticmethod
    def _inches(left: float, width: float, whole: float) -> tuple[float, float, float, float]:
        return left / WIDTH, BELOW / whole, width / WIDTH, PANEL / whole

    def _reach(self) -> np.ndarray:
        """(2, n) points of the picture above that the axes hold."""
        shown, circle = self.shown, np.array((np.cos(TURN[::6]), np.sin(TURN[::6])))
        moved = shown.exaggeration * shown.lift
        line = picture_of(shown.position, moved[:, 0], moved[:, 1])
        found = [line - self.radii, line + self.radii]
        for point, _, radius in self.discs:
            at = shown.exaggeration * shown.lift_at(point)[:, :, None] + radius * circle
            found.append(picture_of(shown.rig.linear.place(point)[1], at[:, 0], at[:, 1]))
        for j, bushing in enumerate(shown.rig.bushings):
            if self._turns(j):
                continue
            bore = shown.exaggeration * bushing.gap + self._radius(j)
            at = self._middle(j, 0)[:, None] + bore * circle
            found.append(picture_of(shown.rig.linear.place(bushing.position)[1], *at))
        corner = 0.17 * shown.length  # where the directions are, below on the right
        points = np.concatenate([part.reshape(2, -1) for part in found], axis=1)
        low, high = points.min(axis=1), points.max(axis=1)
        margin = 0.03 * shown.length
        return np.array((low - margin, high + margin, (high[0] + margin, min(low[1], high[1] - 1.5 * corner)))).T

    def _draw_above(self, ax: Axes) -> None:
        ax.set_axis_off()
        self.words = ax.set_title("", fontsize=FONT, loc="left", pad=4)
        words = f"displacements and gaps drawn {self.shown.exaggeration:.3g} times larger"
        ax.set_title(words, fontsize=FONT, loc="right", pad=4)
        first, last = self.shown.rig.linear.span
        ax.plot(*picture_of([first, last], 0, 0), color=HALF, lw=0.6, ls=(0, (6, 3, 1, 3)), zorder=0)
        for shaft in self.shafts:
            for support in shaft.supports:
                self._draw_support(ax, support.position, support.kind in ("clamped", "guided"))
        self._draw_axes_of_space(ax)
        self.bodies = self._pieces(ax)
        self.tubes = {j: self._draw_tube(ax, j) for j in range(len(self.rows)) if not self._turns(j)}
        orders = [self._order(self.shown.rig.linear.place(point)[1]) for point, *_ in self.discs]
        self.plates = [(self._polygon(ax, MASS, at), self._line(ax, "white", 1.2, at + 0.001)) for at in orders]
        self.paths = [self._line(ax, COLOURS[j % len(COLOURS)], 1.1, 6) for j in range(len(self.rows))]
        for j in (j for j, (axis, _) in enumerate(self.axes) if axis == "RX"):
            for wall in filter(np.isfinite, self.shown.rig.bushings[j].walls):
                ax.plot(*self._spoke(j, wall), color=HALF, lw=1.2, zorder=5)

    def _order(self, x: float) -> float:
        """Where a place (m) is in the order of drawing: what is nearer to the eye, at a smaller x, comes later."""
        first, last = self.shown.rig.linear.span
        return 4.0 - (x - first) / (last - first)

    def _pieces(self, ax: Axes) -> list[tuple[np.ndarray, Polygon]]:
        """Pieces of the shafts between discs, which hide what is behind them: points of each, and what is drawn."""
        position, found = self.shown.position, []
        places = [self.shown.rig.linear.place(point) for point, *_ in self.discs]
        for number, on in enumerate(self.numbers):
            points = np.flatnonzero(on)
            inner = [x for i, x in places if i == number and position[points[0]] < x < position[points[-1]]]
            edges = [0, *np.searchsorted(position[points], sorted(set(inner))), points.size - 1]
            for first, last in zip(edges[:-1], edges[1:]):
                piece = points[first : last + 1]
                found.append((piece, self._polygon(ax, STEEL, self._order(float(position[piece].mean())))))
        return found

    def _polygon(self, ax: Axes, colour: str, order: float) -> Polygon:
        patch = Polygon(np.zeros((1, 2)), facecolor=colour, edgecolor=HALF, lw=0.5, zorder=order)
        ax.add_patch(patch)
        self.moving.append(patch)
        return patch

    def _line(self, ax: Axes, colour: str, width: float, order: float) -> Line2D:
        (line,) = ax.plot([], [], color=colour, lw=width, zorder=order)
        self.moving.append(line)
        return line

    def _draw_support(self, ax: Axes, x: float, is_wall: bool) -> None:
        size = 0.05 * self.shown.length
        if is_wall:
            corners = picture_of(x, size * np.array([-1, 1, 1, -1]), size * np.array([-1, -1, 1, 1]))
        else:
            corners = picture_of(x + 0.3 * size * np.array([0, -1, 1]), 0, size * np.array([0, -1, -1]))
        ax.add_patch(Polygon(corners.T, facecolor=CLAMP, edgecolor=HALF, lw=0.6, zorder=1))

    def _draw_axes_of_space(self, ax: Axes) -> None:
        """Directions in the lower right corner, and that of gravity."""
        (_, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        length = 0.07 * self.shown.length
        origin = np.array([right - 1.3 * length, low + 0.45 * length + 0.02 * (high - low)])
        arrows = {name: length * picture_of(*axis) for name, axis in zip("xyz", np.eye(3))}
        if self.shown.rig.gravity is not None:
            g = np.array(self.shown.rig.gravity)
            tip = length * picture_of(*g / np.linalg.norm(g))
            self._arrow(ax, origin - [1.6 * length, -length], tip, "g", COLOURS[1])
        for name, tip in arrows.items():
            self._arrow(ax, origin, tip, name, HALF)

    @staticmethod
    def _arrow(ax: Axes, start: np.ndarray, tip: np.ndarray, name: str, colour: str) -> None:
        look = {"arrowstyle": "->", "color": colour, "lw": 0.9}
        ax.annotate("", tuple(start + tip), tuple(start), arrowprops=look)
        x, y = start + 1.3 * tip
        ax.text(x, y, name, fontsize=FONT - 1, ha="center", va="center", color=colour)

    def _draw_tube(self, ax: Axes, j: int) -> tuple[tuple[Polygon, Line2D], tuple[Polygon, Line2D]]:
        """The half behind the shaft and the half before it, or both plates of a slot, with lines at both ends."""
        colour, halves = COLOURS[j % len(COLOURS)], []
        for order, alpha in ((2.0, 0.28), (5.0, 0.16)):
            half = self._polygon(ax, colour, order)
            half.set(alpha=alpha, linewidth=0)
            halves.append((half, self._line(ax, colour, 0.9, order + 0.1)))
        return halves[0], halves[1]

    def _discs(self) -> list[tuple[float | str, float, float]]:
        """Points of discs and masses, the angle (rad) of what marks their turning, and radii as drawn, m."""
        rig, most = self.shown.rig, LARGEST_DISC * self.shown.length
        found: list[tuple[float | str, float, float]] = []
        for shaft, edges in zip(self.shafts, self.edges):
            for disc in shaft.discs:
                point = f"{shaft.name}@{disc.position!r}" if shaft.name else disc.position
                radius = np.sqrt(2 * disc.polar_inertia / disc.mass) if disc.polar_inertia and disc.mass else 0.0
                found.append((point, 0.0, float(radius or DISC_RADII * edges[1].max())))
        found += [(mass.position, 0.0, DISC_RADII / 2 * float(self.radii.max())) for mass in rig.masses]
        heavy = {each.position: each.phase for each in rig.unbalances}
        return [(point, heavy.get(point, 0.0), min(radius, most)) for point, _, radius in found]

    def _draw_orbit(self, ax: Axes, j: int) -> tuple[Line2D, Line2D]:
        bushing, (axis, _), colour = self.shown.rig.bushings[j], self.axes[j], COLOURS[j % len(COLOURS)]
        gap, walls = self._in_panel(j, bushing.gap), self._in_panel(j, np.array(bushing.walls))
        if bushing.is_round:
            ax.plot(gap * np.cos(TURN), gap * np.sin(TURN), color=TEST, lw=0.9)
        for wall in () if bushing.is_round else walls[np.isfinite(walls)]:
            (ax.axvline if axis == "Y" else ax.axhline)(wall, color=TEST, lw=0.9)
        reach = 1.1 * max(gap, np.abs(self._in_panel(j, self.shown.path[:, self.rows[j]])).max())
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach))
        if self._turns(j):
            tidy(ax, f"bushing {j + 1}, {axis} (mrad)")
        else:
            tidy(ax, f"bushing {j + 1}", "z (µm)" if j == 0 else "", "y (µm)")
        if j:
            ax.set_yticklabels([])
        dot = self._line(ax, colour, 0, 4)
        dot.set(marker="o", markersize=5)
        return self._line(ax, colour, 0.9, 3), dot

    def _turns(self, j: int) -> bool:
        return self.axes[j][0].startswith("R")

    def _in_panel(self, j: int, place: Any) -> Any:
        """µm of places in a clearance, mrad of rotations."""
        return (1e3 if self._turns(j) else 1e6) * place

    def _path(self, j: int, samples: slice) -> np.ndarray:
        """(2, n) places in a clearance: along y and z, of what moves along one of them 0 along the other."""
        path = self.shown.path[samples, self.rows[j]].T
        if len(path) == 2:
            return path
        return np.concatenate((path, 0 * path) if self.axes[j][0] == "Y" else (0 * path, path))

    def _spoke(self, j: int, angle: float) -> np.ndarray:
        """(2, 2) line from the shaft's axis outwards that shows a twist, rad."""
        bushing, at = self.shown.rig.bushings[j], DRAWN_TWIST * angle / self.shown.rig.bushings[j].gap
        reach = FLANK * self._radius(j) * np.array([0, 1])
        return picture_of(self.shown.rig.linear.place(bushing.position)[1], -reach * np.sin(at), reach * np.cos(at))

    def _move(self, i: int) -> None:
        shown = self.shown
        turned = f", {np.degrees(shown.angle[i]) % 360:3.0f}°" if shown.angle.any() else ""
        self.words.set_text(f"t = {shown.time[i]:.4f} s{turned}, {shown.slow:g} times slower")
        self.cursor.set_xdata([shown.time[i]] * 2)
        lift = shown.exaggeration * shown.lift[i]
        for points, body in self.bodies:
            body.set_xy(self._silhouette(shown.position[points], lift[:, points], self.radii[points]).T)
        for (point, phase, radius), (plate, spoke) in zip(self.discs, self.plates):
            x, (y, z) = shown.rig.linear.place(point)[1], shown.exaggeration * shown.lift_at(point, i)
            plate.set_xy(picture_of(x, y + radius * np.cos(TURN), z + radius * np.sin(TURN)).T)
            at = shown.angle[i] + phase
            spoke.set_data(*picture_of(x, y + radius * np.cos(at) * np.array([0, 1]),
                                      z + radius * np.sin(at) * np.array([0, 1])))  # fmt: skip
        last = int(np.searchsorted(shown.trace_time, shown.time[i] + 1e-12))
        trail = slice(max(last - round(TRAIL * len(shown.trace_time)), 0), max(last, 1))
        for j, tube in self.tubes.items():
            middle, x = self._middle(j, i), shown.rig.linear.place(shown.rig.bushings[j].position)[1]
            self._move_tube(tube, j, middle)
            path = middle[:, None] + shown.exaggeration * self.axes[j][1] * self._path(j, trail)
            self.paths[j].set_data(*picture_of(x, *path))
        for j, (axis, _) in enumerate(self.axes):
            if axis == "RX":
                self.paths[j].set_data(*self._spoke(j, self._path(j, trail)[1, -1]))
        for j, (line, dot) in enumerate(self.trails):
            path = self._in_panel(j, self._path(j, trail))
            line.set_data(*path)
            dot.set_data(*path[:, -1:])

    def _middle(self, j: int, i: int) -> np.ndarray:
        """(2,) drawn place of a clearance's middle: of one on another shaft it moves with that."""
        to, offset = self.shown.rig.bushings[j].to, self.shown.rig.row_offsets[self.rows[j]]
        carried = np.zeros(2) if to is None else self.shown.lift_at(to, i)
        return np.asarray(self.shown.exaggeration * (carried - offset))

    def _radius(self, j: int) -> float:
        """Radius of the shaft in a clearance, m."""
        number, x = self.shown.rig.linear.place(self.shown.rig.bushings[j].position)
        return float(np.interp(x, *self.edges[number][:2]))

    def _walls(self, j: int) -> Iterator[np.ndarray]:
        """(2, n) y and z of both parts of a wall as drawn, from its middle: half circles, or lines across the shaft."""
        bushing, radius, (axis, sign) = self.shown.rig.bushings[j], self._radius(j), self.axes[j]
        for start, wall, side in zip((np.pi / 2, -np.pi / 2), sorted(sign * wall for wall in bushing.walls), (-1, 1)):
            if bushing.is_round:  # y < 0 lies behind the shaft, y > 0 before it
                turn = np.linspace(start, start + np.pi, 37)
                yield (self.shown.exaggeration * bushing.gap + radius) * np.array((np.cos(turn), np.sin(turn)))
            else:
                face = np.full(2, self.shown.exaggeration * wall + side * radius), 2 * radius * np.array([-1, 1])
                yield np.array(face if axis == "Y" else face[::-1])

    def _silhouette(self, x: np.ndarray, lift: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """(2, n) outline of a bent shaft in the picture."""
        line = picture_of(x, *lift)
        along = np.gradient(line, axis=1)
        along /= np.maximum(np.hypot(*along), 1e-300)
        across = radius * np.array((-along[1], along[0]))
        return np.concatenate((line + across, (line - across)[:, ::-1]), axis=1)

    def _move_tube(self, halves: tuple[tuple[Polygon, Line2D], ...], j: int, centre: np.ndarray) -> None:
        bushing = self.shown.rig.bushings[j]
        x = self.shown.rig.linear.place(bushing.position)[1]
        half = max(bushing.length, 0.02 * self.shown.length) / 2
        for (surface, rings), wall in zip(halves, self._walls(j)):
            ends = [picture_of(x + side * half, *(centre[:, None] + wall)) for side in (-1, 1)]
            surface.set_xy(np.concatenate((ends[0], ends[1][:, ::-1]), axis=1).T)
            rings.set_data(*np.concatenate((ends[0], np.full((2, 1), np.nan), ends[1]), axis=1))
