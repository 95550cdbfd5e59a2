"""Tolerances to tighten, and how far, so that few enough designs touch or exceed a limit.

The lowest level at which a design touches (or exceeds the limit) is learnt from designs of the production as it is, as
a function of the deviation of each number from its middle; the function's error is known by cross-validation and
enters every fraction. The answer is then computed again with designs of the tightened scatter. Where no tolerance
suffices, a nominal gap is sought that does.

Under random excitation a design is marched at one level. With λ impacts in the time, of at most N, the level at which
it touches with probability 1/2, λ = ln 2, is √(ln(N/λ) / ln(N/ln 2)) times as high if its motion in the gap is
Gaussian, λ = N exp(-gap²/2σ²) (S. O. Rice, Bell System Technical Journal 24, 1945). That at which it exceeds a limit is
assumed in proportion to the largest value. Both are on the correct side of the level; fractions need no more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize
from scipy.stats import norm

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..core.runner import ALL_CORES, Runner
from ..model import Model
from ..periodic.axes import level_axis
from ..statistics.shares import share_interval
from .designs import Designs
from .learnt import Learnt, learn
from .limits import Limit
from .random_designs import DesignPeaks, Noise, random_production
from .rattling import CONTACT, EXCEEDING
from .scatter import Scatter
from .sines import Sines, settings_of, total_of

__all__ = ["Tightening", "random_tightening", "tighten"]

LOOKED_AHEAD = 3.0  # times the level, up to which designs are followed for the learnt function
POINTS = 2**13  # of the production, at which the learnt function is evaluated
SMOOTHED = 0.05  # of the level's standard deviation: least smoothing of fractions as functions of tolerances
NARROWEST = 0.02  # factor of a tolerance below which none is tightened
GAPS, GAPS_TRIED = (0.5, 8.0), 4  # times the nominal gap, range of the search for another one, and number of trials
MARGIN = 0.03  # of the logarithm of the level, aimed at by a gap
IMPACTS = 200.0  # 1/s, upper bound of the rate at a bushing

FirstLevels = Callable[[Designs], np.ndarray]
"""Lowest levels (n,) at which designs touch or exceed the limit"""


@dataclass(frozen=True, eq=False)
class Tightening:
    """Widths of tolerances for which at most a fraction of the designs touches or exceeds the limit."""

    level: float
    """of the excitation, m/s², N or a factor of the unbalances"""
    what: str
    """criterion: "contact", or the limit in words"""
    allowed: float
    """allowed fraction of the designs"""
    names: tuple[str, ...]
    """paths of the scattering numbers, as in the scatter"""
    share: float
    """computed fraction of the present designs"""
    share_limits: tuple[float, float]
    """its 95 % interval"""
    width: np.ndarray
    """(n_numbers,) factor of each number's tolerance if it alone is tightened; 1: it need not be; nan: tightening it
    alone does not suffice"""
    share_without: np.ndarray
    """(n_numbers,) fraction of the designs if the number alone does not scatter"""
    cheapest: Mapping[str, float]
    """factors of the tolerances that together suffice at the lowest price; empty without prices, or if none does"""
    cost: float
    """of the cheapest set, in the prices' currency; nan without"""
    scatter: Scatter
    """the cheapest one, or the present one"""
    cheapest_share: float
    """computed fraction of the designs of that scatter; nan without"""
    cheapest_limits: tuple[float, float]
    """its 95 % interval"""
    error: float
    """of the learnt level, dB, RMS of cross-validation"""
    unit: str
    """of the level, in words behind a number"""
    gap: float = math.nan
    """factor of the nominal gaps that suffices, or else the best trial; nan where a tolerance does"""
    gaps: tuple[float, ...] = ()
    """m, the radial gaps of the rig's bushings with it"""
    gap_share: float = math.nan
    """computed fraction of the designs about these gaps"""
    gap_limits: tuple[float, float] = (math.nan, math.nan)
    """its 95 % interval"""

    def rows(self) -> list[dict[str, Any]]:
        """Return a row of plain data for each number."""
        return [
            {"number": name, "width_alone": float(width), "share_without": float(left)}
            | ({"width_cheapest": float(self.cheapest.get(name, 1.0))} if self.cheapest else {})
            for name, width, left in zip(self.names, self.width, self.share_without)
        ]


