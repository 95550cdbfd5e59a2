"""Natural frequencies, damping and shapes out of FRFs.

Poles come from the least-squares complex frequency method (LSCF) over many model orders. Those that stay from order
to order are weighed against each other in a fit of the FRFs; the best are refined, together with the shapes, by
least squares on the FRFs themselves. Peaks so noisy that LSCF misses them are then looked for in what is left.

Guillaume, Verboven, Vanlanduit, Van der Auweraer and Peeters, A poly-reference implementation of the least-squares
complex frequency-domain estimator, IMAC 21, 2003; Cauberghe, Guillaume, Verboven, Vanlanduit and Parloo, On the
influence of the parameter constraint on the stability of the poles and the discrimination capabilities of the
stabilisation diagrams, Mechanical Systems and Signal Processing 19, 2005; Golub and Pereyra, Separable nonlinear
least squares: the variable projection method and its applications, Inverse Problems 19, 2003.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.ndimage

from ..errors import RecordError
from . import _labelled as labelled
from .arrays import ArrayData, read_only
from .frf import FRF

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Modes", "extract_modes"]

MIN_ORDER = 5
LINES_PER_ORDER = 3
LEAST_LINES = LINES_PER_ORDER * (MIN_ORDER + 1)
CIRCLE = 0.9  # share of the unit circle that the band covers; the rest takes up the jump from its end to its start
RIDGE = 1e-12
QUIETEST = 1e-3  # level over the largest, below which lines get no more weight
LARGEST_DAMPING = 0.3  # what is broader is background
STABLE = 0.01, 0.2  # largest change of the logarithms of frequency and damping from one order to the next
ALIKE = 0.015, 0.5  # the same, between the poles of one mode
REACH = 0.05, 1.6  # the same, from a candidate to the refined pole
PERSISTENT = 0.1  # least share of the orders in which a mode shows
SIGNIFICANT = 10.0  # least ratio of what a mode explains to what it would explain of noise
VISIBLE = 1e-3  # least share of the FRFs' energy that a mode which LSCF missed explains
UPPER = 2, 4  # powers of s for the modes above the band; a constant stands for those below, and for a moving base
ITERATIONS, CONVERGED = 40, 1e-9  # change of the sum of squares over itself, or of the logarithms
SMOOTH, AROUND = 6, 21  # coefficients of a smooth curve; lines over which noise is averaged
BLOCK = 2048  # numbers in a matrix that is still small for BLAS
SCAN_LINES, SCAN_DAMPING = 100, (0.01, 0.03, 0.1, 0.2)


@dataclass(frozen=True, eq=False, repr=False)
class Modes(ArrayData):
    """Natural frequencies in rising order, with damping and shapes as columns."""

    frequency: np.ndarray
    """(n,) undamped natural frequencies, Hz"""
    damping: np.ndarray
    """(n,) ratio to critical damping"""
    shape: np.ndarray
    """(n_dof, n) complex; the largest component of each is 1"""
    responses: tuple[str, ...] = ()
    """degree of freedom of each row of the shapes, such as "3:+Z" """

    def __post_init__(self) -> None:
        self._set(
            frequency=read_only(self.frequency), damping=read_only(self.damping), shape=read_only(self.shape, complex)
        )

    def to_xarray(self) -> xr.Dataset:
        """Return ``natural_frequency``, ``damping`` (mode,) and ``shape`` (response, mode), with labels and units."""
        variables = {
            "natural_frequency": ("mode", self.frequency, "Hz"),
            "damping": ("mode", self.damping, "1"),
            "shape": (("response", "mode"), self.shape, "1"),
        }
        return labelled.dataset("modes", variables, {"response": self.responses})

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Modes:
        """Return the modes of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "modes")
        shape = labelled.values(ds, "shape", "response", "mode", dtype=complex)
        responses = labelled.labels(ds, "response") if "response" in ds.coords else ()
        frequency, damping = (labelled.values(ds, name, "mode") for name in ("natural_frequency", "damping"))
        return cls(frequency, damping, shape, responses)


