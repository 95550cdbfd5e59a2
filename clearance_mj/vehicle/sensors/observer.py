"""The observer of a car's states: a Kalman filter on the nominal design model, at the time of the measurements.

All measurements are old by the bus's mean delay D. The filter lives at that time, t - D, and the model brings its
estimate to the present with the commands and curvature since then, which compensates the delay
(Anderson and Moore, Optimal Filtering, 1979, chapter 7).

The model in the observer: the nominal design model, the sensors' offsets and unknown forces of the axles.

The state is [e_y, e_ψ, v_y, r, δ, dδ/dt, b_r, b_a, F_f, F_r]: that of the design model, the offsets of yaw rate and
lateral acceleration, and the lateral forces of the axles that the nominal vehicle lacks: true tyres and mass,
the steering's lost motion, wind. These are Gauss-Markov processes (Gelb, Applied Optimal Estimation, 1974, section
3.8). They correct the estimate of the motion by the accelerometer and are used in the observer only.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg

from ...core.jit import jit
from ..controllers.base import Task
from ..controllers.design import DesignModel
from ..nominal import Servo, Vehicle
from ..path import Table, curvature_ahead

__all__ = ["N_STATES", "Deviations", "ObserverModel", "RunObserver", "observer_model", "take"]

WAY_NOISE = 0.1  # m/√s, noise of the travelled distance over the integrated wheel speed


class RunObserver:
    """A Kalman filter during a run that begins on the path, wheels straight."""

    def __init__(self, task: Task, delay: float, deviations: Deviations, driven: float = 0.0, fixes: float = 20.0):
        """Take the mean age of measurements and the time driven straight before, s, and the rate of fixes, Hz."""
        model = observer_model(task.vehicle, task.servo, task.speed, task.period, delay, deviations)
        self.delay = delay
        """s, mean age of the measurements"""
        self.state, self.covariance = np.zeros(N_STATES), _settled(model, driven, fixes).copy()
        """(10,) and (10, 10), at the time of the measurements"""
        self.s = -task.speed * delay
        """m, arc length at the time of the measurements"""
        self._task, self._deviations, self._model = task, deviations, model
        self._commands, self._rate, self._s_variance = np.zeros(model.middles.size + 1), np.zeros(N_STATES), 0.0

    def advance(self, command: float, speed: float) -> None:
        """Advance by a period with a command, rad, at a measured speed, m/s."""
        model, period = self._model, self._task.period
        _predict(
            self.state, self.covariance, self._rate, self._commands, command, self._task.path.table, self.s, speed,
            model.flow, model.inputs, model.noise, period,
        )  # fmt: skip
        self.s += speed * period
        self._s_variance += WAY_NOISE**2 * period

    def measure(
        self, angle: float | None, motion: tuple[float, float] | None, position: tuple[float, float] | None
    ) -> None:
        """Update by measurements or None: steering angle, rad; yaw rate and lateral acceleration, rad/s, m/s²; x, y, m.

        All of them are old by the mean delay.
        """
        deviations = self._deviations
        yaw_rate, acceleration = (math.nan, math.nan) if motion is None else motion
        lateral = math.nan
        if position is not None:
            s, lateral, _, _ = self._task.path.locate(*position, self.s)
            noise = deviations.position**2 + (self._task.speed * deviations.age) ** 2
            self.s += self._s_variance / (self._s_variance + noise) * (s - self.s)
            self._s_variance *= noise / (self._s_variance + noise)
        values = np.array((math.nan if angle is None else angle, yaw_rate, acceleration, lateral))
        take(self.state, self.covariance, values, self._model.variances, self._model.rows, deviations.age * self._rate)

    def present(self, speed: float) -> tuple[float, np.ndarray]:
        """Return the arc length, m, and state (10,) at the last sample, at a measured speed, m/s."""
        model = self._model
        state = _present(
            self.state, self._commands, self._task.path.table, self.s, speed, model.middles, model.ahead, model.since
        )
        return self.s + speed * self.delay, state


@jit
def _predict(
    state: np.ndarray, covariance: np.ndarray, rate: np.ndarray, commands: np.ndarray, command: float, table: Table,
    s: float, speed: float, flow: np.ndarray, effect: np.ndarray, noise: np.ndarray, period: float,
) -> None:  # fmt: skip
    """Advance by one period, in place; ``rate`` becomes that of the state."""
    commands[:-1] = commands[1:].copy()
    commands[-1] = command
    curvature = curvature_ahead(table, s, speed, np.array([period / 2]), np.inf)
    new_state = flow @ state + effect @ np.concatenate((commands[:2], curvature))
    rate[:] = (new_state - state) / period
    state[:] = new_state
    covariance[:] = flow @ covariance @ flow.T + noise


@jit
def _present(
    state: np.ndarray, commands: np.ndarray, table: Table, s: float, speed: float, middles: np.ndarray,
    ahead: np.ndarray, since: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return the state at the last sample."""
    curvature = curvature_ahead(table, s, speed, middles, np.inf)
    return ahead @ state + since @ np.concatenate((commands[1:], curvature))


