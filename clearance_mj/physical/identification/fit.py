"""Output error of a MuJoCo model over records: clearances and joints with the values that let it move as recorded."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
import scipy.linalg
import scipy.signal
import scipy.stats

from ...core.errors import ModelError, RecordError, SimulationError
from ...estimate.estimates import COUNTS, UNIDENTIFIED, Combination, Estimates, principal_deviations
from ...estimate.parameter import Parameter
from .quantities import open_parameters, written_into
from .record import ModelRecord
from .simulation import Simulator, moved

__all__ = ["ModelFit", "model"]

GUIDANCE = (2.0, 0.7)
"""Hz, bandwidths with which simulations are pulled towards the record at first"""
STEP = 0.05
"""of a parameter's logarithm, for differences: above the jumps of trajectories whose teeth meet between two steps"""
ROUGH = 3.0
"""times that while simulations are guided and parameters far off"""
STEPS = 25
"""of a fit at one guidance, at most"""
DAMPINGS = (1e-6, 1e-2, 1e-1, 1.0)
"""of Levenberg and Marquardt, tried at once, as shares of the diagonal"""
FAR = 1.0
"""of a logarithm, the longest step"""
STATE = 0.1
"""of a state's standard deviation, for differences"""
ENOUGH = 5.0
"""s, of guided simulations"""
TOLD = 1.0
"""s, of a record to be predicted, from which its state is found"""
BLOCKS = 30
"""of all records, over which residuals may depend on each other as they like"""
NOTHING = 10.0
"""standard deviation of a logarithm, from which on the records say nothing"""
ORDER = 20
"""of the autoregressive model of a sensor's residual"""
SETTLED = 0.5
"""s at the beginning of a record that do not count: a guided simulation comes to follow it there"""


@dataclass(frozen=True, eq=False)
class Prediction:
    """What a model shows under the controls of a record."""

    sensors: dict[str, np.ndarray]
    """(n,) or (n, dim) by name, at the samples from `begin` on"""
    residual: dict[str, np.ndarray]
    """what was measured less that"""
    begin: int
    """first sample; what is before it served to find the state there"""

    @property
    def rms(self) -> dict[str, float]:
        """Residual of each sensor, in its unit."""
        return {name: float(np.sqrt(np.mean(r**2))) for name, r in self.residual.items()}


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
        return _Problem(self.spec, self.estimates.parameters, [record]).prediction(self.estimates.value)

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return a table in words: estimates with 95 % intervals, residuals, and what is not identified."""
        low, high = self.estimates.interval()
        width = max(map(len, self.estimates.names))
        lines = [
            f"{p.name:<{width}}  {v:10.4g}  95 %: {a:.4g} to {b:.4g} {p.unit}"
            + ("" if s < UNIDENTIFIED else "  not identified")
            for p, v, a, b, s in zip(
                self.estimates.parameters, self.estimates.value, low, high, self.estimates.varied_std
            )
        ]  # fmt: skip
        lines += [f"residual of {n}: {r:.3g} RMS, noise {self.noise[n]:.3g}" for n, r in self.residual.items()]
        return "\n".join(lines)


def model(
    spec: mujoco.MjSpec,
    records: ModelRecord | Sequence[ModelRecord],
    parameters: Sequence[str | Parameter] | Mapping[str, tuple[float, float]],
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
    return _Problem(spec, open_parameters(spec, parameters), records).fit()


@dataclass
class _Stage:
    """How simulations run, and how their residuals count."""

    bandwidth: float
    """Hz, of the guidance"""
    weight: np.ndarray
    """(n_channels,) one over the size of a residual"""
    begin: list[np.ndarray] | None = None
    """of each record, the state at the first sample that counts; None: guided all the way"""
    spread: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    """(2 nv,) standard deviations of these states"""
    duration: float = math.inf
    """s, that counts at most"""
    filters: list[np.ndarray] | None = None
    """of each channel, coefficients that make its residual white"""


class _Linear(NamedTuple):
    """Residuals near a point, and how they change."""

    residual: np.ndarray
    """(n,) means over all points of the differences"""
    jacobian: np.ndarray
    """(n, n_open)"""
    jumps: list[np.ndarray]
    """of each record, (n_pairs, n_open): gradient of what the mean of two opposite points has beyond all others'"""


