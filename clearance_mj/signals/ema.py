"""Natural frequencies, damping and shapes from FRFs.

Poles come from the least-squares complex frequency method (LSCF) over many model orders. Those that stay from order
to order are weighed against each other in a fit of the FRFs; the best are refined, together with the shapes, by
least squares on the FRFs themselves. Peaks so noisy that LSCF misses them are then looked for in the residual.

Guillaume, Verboven, Vanlanduit, Van der Auweraer and Peeters, A poly-reference implementation of the least-squares
complex frequency-domain estimator, IMAC 21, 2003; Cauberghe, Guillaume, Verboven, Vanlanduit and Parloo, On the
influence of the parameter constraint on the stability of the poles and the discrimination capabilities of the
stabilisation diagrams, Mechanical Systems and Signal Processing 19, 2005; Golub and Pereyra, Separable nonlinear
least squares: the variable projection method and its applications, Inverse Problems 19, 2003.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.ndimage

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..core.overview import HasOverview, Overview, few
from . import labelled
from .arrays import ArrayData, read_only
from .frf import FRF
from .modal_fit import ModalFit, damping_of, least_squares, line_weight, poles_of, qr
from .quantities import require_quantity

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Modes", "extract_modes", "refitted_modes"]

MIN_ORDER = 5
LINES_PER_ORDER = 3
MIN_LINES = LINES_PER_ORDER * (MIN_ORDER + 1)
CIRCLE = 0.9  # fraction of the unit circle that the band covers; the rest takes up the jump from its end to its start
RIDGE = 1e-12
LARGEST_DAMPING = 0.3  # what is broader is background
STABLE = 0.01, 0.2  # largest change of the logarithms of frequency and damping from one order to the next
SAME_MODE = 0.015, 0.5  # the same, between the poles of one mode
REACH = 0.05, 1.6  # the same, from a candidate to the refined pole
PERSISTENT = 0.1  # least fraction of the orders in which a mode shows
SIGNIFICANT = 10.0  # least ratio of the energy that a mode explains to what it would explain of noise
VISIBLE = 1e-3  # least fraction of the FRFs' energy that a mode which LSCF missed explains


AROUND = 21  # lines over which noise is averaged
SCAN_LINES, SCAN_DAMPING = 100, (0.01, 0.03, 0.1, 0.2)


@dataclass(frozen=True, eq=False, repr=False)
class Modes(HasOverview, ArrayData):
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
        super().__post_init__()
        self._set(shape=read_only(self.shape, complex))

    def _overview(self) -> Overview:
        rows = [(str(i), f"{f:.4g}", f"{100 * d:.3g}") for i, (f, d) in enumerate(zip(self.frequency, self.damping), 1)]
        table = [("mode", "frequency (Hz)", "damping (%)"), *rows] if rows else ()
        return Overview(f"Modes: {len(rows)}", {"responses": few(self.responses)}, table)

    def to_xarray(self) -> xr.Dataset:
        """Return ``natural_frequency``, ``damping`` (mode,) and ``shape`` (response, mode), with labels and units."""
        variables = {
            "natural_frequency": ("mode", self.frequency, "Hz"), "damping": ("mode", self.damping, "1"),
            "shape": (("response", "mode"), self.shape, "1"),
        }  # fmt: skip
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


@checks_kinds
def extract_modes(frf: FRF, n_modes: int = 4, band: tuple[float, float] | None = None, max_order: int = 40) -> Modes:
    """Extract the modes that show most in FRFs whose responses are accelerations.

    Parameters
    ----------
    frf : FRF
        Accelerations over base acceleration, H = 1 + ω² Σ ..., or over force: both are s² times a sum over modes,
        plus the part of modes outside the band and of the motion of the base. Of several references, each pair of
        response and reference is a row of the shapes. The damping of their exponential window is taken out.
    n_modes : int
        Largest number of modes to return; fewer come back if fewer stand out of the noise, none from noise alone.
    band : (float, float), optional
        Lines to use, Hz; all if left out.
    max_order : int
        Highest order of the common denominator; a third of the number of lines if that is lower.

    Raises
    ------
    RecordError
        If the quantity is unknown, a line is not finite, the band holds too few lines, or a number is impossible.
    """
    require_quantity(frf)
    frf = frf.within(band) if band else frf
    max_order = _usable_order(frf, n_modes, max_order)
    value = frf.functions
    fit = ModalFit(frf.frequency, value, line_weight(value), frf.window_rate)

    candidates, persistence = _cluster(_stable_poles(frf, value, max_order), max_order - MIN_ORDER)
    poles = _refine(fit, _strongest(fit, candidates, persistence, n_modes))
    return _modes(frf, fit, _with_noisy(fit, poles, n_modes))


def refitted_modes(frf: FRF, modes: Modes) -> Modes:
    """Return modes whose poles and shapes fit FRFs best, near those that are given.

    Parameters
    ----------
    frf : FRF
        Their FRFs.
    modes : Modes
        Start of the fit.
    """
    value = frf.functions
    fit = ModalFit(frf.frequency, value, line_weight(value), frf.window_rate)
    poles = poles_of(np.log(np.concatenate((modes.frequency / frf.frequency[-1], modes.damping))))
    return _modes(frf, fit, _refine(fit, poles))


def _modes(frf: FRF, fit: ModalFit, poles: np.ndarray) -> Modes:
    """Return the modes of poles, with the shapes that fit best."""
    poles = poles[np.argsort(np.abs(poles))]
    shape = fit.residues(poles).T
    largest = np.argmax(np.abs(shape), axis=0)
    shape = shape / np.take_along_axis(shape, largest[None], axis=0)
    return Modes(np.abs(poles) * frf.frequency[-1], damping_of(poles), shape, frf.labels)


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
        raise RecordError(f"modes need at least {MIN_LINES} lines, the band holds {frf.frequency.size}")
    return order


def _near(a: np.ndarray, b: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Return (len(a), len(b)) True where the logarithms of frequency and damping differ by no more than the limits."""
    frequency = np.abs(np.log(np.abs(a)[:, None] / np.abs(b)))
    damping = np.abs(np.log(damping_of(a)[:, None] / damping_of(b)))
    return (frequency < limits[0]) & (damping < limits[1])


