"""Output-error identification of a MuJoCo model's clearances and joints from records."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ...core.errors import ModelError, RecordError, SimulationError
from ...estimate import Combination, Estimates, Parameter, Solution, StoppingCriteria, principal_deviations, solve
from ...estimate.covariance import jackknife, student_widening
from ...estimate.estimates import COUNTS, UNIDENTIFIED
from .comparison import GUIDANCE, FitStage, Prediction, SimulationResiduals
from .quantities import open_parameters, written_into
from .record import ModelRecord

__all__ = ["ModelFit", "fit_model"]

GUIDED_DURATION = 5.0  # s, of guided simulations
ROUGH = StoppingCriteria(25, decrease=1e-2, move=0.0)  # of guided fits, and of the first unguided one
LAST = StoppingCriteria(6, decrease=-0.03, move=0.01)
"""of the last fit: jumps of trajectories make its cost noisy, by a hundredth between neighbouring points"""
STATE = StoppingCriteria(25, decrease=1e-3, move=0.0)  # of a fit of a prediction's initial state
DAMPINGS = (1e-6, 1e-2, 1e-1, 1.0)  # times the precision's diagonal, all tried at once
LONGEST_STEP = 1.0  # of a logarithm
STATE_DURATION = 1.0  # s, beginning of a record, from which a prediction's initial state is fitted
BLOCKS = 30  # of all records, within which residuals may depend on each other
UNKNOWN_STD = 10.0  # of a logarithm, above which a parameter is refused as not identifiable
MISFIT = 3.0  # residual over noise, above which other starts are tried and a note is given
SAME = 0.05  # difference of mean log residuals, below which two starts have found the same minimum
AT_BOUND = 1e-3  # relative distance to a bound, below which a value lies on it
SPREAD = 2.0  # largest factor between a drawn start and the given one


@dataclass(frozen=True, eq=False, repr=False)
class ModelFit:
    """A MuJoCo model fitted to records."""

    spec: mujoco.MjSpec
    """with the fitted values; `physical.compile` makes the model of it"""
    estimates: Estimates
    """of the parameters, fitted as logarithms; intervals hold for correlated residuals"""
    predictions: tuple[Prediction, ...]
    """of the fitted records"""
    noise: dict[str, float]
    """RMS of each sensor's whitened residual, in its unit: noise and quantisation"""
    simulations: int
    """number of simulations of a whole record"""
    starts: int = 1
    """number of starts, of which this is the best fit"""

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name, SI units."""
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))

    @property
    def residual(self) -> dict[str, float]:
        """RMS of each sensor's residual over all records, in its unit."""
        squares = {n: np.concatenate([np.ravel(p.residual[n]) for p in self.predictions if n in p.residual]) ** 2
                   for p in self.predictions for n in p.residual}  # fmt: skip
        return {name: float(np.sqrt(s.mean())) for name, s in squares.items()}

    @property
    def misfit(self) -> dict[str, float]:
        """Residual of each sensor over its noise: 1 for a model without error."""
        return {name: residual / self.noise[name] for name, residual in self.residual.items()}

    @property
    def not_told(self) -> tuple[str, ...]:
        """Unidentified parameters: standard deviation above half of the value, or half of the prior."""
        e = self.estimates
        limits = (UNIDENTIFIED if p.transform == "log" else UNIDENTIFIED * p.known_std for p in e.parameters)
        return tuple(name for name, std, limit in zip(e.names, e.varied_std, limits) if not std < limit)

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings in sentences: misfit, values on bounds, and unidentified parameters."""
        notes = [
            f"the residual of {name} is {ratio:.3g} times its noise, after {self.starts} starts: the model does not "
            "move as recorded (what it lacks, a number that is taken for known, or its step); intervals are wider by "
            "that factor"
            for name, ratio in self.misfit.items() if ratio > MISFIT
        ]  # fmt: skip
        notes += [
            f"{p.name} ended at its bound {value:.4g} {p.unit}".rstrip()
            for p, value in zip(self.estimates.parameters, self.estimates.value)
            if p.low < p.high and not p.low * (1 + AT_BOUND) < value < p.high * (1 - AT_BOUND)
        ]
        return (*notes, *(f"{name} is not told by these records" for name in self.not_told))

    def predict(self, record: ModelRecord) -> Prediction:
        """Simulate another record freely, from an initial state fitted to its first second.

        Parameters
        ----------
        record : ModelRecord
            With controls, and some of the sensors.

        Raises
        ------
        RecordError
            For a record that does not fit the model.
        """
        fixed = [replace(p, low=v, high=v) for p, v in zip(self.estimates.parameters, self.estimates.value.tolist())]
        comparison = SimulationResiduals(self.spec, fixed, [record])
        guided = FitStage(GUIDANCE[-1] if comparison.simulators[0].guides else 0.0, np.ones(len(comparison.channels)))
        comparison.weigh(self.estimates.value, guided)
        free = comparison.freed(self.estimates.value, guided)
        free.duration = STATE_DURATION
        solution = _solve_stage(comparison, self.estimates.value, free, STATE)
        free.duration = math.inf
        return comparison.prediction(0, solution.values, free)

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return a table as text: estimates with 95 % intervals, residuals, unidentified parameters, and notes."""
        low, high = self.estimates.interval()
        width = max(map(len, self.estimates.names))
        lines = [
            f"{p.name:<{width}}  {v:10.4g}  95 %: {a:.4g} to {b:.4g} {p.unit}"
            + ("  not identified" if p.name in self.not_told else "")
            for p, v, a, b in zip(self.estimates.parameters, self.estimates.value, low, high)
        ]  # fmt: skip
        lines += [f"residual of {n}: {r:.3g} RMS, noise {self.noise[n]:.3g}" for n, r in self.residual.items()]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])


