"""Output error of a MuJoCo model over records: clearances and joints with the values that let it move as recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ...core.errors import ModelError, RecordError, SimulationError
from ...estimate import Combination, Estimates, Parameter, Solution, Stop, principal_deviations, solve
from ...estimate.covariance import jackknife, student_widening
from ...estimate.estimates import COUNTS, UNIDENTIFIED
from .comparison import GUIDANCE, Comparison, Prediction, Stage
from .quantities import open_parameters, written_into
from .record import ModelRecord

__all__ = ["ModelFit", "fit_model"]

GUIDED_DURATION = 5.0  # s, of guided simulations
ROUGH = Stop(25, decrease=1e-2, move=0.0)  # of a fit at one guidance, and of the first without
LAST = Stop(6, decrease=-0.03, move=0.01)
"""of the last fit: jumps of trajectories make its costs noisy, by a hundredth from one point to the next"""
STATE = Stop(25, decrease=1e-3, move=0.0)  # of a fit of the state with which a prediction begins
DAMPINGS = (1e-6, 1e-2, 1e-1, 1.0)  # shares of the precision's diagonal, all tried at once
LONGEST_STEP = 1.0  # of a logarithm
STATE_DURATION = 1.0  # s, of a record to be predicted, from which its state is found
BLOCKS = 30  # of all records, within which residuals may depend on each other
UNKNOWN_STD = 10.0  # of a logarithm, from which on the records say nothing
MISFIT = 3.0  # of a residual over its noise, from which on other starts are tried, and the fit says so
SAME = 0.05  # by which residuals of two starts differ at most that have ended at the same place
AT_BOUND = 1e-3  # of a bound, within which a value has ended there
SPREAD = 2.0  # factor, up to which to both sides of the given start the other ones are drawn


@dataclass(frozen=True, eq=False, repr=False)
class ModelFit:
    """A MuJoCo model fitted to records."""

    spec: mujoco.MjSpec
    """with the fitted values; `physical.compile` makes the model of it"""
    estimates: Estimates
    """of the parameters, which varied by their logarithms; intervals hold for residuals that depend on each other"""
    predictions: tuple[Prediction, ...]
    """of the records that were fitted"""
    noise: dict[str, float]
    """RMS of each sensor's residual that the samples before do not explain, in its unit: noise and quantisation"""
    simulations: int
    """of a whole record"""
    starts: int = 1
    """from which a search was made; what is best is here"""

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
        """Residual of each sensor over its noise: 1 for a model that moves as recorded."""
        return {name: residual / self.noise[name] for name, residual in self.residual.items()}

    @property
    def not_told(self) -> tuple[str, ...]:
        """Parameters that the records do not tell: known to half of their size at best, or to half of their prior."""
        e = self.estimates
        limits = (UNIDENTIFIED if p.transform == "log" else UNIDENTIFIED * p.known_std for p in e.parameters)
        return tuple(name for name, std, limit in zip(e.names, e.varied_std, limits) if not std < limit)

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know before the numbers are used, in sentences: misfit, bounds, and what is not told."""
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
        """Simulate another record: its state is found in the first part, the rest is the model's own motion.

        Parameters
        ----------
        record : ModelRecord
            With controls, and some of the sensors.

        Raises
        ------
        RecordError
            For a record that does not fit the model.
        """
        known = [replace(p, low=v, high=v) for p, v in zip(self.estimates.parameters, self.estimates.value.tolist())]
        compared = Comparison(self.spec, known, [record])
        guided = Stage(GUIDANCE[-1] if compared.simulators[0].guides else 0.0, np.ones(len(compared.channels)))
        compared.weigh(self.estimates.value, guided)
        free = compared.freed(self.estimates.value, guided)
        free.duration = STATE_DURATION
        found = _solved(compared, self.estimates.value, free, STATE)
        free.duration = math.inf
        return compared.prediction(0, found.values, free)

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return a table in words: estimates with 95 % intervals, residuals, what is not identified, and notes."""
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
    spec: mujoco.MjSpec,
    records: ModelRecord | Sequence[ModelRecord],
    parameters: Sequence[str | Parameter] | Mapping[str, tuple[float, float]],
    starts: int = 3,
    seed: int = 0,
) -> ModelFit:
    """Fit a MuJoCo model's clearances and joints to records by output error.

    Simulations under the recorded controls are compared with the recorded sensors. At first they are guided: a spring
    and damper pull measured joints and tendons towards the record, so that wrong starts do not add up and a drive that
    nobody measures follows by the model's own physics. Then the model moves by itself over the whole record, from a
    state that is estimated too, and an autoregressive model of each sensor's residual weighs its frequencies.
    Derivatives are differences over wide steps, for trajectories jump where teeth meet between two steps of the
    model. The covariance is a jackknife over blocks of the records, within which residuals may depend on each other,
    and that of these jumps.

    Controls are linear between samples (or held, see `ModelRecord`), the model's step is the nearest below its own of
    which the sampling interval is a multiple. Counting sensors are taken as rounded to the nearest count, evenly
    distributed within it. ``mujoco.sysid`` has no guidance, no unmeasured states, no intervals for residuals that
    depend on each other, and needs one more library; what is used of MuJoCo is ``mujoco.batch``, on all threads.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Its clearances marked by `clearance_mj.physical`; parameters start where it has them. Not changed.
    records : ModelRecord or sequence of ModelRecord
        All with the same sensors.
    parameters : sequence of str or Parameter, or Mapping of str to (low, high)
        "ELEMENT.QUANTITY": k or c of a contact, limit or clearance, gap of a clearance, friction of what has bristles;
        damping, frictionloss, stiffness or armature of a hinge or slide. Bounds are a factor of 100 to both sides
        unless given.
    starts : int
        Number of starts at most: the given one, and while the residual of what was found is beyond the noise and no
        two agree, others that are drawn about it; the best is kept.
    seed : int
        Of the random numbers with which they are drawn.

    Returns
    -------
    ModelFit
        Estimates with intervals, the fitted specification, residuals, and predictions of other records.

    Raises
    ------
    ModelError
        For elements or quantities that the model does not have, and parameters that the records say nothing about.
    RecordError
        For records that do not fit the model.
    SimulationError
        If the step is too long for parameters on the way.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ModelError(f"got {type(spec).__name__}, needs a mujoco.MjSpec")
    records = [records] if isinstance(records, ModelRecord) else list(records)
    if not records or not all(isinstance(r, ModelRecord) for r in records):
        raise RecordError("records must be one or several of ModelRecord")
    if starts < 1:
        raise ModelError(f"starts is {starts}; a search needs one at least")
    compared = Comparison(spec, open_parameters(spec, parameters), records)
    tried: list[ModelFit] = []
    for values in _starts(compared.parameters, starts, seed):
        try:
            tried.append(_searched(spec, compared, values))
        except SimulationError:  # a drawn start may be too stiff for the model's step, the given one must not be
            if not tried:
                raise
        tried.sort(key=_size)
        again = len(tried) > 1 and _size(tried[1]) - _size(tried[0]) < SAME
        if again or max(tried[0].misfit.values()) < MISFIT:
            break
    best = tried[0]
    widened = best.estimates.widened(max(1.0, *best.misfit.values()))
    return replace(best, estimates=widened, simulations=compared.simulations, starts=len(tried))


def _size(fit: ModelFit) -> float:
    """Mean logarithm of the residuals, which compares fits whatever the sensors' units."""
    return sum(math.log(max(residual, 1e-300)) for residual in fit.residual.values()) / len(fit.residual)


