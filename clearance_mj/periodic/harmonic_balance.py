"""The condensed harmonic balance x = x_lin - R F(x): residual and Jacobian, with receptances R; compiled.

Harmonics are real: the mean, then cosine and sine of each, c cos hθ + s sin hθ with θ = ωt; K = 2 H + 1 of them. The
unknowns are those of coordinates z of the clearances' points, x = B z + y: the remainder y, the bending of the shaft
within a bushing, is so stiff that it follows by substitution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import STRICT, jit
from .forces import Laws, Sampled, Slopes, equal, fill_forces

__all__ = ["Grid", "add_jacobian", "blocks", "real_harmonics", "reduce_matrices", "response"]


class Grid(NamedTuple):
    """Harmonic functions at the samples of a period."""

    basis: np.ndarray  # (N, K) harmonic functions
    rate: np.ndarray  # (N, K) their derivatives by the angle
    project: np.ndarray  # (K, N) harmonics of samples
    even: np.ndarray  # (H + 1, N // 2 + 1) cosines of the first half, which the second half mirrors
    odd: np.ndarray  # (H + 1, N // 2 + 1) sines of the first half
    moments: np.ndarray  # (N, 4 H + 1) the functions of twice as many harmonics over N: means of products


@jit(**STRICT)
def reduce_matrices(matrices: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Return Bᵀ M B of matrices (H + 1, n_points, n_points)."""
    points, r = basis.shape
    product = np.zeros((matrices.shape[0], r, r), np.complex128)
    for h in range(matrices.shape[0]):
        for p in range(points):
            for b in range(r):
                total = 0.0j
                for q in range(points):
                    total += matrices[h, p, q] * basis[q, b]
                for a in range(r):
                    product[h, a, b] += basis[p, a] * total
    return product


@jit(**STRICT)
def times(factor: float, matrices: np.ndarray, values: np.ndarray, out: np.ndarray) -> None:
    """Add a factor times complex matrices (H + 1, n, m) times harmonics (m, K) to out (n, K)."""
    for a in range(out.shape[0]):
        for b in range(values.shape[0]):
            out[a, 0] += factor * matrices[0, a, b].real * values[b, 0]
            for h in range(1, matrices.shape[0]):
                re, im = factor * matrices[h, a, b].real, factor * matrices[h, a, b].imag
                c, s = values[b, 2 * h - 1], values[b, 2 * h]
                out[a, 2 * h - 1] += re * c + im * s
                out[a, 2 * h] += re * s - im * c


@jit(**STRICT)
def real_harmonics(complex_: np.ndarray) -> np.ndarray:
    """Return real harmonics (n, K) of complex amplitudes (H + 1, n)."""
    highest = complex_.shape[0] - 1
    harmonics = np.empty((complex_.shape[1], 2 * highest + 1))
    for p in range(complex_.shape[1]):
        harmonics[p, 0] = complex_[0, p].real
        for h in range(1, highest + 1):
            harmonics[p, 2 * h - 1], harmonics[p, 2 * h] = complex_[h, p].real, -complex_[h, p].imag
    return harmonics


@jit(**STRICT)
def blocks(laws: Laws, basis: np.ndarray, owner: np.ndarray, grid: Grid, omega: float, slopes: Slopes) -> np.ndarray:
    """Return (r, r, K, K) derivatives of the forces' harmonics by those of coordinates of the same clearance.

    ``basis`` (n_rows, r) are the coordinates' rows, ``owner`` (r,) their clearances; other blocks stay empty.
    """
    r = basis.shape[1]
    samples, harmonics = grid.basis.shape
    jacobian = np.empty((r, r, harmonics, harmonics))
    count = 0
    for a in range(r):
        for b in range(r):
            count += owner[a] == owner[b]
    series, pair = np.zeros((2 * count, samples)), 0
    for a in range(r):
        for b in range(r):
            if owner[a] == owner[b]:
                jacobian[a, b] = 0.0
                _add_pair(laws, basis, a, b, slopes, series[pair : pair + 2], jacobian[a, b])
                pair += 2
    means, pair = np.dot(series, grid.moments), 0
    for a in range(r):
        for b in range(r):
            if owner[a] == owner[b]:
                add_products(means[pair : pair + 2], omega, jacobian[a, b])
                pair += 2
    return jacobian


