"""Which tolerance to tighten, and how far, so that few enough designs touch or exceed a limit.

The lowest level at which a design touches (or exceeds the limit) is learnt from designs of the production as it stands,
as a function of how far each number is from its middle; what the function misses is known by cross-validation and goes
into every share. The answer is then computed anew with designs of the tightened scatter. Where no tolerance does, the
nominal gap is looked for that does.

Under random excitation a design is marched at one level. With λ impacts in the time, of at most N, the level at which
it touches as likely as not, λ = ln 2, is √(ln(N/λ) / ln(N/ln 2)) times as high if its motion in the gap is Gaussian,
λ = N exp(-gap²/2σ²) (S. O. Rice, Bell System Technical Journal 24, 1945). That at which it exceeds a limit is taken to
be in proportion to the largest value. Both have the right side of the level that is asked for; shares need no more.
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

LOOKED_AHEAD = 3.0  # times the level, up to which designs are followed: what the function is learnt from
POINTS = 2**13  # of the production, at which the learnt function is read
SMOOTHED = 0.05  # of the level's standard deviation: by which shares are smooth functions of tolerances at least
NARROWEST = 0.02  # share of a tolerance below which none is tightened
GAPS, GAPS_TRIED = (0.5, 8.0), 4  # times the nominal gap, within which another one is looked for, and how often
MARGIN = 0.03  # of the logarithm of the level, by which a gap should do
IMPACTS = 200.0  # 1/s, more than there are at a bushing

FirstLevels = Callable[[Designs], np.ndarray]
"""Lowest levels (n,) at which designs do what they must not"""


@dataclass(frozen=True, eq=False)
class Tightening:
    """What each tolerance may be so that at most a share of the designs does what it must not."""

    level: float
    """of the excitation, m/s², N or a factor of the unbalances"""
    what: str
    """that must not be: "contact", or the limit in words"""
    allowed: float
    """share of the designs that may"""
    names: tuple[str, ...]
    """paths of what scatters, as the scatter has them"""
    share: float
    """of the designs as they stand, computed"""
    share_limits: tuple[float, float]
    """its 95 % interval"""
    width: np.ndarray
    """(n_numbers,) share of its tolerance that each number alone may have; 1: it need not be tightened; nan: tightening
    it alone does not do"""
    share_without: np.ndarray
    """(n_numbers,) share of the designs that is left if the number alone does not scatter"""
    cheapest: Mapping[str, float]
    """shares of the tolerances that together do at the lowest price; empty without prices, or if none does"""
    cost: float
    """of them, in the prices' currency; nan without"""
    scatter: Scatter
    """the cheapest one, or as it stands"""
    cheapest_share: float
    """of the designs of that scatter, computed anew; nan without"""
    cheapest_limits: tuple[float, float]
    """its 95 % interval"""
    error: float
    """of the learnt level, dB, RMS of cross-validation"""
    unit: str
    """of the level, in words behind a number"""
    gap: float = math.nan
    """factor of the nominal gaps that does, or else the best that was tried; nan where a tolerance does"""
    gaps: tuple[float, ...] = ()
    """m, the radial gaps of the rig's bushings with it"""
    gap_share: float = math.nan
    """of the designs about these gaps, computed anew"""
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
    """Find how far tolerances must be tightened so that at most a share of the designs touches, or exceeds a limit.

    Parameters
    ----------
    model : Model
        As `production` takes it.
    scatter : Scatter or None
        How the production scatters; None: by the rig file's own tolerances. Numbers with a price take part in the
        cheapest set, each at its price times 1/width - 1 (the reciprocal cost of a tolerance, Chase and Greenwood,
        Manufacturing Review 1, 1988).
    sines : Sines
        What must not be exceeded, or no contact at all, up to their largest level, at none of their frequencies.
    allowed : float
        Share of the designs that may.
    n_designs : int
        How many are computed, of the scatter as it stands and of the cheapest one each.
    seed : int
        Of the draws.
    runner : Runner
        As `production` takes it.

    Returns
    -------
    Tightening

    Raises
    ------
    ClearanceError
        If the share is impossible, or there are too few designs to learn from.
    """
    settings = settings_of(model, sines)
    level, unit = float(settings.levels[-1]), level_axis(settings.kind).unit
    settings = replace(settings, levels=np.array([LOOKED_AHEAD * level]))
    what = settings.limit.words if settings.limit else "contact"

    def first_levels(designs: Designs) -> np.ndarray:
        found = total_of("tightening", settings, designs, runner)
        return found.of_designs[EXCEEDING if settings.limit else CONTACT]

    return _tightened(model, scatter, first_levels, level, unit, what, allowed, n_designs, seed)