NO_MODES = Modes(np.empty(0), np.empty(0), np.empty((0, 0)))


def extract_modes(frf: FRF, n_modes: int = 4, band: tuple[float, float] | None = None, max_order: int = 40) -> Modes:
    """Extract the modes that show most in FRFs whose responses are accelerations.

    Parameters
    ----------
    frf : FRF
        Accelerations over base acceleration, H = 1 + ω² Σ ..., or over force: both are s² times a sum over modes,
        plus what the modes outside the band and the motion of the base leave. Of several references, each pair of
        response and reference is a row of the shapes.
    n_modes : int
        Most modes to return; fewer come back if fewer stand out of the noise, none from noise alone.
    band : (float, float), optional
        Lines to use, Hz; all if left out.
    max_order : int
        Highest order of the common denominator; a third of the number of lines if that is lower.

    Raises
    ------
    RecordError
        If a line is not finite, the band holds too few lines, or a number is impossible.
    """
    frf = frf.within(band) if band else frf
    max_order = _usable_order(frf, n_modes, max_order)
    value = frf.functions
    level = np.sqrt(np.mean(np.abs(value) ** 2, axis=0))
    # Half way between equal and relative weights: the noise of a test is partly in proportion to the response.
    fit = _Fit(frf.frequency, value, np.maximum(level / level.max(), QUIETEST) ** -0.5)

    candidates, persistence = _cluster(_stable_poles(frf.frequency, value, max_order), max_order - MIN_ORDER)
    poles = _refine(fit, _strongest(fit, candidates, persistence, n_modes))
    poles = _with_noisy(fit, poles, n_modes)

    poles = poles[np.argsort(np.abs(poles))]
    shape = fit.residues(poles).T
    largest = np.argmax(np.abs(shape), axis=0)
    shape = shape / np.take_along_axis(shape, largest[None], axis=0)
    return Modes(np.abs(poles) * frf.frequency[-1], _damping(poles), shape, frf.labels)


