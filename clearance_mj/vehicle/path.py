"""A path to follow: cubic Hermite polynomials over arc length, and the foot point of a position.

The polynomials run between points about 0.1 m apart at which position, heading, curvature and its slope are exact;
their error is below 1e-8 (m, rad, 1/m). Beyond its ends a path continues straight.

Pieces of paths: graphs Y(X), straights, arcs and clothoids, lane changes.

Points are those of the closed forms; arc lengths are integrated by Gauss-Legendre quadrature.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ManoeuvreError
from ..core.jit import jit

__all__ = [
    "Derivatives", "Path", "PathPoint", "PathSegment", "clothoids", "curvature_ahead", "graph", "lane",
    "lane_changes", "quintic",
]  # fmt: skip

X, Y, HEADING, CURVATURE = range(4)


class PathPoint(NamedTuple):
    """The foot point of a position on a path."""

    s: float  # m, arc length; negative before the start
    lateral_error: float  # m, of the position from the path, left positive
    heading: float  # rad, of the path
    curvature: float  # 1/m, of the path, left positive


class PathSegment(NamedTuple):
    """Points of a smooth part of a path; where two parts meet the slope of the curvature may jump."""

    s: np.ndarray  # (n,) m, arc length from any origin
    x: np.ndarray  # (n,) m
    y: np.ndarray  # (n,) m
    heading: np.ndarray  # (n,) rad
    curvature: np.ndarray  # (n,) 1/m
    slope: np.ndarray  # (n,) 1/m², of the curvature over arc length


Table = tuple[np.ndarray, np.ndarray]
"""Arc length of the points, m (n + 1,); x, y, heading and curvature over each interval, value and slope at its start
and end, (4, n, 4). Not a named tuple: compiled functions take these more slowly"""


@dataclass(frozen=True, eq=False)
class Path:
    """A plane curve over its arc length; see `manoeuvres` for examples."""

    name: str  # in words
    table: Table  # its points

    @classmethod
    def of(cls, name: str, pieces: Sequence[PathSegment]) -> Path:
        """Join pieces, each of which begins where the one before ends."""
        nodes, columns, begin = [np.zeros(1)], [], 0.0
        for s, x, y, heading, curvature, slope in pieces:
            pairs = ((x, np.cos(heading)), (y, np.sin(heading)), (heading, curvature), (curvature, slope))
            columns.append([np.stack([v[:-1], d[:-1], v[1:], d[1:]], axis=-1) for v, d in pairs])
            nodes.append(begin + s[1:] - s[0])
            begin = nodes[-1][-1]
        return cls(name, (np.concatenate(nodes), np.ascontiguousarray(np.concatenate(columns, axis=1))))

    @property
    def length(self) -> float:
        """Arc length, m."""
        return float(self.table[0][-1])

    @property
    def largest_curvature(self) -> float:
        """Largest |κ|, 1/m."""
        return float(np.abs(self.table[1][CURVATURE][:, [0, 2]]).max())

    def position(self, s: ArrayLike) -> np.ndarray:
        """Return the points of the path at arc lengths s, m: x and y, m, shape (2, ...)."""
        return np.stack([self._evaluate(row, s) for row in (X, Y)])

    def heading(self, s: ArrayLike) -> np.ndarray:
        """Return the direction of the path at arc lengths s, m, continuous (not wrapped), rad."""
        return self._evaluate(HEADING, s)

    def curvature(self, s: ArrayLike) -> np.ndarray:
        """Return the curvature at arc lengths s, m, in 1/m, left positive; zero beyond the ends."""
        return self._evaluate(CURVATURE, s)

    def _evaluate(self, row: int, s: ArrayLike) -> np.ndarray:
        s = np.asarray(s, dtype=float)
        return _hermite_all(self.table, row, s.ravel()).reshape(s.shape)

    def locate(self, x: float, y: float, s_guess: float | None = None) -> PathPoint:
        """Find the foot point of a position, m, near an arc length such as the last one, or on the whole path."""
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ManoeuvreError(f"path {self.name!r}: position ({x:g}, {y:g}) m is not finite")
        return PathPoint(*_foot_point(self.table, x, y, math.nan if s_guess is None else s_guess))

    def needed_acceleration(self, speed: float) -> float:
        """Largest lateral acceleration |κ| v² of a vehicle that follows the path exactly at a speed, m/s, in m/s²."""
        return self.largest_curvature * speed**2


@jit
def _hermite(table: Table, row: int, s: float) -> float:
    """Return the Hermite polynomial of one row of the table; straight beyond the ends."""
    node, value = table
    last = node.size - 1
    if s < 0.0 or s > node[last]:
        i, end, s_end = (0, 0, 0.0) if s < 0.0 else (last - 1, 2, node[last])
        if row == CURVATURE:
            return 0.0
        rate = 0.0 if row == HEADING else value[row, i, end + 1]
        return value[row, i, end] + rate * (s - s_end)
    i = min(int(np.searchsorted(node, s, side="right")) - 1, last - 1)
    h = node[i + 1] - node[i]
    u = (s - node[i]) / h
    v0, d0, v1, d1 = value[row, i, 0], value[row, i, 1], value[row, i, 2], value[row, i, 3]
    return v0 + u * u * (3.0 - 2.0 * u) * (v1 - v0) + h * u * (1.0 - u) * ((1.0 - u) * d0 - u * d1)


@jit
def _hermite_all(table: Table, row: int, s: np.ndarray) -> np.ndarray:
    out = np.empty(s.size)
    for i in range(s.size):
        out[i] = _hermite(table, row, s[i])
    return out


@jit
def curvature_ahead(table: Table, s: float, speed: float, times: np.ndarray, longest: float) -> np.ndarray:
    """Return the curvature, 1/m, at a vehicle at s, m, after times, s, at a speed, m/s; constant after ``longest``."""
    out = np.empty(times.size)
    for i in range(times.size):
        out[i] = _hermite(table, CURVATURE, s + speed * min(times[i], longest))
    return out


@jit
def _foot_point(table: Table, x: float, y: float, guess: float) -> tuple[float, float, float, float]:
    """Return the foot point by Newton's method, from the guess or the nearest point of the whole table."""
    for attempt in range(2):
        s = guess
        if attempt == 1 or not np.isfinite(s):
            node, value = table
            s = node[np.argmin((value[X, :, 0] - x) ** 2 + (value[Y, :, 0] - y) ** 2)]
        for _ in range(20):
            heading, curvature = _hermite(table, HEADING, s), _hermite(table, CURVATURE, s)
            dx, dy = x - _hermite(table, X, s), y - _hermite(table, Y, s)
            cos, sin = math.cos(heading), math.sin(heading)
            tangential, lateral = dx * cos + dy * sin, dy * cos - dx * sin
            if abs(tangential) < 1e-9:
                return s, lateral, heading, curvature
            # Within half a radius of the centre of curvature the full step would overshoot.
            s += tangential / max(1.0 - curvature * lateral, 0.5)
    return s, lateral, heading, curvature


