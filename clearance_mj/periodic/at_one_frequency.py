"""Motions over the level at one frequency: Newton's method with its receptances and continuation, compiled whole."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import STRICT, jit
from .condensed import Condensed
from .continuation import (
    CORNERS,
    ITERATIONS,
    SHARP_CORNER,
    SHARPEST,
    SHORTEST,
    SLOW,
    SMALLEST_DAMPING,
    Motion,
    Motions,
    Solver,
)
from .forces import Laws, Slopes
from .harmonic_balance import Grid, Linear, balanced, real_harmonics, receptances

__all__ = ["LevelSolver"]

LONGER = 2.0  # times as long are steps beyond the level up to which motions are wanted


class _Balance(NamedTuple):
    """The harmonic balance at one frequency."""

    linear: Linear
    compliance: np.ndarray  # (H + 1, n_points, n_points) receptances
    driven: np.ndarray  # (n_points, K) displacements by the excitation of level 1
    grid: Grid
    laws: Laws
    slopes: Slopes
    omega: float  # 1/s
    tolerance: float  # of the motion: what the balance may leave
    least: float  # m: smaller motions are measured by it
    jacobian: np.ndarray  # (r K + 1, r K + 1) room for its derivatives


@jit(**STRICT)
def _distance(left: np.ndarray, beside: np.ndarray, y: np.ndarray, scale: float) -> float:
    total = 0.0
    for a in range(left.shape[0]):
        for k in range(left.shape[1]):
            total += left[a, k] ** 2
    for p in range(y.shape[0]):
        for k in range(y.shape[1]):
            total += (beside[p, k] - y[p, k]) ** 2
    return np.sqrt(total) / scale


@jit(**STRICT)
def _inverse(jacobian: np.ndarray, driven: np.ndarray, row: np.ndarray, scale: float, pace: float) -> np.ndarray:
    """Inverse (n + 1, n + 1) of the derivatives by unknowns over scale and level over pace, bordered by a row."""
    n = driven.size
    matrix = jacobian.copy()
    for i in range(n):
        matrix[i, n] = -driven[i] * pace / scale
    matrix[n] = row
    return np.linalg.inv(matrix)


@jit(inline="always", **STRICT)
def _left(
    balance: _Balance, level: float, z: np.ndarray, y: np.ndarray, want: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What z leaves of the balance, forces, displacements beside B z, and places (n_points, N) at samples."""
    left, force, beside, place, _, _ = balanced(
        balance.linear, balance.compliance, level * balance.driven, balance.grid, balance.laws, balance.slopes,
        balance.omega, z, y, want, balance.jacobian,
    )  # fmt: skip
    return left, force, beside, place


@jit(**STRICT)
def _solved(
    balance: _Balance, level: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float
) -> tuple[bool, float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, np.ndarray]:
    """What `Follower.solve` does: whether a motion was found, the motion, and its places at samples."""
    n, pace, old = row.size - 1, level, np.inf
    by_level = np.dot(balance.linear.basis.T, balance.driven).ravel()
    right = np.zeros(n + 1)
    left, force, beside, place = _left(balance, level, z, y, True)
    inverse = _inverse(balance.jacobian, by_level, row, scale, pace)
    for _ in range(ITERATIONS):
        now = _distance(left, beside, y, scale)
        if now < balance.tolerance:
            own = max(np.sqrt(np.sum(z * z)), balance.least)
            tangent = inverse[:, n].copy()
            tangent[:n] *= scale / own
            tangent[n] *= pace / level
            return True, level, z, y, force, tangent / np.sqrt(np.sum(tangent * tangent)), own, place
        if now > SLOW * old and old < np.inf:
            _left(balance, level, z, y, True)
            inverse = _inverse(balance.jacobian, by_level, row, scale, pace)
        right[:n] = left.ravel()
        step = np.dot(inverse, right) / -scale
        share = 1.0
        while True:
            ahead = level + share * step[n] * pace
            moved = z + share * scale * step[:n].copy().reshape(z.shape)
            if ahead > 0.0:
                left, force, further, place = _left(balance, ahead, moved, beside, False)
                then = _distance(left, further, beside, scale)
                if then < (1.0 - share / 4.0) * now or then < balance.tolerance:
                    break
            share /= 2.0
            if share < SMALLEST_DAMPING:
                return False, level, z, y, force, right, scale, place
        level, z, y, old = ahead, moved, beside, now
        beside = further
    return False, level, z, y, force, right, scale, place


@jit(inline="always", **STRICT)
def _ahead(
    balance: _Balance, level: float, z: np.ndarray, y: np.ndarray, scale: float, direction: np.ndarray, step: float
) -> tuple[bool, float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, np.ndarray, np.ndarray]:
    """What `Follower.ahead` does: what `_solved` returns, and the way to there in the units of the motion before."""
    n, longer = direction.size - 1, 1.0 + step * direction[-1]
    row = direction.copy()
    row[n] *= longer
    guess = z + step * scale * direction[:n].copy().reshape(z.shape)
    if longer <= 0.0:
        return False, level, z, y, y, row, scale, y, row
    found, at, there, beside, force, tangent, own, place = _solved(balance, level * longer, guess, y, row, scale)
    way = np.empty(n + 1)
    way[:n] = (there - z).ravel() / scale
    way[n] = at / level - 1.0
    if np.dot(tangent, way) * step < 0.0:
        tangent = -tangent
    return found, at, there, beside, force, tangent, own, place, way