def _starts(parameters: Sequence[Parameter], count: int, seed: int) -> Iterator[np.ndarray]:
    """Yield the given start (n_parameters,), then ones drawn about it, within the bounds."""
    rng = np.random.default_rng(seed)
    low, start, high = np.array([[p.low, p.start, p.high] for p in parameters]).T
    spreads = [math.log(SPREAD) if p.transform == "log" else p.known_std for p in parameters]
    for i in range(count):
        moves = [spread * rng.uniform(-1, 1) for spread in spreads] if i else np.zeros(len(spreads))
        drawn = [float(p.from_varied(np.array(p.to_varied(p.start) + move))) for p, move in zip(parameters, moves)]
        yield np.clip(drawn if i else start, low, high)


def _searched(spec: mujoco.MjSpec, compared: Comparison, values: np.ndarray) -> ModelFit:
    """Search from values (n_parameters,): guided at first, then by the model's own motion over the whole record."""
    stage = Stage(0.0, np.ones(len(compared.channels)))
    for bandwidth in GUIDANCE if compared.simulators[0].guides else ():
        stage = Stage(bandwidth, np.ones(len(compared.channels)), duration=GUIDED_DURATION)
        compared.weigh(values, stage)
        values = _solved(compared, values, stage, ROUGH).values
        compared.weigh(values, stage)
    free = compared.freed(values, stage)
    rough = _solved(compared, values, free, ROUGH)
    compared.whiten(rough.values, free)
    return _result(spec, compared, _solved(compared, rough.values, free, LAST, rough.at), free)


