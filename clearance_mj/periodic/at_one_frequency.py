"""Motions over the level at one frequency: Newton's method with the frequency's receptances, compiled whole."""

from __future__ import annotations

import numpy as np

from ..clearance.pointers import STRICT, kernel_loop
from .continuation import ITERATIONS, SLOW, SMALLEST_DAMPING, Motion, Solver
from .forces import Laws, Slopes
from .harmonic_balance import Grid, Linear, balanced, real_harmonics, receptances

__all__ = ["LevelSolver"]


@kernel_loop(**STRICT)
def _distance(left: np.ndarray, beside: np.ndarray, y: np.ndarray, scale: float) -> float:
    total = 0.0
    for a in range(left.shape[0]):
        for k in range(left.shape[1]):
            total += left[a, k] ** 2
    for p in range(y.shape[0]):
        for k in range(y.shape[1]):
            total += (beside[p, k] - y[p, k]) ** 2
    return np.sqrt(total) / scale


@kernel_loop(**STRICT)
def _inverse(jacobian: np.ndarray, driven: np.ndarray, row: np.ndarray, scale: float, pace: float) -> np.ndarray:
    """Inverse (n + 1, n + 1) of the derivatives by unknowns over scale and level over pace, bordered by a row."""
    n = driven.size
    matrix = jacobian.copy()
    for i in range(n):
        matrix[i, n] = -driven[i] * pace / scale
    matrix[n] = row
    return np.linalg.inv(matrix)


@kernel_loop(**STRICT)
def _solved(
    linear: Linear, compliance: np.ndarray, driven: np.ndarray, grid: Grid, laws: Laws, slopes: Slopes, omega: float,
    level: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float, tolerance: float, jacobian: np.ndarray,
) -> tuple[bool, float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """What `Follower.solve` does: whether a motion was found, its level, z, y and forces, and the way ahead."""
    n, pace, old = row.size - 1, level, np.inf
    by_level = np.dot(linear.basis.T, driven).ravel()
    right = np.zeros(n + 1)
    left, force, beside, _, _, _ = balanced(
        linear, compliance, level * driven, grid, laws, slopes, omega, z, y, True, jacobian
    )
    inverse = _inverse(jacobian, by_level, row, scale, pace)
    for _ in range(ITERATIONS):
        now = _distance(left, beside, y, scale)
        if now < tolerance:
            return True, level, z, y, force, inverse[:, n].copy()
        if now > SLOW * old and old < np.inf:
            balanced(linear, compliance, level * driven, grid, laws, slopes, omega, z, y, True, jacobian)
            inverse = _inverse(jacobian, by_level, row, scale, pace)
        right[:n] = left.ravel()
        step = np.dot(inverse, right) / -scale
        share = 1.0
        while True:
            ahead = level + share * step[n] * pace
            moved = z + share * scale * step[:n].copy().reshape(z.shape)
            if ahead > 0.0:
                left, force, further, _, _, _ = balanced(
                    linear, compliance, ahead * driven, grid, laws, slopes, omega, moved, beside, False, jacobian
                )
                then = _distance(left, further, beside, scale)
                if then < (1.0 - share / 4.0) * now or then < tolerance:
                    break
            share /= 2.0
            if share < SMALLEST_DAMPING:
                return False, level, z, y, force, right
        level, z, y, old = ahead, moved, beside, now
        beside = further
    return False, level, z, y, force, right


class LevelSolver(Solver):
    """A solver whose parameter is the level, at one frequency after the other."""

    def over_level(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Take a frequency, with its receptances; return what rest leaves, and what lies beside, both of the drive."""
        linear, points = self.system.linear, self.rows
        shape = self.harmonics + 1, points
        self.at = omega
        self._compliance, by_omega = np.empty((2, *shape, points), dtype=complex)
        driven, driven_by = np.empty((2, *shape), dtype=complex)
        receptances(linear, omega, False, self._compliance, by_omega, driven, driven_by)
        self._driven = real_harmonics(driven)
        own = linear.basis.T @ self._driven
        return -own, self._driven - linear.basis @ own

    def solve(self, omega: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float) -> Motion | None:
        """Return the motion near a guess on the plane across ``row`` through it, as `Follower.solve`."""
        assert self.at is not None
        found, level, z, y, force, ahead = _solved(
            self.system.linear, self._compliance, self._driven, self.grid, self.system.laws, self.slopes, self.at,
            float(omega), z, y, row, scale, self.tolerance, self.jacobian,
        )  # fmt: skip
        if not found:
            return None
        own = max(float(np.linalg.norm(z)), self.least)
        ahead[:-1] *= scale / own
        ahead[-1] *= omega / level
        return Motion(level, z, y, force, ahead / np.linalg.norm(ahead), own)
