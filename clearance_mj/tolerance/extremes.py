"""Prediction of the largest value of a long time from a short record: peaks over threshold, predictive interval.

Values above a threshold come in clusters, one for each burst of the vibration. Their peaks are modelled as a Poisson
process whose excesses have a generalised Pareto distribution (Coles, An Introduction to Statistical Modeling of Extreme
Values, 2001, chapters 4 and 5). Rate, scale and shape are known by their posterior, over which the
distribution of the largest value of the long time is averaged: with n peaks in t, scale σ and shape ξ, it lies below x
with the probability E[(1 + T (1 + ξ (x - u)/σ)^(-1/ξ) / t)^-(n + 1/2)], the rate with Jeffreys' prior being integrated
in closed form. Its quantiles are the interval: it is of the largest value itself, not of a mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.optimize

__all__ = ["LEAST_PEAKS", "Largest", "decluster", "largest_value", "threshold_of"]

QUANTILES = (0.05, 0.5, 0.95)
LEAST_PEAKS = 5
"""peaks below which the largest value is not predicted"""
PEAKS = 60  # number of peaks above the threshold, if there are as many
SHAPE_PRIOR = (-0.1, 0.15)
"""mean and standard deviation of ξ: a bounded structure under Gaussian noise has tails a little lighter than
exponential; chosen on records of 60 s and hours of the Table 1 rig, other seeds and levels than the reported ones"""
SHAPES = np.linspace(-0.6, 0.5, 32)  # without 0, where the formulas divide by it
SCALES = np.exp(np.linspace(-1.2, 1.6, 45))  # of the mean excess
SEARCHED = 1 - np.geomspace(3e-4, 0.6, 40)  # quantiles of the samples tried as threshold


@dataclass(frozen=True)
class Largest:
    """Prediction of the largest value of a time from a record; nan where it has too few peaks."""

    median: float
    """median"""
    low: float
    """5 % quantile"""
    high: float
    """95 % quantile"""
    threshold: float
    """threshold of the fitted peaks"""
    peaks: int
    """number of clusters above the threshold"""
    scale: float
    """posterior mean of the generalised Pareto scale σ"""
    shape: float
    """posterior mean of its shape ξ"""
    misfit: float
    """Anderson-Darling distance of the excesses from the fitted distribution; beyond about 2 it fits badly"""
    exceeded: tuple[float, ...] = ()
    """probability that the largest value exceeds each of the given limits"""


def decluster(value: np.ndarray, threshold: float, run: int) -> np.ndarray:
    """Return the peak (n,) of each cluster above a threshold: clusters are ``run`` samples or more apart."""
    above = np.flatnonzero(value > threshold)
    if not above.size:
        return np.empty(0)
    starts = np.flatnonzero(np.diff(above, prepend=-run - 1) > run)
    return np.maximum.reduceat(value[above], starts)


def threshold_of(value: np.ndarray, run: int, least: float = -np.inf) -> tuple[float, np.ndarray]:
    """Return the highest threshold with `PEAKS` clusters above, or else that with most, and their peaks."""
    best, highest_peaks = float(value.max()), np.empty(0)
    for threshold in (*np.quantile(value, SEARCHED), least):
        if threshold < least or highest_peaks.size >= PEAKS:
            break
        peaks = decluster(value, threshold, run) if np.isfinite(threshold) else highest_peaks
        if peaks.size > highest_peaks.size:
            best, highest_peaks = float(threshold), peaks
    return best, highest_peaks


def largest_value(
    value: np.ndarray, run: int, ratio: float, least: float = -np.inf, limits: tuple[float, ...] = ()
) -> Largest:
    """Predict the largest value of a time that is ``ratio`` times as long as a record.

    Parameters
    ----------
    value : ndarray, shape (n,)
        Record.
    run : int
        Samples below the threshold that end a cluster.
    ratio : float
        Time of the prediction over that of the record.
    least : float
        Lowest threshold: 0 for quantities that are 0 between impacts.
    limits : tuple of float
        Limits whose probabilities of being exceeded are predicted.
    """
    threshold, peaks = threshold_of(value, run, least)
    if peaks.size < LEAST_PEAKS:
        return Largest(np.nan, np.nan, np.nan, threshold, peaks.size, np.nan, np.nan, np.nan, (np.nan,) * len(limits))
    posterior = _Posterior(peaks - threshold, ratio)
    low, median, high = (threshold + posterior.quantile(p) for p in QUANTILES)
    exceeded = tuple(
        1 - posterior.below(limit - threshold) if limit > threshold else _probability_by_rate(value, limit, run, ratio)
        for limit in limits
    )
    scale, shape = posterior.mean
    return Largest(median, low, high, threshold, peaks.size, scale, shape, posterior.misfit, exceeded)


def _probability_by_rate(value: np.ndarray, limit: float, run: int, ratio: float) -> float:
    """Return the probability that a limit below the threshold is exceeded: of any cluster at the observed rate."""
    return float(1 - (1 + ratio) ** -(decluster(value, limit, run).size + 0.5))


class _Posterior:
    """Scale and shape on a grid, weighted by the likelihood of excesses and the shape's prior."""

    def __init__(self, excess: np.ndarray, ratio: float) -> None:
        self.excess, self.ratio = np.sort(excess), ratio
        self.shape, self.scale = np.meshgrid(SHAPES, excess.mean() * SCALES, indexing="ij")
        z = excess / self.scale[0][:, None]
        logarithm = np.array([_log_density(z, shape) for shape in SHAPES]) - excess.size * np.log(self.scale)
        logarithm -= ((self.shape - SHAPE_PRIOR[0]) / SHAPE_PRIOR[1]) ** 2 / 2
        weight = np.exp(logarithm - logarithm.max())
        self.weight = weight / weight.sum()

    @property
    def mean(self) -> tuple[float, float]:
        """Posterior means of scale and shape."""
        return float(np.sum(self.weight * self.scale)), float(np.sum(self.weight * self.shape))

    @property
    def misfit(self) -> float:
        """Anderson and Darling's A² of the excesses against the posterior mean of their distribution."""
        n = self.excess.size
        survival = np.clip([np.sum(self.weight * self._survival(x)) for x in self.excess], 1e-12, 1 - 1e-12)
        odd = 2 * np.arange(1, n + 1) - 1
        return float(-n - np.mean(odd * (np.log1p(-survival) + np.log(survival[::-1]))))

    def below(self, excess: float) -> float:
        """Return the probability that the largest excess of the long time lies below a value."""
        return float(np.sum(self.weight * (1 + self.ratio * self._survival(excess)) ** -(self.excess.size + 0.5)))

    def quantile(self, probability: float) -> float:
        """Return the quantile of the largest excess at a probability; 0 where no peak at all is more likely."""
        if self.below(0.0) >= probability:
            return 0.0
        high = self.excess[-1]
        while self.below(high) < probability:
            high *= 2
        return float(scipy.optimize.brentq(lambda x: self.below(x) - probability, 0.0, high, rtol=1e-6))

    def _survival(self, excess: float) -> np.ndarray:
        """Return the fraction (n_shapes, n_scales) of peaks above an excess."""
        inside = np.maximum(1 + self.shape * excess / self.scale, 0.0)
        with np.errstate(divide="ignore"):
            return np.where(inside > 0, np.exp(-np.log(inside) / self.shape), 0.0)


def _log_density(z: np.ndarray, shape: float) -> np.ndarray:
    """Return the logarithm of the generalised Pareto density of scaled excesses, (n_scales, n) to (n_scales,)."""
    inside = 1 + shape * z
    possible = (inside > 0).all(axis=1)
    return np.where(possible, -(1 + 1 / shape) * np.log(np.where(inside > 0, inside, 1.0)).sum(axis=1), -np.inf)
