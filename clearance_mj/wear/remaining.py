"""Remaining life from a history of gaps: coefficients of wear and hours to a limit, with intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError, RecordError
from ..core.kinds import checks_kinds
from ..model import Model
from ..signals.arrays import ArrayData
from ..statistics.shares import quantiles
from .clock import HORIZON, PaceSamples, find_pace
from .coefficients import spreads
from .growth import changed, clearances_of, with_clearances
from .history import GapHistory
from .life import Life, gap_limits, predict_life
from .operation import Operation
from .rubbing import footprints

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DRIFT", "Remaining", "predict_remaining"]

DRIFT = 0.4
"""Of log K over a time as long as the history, scale of its prior; chosen on virtual machines (docs/wear.md)"""
BEFORE = 4.0  # standard errors of the first gap by which the predicted way begins before it
ALONG = 3  # ways along the history, each with the coefficients of the one before: bushings change each other's rates
ENDLESS = 1e15  # h, for the way along the history, whose coefficient may be far off
COARSE = 0.02  # accuracy of a predicted way
SAMPLES = 2000
WAYS = 12  # drawn models, by default
NOISE = 4.5
"""Variance that a walk must have, per squared relative error of a marched rate and number of them on the way: rates of
the third that is known and of the rest, whose means are 3 and 1.5 times as uncertain as that of all, differ so"""
FLOOR = 1e-3  # of a bushing's quickest rate: slower is as good as not at all


@dataclass(frozen=True, eq=False, repr=False)
class Remaining(ArrayData):
    """What a history of gaps says of wear and of what is left of a machine's life."""

    history: GapHistory
    """what was found of the gaps"""
    life: Life
    """the way from the first gap on that the model goes, with the likeliest coefficients"""
    limit: np.ndarray
    """(n_bushings,) gaps at which life ends, m"""
    coefficient: np.ndarray
    """(n_bushings, m) samples of Archard's coefficient at the history's end, m²/N; nan without a history"""
    hours: np.ndarray
    """(n_bushings, m) samples of the hours from the history's end to each limit; infinite where it is not reached"""
    drift: np.ndarray
    """(n_bushings,) median of the random walk of log K over a time as long as the history"""
    misfit: np.ndarray
    """(n_bushings,) RMS of what the history misses, over its errors"""

    def interval(self, level: float = 0.9) -> np.ndarray:
        """Return limits (2, n_bushings) between which the remaining hours lie with a probability.

        Parameters
        ----------
        level : float
            Probability.
        """
        return quantiles(self.hours, [0.5 - level / 2, 0.5 + level / 2])

    def coefficient_interval(self, level: float = 0.9) -> np.ndarray:
        """Return limits (2, n_bushings) between which the coefficients lie with a probability, m²/N.

        Parameters
        ----------
        level : float
            Probability.
        """
        return quantiles(self.coefficient, [0.5 - level / 2, 0.5 + level / 2])

    @property
    def median(self) -> np.ndarray:
        """(n_bushings,) remaining hours that are as likely too few as too many."""
        return quantiles(self.hours, 0.5)

    def machine(self, level: float = 0.9) -> tuple[float, float, float]:
        """Return median and limits of the hours until the first bushing reaches its limit.

        Parameters
        ----------
        level : float
            Probability between the limits.
        """
        first = np.min(self.hours[list(self.history.known)], axis=0)
        low, middle, high = quantiles(first, [0.5 - level / 2, 0.5, 0.5 + level / 2])
        return float(middle), float(low), float(high)

    def words(self) -> list[str]:
        """Say in lines what is known of each bushing, and of the machine."""
        lines = []
        low, high = self.interval()
        k_low, k_high = 1e9 * self.coefficient_interval()
        for j in self.history.known:
            name = self.life.model.rig.clearance_labels[j]
            k = 1e9 * float(np.median(self.coefficient[j]))
            lines.append(
                f"{name}: wear {k:.3g} mm³/(N m) (90 %: {k_low[j]:.3g} to {k_high[j]:.3g}), "
                f"{self.median[j]:.4g} h to {1e3 * self.limit[j]:.4g} mm (90 %: {low[j]:.4g} to {high[j]:.4g} h)"
            )
        middle, first, last = self.machine()
        return [*lines, f"remaining life {middle:.4g} h (90 %: {first:.4g} to {last:.4g} h)"]

    def plot(self) -> Figure:
        """Draw each history with its way on: the median and the 90 % band, and the limits."""
        from ..core.drawing import canvas

        known = self.history.known
        figure = canvas(2.6 * len(known))
        for j, axes in zip(known, np.ravel(figure.subplots(len(known), 1, squeeze=False, sharex=True))):
            self._panel(axes, j)
        return figure

    def _panel(self, axes, j: int) -> None:  # type: ignore[no-untyped-def]
        from ..core.drawing import COLOURS, tidy

        hours, gap, std = self.history.of(j)
        axes.errorbar(hours, 1e3 * gap, 1.645e3 * std, fmt="o", ms=3, color="k", lw=0.8, label="history, 90 %")
        last, (low, high), middle = float(hours[-1]), self.interval()[:, j], float(self.median[j])
        for at, style, words in ((low, ":", "90 %"), (middle, "-", "median"), (high, ":", None)):
            if np.isfinite(at):
                axes.plot([last, last + at], [1e3 * gap[-1], 1e3 * self.limit[j]], style, color=COLOURS[0], label=words)
        axes.axhline(1e3 * self.limit[j], color=COLOURS[1], lw=0.8, ls="--", label="limit")
        tidy(axes, self.life.model.rig.clearance_labels[j], "Gap (mm)", "Time in operation (h)")
        axes.legend(frameon=False, fontsize="small")


