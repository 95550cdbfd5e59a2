"""Residuals of a MuJoCo model over records, guided or free, and their derivatives."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import scipy.linalg
import scipy.signal

from ...core.errors import RecordError, SimulationError
from ...estimate import LinearisedResiduals, Parameter, Problem
from ..drives import drives
from .record import ModelRecord
from .simulation import Simulator, moved_state

__all__ = ["Prediction"]

GUIDANCE = (2.0, 0.7)  # Hz, bandwidths of the guided stages
STEP = 0.05  # of a parameter's logarithm, for differences: above the jumps of trajectories when teeth meet
GUIDED_STEP = 0.15  # the same while simulations are guided and parameters far off
STATE_STEP = 0.1  # of a state's standard deviation, for differences
APPROACH_BANDWIDTH = GUIDANCE[0]
"""Hz, of the guidance before the first counted sample: with less, friction and weight keep states far from the record,
and residuals would be that error instead of the model's"""
STATE_BANDWIDTH = 2.0  # Hz, ratio of velocity to position deviations, over 2π
ORDER = 20  # of the autoregressive model of a sensor's residual
SETTLING = 0.5  # s at the beginning of a record without residuals: a guided simulation approaches it there


@dataclass(frozen=True, eq=False)
class Prediction:
    """Simulated sensors under the controls of a record, and their residuals."""

    sensors: dict[str, np.ndarray]
    """(n,) or (n, dim) by name, at the samples from `begin` on"""
    residual: dict[str, np.ndarray]
    """measured less simulated"""
    begin: int
    """index of the first sample; earlier ones served to estimate the state there"""

    @property
    def rms(self) -> dict[str, float]:
        """RMS residual of each sensor, in its unit."""
        return {name: float(np.sqrt(np.mean(r**2))) for name, r in self.residual.items()}


@dataclass
class FitStage:
    """A stage of the fit: guidance of the simulations and weights of their residuals."""

    bandwidth: float  #: Hz, of the guidance; 0: none
    weight: np.ndarray  #: (n_channels,) one over a residual's standard deviation
    begin: list[np.ndarray] | None = None
    """of each record, the state at the first counted sample; None: guided throughout"""
    spread: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    """(2 (nv + n_drives),) standard deviations of these states"""
    duration: float = math.inf  #: s, of counted samples at most
    filters: list[np.ndarray] | None = None  #: (n_channels,) whitening filters


