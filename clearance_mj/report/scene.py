"""Points in space of an animation's shafts, discs, supports, clearances and contact forces, in every picture.

Lifts and gaps are drawn many times larger than they are, the shafts' length and thickness as they are. Shafts of a rig
that moves in one plane are drawn one above another, each at another level; what moves across stays where it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..structure import Support
from ..structure.base import is_rotation
from .clip import Clip
from .outline import outline

__all__ = ["Box", "DrawnDisc", "Scene"]

ARROW, PLATE, WALL, MIN_HEIGHT = 0.1, 0.015, 0.06, 0.15
"""length of the arrow of the largest force, thickness of a bushing's halves, half height of a clamp, least half height
of a shaft's lane, as shares of the shafts' length"""
BEYOND = 0.04, 0.03  # room before and behind the shafts, as shares of their length
LARGEST_DISC, DOT = 0.13, 0.012
"""radius of a disc as it is drawn, at most and where its thickness is not seen, as shares of the shafts' length"""
DISC_RADII = 4.0  # radii of the shaft that a disc without a polar inertia has


@dataclass(frozen=True)
class DrawnDisc:
    """A disc or point mass on a shaft."""

    point: float | str  #: where it is
    shaft: int  #: number of its shaft
    position: float  #: m, along the shaft
    radius: float  #: m, as it is drawn
    phase: float  #: rad, from the shaft's angle to what marks its turning


@dataclass(frozen=True, eq=False)
class Box:
    """A box, or the symbol drawn into it, which stands still or moves up and down."""

    kind: str  #: "block", "foot" or "spring"
    low: np.ndarray  #: (3,) or (3, n) of all pictures: its lower corner, m
    high: np.ndarray  #: the same of its upper corner


