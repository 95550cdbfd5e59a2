"""Manoeuvres: double lane change, ISO 3888-1 lane change, clothoid-arc-clothoid, straight.

Points are those of the closed forms; arc lengths are integrated by Gauss-Legendre quadrature.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..errors import ManoeuvreError
from .commonroad import GRAVITY
from .path import Path, Piece

__all__ = [
    "Gate",
    "check_feasible",
    "clothoid_arc",
    "double_lane_change",
    "iso3888_gates",
    "iso_lane_change",
    "straight",
]

SPACING = 0.1
"""m between two points"""
SPEEDS = (5.0, 50.0)
"""m/s, within which the vehicle models hold"""
LANE_OFFSET = 3.5
"""m between the centre lines of the two lanes of ISO 3888-1"""
REACH = 1 / 6
"""share of a lane change that lies within each of the two gates it connects"""
ROOT, WEIGHT = np.polynomial.legendre.leggauss(5)

Derivatives = Callable[[np.ndarray], Sequence[np.ndarray]]
"""Y and its first three derivatives at X"""


class Gate(NamedTuple):
    """A stretch of lane between cones."""

    start: float  # m along X
    end: float  # m along X
    centre: float  # m along Y
    width: float  # m


def check_feasible(path: Path, speed: float, friction: float) -> None:
    """Refuse a manoeuvre that no controller could follow at a speed, m/s, on a road of a friction coefficient.

    The speed is outside `SPEEDS`, or the path needs more than the friction's lateral acceleration.
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
    """Straight path along x, of a length in m."""
    _check_positive(length=length)
    return Path.of("straight", _clothoids([(length, 0.0, 0.0)]))


def clothoid_arc(
    radius: float = 200.0, clothoid: float = 60.0, arc: float = 100.0, lead: float = 30.0, tail: float = 60.0
) -> Path:
    """Straight, clothoid, left-hand arc, clothoid, straight; lengths in m."""
    _check_positive(radius=radius, clothoid=clothoid, arc=arc, lead=lead, tail=tail)
    k = 1 / radius
    parts = [(lead, 0.0, 0.0), (clothoid, 0.0, k), (arc, k, k), (clothoid, k, 0.0), (tail, 0.0, 0.0)]
    return Path.of("clothoid-arc", _clothoids(parts))


def double_lane_change(length_factor: float = 1.0) -> Path:
    """Double lane change with hyperbolic tangents.

    Y = dy1/2 (1 + tanh z1) - dy2/2 (1 + tanh z2), z_i = 2.4/dx_i (X - Xs_i) - 1.2, dx 25 and 21.95 m, dy 4.05 and
    5.7 m, Xs 27.19 and 56.46 m (Falcone et al., IEEE Trans. Control Syst. Technol. 15, 2007), with all lengths along X
    scaled; at 1 the path needs 10.9 m/s² at 72 km/h. It begins 30 m before X = 0, where its slope is below 1e-6.
    """
    _check_positive(length_factor=length_factor)
    dx, dy, start = np.array([25.0, 21.95]), np.array([4.05, -5.7]), np.array([27.19, 56.46])

    def derivatives(x: np.ndarray) -> list[np.ndarray]:
        x = x[:, None] / length_factor
        rate = 2.4 / dx / length_factor
        t = np.tanh(2.4 / dx * (x - start) - 1.2)
        sech2 = 1 - t**2
        orders = (1 + t, sech2 * rate, -2 * t * sech2 * rate**2, (6 * t**2 - 2) * sech2 * rate**3)
        return [order @ (dy / 2) for order in orders]

    first, last = length_factor * np.array([-30.0, 125.0])
    return Path.of(f"double-lane-change x {length_factor:g}", [_graph(derivatives, first, last)])