@checks_kinds
def predict_remaining(
    model: Model, operation: Operation, history: GapHistory, limit: float | str | Mapping[str, float | str],
    drift: float = DRIFT, n_ways: int = WAYS, seed: int = 0, progress: bool = False,
) -> Remaining:  # fmt: skip
    """Predict what is left of a machine's life from the history of its gaps.

    The model says how the rate of wear changes with the gap; the history says the coefficients, and how much of the way
    is gone. A coefficient is not quite constant: its logarithm walks at random, how far is estimated too.

    Parameters
    ----------
    model : Model
        Rig and law; its bushings' ``wear`` is where the search begins, and with a tolerance a prior.
    operation : Operation
        How the machine has run and goes on.
    history : GapHistory
        Of one or more bushings.
    limit : float, str or mapping
        Gap at which life ends, as for `predict_life`.
    drift : float
        Scale of the prior of the walk: standard deviation of log K over a time as long as the history.
    n_ways : int
        Number of models drawn from the model's posterior, if it has one, of which each goes its own way from gap to
        gap; the history weighs them. Where wear is about to stop, they decide.
    seed : int
        Seed of the random numbers.
    progress : bool
        Show progress bars.

    Returns
    -------
    Remaining

    Raises
    ------
    RecordError
        If the history has other bushings than the rig, or of none that wears.
    ClearanceError
        As `predict_life`, and if a gap of the history is beyond its limit.
    """
    footprints(model.rig)
    if history.gap.shape[1] != len(model.rig.bushings):
        raise RecordError(f"the history has {history.gap.shape[1]} bushings, the rig {len(model.rig.bushings)}")
    known = [j for j in history.known if model.rig.bushings[j].wear]
    if not known or len(known) < len(history.known):
        raise RecordError("every bushing with a history needs a coefficient of wear in the rig, at least a rough one")
    if not 0 < drift < np.inf:
        raise ClearanceError(f"drift must be > 0 and finite, got {drift!r}")
    limits, rng = gap_limits(model, limit), np.random.default_rng(seed)

    def found(way: Model, wanted: dict[str, float], hours: float) -> _Found:
        life = predict_life(way, operation, wanted, hours, COARSE, progress)
        return _Found(life, history, limits, {j: _pace(model, life, history, j, drift, rng) for j in known}, rng)

    seen = {f"bushings[{j}]": float(np.max(history.of(j)[1])) for j in known}
    way = _begun(model, history, known, limits)
    for _ in range(ALONG):
        rough = found(way, seen, ENDLESS)
        way = changed(way, ({"wear": k} for k in rough.coefficients))
    slowest = max(known, key=lambda j: float(np.median(rough.hours[j])))
    wanted = {f"bushings[{slowest}]": float(limits[slowest])}
    hours, ways = HORIZON * max(pace.span for pace in rough.paces.values()), []
    for each in tqdm([model, *model.drawn(n_ways)], desc="ways", disable=not (progress and model.posterior)):
        way = changed(_begun(each, history, known, limits), ({"wear": k} for k in rough.coefficients))
        try:
            ways.append(found(way, wanted, hours))
        except RecordError:
            if each is model:
                raise  # a drawn model may not rub at all
    return _mixed(ways, rng)


