"""The condensed harmonic balance of round clearances: what is left of x = x_lin - R F(x); compiled.

As `harmonic_balance`, with two rows for each point: its motion along y, then along z. The linear system's receptances
are given, as they may change with the spin.
"""

from __future__ import annotations

import numpy as np

from ...core.jit import STRICT, jit
from ..forces import Laws
from ..harmonic_balance import (
    Grid,
    add_jacobian,
    add_products,
    motion_over_period,
    projected,
    real_harmonics,
    reduced,
    times,
)
from .forces import RoundSlopes, Sampled, fill_round_forces

__all__ = ["round_balance"]


@jit(**STRICT)
def _blocks(basis: np.ndarray, owner: np.ndarray, grid: Grid, omega: float, slopes: RoundSlopes) -> np.ndarray:
    """Return (r, r, K, K) derivatives of the forces' harmonics by those of coordinates of one owner."""
    r = basis.shape[1]
    samples, harmonics = grid.basis.shape
    found = np.empty((r, r, harmonics, harmonics))
    count = 0
    for a in range(r):
        for b in range(r):
            count += owner[a] == owner[b]
    series, pair = np.zeros((2 * count, samples)), 0
    for a in range(r):
        for b in range(r):
            if owner[a] == owner[b]:
                found[a, b] = 0.0
                _add_pair(basis[:, a].copy(), basis[:, b].copy(), slopes, series[pair : pair + 2], found[a, b])
                pair += 2
    means, pair = np.dot(series, grid.moments), 0
    for a in range(r):
        for b in range(r):
            if owner[a] == owner[b]:
                add_products(means[pair : pair + 2], omega, found[a, b])
                pair += 2
    return found


@jit(**STRICT)
def _add_pair(a: np.ndarray, b: np.ndarray, slopes: RoundSlopes, series: np.ndarray, block: np.ndarray) -> None:
    """Add derivatives of the force along coordinate a (2 n_points,) by coordinate b, at samples and by harmonics."""
    harmonics = block.shape[0]
    for row in range(a.size):
        if a[row] == 0.0:
            continue
        p, d = row // 2, row % 2
        for e in range(2):
            weight, used = a[row] * b[2 * p + e], slopes.used[p]
            if weight == 0.0:
                continue
            for i in range(series.shape[1]):
                series[0, i] += weight * slopes.x[p, d, e, i]
                series[1, i] += weight * slopes.v[p, d, e, i]
            if used > 0:
                carried = np.dot(slopes.onto[p, :used].T, slopes.rows[p, d, e, :used])
                for k in range(harmonics):
                    for l in range(harmonics):
                        block[k, l] += weight * carried[k, l]


@jit(**STRICT)
def round_balance(
    compliance: np.ndarray, driven: np.ndarray, basis: np.ndarray, owner: np.ndarray, grid: Grid, laws: Laws,
    slopes: RoundSlopes, omega: float, spin: float, z: np.ndarray, y: np.ndarray, want: bool, jacobian: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Return what z (r, K) leaves of the balance, forces (2 n_points, K) and the displacements y beside B z.

    ``compliance`` (H + 1, 2 n_points, 2 n_points) and ``driven`` (H + 1, 2 n_points) are receptances and displacements
    without clearances, ``basis`` B (2 n_points, r) and ``owner`` (r,) as in `harmonic_balance.Linear`. If wanted, the
    (r K, r K) corner of ``jacobian`` is filled with the derivative by z, and ``slopes`` changed.
    """
    x = np.dot(basis, z) + y
    place, speed = motion_over_period(grid, omega, x)
    points, n = place.shape[0] // 2, place.shape[1]
    motion = Sampled(place.reshape((points, 2, n)), speed.reshape((points, 2, n)), omega, spin)
    samples = np.empty((points, 2, n))
    fill_round_forces(laws, motion, grid.basis, grid.rate, grid.project, want, samples, slopes)
    force = projected(grid, samples.reshape((2 * points, n)))
    found = real_harmonics(driven)
    times(-1.0, compliance, force, found)
    own = np.dot(basis.T, found)
    beside = found - np.dot(basis, own)
    if want:
        by_coordinates = _blocks(basis, owner, grid, omega, slopes)
        add_jacobian(reduced(compliance, basis), by_coordinates, owner, jacobian)
    return z - own, force, beside