@checks_kinds
def tighten(
    model: Model, scatter: Scatter | None, sines: Sines, allowed: float = 0.01, n_designs: int = 500, seed: int = 0,
    runner: Runner = ALL_CORES,
) -> Tightening:  # fmt: skip
    """Compute how far to tighten tolerances so that at most a fraction of the designs touches, or exceeds a limit.

    Parameters
    ----------
    model : Model
        As in `production`.
    scatter : Scatter or None
        Scatter of the production; None: by the rig file's tolerances. Numbers with a price take part in the
        cheapest set, each at its price times 1/width - 1 (the reciprocal cost of a tolerance, Chase and Greenwood,
        Manufacturing Review 1, 1988).
    sines : Sines
        Limit, or no contact at all, up to their largest level, at all of their frequencies.
    allowed : float
        Allowed fraction of the designs.
    n_designs : int
        Number of computed designs, of the present scatter and of the cheapest one each.
    seed : int
        Seed of the draws.
    runner : Runner
        As in `production`.

    Returns
    -------
    Tightening

    Raises
    ------
    ClearanceError
        If the fraction is impossible, or there are too few designs to learn from.
    """
    settings = settings_of(model, sines)
    level, unit = float(settings.levels[-1]), level_axis(settings.kind).unit
    settings = replace(settings, levels=np.array([LOOKED_AHEAD * level]))
    what = settings.limit.words if settings.limit else "contact"

    def first_levels(designs: Designs) -> np.ndarray:
        return total_of("tightening", settings, designs, runner).of_designs[EXCEEDING if settings.limit else CONTACT]

    return _tighten(model, scatter, first_levels, level, unit, what, allowed, n_designs, seed)


@checks_kinds
def random_tightening(
    model: Model, scatter: Scatter | None, noise: Noise, allowed: float = 0.01, n_designs: int = 500, seed: int = 0,
    runner: Runner = ALL_CORES,
) -> Tightening:  # fmt: skip
    """Compute how far to tighten tolerances so that few enough designs touch under random excitation.

    A design counts if it touches, or exceeds the limit, with probability 1/2 or more within the time.

    Parameters
    ----------
    model, scatter, allowed, n_designs, seed
        As in `tighten`; the seed is that of the noise, too.
    noise : Noise
        Its largest level counts, and its limit of the largest value of the time, of all bushings or sensors; without a
        limit no contact at all.
    runner : Runner
        As in `production`.

    Returns
    -------
    Tightening

    Raises
    ------
    ClearanceError
        As `tighten` and `random_production`.
    """
    level, limit = float(max(noise.levels)), noise.limit
    noise = replace(noise, levels=(level,))

    def first_levels(designs: Designs) -> np.ndarray:
        (peaks,) = random_production(designs, noise, seed, runner)
        return level * _median_level_ratio(peaks.by_design, limit, 3600 * noise.hours)

    what = f"{Limit(noise.quantity, limit).words if limit else 'contact'} within {noise.hours:g} h"
    unit = f"{level_axis(noise.psd.kind).unit} RMS"
    return _tighten(model, scatter, first_levels, level, unit, what, allowed, n_designs, seed)


def _median_level_ratio(designs: Sequence[DesignPeaks], limit: float | None, time: float) -> np.ndarray:
    """Return levels at which designs touch, or reach the limit, with probability 1/2, over the marched level."""
    with np.errstate(divide="ignore"):
        if limit is not None:
            return limit / np.nan_to_num([each.median for each in designs]).max(axis=1)
        touch, rate = (np.array([getattr(each, name) for each in designs]).max(axis=1) for name in
                       ("impact_probability", "impacts_per_second"))  # fmt: skip
        impacts = np.where(rate > 0, rate * time, -np.log1p(-touch))
        largest = IMPACTS * time
        return np.sqrt(np.log(largest / np.minimum(impacts, largest / 2)) / math.log(largest / math.log(2)))


def _tighten(
    model: Model, scatter: Scatter | None, first_levels: FirstLevels, level: float, unit: str, what: str,
    allowed: float, n_designs: int, seed: int,
) -> Tightening:  # fmt: skip
    """Tighten so that few enough designs have their first level below ``level``."""
    if not 0 < allowed < 1:
        raise ClearanceError(f"allowed must be a share between 0 and 1, got {allowed!r}")
    scatter = scatter or Scatter.of_rig(model.rig)
    rule = scatter.rule(model)
    drawn = rule.draw(n_designs, seed)
    first, names = first_levels(drawn), tuple(number.of for number in scatter.numbers)
    fraction, interval = _fraction(first, level)
    learnt = learn(rule.deviations(drawn), np.log(np.minimum(first, LOOKED_AHEAD * level)))
    predicted = _FailingFraction(learnt, rule.deviations(rule.draw(POINTS, seed)), math.log(level), rule.owner)
    widths, without = zip(*(_tighten_alone(predicted, i, allowed) for i in range(len(scatter.numbers))))
    cheapest = _cheapest(predicted, scatter, allowed) if predicted.share() > allowed else {}
    prices = {number.of: number.price for number in scatter.numbers if number.price}
    tightened = scatter.narrowed(cheapest) if cheapest else scatter
    cost, new_fraction, limits = math.nan, math.nan, (math.nan, math.nan)
    if cheapest:
        cost = sum(prices[name] * (1 / width - 1) for name, width in cheapest.items())
        new_fraction, limits = _fraction(first_levels(tightened.draw(model, n_designs, seed)), level)
    result = Tightening(
        level, what, allowed, names, fraction, interval, np.array(widths), np.array(without), cheapest,
        cost, tightened, new_fraction, limits, 20 / math.log(10) * learnt.error, unit,
    )  # fmt: skip
    if fraction <= allowed or cheapest or np.any(result.width < 1):
        return result

    def with_gap(factor: float) -> np.ndarray:
        return first_levels(scatter.draw(model.with_gap(f"x{factor!r}"), n_designs, seed))

    factor, again = _search_gap(with_gap, first, level, allowed)
    gaps, (failing, limits) = (tuple(factor * bushing.gap for bushing in model.rig.bushings), _fraction(again, level))
    return replace(result, gap=factor, gaps=gaps, gap_share=failing, gap_limits=limits)


