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
from .clock import HORIZON, PaceSamples, fit_wear_rate
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
"""Scale of the prior of the drift of log K over a time as long as the history; chosen on virtual machines
(docs/wear.md)"""
BEFORE = 4.0  # standard errors of the first gap by which the predicted life begins before it
ALONG = 3  # predictions along the history, each with the coefficients of the one before: bushings are coupled
ENDLESS = 1e15  # h, for predictions along the history, whose coefficient may be far off
COARSE = 0.02  # accuracy of a predicted life
SAMPLES = 2000
WAYS = 12  # default number of drawn models
NOISE = 4.5
"""Least variance of a walk, per squared relative error of a marched rate and number of rates: the means of the known
third and of the remaining rates are 3 and 1.5 times as uncertain as that of all, and differ by so much"""
FLOOR = 1e-3  # of a bushing's fastest rate: lower bound of rates


@dataclass(frozen=True, eq=False, repr=False)
class Remaining(ArrayData):
    """Wear and remaining life of a machine from a history of gaps."""

    history: GapHistory
    """the measured gaps"""
    life: Life
    """predicted life from the first gap on, with the likeliest coefficients"""
    limit: np.ndarray
    """(n_bushings,) gaps at which life ends, m"""
    coefficient: np.ndarray
    """(n_bushings, m) samples of Archard's coefficient at the history's end, m²/N; nan without a history"""
    hours: np.ndarray
    """(n_bushings, m) samples of the hours from the history's end to each limit; infinite where it is not reached"""
    drift: np.ndarray
    """(n_bushings,) median of the random walk of log K over a time as long as the history"""
    misfit: np.ndarray
    """(n_bushings,) RMS of the history's residuals, over its errors"""

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
        """(n_bushings,) median of the remaining hours."""
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
        """Return sentences on each bushing, and on the machine."""
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
        """Draw each history with its prediction: the median, the 90 % band, and the limits."""
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
    """Predict the remaining life of a machine from the history of its gaps.

    The model gives the rate of wear over the gap; the history gives the coefficients, and the progress of wear. A
    coefficient is not quite constant: its logarithm is a random walk, whose scale is estimated too.

    Parameters
    ----------
    model : Model
        Rig and law; its bushings' ``wear`` is the initial guess, and with a tolerance a prior.
    operation : Operation
        Operation of the machine, before and after.
    history : GapHistory
        History of one or more bushings.
    limit : float, str or mapping
        Gap at which life ends, as for `predict_life`.
    drift : float
        Scale of the prior of the walk: standard deviation of log K over a time as long as the history.
    n_ways : int
        Number of models drawn from the model's posterior, if it has one, each with another predicted life; the history
        weighs them. Where wear is about to stop, they decide.
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

    def fit(start: Model, ends: dict[str, float], hours: float) -> _Fit:
        life = predict_life(start, operation, ends, hours, COARSE, progress)
        return _Fit(life, history, limits, {j: _fit(model, life, history, j, drift, rng) for j in known}, rng)

    last_gaps = {f"bushings[{j}]": float(np.max(history.of(j)[1])) for j in known}
    start = _model_at_start(model, history, known, limits)
    for _ in range(ALONG):
        rough = fit(start, last_gaps, ENDLESS)
        start = changed(start, ({"wear": k} for k in rough.coefficients))
    slowest = max(known, key=lambda j: float(np.median(rough.hours[j])))
    limit_by_name = {f"bushings[{slowest}]": float(limits[slowest])}
    hours, fits = HORIZON * max(pace.span for pace in rough.paces.values()), []
    for drawn in tqdm([model, *model.drawn(n_ways)], desc="ways", disable=not (progress and model.posterior)):
        start = changed(_model_at_start(drawn, history, known, limits), ({"wear": k} for k in rough.coefficients))
        try:
            fits.append(fit(start, limit_by_name, hours))
        except RecordError:
            if drawn is model:
                raise  # a drawn model may not rub at all
    return _mix(fits, rng)


class _Fit:
    """Fit of one predicted life to a history."""

    def __init__(
        self, life: Life, history: GapHistory, limits: np.ndarray, paces: dict[int, PaceSamples],
        rng: np.random.Generator,
    ):  # fmt: skip
        self.life, self.history, self.limits, self.paces = life, history, limits, paces
        self.hours = {j: pace.hours_to(_hour_at(life, j, float(limits[j])), rng) for j, pace in paces.items()}

    @property
    def coefficients(self) -> list[float | None]:
        """Return the likeliest coefficients at the end of the history, of all bushings."""
        return [
            (k or 0.0) * float(np.exp(np.median(self.paces[j].log_pace))) if j in self.paces else k
            for j, k in enumerate([bushing.wear for bushing in self.life.model.rig.bushings])
        ]

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence of all histories."""
        return sum(pace.log_evidence for pace in self.paces.values())


