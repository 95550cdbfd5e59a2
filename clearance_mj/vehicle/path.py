"""Paths to follow: double lane change, ISO 3888-1 lane change, clothoid-arc-clothoid, straight.

A path is a table of points about 0.1 m apart. At each of them position, heading, curvature and its slope are the closed
form's; between them cubic Hermite polynomials of the arc length hold, whose error is below 1e-8 (m, rad, 1/m). Arc
lengths are integrated by Gauss-Legendre quadrature. Beyond its ends a path goes on straight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from ..errors import ManoeuvreError

__all__ = [
    "Gate",
    "Path",
    "PathPoint",
    "check_feasible",
    "clothoid_arc",
    "double_lane_change",
    "iso3888_gates",
    "iso_lane_change",
    "straight",
]

SPACING = 0.1
"""m between two points of the table"""
GRAVITY = 9.81
"""m/s²"""
SPEEDS = (5.0, 50.0)
"""m/s, within which the vehicle models hold"""
LANE_OFFSET = 3.5
"""m between the centre lines of the two lanes of ISO 3888-1"""
REACH = 1 / 6
"""share of a lane change that lies within each of the two gates it connects"""


class PathPoint(NamedTuple):
    """The foot point of a position on a path."""

    s: float
    """m, arc length; negative before the start"""
    lateral_error: float
    """m, of the position from the path, left positive"""
    heading: float
    """rad, of the path"""
    curvature: float
    """1/m, of the path, left positive"""


class Gate(NamedTuple):
    """A stretch of lane between cones."""

    start: float
    """m along X"""
    end: float
    """m along X"""
    centre: float
    """m along Y"""
    width: float
    """m"""


@dataclass(frozen=True, eq=False)
class Path:
    """A plane curve over its arc length; made by the functions of this module."""

    name: str
    """for people"""
    node: np.ndarray
    """(n + 1,) m, arc length of the table's points"""
    table: np.ndarray
    """(4, n, 4): x, y, heading, curvature over each interval; value and slope at its start and at its end"""

    @property
    def length(self) -> float:
        """Arc length, m."""
        return float(self.node[-1])

    @property
    def largest_curvature(self) -> float:
        """Largest |κ|, 1/m."""
        return float(np.abs(self.table[3][:, [0, 2]]).max())

    def position(self, s) -> np.ndarray:
        """Points of the path.

        Parameters
        ----------
        s : array_like
            Arc length, m.

        Returns
        -------
        ndarray, shape (2, ...)
            x and y, m.
        """
        return np.stack([_evaluate(self.node, self.table, row, s) for row in (0, 1)])

    def heading(self, s):
        """Direction of the path, continuous (not wrapped).

        Parameters
        ----------
        s : array_like
            Arc length, m.

        Returns
        -------
        ndarray
            rad.
        """
        return _evaluate(self.node, self.table, 2, s)

    def curvature(self, s):
        """Curvature, left positive; zero beyond the ends.

        Parameters
        ----------
        s : array_like
            Arc length, m.

        Returns
        -------
        ndarray
            1/m.
        """
        return _evaluate(self.node, self.table, 3, s)

    def locate(self, x: float, y: float, s_guess: float | None = None) -> PathPoint:
        """Find the foot point of a position.

        Parameters
        ----------
        x, y : float
            m.
        s_guess : float, optional
            Arc length near which it lies, m, such as the last one; None: the whole path is searched.

        Raises
        ------
        ManoeuvreError
            If the position is not finite.
        """
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ManoeuvreError(f"path {self.name!r}: position ({x:g}, {y:g}) m is not finite")
        return PathPoint(*_locate(self.node, self.table, x, y, math.nan if s_guess is None else s_guess))

    def needed_acceleration(self, speed: float) -> float:
        """Largest lateral acceleration |κ| v² of a vehicle that follows the path exactly, m/s².

        Parameters
        ----------
        speed : float
            m/s.
        """
        return self.largest_curvature * speed**2


def check_feasible(path: Path, speed: float, friction: float):
    """Refuse a manoeuvre that no controller could drive.

    Parameters
    ----------
    path : Path
        The path.
    speed : float
        m/s.
    friction : float
        Friction coefficient of tyres and road.

    Raises
    ------
    ManoeuvreError
        If the speed is outside `SPEEDS` or the path needs more than the friction's lateral acceleration.
    """
    if not SPEEDS[0] <= speed <= SPEEDS[1]:
        low, high = (f"{3.6 * v:g}" for v in SPEEDS)
        raise ManoeuvreError(f"speed must be in {low}..{high} km/h, got {3.6 * speed:g}")
    needed, limit = path.needed_acceleration(speed), friction * GRAVITY
    if needed > limit:
        fastest = 3.6 * math.sqrt(limit / path.largest_curvature)
        raise ManoeuvreError(
            f"path {path.name!r} needs a lateral acceleration of {needed:.1f} m/s² at {3.6 * speed:g} km/h, friction "
            f"{friction:g} allows {limit:.1f}; drive at most {fastest:.0f} km/h or lengthen the path"
        )


