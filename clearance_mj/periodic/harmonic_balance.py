"""The condensed harmonic balance: what is left of x = x_lin - R F(x), and its derivatives; compiled.

Harmonics are real: the mean, then cosine and sine of each, c cos hθ + s sin hθ with θ = ωt; K = 2 H + 1 of them. The
unknowns are those of coordinates z of the clearances' points, x = B z + y: what B leaves out, the bending of the shaft
within a bushing, is so stiff that it follows by substitution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import STRICT, jit
from .forces import Laws, Slopes, equal, fill_forces

__all__ = [
    "Grid", "Linear", "add_jacobian", "add_products", "balance", "balanced", "blocks", "motion_over_period",
    "projected",
    "real_harmonics", "receptances", "reduced", "times",
]  # fmt: skip


class Linear(NamedTuple):
    """The in-gap linear system by its poles: displacement = Σ residue / (iω - pole)."""

    poles: np.ndarray  # (J,) complex, 1/s
    residues: np.ndarray  # (J, n_points, n_points) of the points' displacements per unit force on them
    driven: np.ndarray  # (J, n_points) of the points' displacements per unit of excitation
    excitation: np.ndarray  # (H + 1,) complex amplitudes of the excitation
    basis: np.ndarray  # (n_points, r) B, orthonormal; every column is of one bushing
    owner: np.ndarray  # (r,) which


class Grid(NamedTuple):
    """Samples of a period."""

    basis: np.ndarray  # (N, K) harmonic functions
    rate: np.ndarray  # (N, K) their derivatives by the angle
    project: np.ndarray  # (K, N) harmonics of samples
    even: np.ndarray  # (H + 1, N // 2 + 1) cosines of the first half, which the second half mirrors
    odd: np.ndarray  # (H + 1, N // 2 + 1) sines of the first half
    moments: np.ndarray  # (N, 4 H + 1) the functions of twice as many harmonics over N: means of products


@jit(**STRICT)
def receptances(
    linear: Linear, omega: float, want: bool, compliance: np.ndarray, by_omega: np.ndarray, driven: np.ndarray,
    driven_by: np.ndarray,
) -> None:  # fmt: skip
    """Fill (H + 1, n_points, n_points) receptances and (H + 1, n_points) driven displacements, and derivatives by ω."""
    poles, residues, of_drive, excitation = linear.poles, linear.residues, linear.driven, linear.excitation
    points = residues.shape[1]
    for h in range(compliance.shape[0]):
        compliance[h] = 0.0
        by_omega[h] = 0.0
        driven[h] = 0.0
        driven_by[h] = 0.0
        for j in range(poles.size):
            near = 1.0 / (1j * h * omega - poles[j])
            change = -1j * h * near * near
            for p in range(points):
                for q in range(points):
                    compliance[h, p, q] += residues[j, p, q] * near
            if want:
                for p in range(points):
                    for q in range(points):
                        by_omega[h, p, q] += residues[j, p, q] * change
            if excitation[h] != 0.0:
                for p in range(points):
                    driven[h, p] += of_drive[j, p] * near * excitation[h]
                    driven_by[h, p] += of_drive[j, p] * change * excitation[h]


@jit(**STRICT)
def reduced(matrices: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Bᵀ M B of matrices (H + 1, n_points, n_points)."""
    points, r = basis.shape
    found = np.zeros((matrices.shape[0], r, r), np.complex128)
    for h in range(matrices.shape[0]):
        for p in range(points):
            for b in range(r):
                total = 0.0j
                for q in range(points):
                    total += matrices[h, p, q] * basis[q, b]
                for a in range(r):
                    found[h, a, b] += basis[p, a] * total
    return found


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
    """Harmonics (n, K) of complex amplitudes (H + 1, n), of which the real part is meant."""
    highest = complex_.shape[0] - 1
    found = np.empty((complex_.shape[1], 2 * highest + 1))
    for p in range(complex_.shape[1]):
        found[p, 0] = complex_[0, p].real
        for h in range(1, highest + 1):
            found[p, 2 * h - 1], found[p, 2 * h] = complex_[h, p].real, -complex_[h, p].imag
    return found