N_STATES = 10


class Deviations(NamedTuple):
    """Standard deviations that the observer assumes."""

    angle: float  # rad, of the steering angle
    yaw_rate: float  # rad/s
    acceleration: float  # m/s²
    position: float  # m
    yaw_rate_offset: float  # rad/s
    acceleration_offset: float  # m/s², including gravity on a cross slope
    age: float = 0.0  # s, of a measurement's age about its mean
    offset_drift: float = 0.05  # m/s² over the root of a second, of the offset of the acceleration
    force: float = 500.0  # N, of the unknown force of each axle
    force_time: float = 0.5  # s, correlation time of that force
    servo: float = 5.0  # rad/s² √s, density of the unknown acceleration of the servo


@dataclass(frozen=True, eq=False)
class ObserverModel:
    """The linear model over a period at the time of the measurements, and from then to the present."""

    period: float  # s
    flow: np.ndarray  # (10, 10) over a period
    inputs: np.ndarray  # (10, 3) of the two commands in a period, and the curvature
    noise: np.ndarray  # (10, 10) over a period
    start: np.ndarray  # (10,) initial variances: path errors and motion known, all else not
    rows: np.ndarray  # (4, 10) of the measurements: steering angle, yaw rate, lateral acceleration, e_y
    variances: np.ndarray  # (4,)
    ahead: np.ndarray  # (10, 10) from then to the present
    since: np.ndarray  # (10, 2 n) of n commands and n curvatures since
    middles: np.ndarray  # (n,) s, midpoints of the intervals in which they are held


@functools.lru_cache(maxsize=16)
def _settled(model: ObserverModel, driven: float, fixes: float) -> np.ndarray:
    """Return the covariance (10, 10) after having driven straight for a time, s, with fixes at a rate, Hz."""
    covariance, values, fix_count = np.diag(model.start), np.zeros(4), -1
    for i in range(round(driven / model.period)):
        covariance = model.flow @ covariance @ model.flow.T + model.noise
        values[3] = 0.0 if (count := math.floor(i * model.period * fixes + 1e-9)) > fix_count else math.nan
        fix_count = count
        take(np.zeros(N_STATES), covariance, values, model.variances, model.rows, np.zeros(N_STATES))
    return covariance