@jit(**STRICT)
def _add_pair(
    laws: Laws, basis: np.ndarray, a: int, b: int, slopes: Slopes, series: np.ndarray, block: np.ndarray
) -> None:
    """Add derivatives of the force along coordinate a by coordinate b: at samples, and carried ones by harmonics."""
    harmonics = block.shape[0]
    for p in range(laws.width.size):
        used = slopes.used[p]
        for d in range(laws.width[p]):
            along = basis[laws.rows[p, d], a]
            if along == 0.0:
                continue
            for e in range(laws.width[p]):
                weight = along * basis[laws.rows[p, e], b]
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
def add_products(means: np.ndarray, omega: float, block: np.ndarray) -> None:
    """Add the harmonics of f_x(θ) x + f_v(θ) ẋ by those of x to (K, K), from the means of f times cos and sin mθ."""
    highest = block.shape[0] // 2
    a_x, a_v = np.zeros(2 * highest + 1), np.zeros(2 * highest + 1)
    b_x, b_v = np.zeros(2 * highest + 1), np.zeros(2 * highest + 1)
    a_x[0], a_v[0] = means[0, 0], means[1, 0]
    for m in range(1, 2 * highest + 1):
        a_x[m], b_x[m] = means[0, 2 * m - 1], means[0, 2 * m]
        a_v[m], b_v[m] = means[1, 2 * m - 1], means[1, 2 * m]
    for l in range(highest + 1):
        l_omega = l * omega
        for k in range(highest + 1):
            total, apart = k + l, abs(k - l)
            sign = 1.0 if k >= l else -1.0
            # means over a period, times two, of cos cos, sin sin, sin cos, cos sin of k (row) and l (column)
            cc_x, ss_x = a_x[apart] + a_x[total], a_x[apart] - a_x[total]
            cc_v, ss_v = a_v[apart] + a_v[total], a_v[apart] - a_v[total]
            sc_x, cs_x = b_x[total] + sign * b_x[apart], b_x[total] - sign * b_x[apart]
            sc_v, cs_v = b_v[total] + sign * b_v[apart], b_v[total] - sign * b_v[apart]
            row, column, weight = max(2 * k - 1, 0), max(2 * l - 1, 0), 0.5 if k == 0 else 1.0
            block[row, column] += weight * (cc_x - l_omega * cs_v)
            if l > 0:
                block[row, 2 * l] += weight * (cs_x + l_omega * cc_v)
            if k > 0:
                block[2 * k, column] += sc_x - l_omega * ss_v
                if l > 0:
                    block[2 * k, 2 * l] += ss_x + l_omega * sc_v


@jit(**STRICT)
def add_jacobian(compliance: np.ndarray, blocks: np.ndarray, owner: np.ndarray, out: np.ndarray) -> None:
    """Fill the (r K, r K) corner of out with 1 + R D."""
    r, harmonics = blocks.shape[0], blocks.shape[2]
    for a in range(r):
        for c in range(r):
            for k in range(harmonics):
                row = out[a * harmonics + k]
                for l in range(harmonics):
                    row[c * harmonics + l] = 1.0 if a == c and k == l else 0.0
            for b in range(r):
                if owner[b] != owner[c]:
                    continue
                block = blocks[b, c]
                re = compliance[0, a, b].real
                row = out[a * harmonics]
                for l in range(harmonics):
                    row[c * harmonics + l] += re * block[0, l]
                for h in range(1, compliance.shape[0]):
                    re, im = compliance[h, a, b].real, compliance[h, a, b].imag
                    cosine, sine = out[a * harmonics + 2 * h - 1], out[a * harmonics + 2 * h]
                    of_cosine, of_sine = block[2 * h - 1], block[2 * h]
                    for l in range(harmonics):
                        cosine[c * harmonics + l] += re * of_cosine[l] + im * of_sine[l]
                        sine[c * harmonics + l] += re * of_sine[l] - im * of_cosine[l]


@jit(**STRICT)
def _first_equal(values: np.ndarray, p: int) -> int:
    """Return the first row that is equal to row p: a bushing without length has its ends in its middle."""
    for q in range(p):
        if equal(values, q, p):
            return q
    return p


