"""The observer of a car's states: a Kalman filter on the nominal design model, at the time of the measurements.

All measurements are old by the bus's mean delay D. The filter lives at that time, t - D, and the model brings its
estimate to the present by the commands given since and the curvature driven over since: so the delay is compensated
(Anderson and Moore, Optimal Filtering, 1979, chapter 7). The state is that of the design model with the offsets of the
sensors of yaw rate and lateral acceleration and the unknown lateral forces of both axles,
[e_y, e_ψ, v_y, r, δ, dδ/dt, b_r, b_a, F_f, F_r].
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
import scipy.linalg

from ..controllers.base import Task
from ..controllers.design import DesignModel

__all__ = ["Deviations", "Observer"]

N_STATES = 10
ALONG = 0.1
"""m/√s, of the way over the integrated speed of the wheels"""


class Deviations(NamedTuple):
    """Standard deviations that the observer counts on."""

    angle: float  # rad, of the steering angle
    yaw_rate: float  # rad/s
    acceleration: float  # m/s²
    position: float  # m
    yaw_rate_offset: float  # rad/s
    acceleration_offset: float  # m/s²
    age: float = 0.0  # s, of a measurement's age about its mean
    offset_drift: float = 0.05  # m/s² √s⁻¹, of the offset of the lateral acceleration with the road's cross slope
    force: float = 500.0  # N, of the unknown lateral force of each axle
    force_time: float = 0.5  # s, over which it stays alike
    servo: float = 5.0  # rad/s² √s, of the unmodelled acceleration of the servo: a density


class Observer:
    """A Kalman filter during a run that begins on the path; offsets are unknown then."""

    def __init__(self, task: Task, delay: float, deviations: Deviations):
        self.delay = delay
        """s, mean age of the measurements"""
        self.state, self.covariance = np.zeros(N_STATES), np.zeros((N_STATES, N_STATES))
        """(8,) and (8, 8), at the time of the measurements"""
        offsets = deviations.yaw_rate_offset, deviations.acceleration_offset
        np.fill_diagonal(self.covariance, np.square([*[0.0] * 6, *offsets, *[deviations.force] * 2]))
        self.s = -task.speed * delay
        """m, arc length at the time of the measurements"""
        self._task, self._deviations = task, deviations
        self._model = _Model.of(task, delay, deviations)
        self._commands, self._moved, self._s_variance = np.zeros(self._model.middles.size + 1), np.zeros(N_STATES), 0.0

    def advance(self, command: float, speed: float) -> None:
        """Go on by the period in which a command was given, rad, at a measured speed, m/s."""
        model, period = self._model, self._task.period
        self._commands[:-1], self._commands[-1] = self._commands[1:], command
        curvature = float(self._task.path.curvature(self.s + speed * period / 2))
        self._moved = self.state
        self.state = model.flow @ self.state + model.inputs @ (*self._commands[:2], curvature)
        self.covariance = model.flow @ self.covariance @ model.flow.T + model.noise
        self.s += speed * period
        self._s_variance += ALONG**2 * period
        self._moved = (self.state - self._moved) / period

    def measure(
        self, angle: float | None, motion: tuple[float, float] | None, position: tuple[float, float] | None
    ) -> None:
        """Take new measurements, or None: steering angle, rad; yaw rate and lateral acceleration, rad/s, m/s²; x, y, m.

        All of them were taken the mean delay ago.
        """
        known = self._deviations
        yaw_rate, acceleration = (math.nan, math.nan) if motion is None else motion
        values = np.array((math.nan if angle is None else angle, yaw_rate, acceleration, math.nan))
        if position is not None:
            s, values[3], _, _ = self._task.path.locate(*position, self.s)
            noise = known.position**2 + (self._task.speed * known.age) ** 2
            self.s += self._s_variance / (self._s_variance + noise) * (s - self.s)
            self._s_variance *= noise / (self._s_variance + noise)
        rows = self._model.rows
        variances = np.square(known[:4]) + np.square(known.age * (rows @ self._moved))
        _update(self.state, self.covariance, values, variances, rows)

    def present(self, speed: float) -> tuple[float, np.ndarray]:
        """Arc length, m, and state (8,) at the last sample, at a measured speed, m/s."""
        model = self._model
        curvature = self._task.path.curvature(self.s + speed * model.middles)
        since = model.since @ np.concatenate((self._commands[1:], curvature))
        return self.s + speed * self.delay, model.ahead @ self.state + since


class _Model(NamedTuple):
    """The design model with offsets, over a period at the time of the measurements and from then to the present."""

    flow: np.ndarray  # (8, 8) over a period
    inputs: np.ndarray  # (8, 3) of the two commands in a period, and the curvature
    noise: np.ndarray  # (8, 8) over a period
    rows: np.ndarray  # (4, 8) of the measurements: steering angle, yaw rate, lateral acceleration, e_y
    ahead: np.ndarray  # (8, 8) to the present
    since: np.ndarray  # (8, 2 n) of n commands and n curvatures since
    middles: np.ndarray  # (n,) s, of the times in which they are held

    @classmethod
    def of(cls, task: Task, delay: float, deviations: Deviations) -> _Model:
        p, speed, period = task.vehicle, task.speed, task.period
        A6, B6, E6 = DesignModel(p, task.servo, speed, period).continuous
        A, held, G = np.zeros((N_STATES, N_STATES)), np.zeros((N_STATES, 2)), np.zeros((N_STATES, 4))
        A[:6, :6], held[:6, 0], held[:6, 1] = A6, B6, E6
        A[2, 8:], A[3, 8:] = 1 / p.mass, np.array([p.lf, -p.lr]) / p.yaw_inertia
        A[8, 8] = A[9, 9] = -1 / deviations.force_time
        G[8, 0] = G[9, 1] = deviations.force * math.sqrt(2 / deviations.force_time)
        G[5, 2], G[7, 3] = deviations.servo, deviations.offset_drift
        rows = np.zeros((4, N_STATES))
        rows[0, 4] = rows[1, 3] = rows[1, 6] = rows[2, 7] = rows[3, 0] = 1.0
        rows[2] += A[2]
        rows[2, 3] += speed
        whole = math.floor(delay / period + 1e-9)
        part = max(delay - whole * period, 0.0)
        flow, over = _held(A, held, period)
        first, over_first = _held(A, held, part)
        rest, over_rest = _held(A, held, period - part)
        inputs = np.column_stack((rest @ over_first[:, 0], over_rest[:, 0], over[:, 1]))
        steps = [np.linalg.matrix_power(flow, whole - i - 1) @ over for i in range(whole)]
        columns = np.array([np.linalg.matrix_power(flow, whole) @ over_first, *steps])
        since = np.concatenate((columns[:, :, 0], columns[:, :, 1])).T
        middles = np.concatenate(([part / 2], part + (np.arange(whole) + 0.5) * period))
        ahead = np.linalg.matrix_power(flow, whole) @ first
        return cls(flow, inputs, _noise(A, G, period), rows, ahead, np.ascontiguousarray(since), middles)


def _held(A: np.ndarray, B: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Flow of dx/dt = A x + B u over a duration, s, and the effect of inputs that are held."""
    n, m = B.shape
    block = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) * duration)
    return block[:n, :n], block[:n, n:]


def _noise(A: np.ndarray, G: np.ndarray, duration: float) -> np.ndarray:
    """Covariance of x after a duration, s, of white noise G w (Van Loan, IEEE Trans. Autom. Control 23, 1978)."""
    n = len(A)
    block = scipy.linalg.expm(np.block([[-A, G @ G.T], [np.zeros((n, n)), A.T]]) * duration)
    return block[n:, n:].T @ block[:n, n:]


@numba.njit(cache=True, nogil=True)
def _update(
    state: np.ndarray, covariance: np.ndarray, values: np.ndarray, variances: np.ndarray, rows: np.ndarray
) -> None:
    """Take measurements that are not NaN into account, one after another."""
    for i in range(values.size):
        if np.isnan(values[i]):
            continue
        cross = covariance @ rows[i]
        variance = np.dot(rows[i], cross) + variances[i]
        if variance > 0.0:
            state += cross * ((values[i] - np.dot(rows[i], state)) / variance)
            covariance -= np.outer(cross, cross) / variance
