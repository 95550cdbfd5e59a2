"""Hermite finite elements of a clamped shaft, as banded matrices.

Cubic Euler-Bernoulli elements with consistent mass (Przemieniecki, Theory of Matrix Structural Analysis, 1968,
sections 5.6 and 11.3). Points of interest need not be nodes: shape functions carry forces and read motions anywhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from clearance_mj.core.errors import RigError
from clearance_mj.rig import Beam, PointMass

_STIFFNESS = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
_MASS = np.array([[156.0, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420


@dataclass(frozen=True)
class Points:
    """Places of a few points on a chain of degrees of freedom: point p is weight[p] @ u[start[p] : start[p] + 4]."""

    start: np.ndarray  # (n_points,) first degree of freedom
    weight: np.ndarray  # (n_points, 4)

    def dense(self, count: int) -> np.ndarray:
        """(n_points, count) the same as a matrix."""
        matrix = np.zeros((self.start.size, count))
        for row, start, weight in zip(matrix, self.start, self.weight):
            row[start : start + 4] = weight
        return matrix


@dataclass(frozen=True)
class FiniteElements:
    """Matrices of a shaft clamped at x = 0; degrees of freedom: deflection (m) and slope (rad) of each free node."""

    mass: np.ndarray  # (4, n) lower bands: mass[k, j] is M[j + k, j]
    stiffness: np.ndarray  # (4, n) lower bands
    inertia: np.ndarray  # (n,) M r, r the unit translation of shaft and clamp: the load per base acceleration
    rayleigh: tuple[float, float]  # (1/s, s): damping matrix rayleigh[0] M + rayleigh[1] K
    length: float  # m

    @classmethod
    def of_shaft(cls, beam: Beam, masses: Iterable[PointMass] = (), elements: int = 64) -> FiniteElements:
        """Assemble a shaft of equal elements; the masses have no rotary inertia."""
        if elements < 2:
            raise RigError(f"a finite-element shaft needs at least 2 elements, got {elements}")
        h = beam.length / elements
        scale = np.array([1.0, h, 1.0, h])
        scale = scale[:, None] * scale
        k, m = np.zeros((4, 2 * elements + 2)), np.zeros((4, 2 * elements + 2))
        for e in range(elements):
            _add(k, 2 * e, beam.bending_stiffness / h**3 * _STIFFNESS * scale)
            _add(m, 2 * e, beam.mass_per_length * h * _MASS * scale)
        for item in masses:
            start, shape = _shape(float(item.position), beam.length, elements)
            _add(m, start, item.mass * shape[:, None] * shape)
        translation = np.zeros(2 * elements + 2)
        translation[::2] = 1.0
        return cls(m[:, 2:], k[:, 2:], _times(m, translation)[2:], beam.rayleigh, beam.length)

    @property
    def count(self) -> int:
        """Number of degrees of freedom."""
        return self.mass.shape[1]

    def points(self, positions: Sequence[float] | np.ndarray) -> Points:
        """Points at distances from the clamp, m."""
        shapes = [_shape(x, self.length, self.count // 2) for x in positions]
        start = np.array([s for s, _ in shapes], dtype=np.int64) - 2
        weight = np.array([w for _, w in shapes]).reshape(-1, 4)
        # In the first element the clamped node drops out: only the far node's two weights stay.
        clamped = start < 0
        weight[clamped] = np.roll(weight[clamped], 2, axis=1) * [1, 1, 0, 0]
        return Points(np.maximum(start, 0), weight)


def _shape(x: float, length: float, elements: int) -> tuple[int, np.ndarray]:
    """First degree of freedom (clamp counted) and the four cubic Hermite shape functions at ``x``."""
    h = length / elements
    element = min(int(x / h), elements - 1)
    s = x / h - element
    values = (1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2))
    return 2 * element, np.array(values)


def _add(band: np.ndarray, start: int, block: np.ndarray) -> None:
    for k in range(4):
        band[k, start : start + 4 - k] += np.diagonal(block, -k)


def _times(band: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Product of a symmetric banded matrix, lower bands of shape (4, n), and a vector."""
    product = band[0] * vector
    for k in range(1, 4):
        product[k:] += band[k, :-k] * vector[:-k]
        product[:-k] += band[k, :-k] * vector[k:]
    return product