@jit(**STRICT)
def motion_over_period(grid: Grid, omega: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and speeds (n_points, N) of harmonics (n_points, K)."""
    points, n, half = x.shape[0], grid.basis.shape[0], grid.even.shape[1]
    first, count = np.zeros(points, np.int64), 0
    even, odd = np.zeros((2 * points, grid.even.shape[0])), np.zeros((2 * points, grid.even.shape[0]))
    for p in range(points):
        first[p] = _first_equal(x, p)
        if first[p] < p:
            continue
        even[count, 0] = x[p, 0]
        for h in range(1, even.shape[1]):
            c, s = x[p, 2 * h - 1], x[p, 2 * h]
            even[count, h], odd[count, h] = c, s
            even[count + 1, h], odd[count + 1, h] = h * omega * s, -h * omega * c
        count += 2
    even_part, odd_part = np.dot(even[:count], grid.even), np.dot(odd[:count], grid.odd)
    place, speed = np.empty((points, n)), np.empty((points, n))
    count = 0
    for p in range(points):
        q = first[p]
        if q < p:
            for i in range(n):
                place[p, i], speed[p, i] = place[q, i], speed[q, i]
            continue
        for i in range(half):
            place[p, i] = even_part[count, i] + odd_part[count, i]
            speed[p, i] = even_part[count + 1, i] + odd_part[count + 1, i]
        for i in range(half, n):
            place[p, i] = even_part[count, n - i] - odd_part[count, n - i]
            speed[p, i] = even_part[count + 1, n - i] - odd_part[count + 1, n - i]
        count += 2
    return place, speed


@jit(**STRICT)
def projected(grid: Grid, samples: np.ndarray) -> np.ndarray:
    """Return harmonics (n_points, K) of forces (n_points, N), of which some are zero or equal."""
    points, n = samples.shape
    half, weight = grid.even.shape[1], 2.0 / n
    first, count = np.full(points, -1), 0
    even, odd = np.zeros((points, half)), np.zeros((points, half))
    for p in range(points):
        active = False
        for i in range(n):
            active = active or samples[p, i] != 0.0
        if not active:
            continue
        first[p] = _first_equal(samples, p)
        if first[p] == p:
            even[count, 0] = samples[p, 0]
            for i in range(1, half):
                if 2 * i == n:
                    even[count, i] = samples[p, i]
                else:
                    even[count, i], odd[count, i] = samples[p, i] + samples[p, n - i], samples[p, i] - samples[p, n - i]
            count += 1
    cosines, sines = np.dot(even[:count], grid.even.T), np.dot(odd[:count], grid.odd.T)
    harmonics = np.zeros((points, 2 * cosines.shape[1] - 1))
    count = 0
    for p in range(points):
        q = first[p]
        if q < 0:
            continue
        if q < p:
            for k in range(harmonics.shape[1]):
                harmonics[p, k] = harmonics[q, k]
            continue
        harmonics[p, 0] = 0.5 * weight * cosines[count, 0]
        for h in range(1, cosines.shape[1]):
            harmonics[p, 2 * h - 1], harmonics[p, 2 * h] = weight * cosines[count, h], weight * sines[count, h]
        count += 1
    return harmonics


@jit(**STRICT)
def response(
    compliance: np.ndarray, driven: np.ndarray, basis: np.ndarray, grid: Grid, laws: Laws, slopes: Slopes,
    omega: float, spin: float, z: np.ndarray, y: np.ndarray, diff: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Return the response to excitation and a motion's forces: coordinates (r, K), remainder (n_rows, K), and forces.

    ``compliance`` (H + 1, n_rows, n_rows) and ``driven`` (n_rows, K) are receptances and displacements without
    clearances, ``basis`` B (n_rows, r), orthonormal, whose columns are each of one clearance. With ``diff``, ``slopes``
    are filled.
    """
    place, speed = motion_over_period(grid, omega, np.dot(basis, z) + y)
    samples = np.empty_like(place)
    fill_forces(laws, Sampled(place, speed, omega, spin), grid.basis, grid.rate, grid.project, diff, samples, slopes)
    force = projected(grid, samples)
    response = driven.copy()
    times(-1.0, compliance, force, response)
    z_new = np.dot(basis.T, response)
    return z_new, response - np.dot(basis, z_new), force