@jit(**STRICT)
def blocks(basis: np.ndarray, owner: np.ndarray, grid: Grid, omega: float, slopes: Slopes) -> np.ndarray:
    """Return (r, r, K, K) derivatives of the forces' harmonics by those of coordinates, 0 between those of two owners.

    ``basis`` (n_points, r) and ``owner`` (r,) are those of `Linear`.
    """
    points, r = basis.shape
    samples, harmonics = grid.basis.shape
    found = np.zeros((r, r, harmonics, harmonics))
    means = np.zeros((2, 2 * harmonics - 1))
    series = np.zeros((2, samples))
    for a in range(r):
        for b in range(a, r):
            if owner[a] != owner[b]:
                continue
            series[:] = 0.0
            block = found[a, b]
            for p in range(points):
                weight = basis[p, a] * basis[p, b]
                if weight == 0.0:
                    continue
                for i in range(samples):
                    series[0, i] += weight * slopes.x[p, i]
                    series[1, i] += weight * slopes.v[p, i]
                if slopes.remembers[p]:
                    for k in range(harmonics):
                        for l in range(harmonics):
                            block[k, l] += weight * slopes.whole[p, k, l]
            np.dot(series, grid.moments, means)
            add_products(means, omega, block)
            if a != b:
                for k in range(harmonics):
                    for l in range(harmonics):
                        found[b, a, k, l] = block[k, l]
    return found


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
        pace = l * omega
        for k in range(highest + 1):
            total, apart = k + l, abs(k - l)
            sign = 1.0 if k >= l else -1.0
            weight = 0.5 if k == 0 else 1.0
            # means over a period, times two, of cos cos, sin sin, sin cos, cos sin of k (row) and l (column)
            cc_x, ss_x = a_x[apart] + a_x[total], a_x[apart] - a_x[total]
            cc_v, ss_v = a_v[apart] + a_v[total], a_v[apart] - a_v[total]
            sc_x, cs_x = b_x[total] + sign * b_x[apart], b_x[total] - sign * b_x[apart]
            sc_v, cs_v = b_v[total] + sign * b_v[apart], b_v[total] - sign * b_v[apart]
            if k == 0 and l == 0:
                block[0, 0] += a_x[0]
            elif k == 0:
                block[0, 2 * l - 1] += weight * (cc_x - pace * cs_v)
                block[0, 2 * l] += weight * (cs_x + pace * cc_v)
            elif l == 0:
                block[2 * k - 1, 0] += cc_x
                block[2 * k, 0] += sc_x
            else:
                block[2 * k - 1, 2 * l - 1] += cc_x - pace * cs_v
                block[2 * k - 1, 2 * l] += cs_x + pace * cc_v
                block[2 * k, 2 * l - 1] += sc_x - pace * ss_v
                block[2 * k, 2 * l] += ss_x + pace * sc_v


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
    mirrored, turned = np.dot(even[:count], grid.even), np.dot(odd[:count], grid.odd)
    place, speed = np.empty((points, n)), np.empty((points, n))
    count = 0
    for p in range(points):
        q = first[p]
        if q < p:
            for i in range(n):
                place[p, i], speed[p, i] = place[q, i], speed[q, i]
            continue
        for i in range(half):
            place[p, i] = mirrored[count, i] + turned[count, i]
            speed[p, i] = mirrored[count + 1, i] + turned[count + 1, i]
        for i in range(half, n):
            place[p, i] = mirrored[count, n - i] - turned[count, n - i]
            speed[p, i] = mirrored[count + 1, n - i] - turned[count + 1, n - i]
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
        acts = False
        for i in range(n):
            acts = acts or samples[p, i] != 0.0
        if not acts:
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
    found = np.zeros((points, 2 * cosines.shape[1] - 1))
    count = 0
    for p in range(points):
        q = first[p]
        if q < 0:
            continue
        if q < p:
            for k in range(found.shape[1]):
                found[p, k] = found[q, k]
            continue
        found[p, 0] = 0.5 * weight * cosines[count, 0]
        for h in range(1, cosines.shape[1]):
            found[p, 2 * h - 1], found[p, 2 * h] = weight * cosines[count, h], weight * sines[count, h]
        count += 1
    return found


@jit(**STRICT)
def balanced(
    linear: Linear, compliance: np.ndarray, driven: np.ndarray, grid: Grid, laws: Laws, slopes: Slopes, omega: float,
    z: np.ndarray, y: np.ndarray, want: bool, jacobian: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Return what z leaves of the balance with the receptances and driven displacements (n_points, K) of a frequency.

    With it forces and the displacements beside B z, and places, speeds and forces at samples. If wanted, the corner of
    ``jacobian`` is filled with the derivative by z.
    """
    x = np.dot(linear.basis, z) + y
    place, speed = motion_over_period(grid, omega, x)
    samples = np.empty_like(place)
    fill_forces(laws, place, speed, omega, grid.basis, grid.rate, grid.project, want, samples, slopes)
    force = projected(grid, samples)
    found = driven.copy()
    times(-1.0, compliance, force, found)
    own = np.dot(linear.basis.T, found)
    beside = found - np.dot(linear.basis, own)
    if want:
        by_coordinates = blocks(linear.basis, linear.owner, grid, omega, slopes)
        add_jacobian(reduced(compliance, linear.basis), by_coordinates, linear.owner, jacobian)
    return z - own, force, beside, place, speed, samples


@jit(**STRICT)
def balance(
    linear: Linear, grid: Grid, laws: Laws, slopes: Slopes, omega: float, z: np.ndarray, y: np.ndarray, want: bool,
    jacobian: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Return what z (r, K) leaves of the balance, forces (n_points, K) and the displacements y beside B z, and B.

    If wanted, the (r K, r K) corner of ``jacobian`` is filled with the derivative by z, its column r K with that by ω
    (1/s), and ``slopes`` changed.
    """
    highest, points = linear.excitation.size - 1, linear.residues.shape[1]
    compliance = np.empty((highest + 1, points, points), np.complex128)
    by_omega = np.empty_like(compliance)
    driven, driven_by = np.empty((highest + 1, points), np.complex128), np.empty((highest + 1, points), np.complex128)
    receptances(linear, omega, want, compliance, by_omega, driven, driven_by)
    left, force, beside, place, speed, samples = balanced(
        linear, compliance, real_harmonics(driven), grid, laws, slopes, omega, z, y, want, jacobian
    )
    if want:
        changed = real_harmonics(driven_by)
        times(-1.0, by_omega, force, changed)
        if np.any(slopes.v != 0.0) or np.any(slopes.remembers):  # else forces know nothing of time
            nearby = omega * (1.0 + 1e-6)
            shifted, faster = np.empty_like(samples), speed * (nearby / omega)
            fill_forces(
                laws, place, faster, nearby, grid.basis, grid.rate, grid.project, np.bool_(False), shifted, slopes
            )
            times(-1.0 / (nearby - omega), compliance, projected(grid, shifted - samples), changed)
        jacobian[: z.size, z.size] = -np.dot(linear.basis.T, changed).ravel()
    return left, force, beside, place