def fit_model(
    spec: mujoco.MjSpec, records: ModelRecord | Sequence[ModelRecord],
    parameters: Sequence[str | Parameter] | Mapping[str, tuple[float, float]], starts: int = 3, seed: int = 0,
) -> ModelFit:  # fmt: skip
    """Fit a MuJoCo model's clearances and joints to records by output error.

    Simulations under the recorded controls are compared with the recorded sensors. At first they are guided: a spring
    and damper pull measured joints and tendons towards the record, so that errors do not accumulate and an unmeasured
    drive follows by the model's physics. Then the model moves freely over the whole record, from an initial state
    that is estimated too, and an autoregressive model of each sensor's residual whitens it. Derivatives are
    differences over wide steps, since trajectories jump where teeth meet between two steps of the model. The
    covariance is a jackknife over blocks of the records, within which residuals may be correlated, plus that of these
    jumps.

    Controls are linear between samples (or held, see `ModelRecord`), the model's step is the nearest below its own of
    which the sampling interval is a multiple. Counting sensors are taken as rounded to the nearest count, evenly
    distributed within it. ``mujoco.sysid`` has no guidance, no unmeasured states, no intervals for correlated
    residuals, and needs one more library; simulations run in ``mujoco.batch``, on all threads.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Its clearances marked by `clearance_mj.physical`; parameters start where it has them. Not changed.
    records : ModelRecord or sequence of ModelRecord
        All with the same sensors.
    parameters : sequence of str or Parameter, or Mapping of str to (low, high)
        "ELEMENT.QUANTITY": k or c of a contact, limit or clearance, gap of a clearance, friction of bristles;
        damping, frictionloss, stiffness or armature of a hinge or slide. Bounds are a factor of 100 to both sides
        unless given.
    starts : int
        Largest number of starts: the given one and, while the residual exceeds the noise and no two fits agree, others
        drawn about it; the best fit is returned.
    seed : int
        Of the random starts.

    Returns
    -------
    ModelFit
        Estimates with intervals, the fitted specification, residuals, and predictions of other records.

    Raises
    ------
    ModelError
        For elements or quantities that the model does not have, and parameters that are not identifiable.
    RecordError
        For records that do not fit the model.
    SimulationError
        If the step is too long for the parameters of an iteration.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ModelError(f"got {type(spec).__name__}, needs a mujoco.MjSpec")
    records = [records] if isinstance(records, ModelRecord) else list(records)
    if not records or not all(isinstance(r, ModelRecord) for r in records):
        raise RecordError("records must be one or several of ModelRecord")
    if starts < 1:
        raise ModelError(f"starts is {starts}; a search needs one at least")
    comparison = SimulationResiduals(spec, open_parameters(spec, parameters), records)
    fits: list[ModelFit] = []
    for values in _starts(comparison.parameters, starts, seed):
        try:
            fits.append(_fit_from(spec, comparison, values))
        except SimulationError:  # a drawn start may be too stiff for the model's step, the given one must not be
            if not fits:
                raise
        fits.sort(key=_log_residual)
        reproduced = len(fits) > 1 and _log_residual(fits[1]) - _log_residual(fits[0]) < SAME
        if reproduced or max(fits[0].misfit.values()) < MISFIT:
            break
    best = fits[0]
    widened = best.estimates.widened(max(1.0, *best.misfit.values()))
    return replace(best, estimates=widened, simulations=comparison.simulations, starts=len(fits))


def _log_residual(fit: ModelFit) -> float:
    """Return the mean logarithm of the residuals, which ranks fits independently of the sensors' units."""
    return sum(math.log(max(residual, 1e-300)) for residual in fit.residual.values()) / len(fit.residual)