def straight(length: float) -> Path:
    """Straight path along x.

    Parameters
    ----------
    length : float
        m.
    """
    _positive(length=length)
    return _path("straight", [_clothoids(0.0, 0.0, 0.0, [(length, 0.0, 0.0)])])


def clothoid_arc(
    radius: float = 200.0, clothoid: float = 60.0, arc: float = 100.0, lead: float = 30.0, tail: float = 60.0
) -> Path:
    """Straight, clothoid, left-hand arc, clothoid, straight.

    Parameters
    ----------
    radius : float
        Of the arc, m.
    clothoid, arc : float
        Length of each clothoid and of the arc, m.
    lead, tail : float
        Length of the straights before and after, m.
    """
    _positive(radius=radius, clothoid=clothoid, arc=arc, lead=lead, tail=tail)
    k = 1 / radius
    pieces = [(lead, 0.0, 0.0), (clothoid, 0.0, k), (arc, k, k), (clothoid, k, 0.0), (tail, 0.0, 0.0)]
    return _path("clothoid-arc", [_clothoids(0.0, 0.0, 0.0, pieces)])


def double_lane_change(length_factor: float = 1.0) -> Path:
    """Double lane change with hyperbolic tangents.

    Y = dy1/2 (1 + tanh z1) - dy2/2 (1 + tanh z2), z_i = 2.4/dx_i (X - Xs_i) - 1.2, dx 25 and 21.95 m, dy 4.05 and
    5.7 m, Xs 27.19 and 56.46 m (Falcone et al., IEEE Trans. Control Syst. Technol. 15, 2007), with all lengths along X
    scaled. It begins 30 m before X = 0, where its slope is below 1e-6.

    Parameters
    ----------
    length_factor : float
        Scale of lengths along X; at 1 the path needs 10.9 m/s² at 72 km/h.
    """
    _positive(length_factor=length_factor)
    dx, dy, start = np.array([25.0, 21.95]), np.array([4.05, -5.7]), np.array([27.19, 56.46])

    def derivatives(x):
        """Y and its first three derivatives over X."""
        x = x[:, None] / length_factor
        rate = 2.4 / dx / length_factor
        t = np.tanh(2.4 / dx * (x - start) - 1.2)
        sech2 = 1 - t**2
        orders = (1 + t, sech2 * rate, -2 * t * sech2 * rate**2, (6 * t**2 - 2) * sech2 * rate**3)
        return [order @ (dy / 2) for order in orders]

    ends = length_factor * np.array([-30.0, 125.0])
    return _path(f"double-lane-change x {length_factor:g}", [_graph(derivatives, *ends)])


def iso3888_gates(width: float = 1.61, length_factor: float = 1.0) -> tuple[Gate, Gate, Gate]:
    """Gates of the double lane change of ISO 3888-1: 15 m, 25 m in the other lane, 30 m back; 30 and 25 m between them.

    Their widths are 1.1, 1.2 and 1.3 times the vehicle's plus 0.25 m; the lanes' centre lines are taken as 3.5 m apart.

    Parameters
    ----------
    width : float
        Of the vehicle, m.
    length_factor : float
        Scale of lengths along X; 1 is the standard's.
    """
    _positive(width=width, length_factor=length_factor)
    lanes = ((0.0, 15.0, 0.0, 1.1), (45.0, 70.0, LANE_OFFSET, 1.2), (95.0, 125.0, 0.0, 1.3))
    gates = (Gate(a * length_factor, b * length_factor, y, factor * width + 0.25) for a, b, y, factor in lanes)
    return tuple(gates)


def iso_lane_change(length_factor: float = 1.0) -> Path:
    """Smooth path through the ISO 3888-1 gates: straights joined by quintic lane changes.

    Each lane change Y = 3.5 m (10 u³ - 15 u⁴ + 6 u⁵) has a sixth of its length within each of its gates, where the
    path is off the centre by at most 0.124 m, less than the free width on either side.

    Parameters
    ----------
    length_factor : float
        Scale of lengths along X; 1 is the standard's.
    """
    _positive(length_factor=length_factor)
    first, second, third = iso3888_gates(length_factor=length_factor)
    quintic = LANE_OFFSET * np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])

    def change(gate, following):
        """Lane change between two gates: where it begins, ends, and its derivatives."""
        reach = REACH / (1 - 2 * REACH) * (following.start - gate.end)
        a, b = gate.end - reach, following.start + reach
        curve = quintic if following.centre > gate.centre else LANE_OFFSET - quintic
        return a, b, lambda x: [curve.deriv(k)((x - a) / (b - a)) / (b - a) ** k for k in range(4)]

    a1, b1, left = change(first, second)
    a2, b2, right = change(second, third)
    ends = -30.0 * length_factor, third.end + 30.0 * length_factor
    pieces = [
        _graph(lambda x: [0 * x] * 4, ends[0], a1),
        _graph(left, a1, b1),
        _graph(lambda x: [0 * x + LANE_OFFSET, *[0 * x] * 3], b1, a2),
        _graph(right, a2, b2),
        _graph(lambda x: [0 * x] * 4, b2, ends[1]),
    ]
    return _path(f"iso-3888-1 x {length_factor:g}", pieces)


