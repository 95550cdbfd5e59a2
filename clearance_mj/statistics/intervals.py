"""Confidence intervals of means over few seeds at several levels.

Two seeds of a level alone would give a Student interval of ± 12.7 standard errors. But an error that is twice as
large at another level also scatters about twice as much from seed to seed, so the scatter of its *logarithm* is
pooled over the levels, as ISO 5725-2 (1994, 7.5) does with a repeatability that is proportional to the level. Whether
one scatter fits all levels is what Cochran's test says.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.stats

__all__ = ["CONFIDENCE", "Interval", "Pooled", "on_power_law", "over_seeds", "ratio"]

CONFIDENCE = 0.95
SMALLEST = 1e-12  # Errors below it are rounding: their logarithms would mean nothing


@dataclass(frozen=True)
class Interval:
    """A value and its confidence interval; nan where there is none."""

    value: float  #: the estimate
    low: float = math.nan  #: lower limit
    high: float = math.nan  #: upper limit
    doubtful: bool = False  #: whether a test refuses what the interval assumes


@dataclass(frozen=True)
class Pooled:
    """Means over the seeds of each level, and what their intervals rest on."""

    means: dict[float, Interval]  #: by level
    scatter: float  #: standard deviation of the natural logarithm from seed to seed, pooled over the levels
    freedom: int  #: its degrees of freedom
    cochran: float  #: largest variance of a level over the sum of all: 1 / number of levels where they are equal
    cochran_limit: float  #: what it exceeds with a probability of 5 % where the scatter is equal


def over_seeds(errors: Mapping[float, Sequence[float]], confidence: float = CONFIDENCE) -> Pooled:
    """Return the mean over the seeds of each level, with a confidence interval from the scatter at all levels.

    The errors of a level are taken to be lognormal, with one standard deviation s of the logarithm at every level.
    With n seeds at a level, m the mean of their logarithms, and ν = Σ (n - 1) degrees of freedom of s, the interval
    of the expected error is exp(m + s²/2 ± t √(s²/n + s⁴/(2ν))), t Student's quantile: Cox's method as U. Olsson
    modified it (Confidence intervals for the mean of a log-normal distribution, Journal of Statistics Education 13(1),
    2005), here with a pooled s. Errors that are not finite are left out; without a level that has two seeds there are
    no intervals. Where Cochran's test (Annals of Eugenics 11, 1941; ISO 5725-2, 7.3.3; it takes as many seeds at each
    level) refuses one scatter for all levels, intervals are doubtful: too narrow at the level that scatters most, too
    wide at the others.
    """
    found = {level: _finite(values) for level, values in errors.items()}
    logarithms = [np.log(np.maximum(v, SMALLEST)) for v in found.values()]
    repeated = [x for x in logarithms if x.size > 1]
    freedom = sum(x.size - 1 for x in repeated)
    if not freedom:
        means = {level: Interval(_mean(v)) for level, v in found.items()}
        return Pooled(means, math.nan, 0, math.nan, math.nan)
    variance = sum(np.sum((x - x.mean()) ** 2) for x in repeated) / freedom
    t = _quantile(confidence, freedom)
    cochran, limit = _cochran(repeated)
    means = {}
    for (level, values), x in zip(found.items(), logarithms):
        if not x.size:
            means[level] = Interval(math.nan)
            continue
        middle = x.mean() + variance / 2
        half = t * math.sqrt(variance / x.size + variance**2 / (2 * freedom))
        low, high = (float(np.exp(middle + side)) for side in (-half, half))
        means[level] = Interval(_mean(values), low, high, doubtful=cochran > limit)
    return Pooled(means, math.sqrt(variance), freedom, cochran, limit)


def _finite(values: Sequence[float]) -> np.ndarray:
    found = np.asarray(values, dtype=float)
    return found[np.isfinite(found)]


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _cochran(groups: Sequence[np.ndarray], risk: float = 0.05) -> tuple[float, float]:
    """Cochran's ratio of variances, and its upper limit from the quantile of F at risk / (number of groups)."""
    variances = [np.var(x, ddof=1) for x in groups]
    n, freedom = len(groups), groups[0].size - 1
    if n < 2 or not sum(variances) > 0:
        return math.nan, math.nan
    return float(max(variances) / sum(variances)), _cochran_limit(n, freedom, risk)


@functools.cache
def _cochran_limit(n: int, freedom: int, risk: float) -> float:
    return float(1 / (1 + (n - 1) / scipy.stats.f.isf(risk / n, freedom, (n - 1) * freedom)))


@functools.cache
def _quantile(confidence: float, freedom: int) -> float:
    """Student's two-sided quantile."""
    return float(scipy.stats.t.ppf(0.5 + confidence / 2, freedom))


def on_power_law(errors: Mapping[float, float], confidence: float = CONFIDENCE) -> dict[float, Interval]:
    """Return the intervals of errors of which there is one at each level: their scatter about a power law of the level.

    A single value says nothing of its scatter. Where the expected error follows a power law of the level, the residuals
    of the straight line through the logarithms do, with two degrees of freedom less than there are levels; where it
    does not, they are larger, and so are the intervals. They are ± t s about the logarithm of each value, and are
    intervals of the median error. What is not finite or at level zero has none; nor has any below four levels.
    """
    fitted = [level for level, error in errors.items() if level > 0 and np.isfinite(error)]
    intervals = {level: Interval(float(error)) for level, error in errors.items()}
    if len(fitted) < 4:
        return intervals
    x, y = np.log(fitted), np.log(np.maximum([errors[level] for level in fitted], SMALLEST))
    residual = y - np.polyval(np.polyfit(x, y, 1), x)
    freedom = len(fitted) - 2
    spread = np.exp(_quantile(confidence, freedom) * np.sqrt(np.sum(residual**2) / freedom))
    for level in fitted:
        error = float(errors[level])
        intervals[level] = Interval(error, error / float(spread), error * float(spread))
    return intervals


def ratio(new: Interval, old: Interval) -> Interval:
    """Return the ratio of two positive values, with an interval recovered from theirs as if they were independent.

    Values under the same seeds mostly scatter together, and then it is too wide. G. Y. Zou and A. Donner, Construction
    of confidence limits about effect measures, Statistics in Medicine 27, 2008, for the difference of the logarithms.
    """
    if not (new.value > 0 and old.value > 0):
        return Interval(math.nan)
    value = new.value / old.value
    if not (new.low > 0 and old.low > 0):
        return Interval(value)
    below = math.hypot(math.log(new.value / new.low), math.log(old.high / old.value))
    above = math.hypot(math.log(new.high / new.value), math.log(old.value / old.low))
    return Interval(value, value * math.exp(-below), value * math.exp(above))
