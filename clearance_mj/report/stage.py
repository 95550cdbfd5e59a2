"""The figure of an animation: a scene drawn by matplotlib or from pictures, orbits in its clearances, contact forces.

What moves in one plane is seen from the side, with the lift in mm; what moves across it axonometrically: nothing is
foreshortened, and a clearance's bore is drawn as wide as the shaft and its exaggerated gap. A slot has plates above and
below the shaft, or before and behind it, and teeth or another play of its twist have two flanks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.transforms import Affine2D

from .outline import position_label
from .scene import Box, DrawnDisc, Scene
from .style import COLOURS, FONT, TEST, tidy

__all__ = ["ACROSS", "CLAMP", "DPI", "HALF", "MASS", "STEEL", "Stage", "seen"]

DPI, WIDTH, LEFT, RIGHT, ABOVE, BETWEEN, BELOW = 100, 7.2, 0.62, 0.12, 0.3, 0.62, 0.42
"""in: the figure's width, margins left and right of the drawing, room above, between and below the panels"""
ACROSS = WIDTH - LEFT - RIGHT
TRACE, PANEL, BESIDE = 1.1, 1.55, 0.62
"""in: height of the trace alone, size of orbits and height of the trace beside them, room for its words there"""
STEEL, MASS, HALF, CLAMP = "#8a949f", "#4d5660", "#3b3b3b", "#d0d0d0"
SEEN_FROM = np.radians((32.0, 14.0))  # around the vertical, and from above
TURN = np.linspace(0.0, 2 * np.pi, 73)
TRAIL = 0.35  # duration of an orbit's trail over the shown time
MOST_ORBITS = 3  # panels next to the trace
DRAWN_TWIST, FLANK = 0.5, 5.0
"""rad, a clearance of twist as it is drawn; length of its flanks in radii of the shaft"""
SPRING = np.array([(0, 0, 1, -1, 1, -1, 1, 0, 0), (0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0)])
"""turns of a spring, as shares of its half width to the right and of its height from above"""
(_COS, _UP), (_SIN, _TILT) = np.cos(SEEN_FROM), np.sin(SEEN_FROM)
SIDE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
AXONOMETRIC = np.array([[_COS, _SIN, 0.0], [_SIN * _TILT, -_COS * _TILT, _UP]])
"""right and up in the picture of x, y and z; axonometrically x runs to the right and away, y towards the eye"""


def seen(view: np.ndarray, x: Any, y: Any, z: Any) -> np.ndarray:
    """Return (2, ...) right and up in a view, `SIDE` or `AXONOMETRIC`, of points, in the unit of x, y and z."""
    return np.asarray(np.tensordot(view, np.array(np.broadcast_arrays(x, y, z), dtype=float), 1))