def _positive(**values):
    for name, value in values.items():
        if not 0 < value < math.inf:
            raise ManoeuvreError(f"{name} must be > 0, got {value:g}")


def _graph(derivatives, start, end):
    """Points (s, x, y, heading, curvature, its slope) of a curve Y(X)."""
    x = np.linspace(start, end, max(2, math.ceil((end - start) / SPACING) + 1))
    y, d1, d2, d3 = derivatives(x)
    root, weight = np.polynomial.legendre.leggauss(5)
    half = np.diff(x) / 2
    inner = (x[:-1] + half)[:, None] + half[:, None] * root
    speed = np.sqrt(1 + derivatives(inner.ravel())[1] ** 2).reshape(inner.shape)
    s = np.concatenate(([0.0], np.cumsum(half * (speed @ weight))))
    q = 1 + d1**2
    slope = (d3 * q - 3 * d1 * d2**2) / q**3  # dκ/ds = (dκ/dX) / √q
    return s, x, y, np.arctan(d1), d2 / q**1.5, slope


def _clothoids(x, y, heading, pieces):
    """Points of straights, arcs and clothoids in a row, each (length, curvature at its start, at its end)."""
    root, weight = np.polynomial.legendre.leggauss(5)
    rows, begin = [], 0.0
    for length, first, last in pieces:
        s = np.linspace(0.0, length, max(2, math.ceil(length / SPACING) + 1))
        rate = (last - first) / length

        def direction(at, first=first, rate=rate, heading=heading):
            return heading + at * (first + rate * at / 2)

        half = s[1] / 2
        inner = direction((s[:-1] + half)[:, None] + half * root)
        along, across = (np.concatenate(([0.0], np.cumsum(half * f(inner) @ weight))) for f in (np.cos, np.sin))
        rows.append((begin + s, x + along, y + across, direction(s), first + rate * s, np.full(s.size, rate)))
        x, y, heading, begin = x + along[-1], y + across[-1], direction(length), begin + length
    return rows


def _path(name, pieces):
    """Join pieces; where two of them meet the slope of the curvature may jump."""
    rows = [row for piece in pieces for row in (piece if isinstance(piece, list) else [piece])]
    nodes, columns, begin = [np.zeros(1)], [], 0.0
    for s, x, y, heading, curvature, slope in rows:
        pairs = ((x, np.cos(heading)), (y, np.sin(heading)), (heading, curvature), (curvature, slope))
        columns.append([np.stack([v[:-1], d[:-1], v[1:], d[1:]], axis=-1) for v, d in pairs])
        nodes.append(begin + s[1:] - s[0])
        begin = nodes[-1][-1]
    return Path(name, np.concatenate(nodes), np.ascontiguousarray(np.concatenate(columns, axis=1)))


@numba.njit(cache=True, nogil=True)
def _value(node, table, row, s):
    """Hermite polynomial of one row of the table; straight beyond the ends."""
    last = node.size - 1
    if s < 0.0 or s > node[last]:
        i, end, at = (0, 0, 0.0) if s < 0.0 else (last - 1, 2, node[last])
        if row == 3:
            return 0.0
        rate = 0.0 if row == 2 else table[row, i, end + 1]
        return table[row, i, end] + rate * (s - at)
    i = min(np.searchsorted(node, s, side="right") - 1, last - 1)
    h = node[i + 1] - node[i]
    u = (s - node[i]) / h
    v0, d0, v1, d1 = table[row, i, 0], table[row, i, 1], table[row, i, 2], table[row, i, 3]
    return v0 + u * u * (3.0 - 2.0 * u) * (v1 - v0) + h * u * (1.0 - u) * ((1.0 - u) * d0 - u * d1)


@numba.njit(cache=True, nogil=True)
def _values(node, table, row, s):
    out = np.empty(s.size)
    for i in range(s.size):
        out[i] = _value(node, table, row, s[i])
    return out


def _evaluate(node, table, row, s):
    s = np.asarray(s, dtype=float)
    return _values(node, table, row, s.ravel()).reshape(s.shape)


@numba.njit(cache=True, nogil=True)
def _locate(node, table, x, y, guess):
    """Foot point by Newton's method from the guess, or from the nearest point of the whole table."""
    for attempt in range(2):
        s = guess
        if attempt == 1 or not np.isfinite(s):
            s = node[np.argmin((table[0, :, 0] - x) ** 2 + (table[1, :, 0] - y) ** 2)]
        for _ in range(20):
            heading, curvature = _value(node, table, 2, s), _value(node, table, 3, s)
            dx, dy = x - _value(node, table, 0, s), y - _value(node, table, 1, s)
            cos, sin = math.cos(heading), math.sin(heading)
            along, across = dx * cos + dy * sin, dy * cos - dx * sin
            if abs(along) < 1e-9:
                return s, across, heading, curvature
            # Within half a radius of the centre of curvature the full step would overshoot.
            s += along / max(1.0 - curvature * across, 0.5)
    return s, across, heading, curvature