def _solved(
    compared: Comparison, values: np.ndarray, stage: Stage, stop: Stop, start: np.ndarray | None = None
) -> Solution:
    """Where the sum of squares of a stage is least, from parameters (n_parameters, ...) and, if given, states."""
    count = len(compared.parameters)
    problem = compared.problem(values[:count], stage)
    at = np.zeros(problem.size)
    if start is not None:
        at[count:] = start[count:]
    return solve(problem, at, stop=stop, dampings=DAMPINGS, longest=LONGEST_STEP)


def _result(spec: mujoco.MjSpec, compared: Comparison, found: Solution, stage: Stage) -> ModelFit:
    count = len(compared.parameters)
    _refuse_unknown(compared.parameters, found.jacobian)
    covariance = _covariance(found, compared.jumps[found.at.tobytes()])
    estimates = Estimates.of(compared.parameters, found.values[:count], covariance[:count, :count])
    noise = {c: float(1 / f[0]) for c, f in zip(compared.channels, stage.filters or [])}
    fitted = written_into(spec, dict(zip(estimates.names, estimates.value)))
    predictions = tuple(compared.prediction(i, found.values, stage) for i in range(len(compared.simulators)))
    return ModelFit(fitted, estimates, predictions, noise, compared.simulations)


def _refuse_unknown(parameters: Sequence[Parameter], jacobian: np.ndarray) -> None:
    """Name what the records say nothing about."""
    own, states = np.split(jacobian, [len(parameters)], axis=1)
    if states.shape[1]:
        own = own - states @ np.linalg.solve(states.T @ states + np.eye(states.shape[1]), states.T @ own)
    direction, std = principal_deviations(own)
    for row, deviation in zip(direction, std):
        if deviation > UNKNOWN_STD:
            exponent = {p.name: float(x) for p, x in zip(parameters, row) if abs(x) > COUNTS}
            raise ModelError(f"the records say nothing about {Combination(exponent, float(deviation))}")


def _covariance(found: Solution, jumps: Sequence[np.ndarray]) -> np.ndarray:
    """Covariance of what is open: a jackknife over blocks, wider by Student's t, and the covariance of the jumps.

    A record is one trajectory, and the optimum that of their mean, from which each jumps away: as far as those of the
    points do, √2 times what the mean of two does.
    """
    sizes = [part.size for part in np.array_split(found.residuals, BLOCKS)]
    covariance = jackknife(found.rows, found.scores, np.repeat(np.arange(BLOCKS), sizes), found.prior)
    covariance *= student_widening(BLOCKS) ** 2
    for each in jumps:
        covariance += 2 * np.cov(np.linalg.solve(found.information + found.prior, each.T))
    return np.asarray(covariance)