class _Found:
    """What one predicted way makes of a history."""

    def __init__(
        self, life: Life, history: GapHistory, limits: np.ndarray, paces: dict[int, PaceSamples],
        rng: np.random.Generator,
    ):  # fmt: skip
        self.life, self.history, self.limits, self.paces = life, history, limits, paces
        self.hours = {j: pace.hours_to(_hour_at(life, j, float(limits[j])), rng) for j, pace in paces.items()}

    @property
    def coefficients(self) -> list[float | None]:
        """Likeliest coefficients at the end of the history, of all bushings."""
        return [
            (k or 0.0) * float(np.exp(np.median(self.paces[j].log_pace))) if j in self.paces else k
            for j, k in enumerate([bushing.wear for bushing in self.life.model.rig.bushings])
        ]

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence of all histories."""
        return sum(pace.log_evidence for pace in self.paces.values())


def _mixed(ways: list[_Found], rng: np.random.Generator) -> Remaining:
    """The samples of all ways, each as often as the history says; arrays with a row for each bushing."""
    first = ways[0]
    log_weights = np.array([way.log_evidence for way in ways])
    weights = np.exp(log_weights - log_weights.max())
    chosen = rng.choice(len(ways), SAMPLES, p=weights / weights.sum())
    n, each = len(first.limits), np.arange(SAMPLES)
    k, hours, drift = np.full((3, n, SAMPLES), np.nan)
    for j in first.paces:
        own = [way.life.model.rig.bushings[j].wear or 0.0 for way in ways]
        k[j] = np.array([q * np.exp(way.paces[j].log_pace) for q, way in zip(own, ways)])[chosen, each]
        hours[j] = np.array([way.hours[j] for way in ways])[chosen, each]
        drift[j] = np.array([way.paces[j].drift for way in ways])[chosen, each]
    misfit = np.array([first.paces[j].misfit if j in first.paces else np.nan for j in range(n)])
    return Remaining(first.history, first.life, first.limits, k, hours, np.median(drift, axis=1), misfit)


def _begun(model: Model, history: GapHistory, known: list[int], limits: np.ndarray) -> Model:
    """The model a little before the first gap of the history."""
    clearances = clearances_of(model.rig)
    for j in known:
        hours, gap, std = history.of(j)
        if gap[-1] - std[-1] >= limits[j]:
            raise ClearanceError(
                f"the history of bushings[{j}] ends at {gap[-1]:g} m, beyond its gap limit {limits[j]:g} m: no life "
                "is left"
            )
        line, covariance = np.polyfit(hours - hours[0], gap, 1, w=1 / std, cov="unscaled")
        first = float(line[1])
        first -= BEFORE * min(float(np.sqrt(covariance[1, 1])), 0.2 * first / BEFORE)
        offsets = clearances[j, 1:] * min(1.0, first / clearances[j, 0])
        clearances[j] = first, *offsets
    return with_clearances(model, clearances)


def _pace(model: Model, life: Life, history: GapHistory, j: int, drift: float, rng: np.random.Generator) -> PaceSamples:
    """What a bushing's history says along a predicted way."""
    hours, gap, std = history.of(j)
    if not np.ptp(life.gap[:, j]) > 0:
        raise RecordError(f"bushings[{j}] does not rub in the model, but its history is to say how it wears")
    own, rough = life.model.rig.bushings[j].wear or 1.0, model.rig.bushings[j].wear or 1.0
    prior = float(np.log(rough / own)), float(spreads(model.rig)[j])
    gap_of, slope_of = _way(life, j)
    start = _hour_at(life, j, float(np.polyval(np.polyfit(hours - hours[0], gap, 1, w=1 / std), 0.0)))
    rubs = life.rubbing[:, j] > 0
    noise = NOISE * np.mean((life.error[rubs, j] / life.rubbing[rubs, j]) ** 2) / np.sum(rubs)
    drift = float(np.sqrt(drift**2 + noise))
    return find_pace(hours, gap, std, gap_of, slope_of, start, prior, drift, SAMPLES, rng)


def _way(life: Life, j: int) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """Gap and rate of a bushing over hours of a predicted life, straight on beyond both ends."""
    last, hours = float(life.hours[-1]), life.hours
    rates = np.maximum(life.rate[:, j], FLOOR * life.rate[:, j].max())

    def gap_of(at: np.ndarray) -> np.ndarray:
        beyond, before = np.maximum(at - last, 0.0), np.minimum(at, 0.0)
        return np.asarray(life.gap_at(at)[..., j] + beyond * rates[-1] + before * rates[0])

    def slope_of(at: np.ndarray) -> np.ndarray:
        return np.interp(at, hours, rates)

    return gap_of, slope_of


def _hour_at(life: Life, j: int, gap: float) -> float:
    """Hour of a predicted life at which a bushing has a gap; straight on beyond both ends, if it wears there."""
    gaps, hours, rate = life.gap[:, j], life.hours, life.rate[:, j]
    if gap <= gaps[0]:
        return float((gap - gaps[0]) / max(rate[0], FLOOR * rate.max()))
    if gap > gaps[-1] * (1 + 1e-6):
        if life.ended == "no rubbing" or not rate[-1] > 0:
            return np.inf
        return float(hours[-1] + (gap - gaps[-1]) / rate[-1])
    fine = np.linspace(0.0, hours[-1], 20 * hours.size)
    return float(np.interp(gap, np.maximum.accumulate(life.gap_at(fine)[:, j]), fine))