@functools.lru_cache(maxsize=16)
def observer_model(
    vehicle: Vehicle, servo: Servo, speed: float, period: float, delay: float, deviations: Deviations
) -> ObserverModel:
    """Return the model of a nominal vehicle at a speed, m/s, sampled once a period, s, of measurements of an age, s."""
    A, B, G = _continuous(vehicle, servo, speed, deviations)
    rows = np.zeros((4, N_STATES))
    rows[0, 4] = rows[1, 3] = rows[1, 6] = rows[2, 7] = rows[3, 0] = 1.0
    rows[2] += A[2]
    rows[2, 3] += speed  # lateral acceleration dv_y/dt + v r + b_a
    periods = math.floor(delay / period + 1e-9)
    first_part = max(delay - periods * period, 0.0)
    flow, over = _discretize(A, B, period)
    first, over_first = _discretize(A, B, first_part)
    flow_rest, over_rest = _discretize(A, B, period - first_part)
    steps = [np.linalg.matrix_power(flow, periods - i - 1) @ over for i in range(periods)]
    columns = np.array([np.linalg.matrix_power(flow, periods) @ over_first, *steps])
    start = np.zeros(N_STATES)
    start[6:] = np.square((deviations.yaw_rate_offset, deviations.acceleration_offset, *[deviations.force] * 2))
    inputs = np.column_stack((flow_rest @ over_first[:, 0], over_rest[:, 0], over[:, 1]))
    ahead = np.linalg.matrix_power(flow, periods) @ first
    since = np.ascontiguousarray(np.concatenate((columns[:, :, 0], columns[:, :, 1])).T)
    middles = np.concatenate(([first_part / 2], first_part + (np.arange(periods) + 0.5) * period))
    noise, variances = _noise(A, G, period), np.square(deviations[:4])
    return ObserverModel(period, flow, inputs, noise, start, rows, variances, ahead, since, middles)


def _continuous(
    vehicle: Vehicle, servo: Servo, speed: float, deviations: Deviations
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A (10, 10), B (10, 2), G (10, 4) of dx/dt = A x + B [u, κ] + G w, w white noise of density 1."""
    A, B, G = np.zeros((N_STATES, N_STATES)), np.zeros((N_STATES, 2)), np.zeros((N_STATES, 4))
    A[:6, :6], B[:6, 0], B[:6, 1] = DesignModel(vehicle, servo, speed, 1.0).continuous
    A[2, 8:], A[3, 8:] = 1 / vehicle.mass, np.array([vehicle.lf, -vehicle.lr]) / vehicle.yaw_inertia
    A[8, 8] = A[9, 9] = -1 / deviations.force_time
    G[8, 0] = G[9, 1] = deviations.force * math.sqrt(2 / deviations.force_time)
    G[5, 2], G[7, 3] = deviations.servo, deviations.offset_drift
    return A, B, G


def _discretize(A: np.ndarray, B: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the flow of dx/dt = A x + B u over a duration, s, and the effect of constant inputs."""
    n, m = B.shape
    block = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) * duration)
    return block[:n, :n].copy(), block[:n, n:].copy()


def _noise(A: np.ndarray, G: np.ndarray, duration: float) -> np.ndarray:
    """Return the covariance of x after a time, s, of white noise Gw (Van Loan, IEEE Trans. Autom. Control 23, 1978)."""
    n = len(A)
    block = scipy.linalg.expm(np.block([[-A, G @ G.T], [np.zeros((n, n)), A.T]]) * duration)
    return block[n:, n:].T @ block[:n, n:]


@jit
def take(
    state: np.ndarray, covariance: np.ndarray, values: np.ndarray, variances: np.ndarray, rows: np.ndarray,
    moved: np.ndarray,
) -> None:  # fmt: skip
    """Update by the measurements that are not NaN, one after another, in place.

    The variance (n,) of each is increased by the square of its change, rows (n, 10) times ``moved`` (10,), within
    the standard deviation of its age.
    """
    for i in range(values.size):
        if np.isnan(values[i]):
            continue
        cross = covariance @ rows[i]
        variance = np.dot(rows[i], cross) + variances[i] + np.dot(rows[i], moved) ** 2
        if variance > 0.0:
            state += cross * ((values[i] - np.dot(rows[i], state)) / variance)
            covariance -= np.outer(cross, cross) / variance
