"""The modal model of FRFs as a separable least-squares problem, and its small, quick solvers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

__all__ = ["ModalFit", "damping_of", "least_squares", "line_weight", "poles_of", "qr"]

UPPER = 2, 4  # powers of s for the modes above the band; a constant stands for those below, and for a moving base
ITERATIONS, CONVERGED = 40, 1e-9  # change of the sum of squares over itself, or of the logarithms
BLOCK = 2048  # numbers in a matrix that is still small for BLAS
QUIETEST = 1e-3  # level over the largest, below which lines get no more weight
SMOOTH = 6  # coefficients of a smooth curve


class ModalFit:
    """The modal model of FRFs as a least-squares problem: linear in the residues, nonlinear in the poles.

    H_o = Σ s² (A_o / (s - p) + A_o* / (s - p*)) + B_o0 + B_o2 s² + B_o4 s⁴, s and p over the highest frequency.
    FRFs under an exponential window of a rate, 1/s, are those at s = jω + rate.
    """

    def __init__(self, frequency: np.ndarray, value: np.ndarray, weight: np.ndarray, rate: float = 0.0) -> None:
        self.s = (rate / (2 * np.pi) + 1j * frequency[:, None]) / frequency[-1]
        self.weight = weight[:, None]
        self.target = self.weighted(value.T)
        """(2 n_f, n_sensors)"""
        self.background = self.weighted(np.hstack([self.s**power for power in (0, *UPPER)]))
        """(2 n_f, 3)"""
        self.chance = 2 * (value.shape[0] + 1) / self.target.size
        """fraction of pure noise that a mode explains: two numbers for each response and two for the pole"""

    def weighted(self, value: np.ndarray) -> np.ndarray:
        """Return (2 n_f, n) real and imaginary parts of columns (n_f, n), weighted."""
        value = self.weight * value
        return np.concatenate((value.real, value.imag))

    def _pairs(self, poles: np.ndarray, ahead: np.ndarray, mirror: np.ndarray) -> np.ndarray:
        """Return (2 n_f, n, 2) columns that the real and the imaginary part of each residue multiply."""
        size = -poles.real * self.s**2  # so that the columns of sharp and of broad modes have about one length
        pairs = np.stack((size * (ahead + mirror), 1j * size * (ahead - mirror)), axis=-1)
        return self.weighted(pairs.reshape(self.s.size, 2 * poles.size)).reshape(2 * self.s.size, poles.size, 2)

    def pairs(self, poles: np.ndarray) -> np.ndarray:
        """Return (2 n_f, n, 2) columns of the poles in the model."""
        return self._pairs(poles, 1 / (self.s - poles), 1 / (self.s - poles.conj()))

    def smooth(self) -> np.ndarray:
        """Return (2 n_f, 2 SMOOTH) polynomials over the band with complex coefficients."""
        place = np.linspace(-1, 1, self.s.size)
        curves = np.polynomial.chebyshev.chebvander(place, SMOOTH - 1)
        return self.weighted(np.hstack((curves, 1j * curves)))

    def basis(self, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the orthonormal basis (2 n_f, 2 n + 3) of the model, and its triangle."""
        model = self.pairs(poles).reshape(self.target.shape[0], 2 * poles.size)
        return qr(np.hstack((model, self.background)))

    def project(self, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return basis and triangle, the target in that basis, and factors (n, 2, n_sensors) of each pole's columns."""
        basis, triangle = self.basis(poles)
        part = basis.T @ self.target
        solution = np.linalg.lstsq(triangle, part, rcond=1e-12)[0]
        return basis, triangle, part, solution[: 2 * poles.size].reshape(poles.size, 2, part.shape[1])

    def residues(self, poles: np.ndarray) -> np.ndarray:
        """Return (n, n_sensors) complex A."""
        *_, pairs = self.project(poles)
        return -poles.real[:, None] * (pairs[:, 0] + 1j * pairs[:, 1])

    def shape_errors(self, poles: np.ndarray, left: np.ndarray) -> np.ndarray:
        """Return (n,) root of the total variance of each pole's residues over their length, by the fit's residual."""
        basis, triangle, _, pairs = self.project(poles)
        inverse = (np.linalg.pinv(triangle, rcond=1e-12)[: 2 * poles.size] @ basis.T).reshape(poles.size, 2, -1)
        variance = np.sum(inverse**2 @ left**2, axis=(1, 2))
        return np.asarray(np.sqrt(variance / np.sum(pairs**2, axis=(1, 2))))

    def explained(self, poles: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the sum of squares that each pole alone explains (n,), and that of the residual."""
        _, triangle, part, pairs = self.project(poles)
        inverse = np.linalg.pinv(triangle, rcond=1e-12)[: 2 * poles.size].reshape(poles.size, 2, -1)
        spread = inverse @ inverse.transpose(0, 2, 1)
        contribution = np.einsum("pio,pij,pjo->p", pairs, np.linalg.pinv(spread, hermitian=True), pairs)
        return contribution, np.sum(self.target**2) - np.sum(part**2)

    def residual(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the residual (2 n_f, n_sensors) of the best residues at the poles of the unknowns, and its slopes.

        The residues are eliminated; slopes with Kaufman's approximation (Golub and Pereyra 2003).
        """
        poles = poles_of(unknowns)
        basis, _, part, coefficients = self.project(poles)
        ahead, mirror = 1 / (self.s - poles) ** 2, 1 / (self.s - poles.conj()) ** 2
        slopes = [
            np.einsum("kpi,pio->pko", self._pairs(poles, rate * ahead, rate.conj() * mirror), coefficients)
            for rate in (poles, -1j * poles * poles.real / poles.imag)  # by ln frequency, by ln damping
        ]
        slope = np.concatenate(slopes)
        return self.target - basis @ part, basis @ (basis.T @ slope) - slope


def line_weight(value: np.ndarray) -> np.ndarray:
    """Return line weights (n_f,) half way between equal and relative: noise is partly in proportion to the response."""
    level = np.sqrt(np.mean(np.abs(value) ** 2, axis=0))
    return np.maximum(level / level.max(), QUIETEST) ** -0.5


def damping_of(poles: np.ndarray) -> np.ndarray:
    """Return the damping ratio of each pole."""
    return -poles.real / np.abs(poles)


def poles_of(unknowns: np.ndarray) -> np.ndarray:
    """Return the poles (n,) out of the logarithms of their frequencies and damping ratios (2 n,)."""
    frequency, damping = np.exp(unknowns).reshape(2, -1)
    return frequency * (-damping + 1j * np.sqrt(1 - damping**2))


def qr(tall: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return QR of a tall matrix by blocks of its rows, and of their triangles.

    As one matrix it is just large enough for BLAS to start threads, which cost several times the work itself.
    """
    rows, columns = tall.shape
    size = max(BLOCK // columns, 2 * columns)
    count = -(-rows // size)
    blocks = np.zeros((count * size, columns))
    blocks[:rows] = tall
    parts, triangles = np.linalg.qr(blocks.reshape(count, size, columns))
    joint, triangle = np.linalg.qr(triangles.reshape(count * columns, columns))
    return (parts @ joint.reshape(count, columns, columns)).reshape(-1, columns)[:rows], triangle


def least_squares(
    residual: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], unknowns: np.ndarray, lower: np.ndarray,
    upper: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return the unknowns of least squares within bounds, by Levenberg and Marquardt.

    The normal equations of the few unknowns cost less than the decomposition of the tall matrix of slopes that
    `scipy.optimize.least_squares` makes at each step.
    """
    value, slope = residual(unknowns)
    damping = 1e-3
    for _ in range(ITERATIONS):
        normal = np.einsum("pko,qko->pq", slope, slope)
        normal[np.diag_indices_from(normal)] *= 1 + damping
        step = np.linalg.lstsq(normal, -np.einsum("pko,ko->p", slope, value), rcond=None)[0]
        candidate = np.clip(unknowns + step, lower, upper)
        new_value, new_slope = residual(candidate)
        square = np.sum(value**2)
        gain = square - np.sum(new_value**2)
        damping = damping / 10 if gain > 0 else damping * 10
        converged = abs(gain) <= CONVERGED * square or np.max(np.abs(candidate - unknowns)) <= CONVERGED
        if gain > 0:
            unknowns, value, slope = candidate, new_value, new_slope
        if converged:
            break
    return unknowns
