"""Pieces of paths: graphs Y(X), straights, arcs and clothoids, lane changes.

Points are those of the closed forms; arc lengths are integrated by Gauss-Legendre quadrature.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..core.errors import ManoeuvreError
from .path import Path, Piece

__all__ = ["Derivatives", "clothoids", "graph", "lane", "lane_changes", "quintic"]

SPACING = 0.1  # m between two points of a path
ROOT, WEIGHT = np.polynomial.legendre.leggauss(5)

Derivatives = Callable[[np.ndarray], Sequence[np.ndarray]]  # Y and its first three derivatives at X.


def graph(derivatives: Derivatives, start: float, end: float) -> Piece:
    """Return the points of a curve Y(X)."""
    x = np.linspace(start, end, max(2, math.ceil((end - start) / SPACING) + 1))
    y, d1, d2, d3 = derivatives(x)
    half = np.diff(x) / 2
    inner = (x[:-1] + half)[:, None] + half[:, None] * ROOT
    speed = np.sqrt(1 + derivatives(inner.ravel())[1] ** 2).reshape(inner.shape)
    s = np.concatenate(([0.0], np.cumsum(half * (speed @ WEIGHT))))
    q = 1 + d1**2
    slope = (d3 * q - 3 * d1 * d2**2) / q**3  # dκ/ds = (dκ/dX) / √q
    return Piece(s, x, y, np.arctan(d1), d2 / q**1.5, slope)


def clothoids(parts: Sequence[tuple[float, float, float]]) -> list[Piece]:
    """Straights, arcs and clothoids in a row from the origin, each (length, curvature at its start, at its end)."""
    pieces, begin, x, y, heading = [], 0.0, 0.0, 0.0, 0.0
    for length, first, last in parts:
        s = np.linspace(0.0, length, max(2, math.ceil(length / SPACING) + 1))
        rate = (last - first) / length
        half = s[1] / 2
        at = (s[:-1] + half)[:, None] + half * ROOT
        inner, direction = (heading + v * (first + rate * v / 2) for v in (at, s))
        dx, dy = (np.concatenate(([0.0], np.cumsum(half * f(inner) @ WEIGHT))) for f in (np.cos, np.sin))
        pieces.append(Piece(begin + s, x + dx, y + dy, direction, first + rate * s, np.full(s.size, rate)))
        x, y, heading, begin = x + dx[-1], y + dy[-1], direction[-1], begin + length
    return pieces


def lane(y: float) -> Derivatives:
    """Straight along X at a Y, m."""
    return lambda x: [0 * x + y, *[0 * x] * 3]


def quintic(begin: float, end: float, start: float, target: float) -> Derivatives:
    """Y from start to target, between X = begin and end, with neither slope nor curvature at its ends; in m."""
    curve, length = start + (target - start) * np.polynomial.Polynomial([0, 0, 0, 10, -15, 6]), end - begin
    return lambda x: [curve.deriv(k)((x - begin) / length) / length**k for k in range(4)]


def lane_changes(name: str, changes: Sequence[tuple[float, float, float]], start: float, end: float) -> Path:
    """Straights joined by quintic lane changes, all in m: each begins at an X, ends at another, and leads to a Y.

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
