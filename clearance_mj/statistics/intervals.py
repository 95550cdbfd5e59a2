"""Confidence intervals of means over few seeds at several levels.

Two seeds of a level alone would give a Student interval of ± 12.7 standard errors, which says nothing: none is given.
But an error that is twice as
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
import scipy.special
import scipy.stats

__all__ = [
    "CONFIDENCE", "LEAST_FREEDOM", "Interval", "Pooled", "on_power_law", "over_seeds", "ratio", "two_sided_quantile",
]  # fmt: skip

CONFIDENCE = 0.95
SMALLEST = 1e-12  # Errors below it are rounding: their logarithms would mean nothing
LEAST_FREEDOM = 2
"""degrees of freedom from which on there are intervals: two seeds at each of two levels, or three at one"""
WIDEST = 100.0
"""times its middle either way, up to which an interval is given; of errors that scatter by a factor of e from seed to
seed, the intervals that are left hold the expected one 92 times in 100 with two degrees of freedom, 95 with five"""
TOO_FEW = "too few records of a level: two at each of two levels, or three at one, are the least"
TOO_FEW_LEVELS = "one value a level needs four levels"
TOO_WIDE = f"it scatters too much from record to record: the interval would be more than {WIDEST:g} times its middle"


@dataclass(frozen=True)
class Interval:
    """A value and its confidence interval; nan where there is none."""

    value: float  #: the estimate
    low: float = math.nan  #: lower limit
    high: float = math.nan  #: upper limit
    doubtful: bool = False  #: True if a test refuses the interval's assumption
    missing: str = ""  #: reason that there is no interval though there is a value


@dataclass(frozen=True)
class Pooled:
    """Means over the seeds of each level, and the pooled scatter of their intervals."""

    means: dict[float, Interval]  #: by level
    scatter: float  #: standard deviation of the natural logarithm from seed to seed, pooled over the levels
    freedom: int  #: its degrees of freedom
    cochran: float  #: largest variance of a level over the sum of all: 1 / number of levels where they are equal
    cochran_limit: float  #: limit that it exceeds with a probability of 5 % where the scatter is equal


def over_seeds(errors: Mapping[float, Sequence[float]], largest: float = math.inf) -> Pooled:
    """Return the mean over the seeds of each level, with a 95 % interval from the scatter at all levels.

    The errors of a level are taken to be lognormal, with one standard deviation s of the logarithm at every level.
    With n seeds at a level, m the mean of their logarithms, and ν = Σ (n - 1) degrees of freedom of s, the interval
    of the expected error is exp(m + s²/2 ± t √(s²/n + s⁴/(2ν))), t Student's quantile: Cox's method as U. Olsson
    modified it (Confidence intervals for the mean of a log-normal distribution, Journal of Statistics Education 13(1),
    2005), here with a pooled s. An error that cannot exceed ``largest``, such as 1 - MAC, has its logit for its
    logarithm: its interval stays within what it can be, and is the same where errors are small.

    Errors that are not finite are left out. There is no interval, and `Interval.missing` says why, with fewer than
    `LEAST_FREEDOM` degrees of freedom, for which Student's quantile is no longer of any use (12.7), and where it would
    be more than `WIDEST` times the middle. Where Cochran's test (Annals of Eugenics 11, 1941; ISO 5725-2, 7.3.3; it
    takes as many seeds at each level) refuses one scatter for all levels, intervals are doubtful: too narrow at the
    level that scatters most, too wide at the others.

    Parameters
    ----------
    errors : mapping of float to sequence of float
        Errors >= 0 of the seeds of each level.
    largest : float
        Largest possible error.
    """
    scale = _Scale(largest)
    finite = {level: np.array([v for v in values if math.isfinite(v)], dtype=float) for level, values in errors.items()}
    logarithms = [scale.to(v) for v in finite.values()]
    repeated = [x for x in logarithms if x.size > 1]
    if not (freedom := sum(x.size - 1 for x in repeated)):
        means = {level: Interval(_mean(v), missing=TOO_FEW if v.size else "") for level, v in finite.items()}
        return Pooled(means, math.nan, 0, math.nan, math.nan)
    variance = sum(np.sum((x - x.mean()) ** 2) for x in repeated) / freedom
    cochran, limit = _cochran(repeated)
    means = {}
    for (level, values), x in zip(finite.items(), logarithms):
        if not x.size:
            means[level] = Interval(math.nan)
            continue
        half = two_sided_quantile(CONFIDENCE, freedom) * math.sqrt(variance / x.size + variance**2 / (2 * freedom))
        limits = scale.limits(scale.expected(float(x.mean()), float(variance)), half)
        missing = TOO_FEW if freedom < LEAST_FREEDOM else "" if limits else TOO_WIDE
        low, high = (limits if limits and not missing else None) or (math.nan, math.nan)
        means[level] = Interval(_mean(values), low, high, cochran > limit and not missing, missing)
    return Pooled(means, math.sqrt(variance), freedom, cochran, limit)


@dataclass(frozen=True)
class _Scale:
    """Logarithm of an error, or its logit where there is a largest one."""

    largest: float

    def to(self, error: np.ndarray) -> np.ndarray:
        inside = np.clip(error, SMALLEST, max(self.largest - SMALLEST, SMALLEST))
        return np.asarray(np.log(inside / (1 - inside / self.largest)))

    def back(self, value: float) -> float:
        if math.isinf(self.largest):
            return math.exp(value)
        return self.largest * float(scipy.special.expit(value - math.log(self.largest)))

    def expected(self, middle: float, variance: float) -> float:
        """Return the scale's value of the expected error where the scale's values are normal."""
        if math.isinf(self.largest):
            return middle + variance / 2
        nodes, weights = _hermite()
        errors = [self.back(middle + math.sqrt(variance) * node) for node in nodes]
        return float(self.to(np.array([np.dot(weights, errors)]))[0])

    def limits(self, middle: float, half: float) -> tuple[float, float] | None:
        """Return the errors at both ends of an interval; None of one that is too wide."""
        if half > math.log(WIDEST):
            return None
        return self.back(middle - half), self.back(middle + half)


@functools.cache
def _hermite() -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of a mean over the standard normal distribution (Gauss and Hermite)."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(61)
    return nodes, weights / weights.sum()


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
def two_sided_quantile(confidence: float, freedom: float = math.inf) -> float:
    """Return the number of standard deviations from its mean within which Student's variable lies with a probability.

    Parameters
    ----------
    confidence : float
        The probability.
    freedom : float
        Degrees of freedom; without, the variable is normal.
    """
    distribution = scipy.stats.norm if math.isinf(freedom) else scipy.stats.t(freedom)
    return float(distribution.ppf(0.5 + confidence / 2))


def on_power_law(errors: Mapping[float, float], largest: float = math.inf) -> dict[float, Interval]:
    """Return the intervals of errors of which there is one at each level: their scatter about a power law of the level.

    A single value says nothing of its scatter. Where the expected error follows a power law of the level, the residuals
    of the straight line through the logarithms do, with two degrees of freedom less than there are levels; where it
    does not, they are larger, and so are the intervals. They are ± t s about the logarithm of each value, and are
    intervals of the median error. What is not finite or at level zero has none; nor has any below four levels, or one
    that would be too wide, as in `over_seeds`.

    Parameters
    ----------
    errors : mapping of float to float
        Error of each level.
    largest : float
        Largest possible error, as in `over_seeds`.
    """
    scale = _Scale(largest)
    fitted = [level for level, error in errors.items() if level > 0 and np.isfinite(error)]
    missing = {level: TOO_FEW_LEVELS if np.isfinite(error) else "" for level, error in errors.items()}
    intervals = {level: Interval(float(error), missing=missing[level]) for level, error in errors.items()}
    if len(fitted) < 4:
        return intervals
    x, y = np.log(fitted), scale.to(np.array([errors[level] for level in fitted]))
    residual = y - np.polyval(np.polyfit(x, y, 1), x)
    freedom = len(fitted) - 2
    half = two_sided_quantile(CONFIDENCE, freedom) * math.sqrt(np.sum(residual**2) / freedom)
    for level, value in zip(fitted, y.tolist()):
        low, high = scale.limits(value, half) or (math.nan, math.nan)
        error = float(errors[level])  # below `SMALLEST` it counts as that
        intervals[level] = Interval(error, min(low, error), max(high, error), missing="" if low <= high else TOO_WIDE)
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
        return Interval(value, missing=new.missing or old.missing)
    below = math.hypot(math.log(new.value / new.low), math.log(old.high / old.value))
    above = math.hypot(math.log(new.high / new.value), math.log(old.value / old.low))
    return Interval(value, value * math.exp(-below), value * math.exp(above))
