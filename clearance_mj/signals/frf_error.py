"""The random error of FRFs that are estimated from noise, and the level difference in dB that it alone causes.

An H1 estimate from n independent averages is H (1 + σ z) with z a complex normal variable of unit variance and
σ² = (1 - γ²) / (n γ²), γ² the coherence (Bendat and Piersol, Random Data, 4th ed., 2010, Table 9.6). Where σ is small,
the magnitude has the relative standard deviation σ / √2. Where it is not, as at antiresonances, |1 + σ z|² is a
non-central χ² variable of two degrees of freedom, a mixture of Gamma variables with Poisson's weights, whose mean
square in dB is a sum.
"""

from __future__ import annotations

import functools

import numpy as np
import scipy.special
import scipy.stats

from ..core.errors import RecordError
from .frf import FRF

__all__ = ["DB", "random_db", "random_error", "why_unknown"]

DB = 20 / np.log(10)
"""dB of a natural logarithm of a magnitude"""
SMALLEST, LARGEST = 1e-3, 1e3  # σ² between which the sum is taken; below it, the linear form is right to 0.1 %
KNOTS = 121  # of σ² at which the sum is taken


def why_unknown(frf: FRF) -> str:
    """Return why the random error of FRFs is not known; "" if it is.

    Parameters
    ----------
    frf : FRF
        The functions.
    """
    if frf.coherence is None:
        return "no coherence"
    return "" if frf.averages else "no number of averages"


def random_error(frf: FRF) -> np.ndarray:
    """Return the relative standard deviation of an estimated FRF's magnitude, from coherence and averages.

    √(1-γ²) / (|γ| √(2 n)). In a nonlinear rig most of it is no noise: another excitation shows another scatter, the
    same one the same.

    Parameters
    ----------
    frf : FRF
        FRF with coherence and averages, as `estimate_frf` gives it by default.

    Returns
    -------
    ndarray, shape (n_outputs, n_inputs, n_f)

    Raises
    ------
    RecordError
        If the FRF has no coherence, or no number of averages.
    """
    return np.sqrt(_variance(frf) / 2)


def random_db(frf: FRF) -> np.ndarray:
    """Return by line the root mean square of 20 log10(|estimate| / |true|) that the random error alone makes, dB.

    Parameters
    ----------
    frf : FRF
        FRF with coherence and averages.

    Returns
    -------
    ndarray, shape (n_outputs, n_inputs, n_f)

    Raises
    ------
    RecordError
        If the FRF has no coherence, or no number of averages.
    """
    variance = _variance(frf)
    knots, over_linear = _mean_squares()
    ratio = np.interp(np.log(np.maximum(variance, 1e-300)), knots, over_linear)
    return np.asarray(DB * np.sqrt(ratio * variance / 2))


def _variance(frf: FRF) -> np.ndarray:
    """Return σ² (n_outputs, n_inputs, n_f)."""
    if (unknown := why_unknown(frf)) or frf.coherence is None or frf.averages is None:
        raise RecordError(f"the FRF has {unknown}, so its random error is not known")
    # Coherences of 1 may be rounded above it.
    return np.asarray(np.maximum(1 - frf.coherence, 0) / (frf.averages * frf.coherence))


@functools.cache
def _mean_squares() -> tuple[np.ndarray, np.ndarray]:
    """Return logarithms of σ² (KNOTS,), and there the mean square of ln|1 + σ z| over its linear form σ²/2.

    ln|1 + σ z|² is ln(σ² G), G of Gamma's distribution with the shape 1 + j, and j of Poisson's with the mean 1/σ².
    """
    variance = np.geomspace(SMALLEST, LARGEST, KNOTS)
    ratios = []
    for value in variance:
        j = np.arange(int(1 / value + 12 / np.sqrt(value)) + 30)
        mean, spread = scipy.special.digamma(1 + j) + np.log(value), scipy.special.polygamma(1, 1 + j)
        square = np.sum(scipy.stats.poisson.pmf(j, 1 / value) * (mean**2 + spread)) / 4
        ratios.append(square / (value / 2))
    return np.log(variance), np.array(ratios)