class Stage:
    """The figure that becomes one picture after the other.

    Parameters
    ----------
    scene : Scene
        What is drawn.
    images : sequence of ndarray
        Pictures of it from the side to the stage's scale, if there are any: matplotlib draws its parts else.
    """

    def __init__(self, scene: Scene, images: Sequence[np.ndarray] = ()):
        self.scene, self.shown, self.images = scene, scene.shown, images
        self.is_plane, self.view = scene.is_plane, SIDE if scene.is_plane else AXONOMETRIC
        self.axes = [scene.rig.row_axes[rows.stop - 1] for rows in scene.rig.clearance_rows]  # of a round one z
        self.figure, self.moving = Figure(facecolor="white", dpi=DPI), []
        self.above, panels, below = self._make_axes()
        # Drawn metres to what the axis says: the lift in mm.
        self.to_picture = Affine2D().scale(1.0, self.millimetres(1.0) if self.is_plane else 1.0) + self.above.transData
        self.words = self.above.set_title("", fontsize=FONT, loc="left", pad=4)
        self.middles = [scene.middle(j) for j in range(len(self.axes))]
        self.tubes = {j: self._draw_tube(j) for j in range(len(self.axes)) if not scene.turns[j]}
        (self._draw_lift_axis if self.is_plane else self._draw_directions)()
        if images:
            edges = scene.left, scene.right, *self.above.get_ylim()
            self.image = self.above.imshow(images[0], extent=edges, aspect="auto", interpolation="none")
            self.moving += [self.image, *self.above.spines.values()]
        else:
            self._draw_parts()
        self.trails = [self._draw_orbit(ax, j) for j, ax in enumerate(panels)]
        self.cursor = self._draw_trace(below)
        self.moving = sorted([*self.moving, self.cursor, self.words], key=lambda artist: artist.get_zorder())
        self.canvas, self.background = FigureCanvasAgg(self.figure), None

    def millimetres(self, drawn: Any) -> Any:
        """Return what a drawn height in m stands for, in mm."""
        return 1e3 * drawn / self.shown.exaggeration

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

    # The panels.

    def _make_axes(self) -> tuple[Axes, list[Axes], Axes]:
        """Return axes: the picture above, orbits of what moves along y and z, the trace next to or below them."""
        low, high = self._picture_limits()
        height = ACROSS * (high - low)[1] / (high - low)[0]
        lower, count = (TRACE, 0) if self.is_plane else (PANEL, min(len(self.axes), MOST_ORBITS))
        if not self.is_plane and height < 1.8:
            extra = (high - low)[1] * (1.8 / height - 1) / 2 * np.array([0, 1])
            low, high, height = low - extra, high + extra, 1.8
        whole = BELOW + lower + BETWEEN + height + ABOVE
        self.figure.set_size_inches(WIDTH, whole)

        def panel(left: float, bottom: float, width: float, height: float) -> Axes:
            return self.figure.add_axes((left / WIDTH, bottom / whole, width / WIDTH, height / whole))

        above = panel(LEFT, BELOW + lower + BETWEEN, ACROSS, height)
        scale = self.millimetres(1.0) if self.is_plane else 1.0
        above.set(xlim=(low[0], high[0]), ylim=(scale * low[1], scale * high[1]))
        start = LEFT + count * (PANEL + 0.12) + (BESIDE if count else 0.0)
        orbits = [panel(LEFT + j * (PANEL + 0.12), BELOW, PANEL, PANEL) for j in range(count)]
        return above, orbits, panel(start, BELOW, WIDTH - RIGHT - start, lower)

    def _picture_limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower left and upper right of the picture above, drawn metres."""
        scene, length = self.scene, self.scene.length
        if self.is_plane:
            return np.array([scene.left, -scene.half_height]), np.array([scene.right, scene.half_height])
        line = np.tensordot(self.view, scene.line(), 1)
        rings = [(scene.at(disc.point), disc.radius) for disc in scene.discs]
        for j, bushing in enumerate(scene.rig.bushings):
            if not scene.turns[j]:
                bore = self.shown.exaggeration * bushing.gap + scene.at_bushings[j]
                rings.append((scene.middle(j)[:, :1], bore))
        corners = [line - scene.radii, line + scene.radii]
        for places, radius in rings:
            circle = radius * self._cross_directions(TURN[::6])
            corners.append(np.tensordot(self.view, places[:, :, None] + circle[:, None], 1))
        points = np.concatenate([part.reshape(2, -1) for part in corners], axis=1)
        low, high = points.min(axis=1), points.max(axis=1)
        corner = 0.17 * length  # where the directions are, below on the right
        low[1] = min(low[1], high[1] - 1.5 * corner)
        return low - 0.03 * length, high + 0.03 * length

    def _draw_lift_axis(self) -> None:
        ax, shafts = self.above, self.scene.shafts
        tidy(ax, ylabel="Lift (mm)", xlabel=position_label(shafts))
        ax.grid(False)
        height = self.millimetres(self.scene.half_height)
        if len(shafts) > 1:  # each shaft has a separate scale about its level
            tick = float(f"{0.6 * height / len(shafts):.1g}")
            levels, ticks = self.millimetres(self.scene.level), np.array([-tick, 0.0, tick])
            ax.set_yticks(np.add.outer(levels, ticks).ravel(), [f"{t:g}" for t in ticks] * len(levels))
            for level, shaft in zip(levels, shafts):
                y = level - 0.8 * height / len(shafts)
                ax.text(self.scene.right, y, f"{shaft.name} ", ha="right", va="center", fontsize=FONT, style="italic")
        words = f"lifts and gaps drawn {self.shown.exaggeration:.3g} times larger; relative to the base"
        ax.set_title(words, fontsize=FONT, loc="right", pad=4)

    def _draw_directions(self) -> None:
        """The unloaded line of the shafts, directions in the lower right corner, and that of gravity."""
        ax, gravity = self.above, self.scene.rig.gravity
        ax.set_axis_off()
        words = f"displacements and gaps drawn {self.shown.exaggeration:.3g} times larger"
        ax.set_title(words, fontsize=FONT, loc="right", pad=4)
        ax.plot(*seen(self.view, self.scene.rig.linear.span, 0, 0), color=HALF, lw=0.6, ls=(0, (6, 3, 1, 3)), zorder=0)
        (_, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        length = 0.07 * self.scene.length
        origin = np.array([right - 1.3 * length, low + 0.45 * length + 0.02 * (high - low)])
        if gravity is not None:
            down = np.array(gravity) / np.linalg.norm(gravity)
            self._draw_direction(origin - [1.6 * length, -length], length * down, "g", COLOURS[1])
        for name, axis in zip("xyz", np.eye(3)):
            self._draw_direction(origin, length * axis, name, HALF)

    def _draw_direction(self, start: np.ndarray, along: np.ndarray, name: str, colour: str) -> None:
        tip, look = self.view @ along, {"arrowstyle": "->", "color": colour, "lw": 0.9}
        self.above.annotate("", tuple(start + tip), tuple(start), arrowprops=look)
        x, y = start + 1.3 * tip
        self.above.text(x, y, name, fontsize=FONT - 1, ha="center", va="center", color=colour)

    def _draw_orbit(self, ax: Axes, j: int) -> tuple[Line2D, Line2D]:
        bushing, (axis, _), colour = self.scene.rig.bushings[j], self.axes[j], COLOURS[j % len(COLOURS)]
        gap, walls = self._panel_units(j, bushing.gap), self._panel_units(j, np.array(bushing.walls))
        if bushing.is_round:
            ax.plot(gap * np.cos(TURN), gap * np.sin(TURN), color=TEST, lw=0.9)
        for wall in () if bushing.is_round else walls[np.isfinite(walls)]:
            (ax.axvline if axis == "Y" else ax.axhline)(wall, color=TEST, lw=0.9)
        reach = 1.1 * max(gap, np.abs(self._panel_units(j, self.shown.path[:, self.scene.rig.clearance_rows[j]])).max())
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach))
        if self.scene.turns[j]:
            tidy(ax, f"bushing {j + 1}, {axis} (mrad)")
        else:
            tidy(ax, f"bushing {j + 1}", "z (µm)" if j == 0 else "", "y (µm)")
        if j:
            ax.set_yticklabels([])
        (line,) = ax.plot([], [], color=colour, lw=0.9, zorder=3)
        (dot,) = ax.plot([], [], "o", color=colour, ms=5, zorder=4)
        self.moving += [line, dot]
        return line, dot

    def _draw_trace(self, ax: Axes) -> Line2D:
        """The contact forces over time; where some are torques, each over its largest. Return the picture's time."""
        some_turn = any(self.scene.turns)
        for j, force in enumerate(self.shown.trace.T):
            scale = max(np.abs(force).max(), 1e-12) if some_turn else 1.0
            look: dict[str, Any] = {"color": COLOURS[j % len(COLOURS)], "lw": 1, "label": f"bushing {j + 1}"}
            ax.plot(self.shown.trace_time, force / scale, **look)
        tidy(ax, ylabel="Force over its largest" if some_turn else "Contact force (N)", xlabel="Time (s)")
        ax.set_xlim(*self.shown.trace_time[[0, -1]])
        if self.is_plane:
            ax.legend(fontsize=FONT - 1, frameon=False, loc="lower right", bbox_to_anchor=(1, 0.97), ncols=4)
            self.figure.align_ylabels()
        return ax.axvline(0, color="black", lw=0.8)

    # The parts of the picture above.

    def _draw_parts(self) -> None:
        scene = self.scene
        for box in scene.supports():
            self._draw_support(box)
        self.bodies = self._draw_pieces()
        self.discs = [self._draw_disc(disc) for disc in scene.discs]
        self.plates = [(box, self._polygon(HALF, 6.0, lw=0)) for box in scene.plates()] if self.is_plane else []
        self.paths = [self._line(COLOURS[j % len(COLOURS)], 1.1, 6) for j in range(len(self.axes))]
        self.line = scene.line()
        if self.is_plane:
            self.arrows = scene.arrows() * (1, self.millimetres(1.0))
            look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.005, "minlength": 0}
            start = self.arrows[0, :, 0]
            look["color"] = [COLOURS[j % len(COLOURS)] for j in range(len(start))]
            self.force = self.above.quiver(*start.T, *np.zeros_like(start.T), **look, zorder=7)
            self.moving.append(self.force)
        for j, (axis, _) in enumerate(self.axes):
            flanks = scene.rig.bushings[j].walls if axis == "RX" and not self.is_plane else ()
            for wall in filter(np.isfinite, flanks):
                self.above.plot(*self._spoke(j, wall), color=HALF, lw=1.2, zorder=5, transform=self.to_picture)

    def _drawing_order(self, x: float) -> float:
        """Return the drawing order of a place (m): what is nearer to the eye, at a smaller x, comes later."""
        first, last = self.scene.rig.linear.span
        return 4.0 - (x - first) / (last - first)

    def _draw_pieces(self) -> list[tuple[np.ndarray, Polygon]]:
        """Draw the shafts' pieces between discs, which hide what is behind; return points and polygon of each."""
        position, pieces = self.shown.position, []
        for number, on in enumerate(self.scene.numbers):
            points = np.flatnonzero(on)
            places = {disc.position for disc in self.scene.discs if disc.shaft == number}
            inner = sorted(x for x in places if position[points[0]] < x < position[points[-1]])
            edges = [0, *np.searchsorted(position[points], inner), points.size - 1]
            for first, last in zip(edges[:-1], edges[1:]):
                piece = points[first : last + 1]
                pieces.append((piece, self._polygon(STEEL, self._drawing_order(float(position[piece].mean())))))
        return pieces

    def _polygon(self, colour: str, order: float, moves: bool = True, lw: float = 0.5, **look: Any) -> Polygon:
        patch = Polygon(np.zeros((1, 2)), facecolor=colour, lw=lw, zorder=order, **{"edgecolor": HALF} | look)
        patch.set_transform(self.to_picture)
        self.above.add_artist(patch)
        if moves:
            self.moving.append(patch)
        return patch

    def _line(self, colour: str, width: float, order: float) -> Line2D:
        (line,) = self.above.plot([], [], color=colour, lw=width, zorder=order, transform=self.to_picture)
        self.moving.append(line)
        return line

    def _draw_support(self, box: Box) -> None:
        ground, top = box.low[2], box.high[2]
        middle, half = (box.low + box.high) / 2, (box.high - box.low)[0] / 2
        is_near = box.high[0] <= self.scene.rig.linear.span[0] and not self.is_plane
        if box.kind == "spring":
            turns = middle[0] + half * SPRING[0], 0, top - (top - ground) * SPRING[1]
            self.above.plot(*seen(self.view, *turns), color=HALF, lw=0.8, zorder=0, transform=self.to_picture)
        elif box.kind == "foot":
            corners = middle[0] + half * np.array([0, -1, 1]), 0, np.array([top, ground, ground])
            self._polygon(CLAMP, 1.0, moves=False, lw=0.7).set_xy(seen(self.view, *corners).T)
        else:
            wall = self._polygon(CLAMP, (4.5 if is_near else 1.0), moves=is_near, lw=0, hatch="////", edgecolor="black")
            wall.set_xy(self._outline(box.low, box.high))

    def _draw_disc(self, disc: DrawnDisc) -> tuple[DrawnDisc, np.ndarray, Polygon, Line2D]:
        """A disc across the shaft, or seen from the side a dot; a line tells how far it has turned."""
        order = 5.5 if self.is_plane else self._drawing_order(disc.position)
        plate, spoke = self._polygon(MASS, order), self._line("white", 0.0 if self.is_plane else 1.2, order + 0.001)
        return disc, self.scene.at(disc.point), plate, spoke

    def _draw_tube(self, j: int) -> list[tuple[Polygon, Line2D, np.ndarray]]:
        """The half behind the shaft and the half before it, or both plates of a slot, with lines at both ends."""
        colour, halves = COLOURS[j % len(COLOURS)], []
        for wall, order, alpha in zip(self.scene.walls(j), (2.0, 5.0), (0.28, 0.16)):
            if self.is_plane:  # where the surface of the shaft touches it: an edge
                half = self._polygon("none", 2.0, lw=0.7)
            else:
                half = self._polygon(colour, order, lw=0, alpha=alpha)
            halves.append((half, self._line(colour, 0.0 if self.is_plane else 0.9, order + 0.1), wall))
        return halves

    # What moves.

    def _move(self, i: int) -> None:
        shown = self.shown
        angle = f", {np.degrees(shown.angle[i]) % 360:3.0f}°" if shown.angle.any() else ""
        self.words.set_text(f"t = {shown.time[i]:.4f} s{angle}, {shown.slow:g} times slower")
        self.cursor.set_xdata([shown.time[i]] * 2)
        for j, tube in self.tubes.items():
            self._move_tube(tube, j, self.middles[j][:, i, None])
        last = int(np.searchsorted(shown.trace_time, shown.time[i] + 1e-12))
        trail = slice(max(last - round(TRAIL * len(shown.trace_time)), 0), max(last, 1))
        for j, (line, dot) in enumerate(self.trails):
            path = self._panel_units(j, self._panel_path(j, trail))
            line.set_data(*path)
            dot.set_data(*path[:, -1:])
        if self.images:
            self.image.set_data(self.images[i])
            return
        for points, body in self.bodies:
            body.set_xy(self._silhouette(self.line[:, i, points], self.scene.radii[points]).T)
        for disc, places, plate, spoke in self.discs:
            centre, angle = places[:, i, None], shown.angle[i] + disc.phase
            plate.set_xy((self.view @ (centre + disc.radius * self._cross_directions(TURN))).T)
            spoke.set_data(*self.view @ (centre + disc.radius * self._cross_directions(angle) * [0, 1]))
        for box, half in self.plates:
            half.set_xy(self._outline(box.low[:, i], box.high[:, i]))
        if self.is_plane:
            tail, tip = np.moveaxis(self.arrows[i], 1, 0)
            self.force.set_offsets(tail)
            self.force.set_UVC(*(tip - tail).T)
            return
        for j, (axis, sign) in enumerate(self.axes):
            if axis == "RX":
                self.paths[j].set_data(*self._spoke(j, self._panel_path(j, trail)[1, -1]))
            elif j in self.tubes:
                path = shown.exaggeration * sign * self._panel_path(j, trail)
                self.paths[j].set_data(*self.view @ (self.middles[j][:, i, None] + np.insert(path, 0, 0.0, axis=0)))

    def _move_tube(self, halves: list[tuple[Polygon, Line2D, np.ndarray]], j: int, centre: np.ndarray) -> None:
        length, whole = self.scene.rig.bushings[j].length, self.scene.length
        half = length / 2 + 0.015 * whole if self.is_plane else max(length, 0.02 * whole) / 2
        for surface, rings, wall in halves:
            ends = [self.view @ (centre + side * np.array([[half], [0.0], [0.0]]) + wall) for side in (-1, 1)]
            surface.set_xy(np.concatenate((ends[0], ends[1][:, ::-1]), axis=1).T)
            rings.set_data(*np.concatenate((ends[0], np.full((2, 1), np.nan), ends[1]), axis=1))

    def _cross_directions(self, angle: Any) -> np.ndarray:
        """Return directions (3, n) across a shaft, in the plane of the picture if seen from the side."""
        cos, sin = np.atleast_1d(np.cos(angle)), np.atleast_1d(np.sin(angle))
        return np.array((cos, 0 * cos, sin) if self.is_plane else (0 * cos, cos, sin))

    def _panel_units(self, j: int, place: Any) -> Any:
        """Return places in a clearance in µm, rotations in mrad."""
        return (1e3 if self.scene.turns[j] else 1e6) * place

    def _panel_path(self, j: int, samples: slice) -> np.ndarray:
        """Return places (2, n) in a clearance along y and z, 0 along the axis without motion."""
        path = self.shown.path[samples, self.scene.rig.clearance_rows[j]].T
        if len(path) == 2:
            return path
        return np.concatenate((path, 0 * path) if self.axes[j][0] == "Y" else (0 * path, path))

    def _spoke(self, j: int, angle: float) -> np.ndarray:
        """Return a line (2, 2) from the shaft's axis outwards that shows a twist, rad."""
        at = DRAWN_TWIST * angle / self.scene.rig.bushings[j].gap
        reach = FLANK * self.scene.at_bushings[j] * np.array([0, 1])
        return seen(self.view, self.scene.places[j][1], -reach * np.sin(at), reach * np.cos(at))

    def _silhouette(self, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Return the outline (2, n) in the picture of a bent shaft through (3, n_x) points."""
        line = self.view @ points
        along = np.gradient(line, axis=1)
        along /= np.maximum(np.hypot(*along), 1e-300)
        across = radius * np.array((-along[1], along[0]))
        return np.concatenate((line + across, (line - across)[:, ::-1]), axis=1)

    def _outline(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return corners (6, 2) in the picture of a box between two corners, in the order of angles."""
        edges = self.view * (high - low)
        edges = edges * np.where(edges[1] < 0, -1, 1)
        edges = edges[:, np.argsort(np.arctan2(edges[1], edges[0]))]
        start = self.view @ (low + high) / 2 - edges.sum(axis=1) / 2
        return np.asarray(start + np.cumsum(np.concatenate((edges, -edges), axis=1), axis=1).T)