def _mix(fits: list[_Fit], rng: np.random.Generator) -> Remaining:
    """Mix the samples of all predictions by their evidence; arrays with a row for each bushing."""
    first = fits[0]
    log_weights = np.array([way.log_evidence for way in fits])
    weights = np.exp(log_weights - log_weights.max())
    chosen = rng.choice(len(fits), SAMPLES, p=weights / weights.sum())
    n, sample = len(first.limits), np.arange(SAMPLES)
    k, hours, drift = np.full((3, n, SAMPLES), np.nan)
    for j in first.paces:
        coefficients = [way.life.model.rig.bushings[j].wear or 0.0 for way in fits]
        k[j] = np.array([q * np.exp(way.paces[j].log_pace) for q, way in zip(coefficients, fits)])[chosen, sample]
        hours[j] = np.array([way.hours[j] for way in fits])[chosen, sample]
        drift[j] = np.array([way.paces[j].drift for way in fits])[chosen, sample]
    misfit = np.array([first.paces[j].misfit if j in first.paces else np.nan for j in range(n)])
    return Remaining(first.history, first.life, first.limits, k, hours, np.median(drift, axis=1), misfit)


def _model_at_start(model: Model, history: GapHistory, known: list[int], limits: np.ndarray) -> Model:
    """Return the model a little before the first gap of the history."""
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
        clearances[j] = first, *(clearances[j, 1:] * min(1.0, first / clearances[j, 0]))
    return with_clearances(model, clearances)


def _fit(model: Model, life: Life, history: GapHistory, j: int, drift: float, rng: np.random.Generator) -> PaceSamples:
    """Fit a bushing's history to a predicted life."""
    hours, gap, std = history.of(j)
    if not np.ptp(life.gap[:, j]) > 0:
        raise RecordError(f"bushings[{j}] does not rub in the model, but its history is to say how it wears")
    predicted, nominal = life.model.rig.bushings[j].wear or 1.0, model.rig.bushings[j].wear or 1.0
    prior = float(np.log(nominal / predicted)), float(spreads(model.rig)[j])
    gap_of, slope_of = _extrapolated(life, j)
    start = _hour_at(life, j, float(np.polyval(np.polyfit(hours - hours[0], gap, 1, w=1 / std), 0.0)))
    is_rubbing = life.rubbing[:, j] > 0
    noise = NOISE * np.mean((life.error[is_rubbing, j] / life.rubbing[is_rubbing, j]) ** 2) / np.sum(is_rubbing)
    drift = float(np.sqrt(drift**2 + noise))
    return fit_wear_rate(hours, gap, std, gap_of, slope_of, start, prior, drift, SAMPLES, rng)


def _extrapolated(life: Life, j: int) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """Return gap and rate of a bushing over hours of a predicted life, linear beyond both ends."""
    last, hours = float(life.hours[-1]), life.hours
    rates = np.maximum(life.rate[:, j], FLOOR * life.rate[:, j].max())

    def gap_of(at: np.ndarray) -> np.ndarray:
        beyond, before = np.maximum(at - last, 0.0), np.minimum(at, 0.0)
        return np.asarray(life.gap_at(at)[..., j] + beyond * rates[-1] + before * rates[0])

    def slope_of(at: np.ndarray) -> np.ndarray:
        return np.interp(at, hours, rates)

    return gap_of, slope_of


def _hour_at(life: Life, j: int, gap: float) -> float:
    """Return the hour of a predicted life at which a bushing has a gap; linear beyond both ends, if it wears there."""
    gaps, hours, rate = life.gap[:, j], life.hours, life.rate[:, j]
    if gap <= gaps[0]:
        return float((gap - gaps[0]) / max(rate[0], FLOOR * rate.max()))
    if gap > gaps[-1] * (1 + 1e-6):
        if life.ended == "no rubbing" or not rate[-1] > 0:
            return np.inf
        return float(hours[-1] + (gap - gaps[-1]) / rate[-1])
    fine = np.linspace(0.0, hours[-1], 20 * hours.size)
    return float(np.interp(gap, np.maximum.accumulate(life.gap_at(fine)[:, j]), fine))
