"""Which tolerance to tighten, and how far, so that few enough designs touch or exceed a limit.

The lowest level at which a design touches (or exceeds the limit) is learnt from designs of the production as it stands,
as a function of how far each number is from its middle; what the function misses is known by cross-validation and goes
into every share. The answer is then computed anew with designs of the tightened scatter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize
from scipy.stats import norm

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..model import Model
from ..periodic.axes import level_axis
from .batches import settings_of, total_of
from .designs import DrawingRule
from .learnt import Learnt, learn
from .limits import Limit
from .scatter import Scatter
from .shares import share_interval

__all__ = ["Tightening", "tighten"]

LOOKED_AHEAD = 3.0  # times the level, up to which designs are followed: what the function is learnt from
POINTS = 2**13  # of the production, at which the learnt function is read
SMOOTHED = 0.05  # of the level's standard deviation: by which shares are smooth functions of tolerances at least
NARROWEST = 0.02  # share of a tolerance below which none is tightened


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

    def rows(self) -> list[dict[str, Any]]:
        """Return a row of plain data for each number."""
        return [
            {"number": name, "width_alone": float(width), "share_without": float(left)}
            | ({"width_cheapest": float(self.cheapest.get(name, 1.0))} if self.cheapest else {})
            for name, width, left in zip(self.names, self.width, self.share_without)
        ]


@checks_kinds
def tighten(
    model: Model, scatter: Scatter | None, limit: Limit | str | None, level: float, frequencies: ArrayLike,
    allowed: float = 0.01, n_designs: int = 500, seed: int = 0, kind: str | None = None,
    n_harmonics: int | None = None, n_samples: int | None = None, n_modes: int = 8, workers: int | None = None,
    scheduler: str | None = None, executor: Executor | None = None, progress: bool = False, kept: Path | None = None,
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
    limit : Limit or str or None
        What must not be exceeded; None: no contact at all.
    level : float
        Amplitude of the excitation, m/s², N or a factor of the unbalances, up to which they must not.
    frequencies : array_like
        (n,) Hz, increasing; at none of them.
    allowed : float
        Share of the designs that may.
    n_designs : int
        How many are computed, of the scatter as it stands and of the cheapest one each.
    seed : int
        Of the draws.
    kind, n_harmonics, n_samples, n_modes, workers, scheduler, executor
        As `production` takes them.
    progress : bool
        Show progress bars.
    kept : Path, optional
        Folder, of this call alone, for what is done, so that an interrupted one goes on where it stopped.

    Returns
    -------
    Tightening

    Raises
    ------
    ClearanceError
        If the share is impossible, or no design does what it must not, so that there is nothing to tighten.
    """
    if not 0 < allowed < 1:
        raise ClearanceError(f"allowed must be a share between 0 and 1, got {allowed!r}")
    scatter = scatter or Scatter.of_rig(model.rig)
    settings = settings_of(model, [LOOKED_AHEAD * level], frequencies, limit, kind, n_harmonics, n_samples, n_modes)
    what = settings.limit.words if settings.limit else "contact"
    rule, unit = scatter.rule(model), level_axis(settings.kind).unit

    def compute(rule: DrawingRule, kept: Path | None) -> tuple[np.ndarray, np.ndarray]:
        """Lowest levels (n_designs,) at which designs do what they must not, and their deviations."""
        drawn = rule.draw(n_designs, seed)
        found = total_of(settings, drawn, workers, scheduler, executor, "designs" if progress else "", kept)
        return found.first_exceeding if settings.limit else found.first_contact, rule.deviations(drawn)

    first, deviation = compute(rule, kept)
    if not np.any(np.isfinite(first)):
        raise ClearanceError(
            f"{what}: none of {n_designs} designs comes to it up to {LOOKED_AHEAD:g} times the level {level:g} {unit}; "
            "give a lower limit or a higher level"
        )
    learnt = learn(deviation, np.log(np.minimum(first, LOOKED_AHEAD * level)))
    dense = rule.deviations(rule.draw(POINTS, seed))
    alone = _Shares(learnt, dense, math.log(level), rule.owner)
    widths, without = zip(*(_alone(alone, i, allowed) for i in range(len(scatter.numbers))))
    names = tuple(number.of for number in scatter.numbers)
    cheapest = _cheapest(alone, scatter, allowed) if alone.share() > allowed else {}
    prices = {number.of: number.price for number in scatter.numbers if number.price}
    tightened = scatter.narrowed(cheapest) if cheapest else scatter
    share = float(np.mean(first <= level))
    new_share, limits = math.nan, (math.nan, math.nan)
    if cheapest:
        again, _ = compute(tightened.rule(model), kept and kept / "tightened")
        new_share = float(np.mean(again <= level))
        limits = _limits(new_share, n_designs)
    return Tightening(
        level, what, allowed, names, share, _limits(share, n_designs), np.array(widths), np.array(without), cheapest,
        sum(prices[name] * (1 / width - 1) for name, width in cheapest.items()) if cheapest else math.nan, tightened,
        new_share, limits, 20 / math.log(10) * learnt.error, unit,
    )  # fmt: skip


def _limits(share: float, designs: int) -> tuple[float, float]:
    low, high = share_interval(share, designs)
    return float(low), float(high)


class _Shares:
    """Shares of the designs that do what they must not, of any widths of the tolerances."""

    def __init__(self, learnt: Learnt, deviations: np.ndarray, level: float, owner: np.ndarray):
        self.learnt, self.deviations, self.level, self.owner = learnt, deviations, level, owner
        self.spread = max(learnt.error, SMOOTHED * float(np.std(learnt(deviations))))

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

    def room(logarithms: np.ndarray) -> float:
        return math.log(allowed) - math.log(max(shares.share(widths(logarithms)), 1e-12))

    lowest = np.full(len(priced), math.log(NARROWEST))
    if not priced or room(lowest) < 0:
        return {}

    def cost(logarithms: np.ndarray) -> float:
        return float(np.sum(price * np.expm1(-logarithms)) / price.sum())

    start = np.full(len(priced), float(brentq(lambda x: room(np.full(len(priced), x)), lowest[0], 0.0, xtol=1e-3)))
    best = minimize(
        cost, start, method="SLSQP", bounds=[(lowest[0], 0.0)] * len(priced), constraints={"type": "ineq", "fun": room},
        options={"maxiter": 60, "ftol": 1e-6},
    ).x  # fmt: skip
    found = best if room(best) > -1e-2 else start
    return {scatter.numbers[i].of: float(math.exp(x)) for i, x in zip(priced, found) if x < -1e-3}