@checks_kinds
def random_tightening(
    model: Model, scatter: Scatter | None, noise: Noise, allowed: float = 0.01, n_designs: int = 500, seed: int = 0,
    runner: Runner = ALL_CORES,
) -> Tightening:  # fmt: skip
    """Find how far tolerances must be tightened so that few enough designs touch under random excitation.

    A design counts if it touches, or exceeds the limit, as likely as not within the time.

    Parameters
    ----------
    model, scatter, allowed, n_designs, seed
        As `tighten` takes them; the seed is that of the noise, too.
    noise : Noise
        Of the largest level, and the limit that the largest value of the time must not exceed, of all bushings or
        sensors; without a limit no contact at all.
    runner : Runner
        As `production` takes it.

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
        (found,) = random_production(designs, noise, seed, runner)
        return level * _over_level(found.by_design, limit, 3600 * noise.hours)

    what = f"{Limit(noise.quantity, limit).words if limit else 'contact'} within {noise.hours:g} h"
    unit = f"{level_axis(noise.psd.kind).unit} RMS"
    return _tightened(model, scatter, first_levels, level, unit, what, allowed, n_designs, seed)


def _over_level(found: Sequence[DesignPeaks], limit: float | None, time: float) -> np.ndarray:
    """Levels at which designs touch, or come to the limit, as likely as not, over that at which they were marched."""
    with np.errstate(divide="ignore"):
        if limit is not None:
            return limit / np.nan_to_num([each.median for each in found]).max(axis=1)
        touch, rate = (np.array([getattr(each, name) for each in found]).max(axis=1) for name in
                       ("impact_probability", "impacts_per_second"))  # fmt: skip
        impacts = np.where(rate > 0, rate * time, -np.log1p(-touch))
        most = IMPACTS * time
        return np.sqrt(np.log(most / np.minimum(impacts, most / 2)) / math.log(most / math.log(2)))


def _tightened(
    model: Model, scatter: Scatter | None, first_levels: FirstLevels, level: float, unit: str, what: str,
    allowed: float, n_designs: int, seed: int,
) -> Tightening:  # fmt: skip
    """What to tighten so that few enough designs have their first level below one."""
    if not 0 < allowed < 1:
        raise ClearanceError(f"allowed must be a share between 0 and 1, got {allowed!r}")
    scatter = scatter or Scatter.of_rig(model.rig)
    rule = scatter.rule(model)
    drawn = rule.draw(n_designs, seed)
    first, names = first_levels(drawn), tuple(number.of for number in scatter.numbers)
    share, share_limits = _share(first, level)
    learnt = learn(rule.deviations(drawn), np.log(np.minimum(first, LOOKED_AHEAD * level)))
    dense = rule.deviations(rule.draw(POINTS, seed))
    alone = _Shares(learnt, dense, math.log(level), rule.owner)
    widths, without = zip(*(_alone(alone, i, allowed) for i in range(len(scatter.numbers))))
    cheapest = _cheapest(alone, scatter, allowed) if alone.share() > allowed else {}
    prices = {number.of: number.price for number in scatter.numbers if number.price}
    tightened = scatter.narrowed(cheapest) if cheapest else scatter
    cost, new_share, limits = math.nan, math.nan, (math.nan, math.nan)
    if cheapest:
        cost = sum(prices[name] * (1 / width - 1) for name, width in cheapest.items())
        new_share, limits = _share(first_levels(tightened.draw(model, n_designs, seed)), level)
    found = Tightening(
        level, what, allowed, names, share, share_limits, np.array(widths), np.array(without), cheapest,
        cost, tightened, new_share, limits, 20 / math.log(10) * learnt.error, unit,
    )  # fmt: skip
    if share <= allowed or cheapest or np.any(found.width < 1):
        return found

    def with_gap(factor: float) -> np.ndarray:
        return first_levels(scatter.draw(model.with_gap(f"x{factor!r}"), n_designs, seed))

    factor, again = _gap(with_gap, first, level, allowed)
    gaps, (gap_share, limits) = tuple(factor * bushing.gap for bushing in model.rig.bushings), _share(again, level)
    return replace(found, gap=factor, gaps=gaps, gap_share=gap_share, gap_limits=limits)


def _gap(
    with_gap: Callable[[float], np.ndarray], first: np.ndarray, level: float, allowed: float
) -> tuple[float, np.ndarray]:
    """The factor of the gaps that leaves the share, or the best of those tried, and the first levels of its designs.

    Levels go with the gap at first; what designs about other gaps do says how they go, by secants over logarithms.
    """

    def margin(first: np.ndarray) -> float:
        return math.log(min(np.sort(first)[int(allowed * first.size)], LOOKED_AHEAD * level) / level)

    at, slope, margins = 0.0, 1.0, {0.0: margin(first)}
    found: dict[float, np.ndarray] = {}
    while slope and len(found) < GAPS_TRIED and not 0 < margins[at] < 5 * MARGIN:
        new = float(np.clip(at + (MARGIN - margins[at]) / slope, *np.log(GAPS)))
        if new in margins:
            break
        found[new] = with_gap(math.exp(new))
        margins[new] = margin(found[new])
        at, slope = new, (margins[new] - margins[at]) / (new - at)
    best = max(found, key=lambda each: (min(margins[each], 0.0), -abs(each)))
    return math.exp(best), found[best]


def _share(first: np.ndarray, level: float) -> tuple[float, tuple[float, float]]:
    """Share of designs whose first level is at most a level, and its interval."""
    share = float(np.mean(first <= level))
    low, high = share_interval(share, first.size)
    return share, (float(low), float(high))


class _Shares:
    """Shares of the designs that do what they must not, of any widths of the tolerances."""

    def __init__(self, learnt: Learnt, deviations: np.ndarray, level: float, owner: np.ndarray):
        self.learnt, self.deviations, self.level, self.owner = learnt, deviations, level, owner
        self.spread = max(learnt.error, SMOOTHED * float(np.std(learnt(deviations))), 1e-9)

    def share(self, widths: np.ndarray | None = None) -> float:
        """Return the share for widths (n_numbers,) of the scatter's numbers."""
        wide = self.deviations if widths is None else self.deviations * widths[self.owner]
        return float(np.mean(norm.cdf((self.level - self.learnt(wide)) / self.spread)))