def _stable_poles(frf: FRF, value: np.ndarray, max_order: int) -> np.ndarray:
    """Return the poles that stay from one order of the denominator to the next, over the band's highest frequency.

    LSCF: Σ |N_o(z) - H_o D(z)|² is least over the numerators N_o and the denominator D, polynomials in z with
    complex coefficients; the band is spread over the unit circle, where the powers of z are nearly orthogonal.
    """
    first, last = frf.frequency[0], frf.frequency[-1]
    angle = 2 * np.pi * CIRCLE * (frf.frequency - first) / (last - first)
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
        poles = (turns * (last - first) + 1j * first + frf.window_rate / (2 * np.pi)) / last
        damping, frequency = damping_of(poles), np.abs(poles)
        poles = poles[(damping > 0) & (damping < LARGEST_DAMPING) & (frequency >= first / last) & (frequency <= 1)]
        stable.append(poles[_near(poles, previous, STABLE).any(axis=1)])
        previous = poles
    return np.concatenate(stable)


def _denominator_roots(normal: np.ndarray) -> np.ndarray:
    """Return the roots of the denominator with the least residual.

    Its lowest coefficient is 1: the roots that only fit noise then lie outside the unit circle (Cauberghe 2005).
    """
    coefficients = np.linalg.lstsq(normal[1:, 1:], -normal[1:, 0], rcond=1e-13)[0]
    return np.roots(np.append(coefficients[::-1], 1))


def _cluster(poles: np.ndarray, orders: int) -> tuple[np.ndarray, np.ndarray]:
    """Return one pole for each group of like poles, and the fraction of orders in which it shows; fullest first."""
    centres, fractions = [], []
    while poles.size:
        is_near = _near(poles, poles, SAME_MODE)
        members = is_near[np.argmax(is_near.sum(axis=1))]
        if members.sum() < PERSISTENT * orders:
            break
        centres.append(np.median(poles[members].real) + 1j * np.median(poles[members].imag))
        fractions.append(members.sum() / orders)
        poles = poles[~members]
    return np.array(centres, dtype=complex), np.array(fractions)


def _strongest(fit: ModalFit, poles: np.ndarray, persistence: np.ndarray, n_modes: int) -> np.ndarray:
    """Return at most n_modes significant poles; those that explain and persist least are left out one by one."""
    while poles.size:
        explained, residual = fit.explained(poles)
        weakest = np.argmin(explained * persistence)
        if poles.size <= n_modes and explained[weakest] > SIGNIFICANT * fit.chance * residual:
            break
        poles, persistence = np.delete(poles, weakest), np.delete(persistence, weakest)
    return poles


def _refine(fit: ModalFit, poles: np.ndarray) -> np.ndarray:
    """Return the poles near given ones of least residual; those that broaden to background are left out."""
    if not poles.size:
        return poles
    start = np.log(np.concatenate((np.abs(poles), damping_of(poles))))
    reach = np.repeat(REACH, poles.size)
    upper = start + reach
    upper[poles.size :] = np.minimum(upper[poles.size :], np.log(1.1 * LARGEST_DAMPING))
    refined = poles_of(least_squares(fit.residual, start, start - reach, upper))
    is_mode = damping_of(refined) < LARGEST_DAMPING
    return refined if is_mode.all() else _refine(fit, refined[is_mode])


def _with_noisy(fit: ModalFit, poles: np.ndarray, n_modes: int) -> np.ndarray:
    """Return the poles and those that noise hid from LSCF, one by one where they explain most of the residual.

    Noise biases the denominator's coefficients, so that a noisy pole ends up unstable and is lost. What a smooth
    curve explains is no mode, nor is what noise as strong as that around the peak would explain.
    """
    if poles.size >= n_modes:
        return poles
    lines = np.abs(fit.s[:: -(-fit.s.size // SCAN_LINES), 0])
    frequency, damping = (grid.ravel() for grid in np.meshgrid(lines[1:-1], SCAN_DAMPING))
    scan = poles_of(np.log(np.concatenate((frequency, damping))))
    basis, _ = qr(np.hstack((fit.basis(poles)[0], fit.smooth())))
    residual = fit.target - basis @ (basis.T @ fit.target)
    columns = fit.pairs(scan)
    columns -= np.einsum("kb,bpi->kpi", basis, np.einsum("kb,kpi->bpi", basis, columns))
    axes = np.linalg.qr(columns.transpose(1, 0, 2))[0]
    explained = np.sum((axes.transpose(0, 2, 1) @ residual) ** 2, axis=(1, 2))
    power = np.sum(residual**2, axis=1).reshape(2, -1)
    around = scipy.ndimage.uniform_filter1d(power.mean(axis=0), AROUND)
    by_chance = np.sum(axes**2, axis=2) @ np.tile(around, 2)
    best = np.argmax(explained)
    if explained[best] < max(SIGNIFICANT * by_chance[best], VISIBLE * np.sum(fit.target**2)):
        return poles
    extended = _refine(fit, np.append(poles, scan[best]))
    return _with_noisy(fit, extended, n_modes) if extended.size > poles.size else poles