def _search_gap(
    with_gap: Callable[[float], np.ndarray], first: np.ndarray, level: float, allowed: float
) -> tuple[float, np.ndarray]:
    """Return the factor of the gaps that suffices, or the best trial, and the first levels of its designs.

    Levels are assumed in proportion to the gap at first, then by secants over logarithms.
    """

    def margin(first: np.ndarray) -> float:
        return math.log(min(np.sort(first)[int(allowed * first.size)], LOOKED_AHEAD * level) / level)

    at, slope, margins = 0.0, 1.0, {0.0: margin(first)}
    first_levels: dict[float, np.ndarray] = {}
    while slope and len(first_levels) < GAPS_TRIED and not 0 < margins[at] < 5 * MARGIN:
        new = float(np.clip(at + (MARGIN - margins[at]) / slope, *np.log(GAPS)))
        if new in margins:
            break
        first_levels[new] = with_gap(math.exp(new))
        margins[new] = margin(first_levels[new])
        at, slope = new, (margins[new] - margins[at]) / (new - at)
    best = max(first_levels, key=lambda each: (min(margins[each], 0.0), -abs(each)))
    return math.exp(best), first_levels[best]


def _fraction(first: np.ndarray, level: float) -> tuple[float, tuple[float, float]]:
    """Return the fraction of designs whose first level is at most a level, and its interval."""
    fraction = float(np.mean(first <= level))
    low, high = share_interval(fraction, first.size)
    return fraction, (float(low), float(high))


class _FailingFraction:
    """Predicted fraction of failing designs as a function of the tolerances' widths."""

    def __init__(self, learnt: Learnt, deviations: np.ndarray, level: float, owner: np.ndarray):
        self.function, self.deviations, self.level, self.owner = learnt.function, deviations, level, owner
        self.spread = max(learnt.error, SMOOTHED * float(np.std(learnt.function(deviations))), 1e-9)

    def share(self, widths: np.ndarray | None = None) -> float:
        """Return the fraction for widths (n_numbers,) of the scatter's numbers."""
        deviations = self.deviations if widths is None else self.deviations * widths[self.owner]
        return float(np.mean(norm.cdf((self.level - self.function(deviations)) / self.spread)))


def _tighten_alone(predicted: _FailingFraction, i: int, allowed: float) -> tuple[float, float]:
    """Return the largest sufficient width of one number alone, and the fraction without its scatter."""

    def excess(width: float) -> float:
        widths = np.ones(predicted.owner.max() + 1)
        widths[i] = width
        return predicted.share(widths) - allowed

    without = excess(0.0) + allowed
    if excess(1.0) <= 0:
        return 1.0, without
    return (math.nan if without > allowed else float(brentq(excess, 0.0, 1.0, xtol=1e-4))), without


def _cheapest(predicted: _FailingFraction, scatter: Scatter, allowed: float) -> dict[str, float]:
    """Return widths at the lowest price of the numbers that have one; empty if they do not suffice."""
    priced = [i for i, number in enumerate(scatter.numbers) if number.price]
    price = np.array([scatter.numbers[i].price for i in priced], dtype=float)

    def margin(logarithms: np.ndarray) -> float:
        widths = np.ones(len(scatter.numbers))
        widths[priced] = np.exp(logarithms)
        return math.log(allowed) - math.log(max(predicted.share(widths), 1e-12))

    lowest = np.full(len(priced), math.log(NARROWEST))
    if not priced or margin(lowest) < 0:
        return {}

    def cost(logarithms: np.ndarray) -> float:
        return float(np.sum(price * np.expm1(-logarithms)) / price.sum())

    start = np.full(len(priced), float(brentq(lambda x: margin(np.full(len(priced), x)), lowest[0], 0.0, xtol=1e-3)))
    best = minimize(
        cost, start, method="SLSQP", bounds=[(lowest[0], 0.0)] * len(priced),
        constraints={"type": "ineq", "fun": margin}, options={"maxiter": 60, "ftol": 1e-6},
    ).x  # fmt: skip
    best_logarithms = best if margin(best) > -1e-2 else start
    return {scatter.numbers[i].of: float(math.exp(x)) for i, x in zip(priced, best_logarithms) if x < -1e-3}