def _alone(shares: _Shares, i: int, allowed: float) -> tuple[float, float]:
    """The largest width of one number alone that does, and the share that is left without its scatter."""

    def beyond(width: float) -> float:
        widths = np.ones(shares.owner.max() + 1)
        widths[i] = width
        return shares.share(widths) - allowed

    left = beyond(0.0) + allowed
    if beyond(1.0) <= 0:
        return 1.0, left
    return (math.nan if left > allowed else float(brentq(beyond, 0.0, 1.0, xtol=1e-4))), left


def _cheapest(shares: _Shares, scatter: Scatter, allowed: float) -> dict[str, float]:
    """Widths at the lowest price of those numbers that have one; empty if that does not do."""
    priced = [i for i, number in enumerate(scatter.numbers) if number.price]
    price = np.array([scatter.numbers[i].price for i in priced], dtype=float)

    def widths(logarithms: np.ndarray) -> np.ndarray:
        found = np.ones(len(scatter.numbers))
        found[priced] = np.exp(logarithms)
        return found

    def margin(logarithms: np.ndarray) -> float:
        return math.log(allowed) - math.log(max(shares.share(widths(logarithms)), 1e-12))

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
    found = best if margin(best) > -1e-2 else start
    return {scatter.numbers[i].of: float(math.exp(x)) for i, x in zip(priced, found) if x < -1e-3}