SPACING = 0.1  # m between two points of a path
ROOT, WEIGHT = np.polynomial.legendre.leggauss(5)

Derivatives = Callable[[np.ndarray], Sequence[np.ndarray]]  # Y and its first three derivatives at X.


def graph(derivatives: Derivatives, start: float, end: float) -> PathSegment:
    """Return the points of a curve Y(X)."""
    x = np.linspace(start, end, max(2, math.ceil((end - start) / SPACING) + 1))
    y, d1, d2, d3 = derivatives(x)
    half = np.diff(x) / 2
    inner = (x[:-1] + half)[:, None] + half[:, None] * ROOT
    speed = np.sqrt(1 + derivatives(inner.ravel())[1] ** 2).reshape(inner.shape)
    s = np.concatenate(([0.0], np.cumsum(half * (speed @ WEIGHT))))
    q = 1 + d1**2
    slope = (d3 * q - 3 * d1 * d2**2) / q**3  # dκ/ds = (dκ/dX) / √q
    return PathSegment(s, x, y, np.arctan(d1), d2 / q**1.5, slope)


def clothoids(parts: Sequence[tuple[float, float, float]]) -> list[PathSegment]:
    """Return straights, arcs and clothoids in sequence from the origin: length, curvature at the start, at the end."""
    pieces, begin, x, y, heading = [], 0.0, 0.0, 0.0, 0.0
    for length, first, last in parts:
        s = np.linspace(0.0, length, max(2, math.ceil(length / SPACING) + 1))
        rate = (last - first) / length
        half = s[1] / 2
        nodes = (s[:-1] + half)[:, None] + half * ROOT
        headings, direction = (heading + v * (first + rate * v / 2) for v in (nodes, s))
        dx, dy = (np.concatenate(([0.0], np.cumsum(half * f(headings) @ WEIGHT))) for f in (np.cos, np.sin))
        pieces.append(PathSegment(begin + s, x + dx, y + dy, direction, first + rate * s, np.full(s.size, rate)))
        x, y, heading, begin = x + dx[-1], y + dy[-1], direction[-1], begin + length
    return pieces


def lane(y: float) -> Derivatives:
    """Return a straight along X at a Y, m."""
    return lambda x: [0 * x + y, *[0 * x] * 3]


def quintic(begin: float, end: float, start: float, target: float) -> Derivatives:
    """Return Y from start to target over X from begin to end, without slope and curvature at its ends; in m."""
    curve, length = start + (target - start) * np.polynomial.Polynomial([0, 0, 0, 10, -15, 6]), end - begin
    return lambda x: [curve.deriv(k)((x - begin) / length) / length**k for k in range(4)]


def lane_changes(name: str, changes: Sequence[tuple[float, float, float]], start: float, end: float) -> Path:
    """Return straights joined by quintic lane changes, each given by begin and end along X and target Y, m.

    From Y = 0 at X = ``start`` to X = ``end``; a change by h over a length L needs up to 10/√3 h/L² of curvature (where
    the path's slope is small).
    """
    pieces, x, y = [], start, 0.0
    for begin, finish, target in changes:
        if finish <= begin or begin < x:
            raise ManoeuvreError(f"path {name!r}: no lane change from X = {begin:g} to {finish:g} m after {x:g} m")
        if begin > x:
            pieces.append(graph(lane(y), x, begin))
        pieces.append(graph(quintic(begin, finish, y, target), begin, finish))
        x, y = finish, target
    return Path.of(name, [*pieces, graph(lane(y), x, end)])