class SimulationResiduals:
    """Residuals of simulated records, for several models at once.

    Points are rows of the parameters' values, then of each record's deviations from its initial state.
    """

    def __init__(self, spec: mujoco.MjSpec, parameters: Sequence[Parameter], records: Sequence[ModelRecord]) -> None:
        self.parameters = tuple(parameters)
        self.simulators = [Simulator(spec, parameters, record) for record in records]
        if len({tuple(s.channels) for s in self.simulators}) > 1:
            raise RecordError("records have other sensors, or the same in another order; give all the same")
        self.channels = self.simulators[0].channels
        self.first = [int(min(SETTLING * r.fs, r.size / 4)) for r in records]
        self.simulations = 0
        self.jumps: dict[bytes, list[np.ndarray]] = {}
        """by linearised point, for each record: (n_pairs, n_open) gradient of the mean of two opposite points less the
        mean of all"""

    def problem(self, values: np.ndarray, stage: FitStage) -> Problem:
        """Return the problem of a stage: parameters that start at values (n_parameters,), and states if it is free."""
        states = [
            Parameter(f"state {i} of record {number}", "", 0.0, -math.inf, math.inf, float(std), "linear")
            for number in range(len(self.simulators) if stage.begin else 0)
            for i, std in enumerate(stage.spread)
        ]
        parameters = [dataclasses.replace(p, start=float(v)) for p, v in zip(self.parameters, values)]
        problem = Problem(
            [*parameters, *states], lambda points: self.residuals(points, stage),
            linearise=lambda point: self.linearised(problem, point, stage),
        )  # fmt: skip
        return problem

    def deviations(self, values: np.ndarray, number: int, stage: FitStage) -> np.ndarray:
        """Return the deviations (..., n_state) of a record's initial state, out of values (..., n_open)."""
        begin = len(self.parameters) + number * stage.spread.size
        return values[..., begin : begin + stage.spread.size]

    def left(self, number: int, points: np.ndarray, stage: FitStage) -> np.ndarray:
        """Return residuals (n_points, n, n_channels) of a record, infinite where the step is unstable."""
        simulator, first = self.simulators[number], self.first[number]
        compiled = [simulator.model(values) for values in points[:, : len(self.parameters)]]
        valid = [i for i, model in enumerate(compiled) if model is not None]
        models = [model for model in compiled if model is not None]
        n = int(min(simulator.record.size, first + stage.duration * simulator.record.fs))
        residuals = np.full((len(points), n - first, len(self.channels)), np.inf)
        if models:
            if stage.begin is None:
                states = self.approached(number, models)
            else:
                deviations = self.deviations(points[valid], number, stage)
                states = np.array([moved_state(m, stage.begin[number], move) for m, move in zip(models, deviations)])
            run = simulator.guided(models, states, slice(first, n), stage.bandwidth)
            residuals[valid] = simulator.measured[first:n] - run.sensors
            self.simulations += len(models)
        return residuals

    def approached(self, number: int, models: list[mujoco.MjModel]) -> np.ndarray:
        """Return the states of guided simulations at the first counted sample."""
        simulator = self.simulators[number]
        states = simulator.start(models)
        return simulator.guided(models, states, slice(0, self.first[number]), APPROACH_BANDWIDTH).state

    def counted(self, residuals: np.ndarray, stage: FitStage) -> np.ndarray:
        """Return residuals (n_points, n_counted) in standard deviations, whitened if the stage has filters."""
        scaled = residuals * stage.weight
        if stage.filters:
            filtered = [scipy.signal.lfilter(f, [1.0], scaled[..., i], axis=1) for i, f in enumerate(stage.filters)]
            scaled = np.stack(filtered, axis=-1)[:, ORDER:]
        return scaled.reshape(len(residuals), -1)

    def residuals(self, points: np.ndarray, stage: FitStage) -> np.ndarray:
        """Return scaled residuals (n_points, n_counted) of all records."""
        with np.errstate(invalid="ignore"):
            parts = [self.counted(self.left(i, points, stage), stage) for i in range(len(self.simulators))]
        return np.hstack(parts)

    def linearised(self, problem: Problem, at: np.ndarray, stage: FitStage) -> LinearisedResiduals:
        """Return the residuals of all records and their derivatives, by central differences.

        The residuals are means over these points: where teeth meet between two steps, the trajectory jumps with the
        parameters, and one point alone would show the jumps and not the slope. A record's own points move its own
        state only.
        """
        count, n_states = len(self.parameters), stage.spread.size
        step = np.where(np.arange(at.size) < count, GUIDED_STEP if stage.bandwidth else STEP, STATE_STEP)
        ahead, behind = np.minimum(at + step, problem.high), np.maximum(at - step, problem.low)
        residuals, jacobians, jumps = [], [], []
        for number in range(len(self.simulators)):
            moving = np.r_[0:count, count + number * n_states : count + (number + 1) * n_states]
            moves = np.arange(at.size) == moving[:, None]
            points = np.vstack([np.where(moves, end, at) for end in (ahead, behind)])
            scaled = self.counted(self.left(number, problem.values(points), stage), stage)
            if not np.isfinite(scaled).all():
                raise SimulationError(
                    f"record {number}: the model's step is too long for parameters near "
                    + ", ".join(f"{p.name} = {v:.4g}" for p, v in zip(self.parameters, problem.values(at)))
                )
            scaled = scaled.reshape(2, moving.size, -1)
            width = (ahead - behind)[moving]
            jacobian = np.zeros((scaled.shape[-1], at.size))
            jacobian[:, moving] = ((scaled[0] - scaled[1]) / np.where(width > 0, width, np.inf)[:, None]).T
            residuals.append(scaled.mean(axis=(0, 1)))
            jacobians.append(jacobian)
            jumps.append((scaled.mean(axis=0) - residuals[-1]) @ jacobian)
        self.jumps[at.tobytes()] = jumps
        return LinearisedResiduals(np.concatenate(residuals), np.vstack(jacobians))

    def weigh(self, values: np.ndarray, stage: FitStage) -> None:
        """Set weights to one over the RMS residual, which is at least the quantisation error."""
        squares = []
        for number in range(len(self.simulators)):
            residuals = self.left(number, values[None], stage)[0]
            if not np.isfinite(residuals).all():
                raise SimulationError(f"record {number}: the model diverges, or its step is too long")
            squares.append(np.mean(residuals**2, axis=0))
        stage.weight = 1 / np.maximum(np.sqrt(np.mean(squares, axis=0)), self._resolution())

    def whiten(self, values: np.ndarray, stage: FitStage) -> None:
        """Set the filters that make the residuals at values white and of unit variance."""
        residuals = [self.left(i, values[None], stage)[0] for i in range(len(self.simulators))]
        stage.weight, stage.filters = np.ones(len(self.channels)), []
        for i, resolution in enumerate(self._resolution()):
            covariance = np.mean([_autocovariance(r[:, i]) for r in residuals], axis=0)
            covariance[0] = covariance[0] * (1 + 1e-6) + (0.1 * resolution) ** 2
            taps = np.r_[1.0, -scipy.linalg.solve_toeplitz(covariance[:-1], covariance[1:])]
            white = np.concatenate([scipy.signal.lfilter(taps, [1.0], r[:, i])[ORDER:] for r in residuals])
            stage.filters.append(taps / max(np.sqrt(np.mean(white**2)), resolution))

    def _resolution(self) -> np.ndarray:
        """Return the standard deviation (n_channels,) of quantisation, at least 1e-6 of the channel's range."""
        steps = [max(s.record.quantisation[c] for s in self.simulators) for c in self.channels]
        span = np.max([np.ptp(s.measured, axis=0) for s in self.simulators], axis=0)
        return np.maximum(np.array(steps) / np.sqrt(12), 1e-6 * span + np.finfo(float).tiny)

    def freed(self, values: np.ndarray, guided: FitStage) -> FitStage:
        """Return the stage without guidance, from the states of the last guided simulations."""
        begin, size = [], 0
        for number, simulator in enumerate(self.simulators):
            model = simulator.model(values)
            assert model is not None  # since `weigh` has simulated it
            size = model.nv + sum(1 for _ in drives(model))
            begin.append(self.approached(number, [model])[0])
        spans = [i for i, c in enumerate(self.channels) if c in {g.sensor for g in self.simulators[0].guides}]
        std = 10 * max((1 / guided.weight[spans]).tolist(), default=1e-3)
        return FitStage(0.0, guided.weight, begin, np.repeat([std, std * 2 * np.pi * STATE_BANDWIDTH], size))

    def prediction(self, number: int, values: np.ndarray, stage: FitStage) -> Prediction:
        """Return the prediction of a record with values (n_open,)."""
        simulator, first = self.simulators[number], self.first[number]
        residuals, sensors, residual = self.left(number, values[None], stage)[0], {}, {}
        for name in dict.fromkeys(self.channels):
            columns = [i for i, c in enumerate(self.channels) if c == name]
            residual[name] = np.squeeze(residuals[:, columns])
            sensors[name] = np.squeeze(simulator.measured[first:, columns]) - residual[name]
        return Prediction(sensors, residual, first)


def _autocovariance(x: np.ndarray) -> np.ndarray:
    return np.array([x[: x.size - lag] @ x[lag:] / x.size for lag in range(ORDER + 1)])