class Scene:
    """Points in space, m, of everything that a clip shows: x along the shafts, y to the eye, z up."""

    def __init__(self, shown: Clip):
        self.shown, self.rig, self.shafts = shown, shown.rig, shown.rig.linear.shafts
        self.is_plane, self.length = not self.rig.moves_across, shown.length
        self.edges = [outline(shaft) for shaft in self.shafts]
        self.numbers = [shown.shaft == i for i in range(len(self.shafts))]
        of_shafts = zip(self.numbers, self.edges)
        self.radii = np.concatenate([np.interp(shown.position[on], *edges[:2]) for on, edges in of_shafts])
        self.radius = max(float(edges[1].max()) for edges in self.edges)
        self.places = [self.rig.linear.place(b.position) for b in self.rig.bushings]
        self.at_bushings = [self.radius_at(*place) for place in self.places]
        self.turns = [is_rotation(b.position) for b in self.rig.bushings]
        self.discs = list(self._discs())
        self.per_newton = ARROW * self.length / max(np.abs(shown.trace).max(), 1e-12)
        self.level, self.half_height = np.zeros(len(self.shafts)), 0.0
        if self.is_plane:
            gaps = [b.gap for b, turns in zip(self.rig.bushings, self.turns) if not turns]
            highest = shown.exaggeration * max([np.abs(shown.lift[:, 1]).max(), *gaps])
            lane = max(MIN_HEIGHT * self.length, 1.1 * highest, 1.05 * np.nanmax(np.abs(self.arrows()[..., 1])))
            self.level = lane * np.arange(len(self.shafts) - 1.0, -len(self.shafts), -2.0)
            self.half_height = lane * len(self.shafts)
        first, last = self.rig.linear.span
        self.left, self.right = first - BEYOND[0] * self.length, last + BEYOND[1] * self.length

    def radius_at(self, shaft: int, x: float) -> float:
        """Return the radius (m) of a shaft at a position, m."""
        return float(np.interp(x, *self.edges[shaft][:2]))

    def _discs(self) -> Iterator[DrawnDisc]:
        rig, most = self.rig, (DOT if self.is_plane else LARGEST_DISC) * self.length
        heavy = {each.position: each.phase for each in rig.unbalances}
        discs: list[tuple[float | str, float]] = []
        for shaft, edges in zip(self.shafts, self.edges):
            for disc in shaft.discs:
                point = f"{shaft.name}@{disc.position!r}" if shaft.name else disc.position
                radius = np.sqrt(2 * disc.polar_inertia / disc.mass) if disc.polar_inertia and disc.mass else 0.0
                discs.append((point, float(radius or DISC_RADII * edges[1].max())))
        discs += [(mass.position, DISC_RADII / 2 * float(self.radii.max())) for mass in rig.masses]
        for point, radius in discs:
            radius = most if self.is_plane else min(radius, most)
            yield DrawnDisc(point, *rig.linear.place(point), radius, heavy.get(point, 0.0))

    def line(self) -> np.ndarray:
        """Return (3, n, n_x) points of the shafts' lines."""
        y, z = self.shown.exaggeration * np.moveaxis(self.shown.lift, 1, 0)
        return np.array(np.broadcast_arrays(self.shown.position, y, z + self.level[self.shown.shaft]))

    def at(self, point: float | str) -> np.ndarray:
        """Return (3, n) places of a point of a shaft."""
        shaft, x = self.rig.linear.place(point)
        y, z = self.shown.exaggeration * self.shown.lift_at(point).T
        return np.array(np.broadcast_arrays(x, y, z + self.level[shaft]))

    def middle(self, j: int) -> np.ndarray:
        """Return (3, n) places of the middle of a clearance: that of one on another shaft moves with it."""
        bushing, (shaft, x) = self.rig.bushings[j], self.places[j]
        carried = np.zeros((self.shown.time.size, 2)) if bushing.to is None else self.shown.lift_at(bushing.to)
        y, z = self.shown.exaggeration * (carried - self.rig.row_offsets[self.rig.clearance_rows[j]]).T
        return np.array(np.broadcast_arrays(x, y, z + self.level[shaft]))

    def walls(self, j: int) -> Iterator[np.ndarray]:
        """Yield (3, n) points of both parts of a clearance's wall from its middle: the part behind, or below, first.

        They are half circles as wide as the shaft and its gap, or lines across the shaft above and below it, or
        before and behind it; nan where there is none.
        """
        bushing, radius = self.rig.bushings[j], self.at_bushings[j]
        axis, sign = self.rig.row_axes[self.rig.clearance_rows[j].stop - 1]
        for start, wall, side in zip((np.pi / 2, -np.pi / 2), sorted(sign * wall for wall in bushing.walls), (-1, 1)):
            if bushing.is_round:
                turn = np.linspace(start, start + np.pi, 37)
                bore = self.shown.exaggeration * bushing.gap + radius
                yield bore * np.array((0 * turn, np.cos(turn), np.sin(turn)))
            else:
                height = self.shown.exaggeration * wall + side * radius if np.isfinite(wall) else np.nan
                face = np.full(2, height), 2 * radius * np.array([-1, 1])
                yield np.array((np.zeros(2), *(face if axis == "Y" else face[::-1])))

    def halves(self) -> np.ndarray:
        """Return (n, n_bushings, 2) heights of the inner faces of lower and upper halves, m; infinite for none.

        A half yields by as much as the shaft goes beyond the gap: what the law calls penetration. A bushing on another
        shaft moves with it.
        """
        shown, faces = self.shown, []
        for bushing, (i, _), radius in zip(self.rig.bushings, self.places, self.at_bushings):
            carried = 0.0 if bushing.to is None else shown.lift_at(bushing.to)[:, 1]
            moved = shown.lift_at(bushing.position)[:, 1] - carried
            lower, upper = (-np.inf, np.inf) if is_rotation(bushing.position) else bushing.walls
            pair = np.column_stack((np.minimum(moved, lower), np.maximum(moved, upper))) + np.reshape(carried, (-1, 1))
            faces.append(self.level[i] + shown.exaggeration * pair + radius * np.array([-1, 1]))
        return np.stack(faces, axis=1)

    def plates(self) -> Iterator[Box]:
        """Yield the halves of bushings in one plane, as they move."""
        for bushing, (_, x), faces in zip(self.rig.bushings, self.places, np.moveaxis(self.halves(), 1, 0)):
            for face, side in zip(faces.T, (-1, 1)):
                if np.isfinite(face).all():
                    ends = np.sort((face, face + side * PLATE * self.length), axis=0)
                    yield self._box("block", (x - bushing.length / 2, x + bushing.length / 2), ends)

    def arrows(self) -> np.ndarray:
        """Return (n, n_bushings, 2, 2) where each arrow begins and ends: x and height, m. It ends on its half."""
        force, thickness = self.shown.force, PLATE * self.length
        below, above = np.moveaxis(self.halves(), -1, 0)
        tip = np.where(force > 0, above + thickness, below - thickness)
        tip = np.where(np.isfinite(tip), tip, self.level[[i for i, _ in self.places]])
        along = np.broadcast_to([x for _, x in self.places], tip.shape)
        return np.stack([np.stack((along, end), axis=-1) for end in (tip + self.per_newton * force, tip)], axis=2)

    def supports(self) -> Iterator[Box]:
        """Yield walls at ends, blocks, feet or springs between them."""
        for i, shaft in enumerate(self.shafts):
            for support in shaft.supports:
                side = int(support.position == shaft.end) - int(support.position == shaft.start)
                yield from self._support_boxes(support, i, side)

    def _support_boxes(self, support: Support, i: int, side: int) -> Iterator[Box]:
        """Yield the boxes of a support of a shaft at its start (-1), its end (1) or between (0)."""
        x, level, wall, half = support.position, self.level[i], WALL * self.length, 0.01 * self.length
        radius = self.radius_at(i, x)
        if support.kind in ("clamped", "guided") and side:
            away = (0.004 * self.length if support.kind == "guided" else 0.0) * side
            along = sorted((x + away, self.left if side < 0 else self.right))
            yield self._box("block", along, (level - wall, level + wall))
        elif support.kind == "clamped":
            for low, high in ((-radius - wall, -radius), (radius, radius + wall)):
                yield self._box("block", (x - half, x + half), (level + low, level + high))
        elif support.kind == "pinned":
            yield self._box("foot", (x - half, x + half), (level - radius - 0.7 * wall, level - radius))
        elif support.translation:
            ground = level - radius - wall
            yield self._box("spring", (x - 0.4 * half, x + 0.4 * half), (ground, level - radius))
            yield self._box("block", (x - half, x + half), (ground - 0.2 * wall, ground))

    def _box(self, kind: str, x: Any, z: Any) -> Box:
        """Return a box between two positions and two heights, four radii of the shaft to both sides."""
        wide = 4 * self.radius
        low, high = (np.array(np.broadcast_arrays(*corner)) for corner in zip(x, (-wide, wide), z))
        return Box(kind, low, high)