class _Problem:
    """Residuals of records as a function of what is open: logarithms of parameters, then each record's first state."""

    def __init__(self, spec: mujoco.MjSpec, parameters: Sequence[Parameter], records: Sequence[ModelRecord]):
        self.spec, self.parameters = spec, tuple(parameters)
        self.simulators = [Simulator(spec, parameters, record) for record in records]
        if len({tuple(s.channels) for s in self.simulators}) > 1:
            raise RecordError("records have other sensors, or the same in another order; give all the same")
        self.channels = self.simulators[0].channels
        self.low, self.high = np.log([[p.low, p.high] for p in parameters]).T
        self.first = [int(min(SETTLED * r.fs, r.size / 4)) for r in records]
        self.simulations = 0

    def left(self, number: int, thetas: np.ndarray, deviations: np.ndarray, stage: _Stage) -> np.ndarray:
        """Residuals (n_sets, n, n_channels) of a record, infinite where the step is too long for the parameters."""
        simulator, first = self.simulators[number], self.first[number]
        compiled = [simulator.model(np.exp(theta)) for theta in thetas]
        good = [i for i, each in enumerate(compiled) if each is not None]
        models = [each for each in compiled if each is not None]
        n = self._end(number, stage)
        left = np.full((len(thetas), n - first, len(self.channels)), np.inf)
        if models:
            if stage.begin is None:
                states = self._approached(number, models, stage.bandwidth)
            else:
                moves = deviations[good] * stage.spread
                states = np.array([moved(m, stage.begin[number], move) for m, move in zip(models, moves)])
            run = simulator.guided(models, states, slice(first, n), stage.bandwidth)
            left[good] = simulator.measured[first:n] - run.sensors
            self.simulations += len(models)
        return left

    def _end(self, number: int, stage: _Stage) -> int:
        """Sample where a record ends for a stage."""
        record = self.simulators[number].record
        return int(min(record.size, self.first[number] + stage.duration * record.fs))

    def _approached(self, number: int, models: list[mujoco.MjModel], bandwidth: float) -> np.ndarray:
        """States at the first sample that counts."""
        simulator = self.simulators[number]
        states = simulator.start(models, bandwidth)
        return simulator.guided(models, states, slice(0, self.first[number]), bandwidth).state

    def _counted(self, left: np.ndarray, stage: _Stage) -> np.ndarray:
        """Residuals (n_sets, n_counted) in standard deviations, white if the stage has filters."""
        scaled = left * stage.weight
        if stage.filters:
            white = [scipy.signal.lfilter(f, [1.0], scaled[..., i], axis=1) for i, f in enumerate(stage.filters)]
            scaled = np.stack(white, axis=-1)[:, ORDER:]
        return scaled.reshape(len(left), -1)

    def _split(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithms (n_parameters,) and deviations (n_records, n_state) of what is open."""
        count = len(self.parameters)
        return at[:count], at[count:].reshape(len(self.simulators), -1)

    def _costs(self, ats: Sequence[np.ndarray], stage: _Stage) -> np.ndarray:
        """(n_sets,) sums of squares."""
        parts = [self._split(at) for at in ats]
        costs = np.array([float(np.sum(deviations**2)) for _, deviations in parts])
        for number in range(len(self.simulators)):
            left = self.left(number, np.array([t for t, _ in parts]), np.array([d[number] for _, d in parts]), stage)
            with np.errstate(invalid="ignore", over="ignore"):
                costs += np.sum(self._counted(left, stage) ** 2, axis=1)
        return np.where(np.isfinite(costs), costs, np.inf)

    def _linearised(self, at: np.ndarray, stage: _Stage) -> _Linear:
        """Counted residuals of all records and their derivatives, by points to both sides of all.

        The residuals are means over these points: where teeth meet between two steps, the trajectory jumps with the
        parameters, and one point alone would show the jumps and not the slope.
        """
        theta, deviations = self._split(at)
        count, wide = len(theta), deviations.shape[1]
        step = ROUGH * STEP if stage.bandwidth else STEP
        ends = np.array([np.minimum(theta + step, self.high), np.maximum(theta - step, self.low)])
        residuals, jacobians, jumps = [], [], []
        for number, own in enumerate(deviations):
            thetas, moved = np.tile(theta, (2, count + wide, 1)), np.tile(own, (2, count + wide, 1))
            for side, sign in enumerate((1.0, -1.0)):
                np.fill_diagonal(thetas[side, :count], ends[side])
                moved[side, count:] += sign * STATE * np.eye(wide)
            left = self.left(number, np.vstack(list(thetas)), np.vstack(list(moved)), stage)
            counted = self._counted(left, stage).reshape(2, count + wide, -1)
            if not np.isfinite(counted).all():
                raise SimulationError(
                    f"record {number}: the model's step is too long for parameters near "
                    + ", ".join(f"{p.name} = {v:.4g}" for p, v in zip(self.parameters, np.exp(theta)))
                )
            width = np.r_[np.where(ends[0] > ends[1], ends[0] - ends[1], np.inf), np.full(wide, 2 * STATE)]
            slope = ((counted[0] - counted[1]) / width[:, None]).T
            jacobian = np.zeros((len(slope), at.size))
            where = count + number * wide
            jacobian[:, :count], jacobian[:, where : where + wide] = slope[:, :count], slope[:, count:]
            residuals.append(counted.mean(axis=(0, 1)))
            jacobians.append(jacobian)
            jumps.append((counted.mean(axis=0) - residuals[-1]) @ jacobian)
        return _Linear(np.concatenate(residuals), np.vstack(jacobians), jumps)

    def _solved(self, at: np.ndarray, stage: _Stage, tolerance: float) -> tuple[np.ndarray, _Linear]:
        """Where the sum of squares is least, with residuals and derivatives there (Levenberg and Marquardt)."""
        prior = np.r_[np.zeros(len(self.parameters)), np.ones(at.size - len(self.parameters))]
        linear = self._linearised(at, stage)
        cost = linear.residual @ linear.residual + at @ (prior * at)
        for _ in range(STEPS):
            residual, jacobian, _ = linear
            information = jacobian.T @ jacobian + np.diag(prior)
            size = np.maximum(np.diag(information), 1e-9 * (np.diag(information).max() or 1.0))
            steps = [
                -np.linalg.solve(information + np.diag(d * size), jacobian.T @ residual + prior * at) for d in DAMPINGS
            ]
            candidates = [self._inside(at + step * FAR / max(FAR, np.abs(step).max())) for step in steps]
            there = candidates[int(np.argmin(self._costs(candidates, stage)))]
            found = self._linearised(there, stage)
            lower = found.residual @ found.residual + there @ (prior * there)
            if lower >= cost:
                break
            at, linear, decrease, cost = there, found, cost - lower, lower
            if decrease < tolerance * cost:
                break
        return at, linear

    def _inside(self, at: np.ndarray) -> np.ndarray:
        return np.r_[np.clip(at[: len(self.parameters)], self.low, self.high), at[len(self.parameters) :]]

    def fit(self) -> ModelFit:
        """With less and less guidance, then without."""
        at = np.log([p.start for p in self.parameters])
        stage = _Stage(0.0, np.ones(len(self.channels)))
        for bandwidth in GUIDANCE if self.simulators[0].guides else ():
            stage = _Stage(bandwidth, np.ones(len(self.channels)), duration=ENOUGH)
            stage.weight = self._weight(at, stage)
            at, *_ = self._solved(at, stage, 1e-2)
            stage.weight = self._weight(at, stage)
        free = self._free(at, stage)
        there = np.r_[at, np.zeros(len(self.simulators) * free.spread.size)]
        there, *_ = self._solved(there, free, 1e-2)
        self._whiten(there, free)
        return self._result(*self._solved(there, free, 1e-4), free)

    def _weight(self, at: np.ndarray, stage: _Stage) -> np.ndarray:
        """(n_channels,) one over the RMS of residuals, but never over less than what counting does."""
        theta, deviations = self._split(at)
        squares = []
        for number in range(len(self.simulators)):
            own = deviations[number : number + 1]
            left = self.left(number, theta[None], own, stage)[0]
            if not np.isfinite(left).all():
                raise SimulationError(f"record {number}: the model diverges, or its step is too long")
            squares.append(np.mean(left**2, axis=0))
        return 1 / np.maximum(np.sqrt(np.mean(squares, axis=0)), self._least())

    def _least(self) -> np.ndarray:
        steps = [max(s.record.quantisation[c] for s in self.simulators) for c in self.channels]
        level = np.max([np.ptp(s.measured, axis=0) for s in self.simulators], axis=0)
        return np.maximum(np.array(steps) / np.sqrt(12), 1e-6 * level + np.finfo(float).tiny)

    def _free(self, at: np.ndarray, guided: _Stage) -> _Stage:
        """Without guidance, from the states that the last guided simulations had."""
        begin, size = [], 0
        for number, simulator in enumerate(self.simulators):
            own = simulator.model(np.exp(at))
            assert own is not None  # since `_weight` has simulated it
            size = own.nv
            begin.append(self._approached(number, [own], guided.bandwidth)[0])
        spans = [i for i, c in enumerate(self.channels) if c in {g.sensor for g in self.simulators[0].guides}]
        place = 10 * max((1 / guided.weight[spans]).tolist(), default=1e-3)
        spread = np.repeat([place, place * 2 * np.pi * GUIDANCE[0]], size)
        return _Stage(0.0, guided.weight, begin, spread)

    def _whiten(self, at: np.ndarray, stage: _Stage) -> None:
        """Filters that make the residuals at hand white and of unit variance."""
        theta, deviations = self._split(at)
        lefts = [self.left(i, theta[None], d[None], stage)[0] for i, d in enumerate(deviations)]
        stage.weight, stage.filters = np.ones(len(self.channels)), []
        for i, least in enumerate(self._least()):
            covariance = np.mean([_autocovariance(left[:, i]) for left in lefts], axis=0)
            covariance[0] = covariance[0] * (1 + 1e-6) + (0.1 * least) ** 2
            taps = np.r_[1.0, -scipy.linalg.solve_toeplitz(covariance[:-1], covariance[1:])]
            innovation = np.sqrt(
                np.mean(np.concatenate([scipy.signal.lfilter(taps, [1.0], left[:, i])[ORDER:] for left in lefts]) ** 2)
            )
            stage.filters.append(taps / max(innovation, least))

    def _result(self, at: np.ndarray, linear: _Linear, stage: _Stage) -> ModelFit:
        count = len(self.parameters)
        self._refuse_unknown(linear.jacobian)
        covariance = _covariance(linear, at.size - count)
        theta, deviations = self._split(at)
        estimates = Estimates.of(self.parameters, np.exp(theta), covariance[:count, :count])
        noise = {c: float(1 / f[0]) for c, f in zip(self.channels, stage.filters or [])}
        spec = written_into(self.spec, dict(zip(estimates.names, estimates.value)))
        predictions = tuple(
            self._seen(i, self.left(i, theta[None], d[None], stage)[0]) for i, d in enumerate(deviations)
        )
        return ModelFit(spec, estimates, predictions, noise, self.simulations)

    def _refuse_unknown(self, jacobian: np.ndarray) -> None:
        """Name what the records say nothing about."""
        count = len(self.parameters)
        own, states = jacobian[:, :count], jacobian[:, count:]
        if states.shape[1]:
            ridge = np.linalg.solve(states.T @ states + np.eye(states.shape[1]), states.T @ own)
            own = own - states @ ridge
        direction, std = principal_deviations(own)
        for row, deviation in zip(direction, std):
            if deviation > NOTHING:
                exponent = {p.name: float(x) for p, x in zip(self.parameters, row) if abs(x) > COUNTS}
                raise ModelError(f"the records say nothing about {Combination(exponent, float(deviation))}")

    def _seen(self, number: int, left: np.ndarray) -> Prediction:
        simulator, first = self.simulators[number], self.first[number]
        shown, residual = {}, {}
        for name in dict.fromkeys(self.channels):
            columns = [i for i, c in enumerate(self.channels) if c == name]
            residual[name] = np.squeeze(left[:, columns])
            shown[name] = np.squeeze(simulator.measured[first:, columns]) - residual[name]
        return Prediction(shown, residual, first)

    def prediction(self, value: np.ndarray) -> Prediction:
        """Find the state by the record's first second, and go on from there."""
        at = np.log(value)
        simulator = self.simulators[0]
        self.low = self.high = at
        stage = _Stage(GUIDANCE[-1] if simulator.guides else 0.0, np.ones(len(self.channels)))
        stage.weight = self._weight(at, stage)
        free = self._free(at, stage)
        there = np.r_[at, np.zeros(free.spread.size)]
        free.duration = TOLD
        there, *_ = self._solved(there, free, 1e-3)
        free.duration = math.inf
        left = self.left(0, at[None], there[None, at.size :], free)[0]
        return self._seen(0, left)


def _autocovariance(x: np.ndarray) -> np.ndarray:
    return np.array([x[: x.size - lag] @ x[lag:] / x.size for lag in range(ORDER + 1)])


def _covariance(linear: _Linear, states: int) -> np.ndarray:
    """Covariance of what is open: by leaving out blocks of the records, wider by Student's t, and of the jumps.

    Without block g the optimum moves by (A - A_g)⁻¹ s_g, A = JᵀJ and s_g the block's part of the gradient (MacKinnon,
    Nielsen and Webb, Journal of Applied Econometrics 38, 2023: CV3). A record is one trajectory, and the optimum that
    of their mean, from which each jumps away: as far as those of the points do, √2 times what the mean of two does.
    """
    residual, jacobian, jumps = linear
    information = jacobian.T @ jacobian
    information[-states:, -states:] += np.eye(states) if states else 0
    parts = np.array_split(np.arange(residual.size), BLOCKS)
    moved = np.array(
        [np.linalg.solve(information - jacobian[p].T @ jacobian[p], jacobian[p].T @ residual[p]) for p in parts]
    )
    wide = scipy.stats.t.ppf(0.975, BLOCKS - 1) / scipy.stats.norm.ppf(0.975)
    found = wide**2 * (BLOCKS - 1) * np.cov(moved.T, bias=True)
    for each in jumps:
        found += 2 * np.cov(np.linalg.solve(information, each.T))
    return found