@jit(**STRICT)
def _followed(
    balance: _Balance, level: np.ndarray, z: np.ndarray, y: np.ndarray, force: np.ndarray, tangent: np.ndarray,
    scale: np.ndarray, step: float, bent: float, longest: float, lowest: float, beyond: float, walls: np.ndarray,
    deep: float,
) -> int:  # fmt: skip
    """What `Follower.onwards` does: fill motions after the first ones of all arrays; return how many there are.

    They end below the lowest level, and where one beyond a level rises and is deeper than ``deep`` beyond walls
    (n_points, 2), lower and upper.
    """
    count, n = 1, tangent.shape[1] - 1
    for _ in range(level.size - 1):
        i = count - 1
        found, at, there, beside, acting, onwards, own, place, way = _ahead(
            balance, level[i], z[i], y[i], scale[i], tangent[i], step
        )
        if not found and step < SHARP_CORNER:
            direction = tangent[i].copy()
            direction[n] = 0.0
            length = np.sqrt(np.sum(direction * direction))
            for corner in CORNERS:
                if not found and length > 0.0:
                    found, at, there, beside, acting, onwards, own, place, way = _ahead(
                        balance, level[i], z[i], y[i], scale[i], direction / length, corner
                    )
        if not found or not (np.dot(onwards, tangent[i]) > SHARPEST or step < SHARP_CORNER):
            step /= 2.0
            if step < SHORTEST:
                break
            continue
        level[count], z[count], y[count], force[count] = at, there, beside, acting
        tangent[count], scale[count] = onwards, own
        count += 1
        if at < lowest:
            break
        if at > beyond and onwards[n] > 0.0:
            depth = -np.inf
            for p in range(place.shape[0]):
                for k in range(place.shape[1]):
                    depth = max(depth, place[p, k] - walls[p, 1], walls[p, 0] - place[p, k])
            if depth > deep:
                break
        off = way - step * tangent[i]
        apart = np.sqrt(np.sum(off * off))
        longer = LONGER if at > beyond else 1.0
        step = min(step * min(max(longer * np.sqrt(bent / max(apart, 1e-12)), 0.3), 2.0), longer * longest)
    return count


class LevelSolver(Solver):
    """A solver whose parameter is the level, at one frequency after the other."""

    def __init__(self, system: Condensed, harmonics: int, samples: int):
        super().__init__(system, harmonics, samples)
        self._walls = np.full((self.rows, 2), (-np.inf, np.inf))
        self._walls[len(system.rig.bushings) :] = np.repeat(
            [bushing.walls for bushing in system.rig.bushings], 2, axis=0
        )

    def over_level(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Take a frequency, with its receptances; return what rest leaves, and what lies beside, both of the drive."""
        linear, points = self.system.linear, self.rows
        shape = self.harmonics + 1, points
        self.at = omega
        compliance, amplitudes = np.empty((*shape, points), dtype=complex), np.empty(shape, dtype=complex)
        by_omega = np.empty_like(compliance), np.empty_like(amplitudes)  # not wanted
        receptances(linear, omega, False, compliance, by_omega[0], amplitudes, by_omega[1])
        driven = real_harmonics(amplitudes)
        self._balance = _Balance(
            linear, compliance, driven, self.grid, self.system.laws, self.slopes, omega, self.tolerance, self.least,
            self.jacobian,
        )  # fmt: skip
        own = linear.basis.T @ driven
        return -own, driven - linear.basis @ own

    def solve(self, omega: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float) -> Motion | None:
        """Return the motion near a guess on the plane across ``row`` through it, as `Follower.solve`."""
        found, *motion, _ = _solved(self._balance, float(omega), z, y, row, scale)
        return Motion(*motion) if found else None

    def followed(
        self, start: Motion, most: int, step: float, lowest: float, beyond: float, deep: float
    ) -> Motions:  # fmt: skip
        """Return a motion and those after it, until one beyond a level rises and is deep in a wall.

        Parameters
        ----------
        start : Motion
            The first motion, whose tangent says where the branch goes.
        most : int
            How many steps are tried.
        step : float
            The first one, as a share of level and motion.
        lowest : float
            Level below which they end too.
        beyond : float
            The level.
        deep : float
            How deep, m.
        """
        first = start.omega, start.z, start.y, start.force, start.tangent, start.scale
        motions = Motions(*(np.empty((most + 1, *np.shape(each))) for each in first))
        for all_of_them, each in zip(motions, first):
            all_of_them[0] = each
        count = _followed(self._balance, *motions, step, self.bent, self.longest, lowest, beyond, self._walls, deep)
        return Motions(*(each[:count] for each in motions))