def iso3888_gates(width: float = 1.61, length_factor: float = 1.0) -> tuple[Gate, ...]:
    """Gates of the double lane change of ISO 3888-1: 15 m, 25 m in the other lane, 30 m back; 30 and 25 m between them.

    Their widths are 1.1, 1.2 and 1.3 times the vehicle's plus 0.25 m; the lanes' centre lines are taken as 3.5 m apart.
    Lengths along X are scaled; 1 is the standard's.
    """
    _check_positive(width=width, length_factor=length_factor)
    lanes = ((0.0, 15.0, 0.0, 1.1), (45.0, 70.0, LANE_OFFSET, 1.2), (95.0, 125.0, 0.0, 1.3))
    return tuple(Gate(a * length_factor, b * length_factor, y, factor * width + 0.25) for a, b, y, factor in lanes)


def iso_lane_change(length_factor: float = 1.0) -> Path:
    """Smooth path through the ISO 3888-1 gates: straights joined by quintic lane changes; lengths along X are scaled.

    Each lane change Y = 3.5 m (10 u³ - 15 u⁴ + 6 u⁵) has a sixth of its length within each of its gates, where the
    path is off the centre by at most 0.124 m, less than the free width on either side.
    """
    _check_positive(length_factor=length_factor)
    first, second, third = iso3888_gates(length_factor=length_factor)
    quintic = LANE_OFFSET * np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])

    def change(gate: Gate, following: Gate) -> tuple[float, float, Derivatives]:
        """Lane change between two gates: where it begins, ends, and its derivatives."""
        reach = REACH / (1 - 2 * REACH) * (following.start - gate.end)
        a, b = gate.end - reach, following.start + reach
        curve = quintic if following.centre > gate.centre else LANE_OFFSET - quintic
        return a, b, lambda x: [curve.deriv(k)((x - a) / (b - a)) / (b - a) ** k for k in range(4)]

    def lane(centre: float) -> Derivatives:
        return lambda x: [0 * x + centre, *[0 * x] * 3]

    a1, b1, left = change(first, second)
    a2, b2, right = change(second, third)
    pieces = [
        _graph(lane(0.0), -30.0 * length_factor, a1),
        _graph(left, a1, b1),
        _graph(lane(LANE_OFFSET), b1, a2),
        _graph(right, a2, b2),
        _graph(lane(0.0), b2, third.end + 30.0 * length_factor),
    ]
    return Path.of(f"iso-3888-1 x {length_factor:g}", pieces)


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        if not 0 < value < math.inf:
            raise ManoeuvreError(f"{name} must be > 0, got {value:g}")


def _graph(derivatives: Derivatives, start: float, end: float) -> Piece:
    """Points of a curve Y(X)."""
    x = np.linspace(start, end, max(2, math.ceil((end - start) / SPACING) + 1))
    y, d1, d2, d3 = derivatives(x)
    half = np.diff(x) / 2
    inner = (x[:-1] + half)[:, None] + half[:, None] * ROOT
    speed = np.sqrt(1 + derivatives(inner.ravel())[1] ** 2).reshape(inner.shape)
    s = np.concatenate(([0.0], np.cumsum(half * (speed @ WEIGHT))))
    q = 1 + d1**2
    slope = (d3 * q - 3 * d1 * d2**2) / q**3  # dκ/ds = (dκ/dX) / √q
    return Piece(s, x, y, np.arctan(d1), d2 / q**1.5, slope)


def _clothoids(parts: Sequence[tuple[float, float, float]]) -> list[Piece]:
    """Straights, arcs and clothoids in a row from the origin, each (length, curvature at its start, at its end)."""
    pieces, begin, x, y, heading = [], 0.0, 0.0, 0.0, 0.0
    for length, first, last in parts:
        s = np.linspace(0.0, length, max(2, math.ceil(length / SPACING) + 1))
        rate = (last - first) / length
        half = s[1] / 2
        at = (s[:-1] + half)[:, None] + half * ROOT
        inner, direction = (heading + v * (first + rate * v / 2) for v in (at, s))
        along, across = (np.concatenate(([0.0], np.cumsum(half * f(inner) @ WEIGHT))) for f in (np.cos, np.sin))
        pieces.append(Piece(begin + s, x + along, y + across, direction, first + rate * s, np.full(s.size, rate)))
        x, y, heading, begin = x + along[-1], y + across[-1], direction[-1], begin + length
    return pieces
