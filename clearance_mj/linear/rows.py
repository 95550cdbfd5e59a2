"""Motion of a rig's points per coordinate of any kind: rows at its clearances, sensors, probes and shaker.

A clearance has a row for each of its coordinates: a slot one, along z or its own degree of freedom, a round clearance
two, along y, then z. Rows are ordered clearance by clearance (`Rig.clearance_rows`), at their ends end by end, and at
each point y before z.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..rig import Rig
from ..rig.loads import Order, order_forces
from ..rig.points import moved_points, probe_point
from ..rig.sensing import SensorRows, sensor_rows
from ..structure.base import Rows, along_axis, in_other_plane, parse_direction

__all__ = ["PlaneRows", "RigRows"]


class PlaneRows(NamedTuple):
    """Motion of points along one direction."""

    rows: Rows
    """displacements (n_points, m) of points per coordinate of the structure"""
    transform: np.ndarray
    """(m, k) these coordinates per coordinate of the model"""
    span: slice
    """indices of these k coordinates in the model"""


@dataclass(frozen=True, eq=False)
class RigRows:
    """Displacements of a rig's points, relative to its base, per coordinate of a model."""

    rig: Rig
    """the rig"""
    planes: tuple[PlaneRows | None, PlaneRows]
    """motion along y, None where points do not move along y, and along z"""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.planes[1].span.stop)

    @property
    def plane_sizes(self) -> list[int]:
        """Numbers of coordinates of each bending plane; of all where planes are not distinguished."""
        return [stop - start for start, stop in sorted({(p.span.start, p.span.stop) for p in self.planes if p})]

    def shapes(self, points: Sequence[float | str] | np.ndarray) -> np.ndarray:
        """Return the shapes at points along their degrees of freedom, on shafts along z, positive at the last position.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom.

        Returns
        -------
        ndarray, shape (n_points, n)
            1/sqrt(kg) for modes of unit mass.
        """
        plane, at = self.planes[1], _as_list(points)
        shapes = np.zeros((len(at), self.size))
        shapes[:, plane.span] = plane.rows(at) @ plane.transform
        return shapes

    def moved(self, points: Sequence[float | str] | np.ndarray) -> np.ndarray:
        """Return how points move along y and z.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom, of whose nodes both are returned.

        Returns
        -------
        ndarray, shape (n_points, 2, n)
            1/sqrt(kg) for modes of unit mass; zeros along y where a planar rig's shafts do not move.
        """
        at = _as_list(points)
        motion = np.zeros((len(at), 2, self.size))
        for i, (axis, plane) in enumerate(zip("YZ", self.planes)):
            if plane is not None:
                motion[:, i, plane.span] = plane.rows([along_axis(point, axis) for point in at]) @ plane.transform
        return motion

    def directed(self, points: Sequence[float | str], direction: np.ndarray) -> np.ndarray:
        """Return how points move in given directions (n_points, n): degrees of freedom in theirs.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom.
        direction : ndarray, shape (n_points, 3) or (3,)
            Unit vectors, for positions on shafts, which do not move along x.
        """
        along, motion = np.broadcast_to(direction, (len(points), 3)), np.empty((len(points), self.size))
        named = np.array([parse_direction(point) is not None for point in points], dtype=bool)
        motion[named] = self._along_dof([point for point, has_name in zip(points, named) if has_name])
        others = self.moved([point for point, has_name in zip(points, named) if not has_name])
        motion[~named] = np.einsum("pd,pdn->pn", along[~named, 1:], others)
        return motion

    def _along_dof(self, points: list[float | str]) -> np.ndarray:
        """(n_points, n) of points that have directions, which may be X, or rotations: of shafts each in its plane."""
        motion, (y, z) = self.shapes(points), self.planes
        if y is not None and y.span != z.span:
            motion[:, y.span] = y.rows([in_other_plane(point) for point in points]) @ y.transform
        return motion

    def _relative_rows(self, joined: Sequence[tuple[float | str, ...]]) -> np.ndarray:
        """Return rows of first points less those of second ones, if any; as many points of each clearance."""
        bushings = [b for b in self.rig.bushings for _ in range(len(joined) // len(self.rig.bushings))]
        rows = [row for bushing, points in zip(bushings, joined) for row in moved_points(bushing, points)]
        relative = np.zeros((len(rows), self.size))
        for axis, plane in zip("YZ", self.planes):
            taps = [(i, *tap) for i, (along, at) in enumerate(rows) if along == axis for tap in zip(at, (1.0, -1.0))]
            if taps and plane is not None:
                row, at, sign = map(list, zip(*taps))
                moves = plane.rows(at) @ plane.transform
                np.add.at(relative[:, plane.span], row, np.array(sign)[:, None] * moves)
        return relative

    @functools.cached_property
    def at_bushings(self) -> np.ndarray:
        """(n_rows, n) relative displacement in the middle of each clearance."""
        return self._relative_rows(self.rig.clearance_points)

    @functools.cached_property
    def at_ends(self) -> np.ndarray:
        """(2 n_rows, n) relative displacement at both ends of each clearance."""
        return self._relative_rows(self.rig.clearance_ends)

    @functools.cached_property
    def at_points(self) -> np.ndarray:
        """(3 n_rows, n) the clearances' middles, then both ends of each."""
        return np.vstack((self.at_bushings, self.at_ends))

    def sliding(self, bushing: int) -> np.ndarray:
        """Return the motion (n,) of the point that slides along a clearance of one coordinate, on which friction acts.

        Parameters
        ----------
        bushing : int
            Index of the bushing.
        """
        point = self.rig.bushings[bushing].sliding_point
        assert point is not None
        return np.asarray(self.directed([point], np.array([0.0, 0.0, 1.0]))[0])

    @property
    def ends_by_row(self) -> np.ndarray:
        """(n_rows, 2, n) relative displacement at both ends for every row of `at_bushings`."""
        return self.at_ends[self.rig.end_rows]

    def at_probes(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the displacements (n_rows, n) that probes in the clearances read, turned as in the rig file.

        Parameters
        ----------
        values : mapping of str to float
            Gains and places that are not 1 and the clearance's middle: "probes[0].gain" of the first row, and
            "probes[0].position" of the first clearance in m.
        """
        rig = self.rig
        places = [values.get(f"probes[{j}].position") for j in range(len(rig.bushings))]
        points = [probe_point(j, b, at, bool(rig.fixture)) for j, (b, at) in enumerate(zip(rig.bushings, places))]
        readings = self._relative_rows(points)
        for rows, bushing in zip(rig.clearance_rows, rig.bushings):
            if bushing.is_round:
                cos, sin = np.cos(bushing.probe_angle), np.sin(bushing.probe_angle)
                readings[rows] = np.array([[cos, sin], [-sin, cos]]) @ readings[rows]
        return readings * np.array([values.get(f"probes[{i}].gain", 1.0) for i in range(len(readings))])[:, None]

    @functools.cached_property
    def sensor_rows(self) -> SensorRows:
        """Readings of the sensors per coordinate and of the base."""
        return sensor_rows(self.rig, self.directed, self.size)

    @property
    def at_sensors(self) -> np.ndarray:
        """(n_sensors, n) readings of the sensors per coordinate, before they are differentiated to their order."""
        return self.sensor_rows.rows

    @property
    def sensors_on_base(self) -> np.ndarray:
        """(n_sensors,) readings of the base."""
        return self.sensor_rows.on_base

    def push(self, number: int = 0) -> np.ndarray:
        """Return the force (n,) of an input of the rig on the coordinates per N.

        Parameters
        ----------
        number : int
            Index in `Rig.inputs`.
        """
        shaker = self.rig.inputs[number]
        points, factors = shaker.pushed()
        if self.planes[0] is None:  # a shaft that moves along z alone
            return np.asarray(factors @ self.shapes(points))
        return np.asarray(factors @ self.directed(points, shaker.unit_direction))

    @functools.cached_property
    def unbalance(self) -> np.ndarray:
        """(2, n) force of all unbalances on the coordinates per Ω² cos φ and Ω² sin φ, with φ the shaft's angle."""
        once = [Order(each.position, 1.0, each.moment, phase=each.phase) for each in self.rig.unbalances]
        return order_forces(once, self.directed, self.size).reshape(-1, 2, self.size).sum(axis=0)


def _as_list(points: Sequence[float | str] | np.ndarray) -> list[float | str]:
    return points.tolist() if isinstance(points, np.ndarray) else list(points)
