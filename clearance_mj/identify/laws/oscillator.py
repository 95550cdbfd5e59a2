"""Stiffness and damping of an oscillator from its free decay, where both may vary in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from ...core.errors import RecordError
from ...signals.arrays import runs
from ...signals.wavelet import Ridge, ridge

__all__ = ["SdofResult", "sdof"]

CORRECTIONS = ("adiabatic", "none")
DAMPINGS = ("viscous", "as-printed")
HOP = 3.5  # σ_t from point to point of the smoothing: the ridge's noise forgets within √(4π) σ_t
POINTS = 8  # at least, in a stretch
NARROWEST, GROWTH = 2.5, 1.4  # smallest bandwidth of the smoothing, in points, and ratio of the next ones


@dataclass(frozen=True, eq=False)
class SdofResult:
    """Stiffness and damping of one degree of freedom from instant to instant."""

    time: np.ndarray  #: (n_t,) s
    k: np.ndarray  #: (n_t,) N/m; nan where not valid
    c: np.ndarray  #: (n_t,) N s/m; nan where not valid
    valid: np.ndarray  #: (n_t,) bool: where the ridge is, in a stretch long enough to smooth
    k_error: np.ndarray  #: (n_t,) standard error of k by the scatter of the record, N/m; nan where not valid
    c_error: np.ndarray  #: (n_t,) standard error of c, N s/m; nan where not valid


def sdof(
    signal: ArrayLike, fs: float, mass: float, band: tuple[float, float], correction: str = "adiabatic",
    damping: str = "viscous", omega0: float = 5.0,
) -> SdofResult:  # fmt: skip
    """Identify k(t) and c(t) of m x'' + c x' + k x = 0 from a free decay.

    Parameters
    ----------
    signal : array_like
        (n_t,) displacement, any unit.
    fs : float
        Samples per second.
    mass : float
        Constant mass, kg.
    band : (float, float)
        Hz; the band of the oscillation.
    correction : {"adiabatic", "none"}
        c = 2m (-A'/A - ω'/(2ω)) and k = m (ω² + (c/2m)²), for parameters that vary; or c = -2m A'/A (Eq. 12) and
        k = m ω² (Eq. 14), for constant ones with little damping.
    damping : {"viscous", "as-printed"}
        c = 2mωζ; or the real part of Eq. 17, 4mωζ, which is twice the damping.
    omega0 : float
        Centre of the Morlet wavelet, rad, at least 4.

    Raises
    ------
    RecordError
        If there is no ridge (see `clearance_mj.identify.ridge`), if no stretch of it is long enough, or an argument
        is impossible.

    Notes
    -----
    x = A cos φ with ω = φ' has (ω A²)' = -(c/m) ω A² if ω changes little in a period (adiabatic invariance). Phase and
    ln A are smoothed by local polynomials, over a bandwidth that cross-validation takes from the data.
    """
    check_options(correction, damping)
    RecordError.require_positive(" kg", mass=mass)
    track = ridge(signal, fs, band, omega0)
    values = np.full((4, track.time.size), np.nan)
    for part in (slice(*run) for run in runs(track.valid)):
        if _points(track, part).size >= POINTS:
            values[:, part] = _parameters(track, part, mass, correction)
    k, c, k_error, c_error = values
    valid = np.isfinite(k)
    if not valid.any():
        raise RecordError(f"no stretch of the ridge between {band[0]:g} and {band[1]:g} Hz is long enough to smooth")
    factor = 2 if damping == "as-printed" else 1
    return SdofResult(track.time, k, factor * c, valid, k_error, factor * c_error)


def check_options(correction: str, damping: str) -> None:
    """Refuse readings of Eqs 12 and 17 that are not known."""
    RecordError.require_known("correction", correction, CORRECTIONS)
    RecordError.require_known("damping", damping, DAMPINGS)


def _points(track: Ridge, part: slice) -> np.ndarray:
    """Samples at which the noise of the ridge is nearly independent."""
    hop = max(1, int(HOP * np.median(track.spread[part]) / track.time[1]))
    remainder = (part.stop - part.start - 1) % hop
    return np.arange(part.start + remainder // 2, part.stop, hop)


def _parameters(track: Ridge, part: slice, mass: float, correction: str) -> np.ndarray:
    """k, c and their standard errors (4, n) over one stretch of a ridge."""
    points = _points(track, part)
    time, level = track.time[points], np.log(track.amplitude[points])
    weight = np.exp(2 * np.polynomial.Polynomial.fit(time, level, 2)(time))  # the noise of phase and ln A goes as 1/A
    omega, omega_error = _slope(time, track.phase[points], weight, 3)
    if correction == "adiabatic":
        level = level + np.log(omega) / 2
    growth, growth_error = _slope(time, level, weight, 2)
    k = mass * (omega**2 + growth**2) if correction == "adiabatic" else mass * omega**2
    values = k, -2 * mass * growth, 2 * mass * omega * omega_error, 2 * mass * growth_error
    return CubicSpline(time, values, axis=1)(track.time[part])


def _slope(time: np.ndarray, value: np.ndarray, weight: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of local polynomials and its standard error, (n,) each.

    Of the bandwidths that predict points left out best, the widest is taken.
    """
    count = int(np.log(time.size / NARROWEST) / np.log(GROWTH)) + 1
    polynomial = np.polynomial.Polynomial.fit(time, value, degree)
    deviation, step = value - polynomial(time), time[1] - time[0]
    fits = [local_polynomials(deviation, weight, NARROWEST * GROWTH**i, degree) for i in range(count)]
    best = min((fit[0] for fit in fits), key=np.mean)
    _, slope, error = [fit for fit in fits if _no_worse(fit[0], best)][-1]
    return polynomial.deriv()(time) + slope / step, error / step


def _no_worse(error: np.ndarray, best: np.ndarray) -> bool:
    """Return True if errors (n,) are not worse than the best with 95 % confidence.

    With so few points the smallest average is one by chance, and often of too narrow a bandwidth.
    """
    excess = error - best
    return excess.mean() <= 1.645 * excess.std() / np.sqrt(error.size)


def local_polynomials(
    value: np.ndarray, weight: np.ndarray, bandwidth: float, degree: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the squared errors of leaving one out, slope per point and its standard error, (n,) each.

    Local polynomials with Gaussian weights: Fan and Gijbels, Local Polynomial Modelling and Its Applications, 1996,
    chapter 3.
    """
    reach = int(3 * bandwidth)
    u = np.arange(-reach, reach + 1) / bandwidth
    kernel = np.exp(-(u**2) / 2)

    def moments(data: np.ndarray, window: np.ndarray, orders: int) -> np.ndarray:
        sums = [np.convolve(data, (window * u**order)[::-1])[reach : reach + data.size] for order in range(orders)]
        return np.stack(sums, axis=-1)

    powers = np.add.outer(np.arange(degree + 1), np.arange(degree + 1))
    inverse = np.linalg.inv(moments(weight, kernel, 2 * degree + 1)[:, powers])
    fit = np.einsum("nij,nj->ni", inverse, moments(weight * value, kernel, degree + 1))
    left_out = weight * ((value - fit[:, 0]) / (1 - weight * inverse[:, 0, 0])) ** 2
    spread = inverse @ moments(weight, kernel**2, 2 * degree + 1)[:, powers] @ inverse
    error = np.sqrt(left_out.mean() * np.maximum(spread[:, 1, 1], 0))
    return left_out, fit[:, 1] / bandwidth, error / bandwidth