def _usable_order(frf: FRF, n_modes: int, max_order: int) -> int:
    """Return the highest order the lines allow, or refuse the FRFs."""
    if n_modes < 1 or max_order <= MIN_ORDER:
        raise RecordError(f"n_modes must be >= 1 and max_order > {MIN_ORDER}, got {n_modes!r} and {max_order!r}")
    finite = np.isfinite(frf.functions).all(axis=0)
    if not finite.all():
        raise RecordError(f"the FRF is not finite at {frf.frequency[np.argmin(finite)]:g} Hz")
    if not np.any(frf.functions):
        raise RecordError("the FRF is zero at every line")
    order = min(max_order, frf.frequency.size // LINES_PER_ORDER)
    if order <= MIN_ORDER:
        raise RecordError(f"modes need at least {LEAST_LINES} lines, the band holds {frf.frequency.size}")
    return order


def _damping(poles: np.ndarray) -> np.ndarray:
    return -poles.real / np.abs(poles)


def _near(a: np.ndarray, b: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """(len(a), len(b)) whether the logarithms of frequency and damping differ by no more than the limits."""
    frequency = np.abs(np.log(np.abs(a)[:, None] / np.abs(b)))
    damping = np.abs(np.log(_damping(a)[:, None] / _damping(b)))
    return (frequency < limits[0]) & (damping < limits[1])


def _stable_poles(frequency: np.ndarray, value: np.ndarray, max_order: int) -> np.ndarray:
    """Poles that stay from one order of the common denominator to the next, over the highest frequency of the band.

    LSCF: Σ |N_o(z) - H_o D(z)|² is least over the numerators N_o and the denominator D, polynomials in z with
    complex coefficients; the band is spread over the unit circle, where the powers of z are nearly orthogonal.
    """
    first, last = frequency[0], frequency[-1]
    angle = 2 * np.pi * CIRCLE * (frequency - first) / (last - first)
    turning = np.exp(1j * np.outer(angle, np.arange(-max_order, max_order + 1)))
    # Products of two powers of z depend on the difference of the powers alone. (einsum: BLAS would start threads)
    factors = np.vstack((np.ones(angle.size), np.sum(np.abs(value) ** 2, axis=0), value))
    sums = np.einsum("of,fd->od", factors, turning)
    powers = np.arange(max_order + 1)
    numerator, denominator, *mixed = sums[:, powers - powers[:, None] + max_order]
    # The numerators are eliminated by Cholesky, whose leading rows do so for every lower order; what is added keeps
    # a very high order positive definite.
    numerator += RIDGE * numerator[0, 0] * np.eye(max_order + 1)
    rows = np.linalg.solve(np.linalg.cholesky(numerator), np.array(mixed)).transpose(1, 0, 2)
    normal = denominator - np.cumsum(rows.conj().transpose(0, 2, 1) @ rows, axis=0)

    stable, previous = [], np.empty(0, dtype=complex)
    for order in range(MIN_ORDER, max_order + 1):
        roots = _denominator_roots(normal[order, : order + 1, : order + 1])
        turns = (np.log(np.abs(roots)) + 1j * np.mod(np.angle(roots), 2 * np.pi)) / (2 * np.pi * CIRCLE)
        poles = (turns * (last - first) + 1j * first) / last
        damping, frequency = _damping(poles), np.abs(poles)
        poles = poles[(damping > 0) & (damping < LARGEST_DAMPING) & (frequency >= first / last) & (frequency <= 1)]
        stable.append(poles[_near(poles, previous, STABLE).any(axis=1)])
        previous = poles
    return np.concatenate(stable)


def _denominator_roots(normal: np.ndarray) -> np.ndarray:
    """Roots of the denominator with the least residual.

    Its lowest coefficient is 1: the roots that only fit noise then lie outside the unit circle (Cauberghe 2005).
    """
    rest = np.linalg.lstsq(normal[1:, 1:], -normal[1:, 0], rcond=1e-13)[0]
    return np.roots(np.append(rest[::-1], 1))


def _cluster(poles: np.ndarray, orders: int) -> tuple[np.ndarray, np.ndarray]:
    """One pole for each group of like poles, and the share of the orders in which the group shows; fullest first."""
    centres, shares = [], []
    while poles.size:
        near = _near(poles, poles, ALIKE)
        members = near[np.argmax(near.sum(axis=1))]
        if members.sum() < PERSISTENT * orders:
            break
        centres.append(np.median(poles[members].real) + 1j * np.median(poles[members].imag))
        shares.append(members.sum() / orders)
        poles = poles[~members]
    return np.array(centres, dtype=complex), np.array(shares)


class _Fit:
    """The modal model of FRFs as a least-squares problem: linear in the residues, nonlinear in the poles.

    H_o = Σ s² (A_o / (s - p) + A_o* / (s - p*)) + B_o0 + B_o2 s² + B_o4 s⁴, s and p over the highest frequency.
    """

    def __init__(self, frequency: np.ndarray, value: np.ndarray, weight: np.ndarray) -> None:
        self.s = 1j * frequency[:, None] / frequency[-1]
        self.weight = weight[:, None]
        self.target = self._real(value.T)
        """(2 n_f, n_sensors)"""
        self.background = self._real(np.hstack([self.s**power for power in (0, *UPPER)]))
        """(2 n_f, 3)"""
        self.chance = 2 * (value.shape[0] + 1) / self.target.size
        """share of pure noise that a mode explains: two numbers for each response and two for the pole"""

    def _real(self, value: np.ndarray) -> np.ndarray:
        value = self.weight * value
        return np.concatenate((value.real, value.imag))

    def _pairs(self, poles: np.ndarray, ahead: np.ndarray, mirror: np.ndarray) -> np.ndarray:
        """(2 n_f, n, 2) columns that the real and the imaginary part of each residue multiply."""
        size = -poles.real * self.s**2  # so that the columns of sharp and of broad modes are alike in length
        pairs = np.stack((size * (ahead + mirror), 1j * size * (ahead - mirror)), axis=-1)
        return self._real(pairs.reshape(self.s.size, 2 * poles.size)).reshape(2 * self.s.size, poles.size, 2)

    def pairs(self, poles: np.ndarray) -> np.ndarray:
        """(2 n_f, n, 2) columns of the poles in the model."""
        return self._pairs(poles, 1 / (self.s - poles), 1 / (self.s - poles.conj()))

    def smooth(self) -> np.ndarray:
        """(2 n_f, 2 SMOOTH) polynomials over the band with complex coefficients."""
        place = np.linspace(-1, 1, self.s.size)
        curves = np.polynomial.chebyshev.chebvander(place, SMOOTH - 1)
        return self._real(np.hstack((curves, 1j * curves)))

    def project(self, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Orthonormal basis (2 n_f, 2 n + 3) of the model, its triangle, and the target in that basis."""
        model = self.pairs(poles).reshape(self.target.shape[0], 2 * poles.size)
        basis, triangle = _qr(np.hstack((model, self.background)))
        return basis, triangle, basis.T @ self.target

    def coefficients(self, poles: np.ndarray, triangle: np.ndarray, part: np.ndarray) -> np.ndarray:
        """(n, 2, n_sensors) what the columns of each pole are multiplied by."""
        solution = np.linalg.lstsq(triangle, part, rcond=1e-12)[0]
        return solution[: 2 * poles.size].reshape(poles.size, 2, part.shape[1])

    def residues(self, poles: np.ndarray) -> np.ndarray:
        """(n, n_sensors) complex A."""
        _, triangle, part = self.project(poles)
        pairs = self.coefficients(poles, triangle, part)
        return -poles.real[:, None] * (pairs[:, 0] + 1j * pairs[:, 1])

    def explained(self, poles: np.ndarray) -> tuple[np.ndarray, float]:
        """What each pole takes out of the residual that no other does (n,), and the residual, as sums of squares."""
        _, triangle, part = self.project(poles)
        pairs = self.coefficients(poles, triangle, part)
        inverse = np.linalg.pinv(triangle, rcond=1e-12)[: 2 * poles.size].reshape(poles.size, 2, -1)
        spread = inverse @ inverse.transpose(0, 2, 1)
        own = np.einsum("pio,pij,pjo->p", pairs, np.linalg.pinv(spread, hermitian=True), pairs)
        return own, np.sum(self.target**2) - np.sum(part**2)

    def residual(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the best residues leave (2 n_f, n_sensors) at the poles of the unknowns, and its slopes (2 n, ...).

        The residues are eliminated; slopes with Kaufman's approximation (Golub and Pereyra 2003).
        """
        poles = _poles(unknowns)
        basis, triangle, part = self.project(poles)
        coefficients = self.coefficients(poles, triangle, part)
        ahead, mirror = 1 / (self.s - poles) ** 2, 1 / (self.s - poles.conj()) ** 2
        slopes = [
            np.einsum("kpi,pio->pko", self._pairs(poles, rate * ahead, rate.conj() * mirror), coefficients)
            for rate in (poles, -1j * poles * poles.real / poles.imag)  # by ln frequency, by ln damping
        ]
        slope = np.concatenate(slopes)
        return self.target - basis @ part, basis @ (basis.T @ slope) - slope


def _qr(tall: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """QR of a tall matrix by blocks of its rows, and of their triangles.

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


def _poles(unknowns: np.ndarray) -> np.ndarray:
    """Poles (n,) out of the logarithms of their frequencies and damping ratios (2 n,)."""
    frequency, damping = np.exp(unknowns).reshape(2, -1)
    return frequency * (-damping + 1j * np.sqrt(1 - damping**2))


def _strongest(fit: _Fit, poles: np.ndarray, persistence: np.ndarray, n_modes: int) -> np.ndarray:
    """Leave out the pole that explains and persists least, until at most n_modes are left and all are significant."""
    while poles.size:
        own, residual = fit.explained(poles)
        weakest = np.argmin(own * persistence)
        if poles.size <= n_modes and own[weakest] > SIGNIFICANT * fit.chance * residual:
            break
        poles, persistence = np.delete(poles, weakest), np.delete(persistence, weakest)
    return poles


def _refine(fit: _Fit, poles: np.ndarray) -> np.ndarray:
    """Poles near the given ones at which the residual is least; those that broaden to background are left out."""
    if not poles.size:
        return poles
    start = np.log(np.concatenate((np.abs(poles), _damping(poles))))
    reach = np.repeat(REACH, poles.size)
    upper = start + reach
    upper[poles.size :] = np.minimum(upper[poles.size :], np.log(1.1 * LARGEST_DAMPING))
    refined = _poles(_least_squares(fit.residual, start, start - reach, upper))
    modes = _damping(refined) < LARGEST_DAMPING
    return refined if modes.all() else _refine(fit, refined[modes])


def _least_squares(
    residual: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    unknowns: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
) -> np.ndarray:
    """Levenberg and Marquardt within bounds.

    The normal equations of the few unknowns cost less than the decomposition of the tall matrix of slopes that
    `scipy.optimize.least_squares` makes at each step.
    """
    value, slope = residual(unknowns)
    caution = 1e-3
    for _ in range(ITERATIONS):
        normal = np.einsum("pko,qko->pq", slope, slope)
        normal[np.diag_indices_from(normal)] *= 1 + caution
        step = np.linalg.lstsq(normal, -np.einsum("pko,ko->p", slope, value), rcond=None)[0]
        trial = np.clip(unknowns + step, lower, upper)
        new_value, new_slope = residual(trial)
        square = np.sum(value**2)
        gain = square - np.sum(new_value**2)
        caution = caution / 10 if gain > 0 else caution * 10
        converged = abs(gain) <= CONVERGED * square or np.max(np.abs(trial - unknowns)) <= CONVERGED
        if gain > 0:
            unknowns, value, slope = trial, new_value, new_slope
        if converged:
            break
    return unknowns


def _with_noisy(fit: _Fit, poles: np.ndarray, n_modes: int) -> np.ndarray:
    """Add the modes whose noise hid them from LSCF, one by one where they explain most of what is left.

    Noise biases the denominator's coefficients, so that a noisy pole ends up unstable and is lost. What a smooth
    curve explains is no mode, nor is what noise as strong as that around the peak would explain.
    """
    if poles.size >= n_modes:
        return poles
    lines = np.abs(fit.s[:: -(-fit.s.size // SCAN_LINES), 0])
    frequency, damping = (grid.ravel() for grid in np.meshgrid(lines[1:-1], SCAN_DAMPING))
    scan = _poles(np.log(np.concatenate((frequency, damping))))
    basis, _ = _qr(np.hstack((fit.project(poles)[0], fit.smooth())))
    left = fit.target - basis @ (basis.T @ fit.target)
    columns = fit.pairs(scan)
    columns -= np.einsum("kb,bpi->kpi", basis, np.einsum("kb,kpi->bpi", basis, columns))
    axes = np.linalg.qr(columns.transpose(1, 0, 2))[0]
    explained = np.sum((axes.transpose(0, 2, 1) @ left) ** 2, axis=(1, 2))
    power = np.sum(left**2, axis=1).reshape(2, -1)
    around = scipy.ndimage.uniform_filter1d(power.mean(axis=0), AROUND)
    by_chance = np.sum(axes**2, axis=2) @ np.tile(around, 2)
    best = np.argmax(explained)
    if explained[best] < max(SIGNIFICANT * by_chance[best], VISIBLE * np.sum(fit.target**2)):
        return poles
    more = _refine(fit, np.append(poles, scan[best]))
    return _with_noisy(fit, more, n_modes) if more.size > poles.size else poles