def _starts(parameters: Sequence[Parameter], count: int, seed: int) -> Iterator[np.ndarray]:
    """Yield the given start (n_parameters,), then random ones about it, within the bounds."""
    rng = np.random.default_rng(seed)
    low, start, high = np.array([[p.low, p.start, p.high] for p in parameters]).T
    spreads = [math.log(SPREAD) if p.transform == "log" else p.known_std for p in parameters]
    for i in range(count):
        moves = [spread * rng.uniform(-1, 1) for spread in spreads] if i else np.zeros(len(spreads))
        trial = [float(p.from_varied(np.array(p.to_varied(p.start) + move))) for p, move in zip(parameters, moves)]
        yield np.clip(trial if i else start, low, high)


def _fit_from(spec: mujoco.MjSpec, comparison: SimulationResiduals, values: np.ndarray) -> ModelFit:
    """Fit from values (n_parameters,): guided at first, then by free motion over the whole record."""
    stage = FitStage(0.0, np.ones(len(comparison.channels)))
    for bandwidth in GUIDANCE if comparison.simulators[0].guides else ():
        stage = FitStage(bandwidth, np.ones(len(comparison.channels)), duration=GUIDED_DURATION)
        comparison.weigh(values, stage)
        values = _solve_stage(comparison, values, stage, ROUGH).values
        comparison.weigh(values, stage)
    free = comparison.freed(values, stage)
    coarse = _solve_stage(comparison, values, free, ROUGH)
    comparison.whiten(coarse.values, free)
    return _result(spec, comparison, _solve_stage(comparison, coarse.values, free, LAST, coarse.at), free)


def _solve_stage(
    comparison: SimulationResiduals, values: np.ndarray, stage: FitStage, stop: StoppingCriteria,
    start: np.ndarray | None = None,
) -> Solution:  # fmt: skip
    """Minimize the sum of squares of a stage, from parameters (n_parameters, ...) and, if given, states."""
    count = len(comparison.parameters)
    problem = comparison.problem(values[:count], stage)
    point = np.zeros(problem.size)
    if start is not None:
        point[count:] = start[count:]
    return solve(problem, point, stop=stop, dampings=DAMPINGS, longest=LONGEST_STEP)


def _result(spec: mujoco.MjSpec, comparison: SimulationResiduals, solution: Solution, stage: FitStage) -> ModelFit:
    count = len(comparison.parameters)
    _require_identifiable(comparison.parameters, solution.jacobian)
    covariance = _covariance(solution, comparison.jumps[solution.at.tobytes()])
    estimates = Estimates.of(comparison.parameters, solution.values[:count], covariance[:count, :count])
    noise = {c: float(1 / f[0]) for c, f in zip(comparison.channels, stage.filters or [])}
    fitted = written_into(spec, dict(zip(estimates.names, estimates.value)))
    predictions = tuple(comparison.prediction(i, solution.values, stage) for i in range(len(comparison.simulators)))
    return ModelFit(fitted, estimates, predictions, noise, comparison.simulations)


def _require_identifiable(parameters: Sequence[Parameter], jacobian: np.ndarray) -> None:
    """Raise ModelError for a combination of parameters that the records do not determine."""
    slopes, states = np.split(jacobian, [len(parameters)], axis=1)
    if states.shape[1]:
        slopes = slopes - states @ np.linalg.solve(states.T @ states + np.eye(states.shape[1]), states.T @ slopes)
    direction, std = principal_deviations(slopes)
    for row, deviation in zip(direction, std):
        if deviation > UNKNOWN_STD:
            exponent = {p.name: float(x) for p, x in zip(parameters, row) if abs(x) > COUNTS}
            raise ModelError(f"the records say nothing about {Combination(exponent, float(deviation))}")


def _covariance(solution: Solution, jumps: Sequence[np.ndarray]) -> np.ndarray:
    """Return the covariance: a jackknife over blocks, widened by Student's t, plus the covariance of the jumps.

    A record is one trajectory, whereas the optimum is that of the mean of two points, from which each deviates by √2
    times the deviation of that mean.
    """
    sizes = [part.size for part in np.array_split(solution.residuals, BLOCKS)]
    covariance = jackknife(solution.rows, solution.scores, np.repeat(np.arange(BLOCKS), sizes), solution.prior)
    covariance *= student_widening(BLOCKS) ** 2
    for jump in jumps:
        covariance += 2 * np.cov(np.linalg.solve(solution.information + solution.prior, jump.T))
    return np.asarray(covariance)
