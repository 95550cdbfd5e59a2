"""The observer of a car's states: a Kalman filter on the nominal design model, at the time of the measurements.

All measurements are old by the bus's mean delay D. The filter lives at that time, t - D, and the model brings its
estimate to the present by the commands given since and the curvature driven over since: so the delay is compensated
(Anderson and Moore, Optimal Filtering, 1979, chapter 7).
"""

from __future__ import annotations

import math

import numpy as np

from ...core.jit import jit
from ..controllers.base import Task
from ..path import Table, curvature_ahead
from .observer_model import N_STATES, Deviations, observer_model, take

__all__ = ["Observer"]

WAY_NOISE = 0.1  # m/√s, noise of the travelled way over the integrated speed of the wheels


class Observer:
    """A Kalman filter during a run that begins on the path, wheels straight."""

    def __init__(self, task: Task, delay: float, deviations: Deviations, driven: float = 0.0, fixes: float = 20.0):
        """Take the mean age of measurements and the time driven straight before, s, and the rate of fixes, Hz."""
        model = observer_model(task.vehicle, task.servo, task.speed, task.period, delay, deviations)
        self.delay = delay
        """s, mean age of the measurements"""
        self.state, self.covariance = np.zeros(N_STATES), model.settled(driven, fixes)
        """(10,) and (10, 10), at the time of the measurements"""
        self.s = -task.speed * delay
        """m, arc length at the time of the measurements"""
        self._task, self._deviations, self._model = task, deviations, model
        self._commands, self._rate, self._s_variance = np.zeros(model.middles.size + 1), np.zeros(N_STATES), 0.0

    def advance(self, command: float, speed: float) -> None:
        """Go on by the period in which a command was given, rad, at a measured speed, m/s."""
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
        """Take new measurements, or None: steering angle, rad; yaw rate and lateral acceleration, rad/s, m/s²; x, y, m.

        All of them were taken the mean delay ago.
        """
        known = self._deviations
        yaw_rate, acceleration = (math.nan, math.nan) if motion is None else motion
        lateral = math.nan
        if position is not None:
            s, lateral, _, _ = self._task.path.locate(*position, self.s)
            noise = known.position**2 + (self._task.speed * known.age) ** 2
            self.s += self._s_variance / (self._s_variance + noise) * (s - self.s)
            self._s_variance *= noise / (self._s_variance + noise)
        values = np.array((math.nan if angle is None else angle, yaw_rate, acceleration, lateral))
        take(self.state, self.covariance, values, self._model.variances, self._model.rows, known.age * self._rate)

    def present(self, speed: float) -> tuple[float, np.ndarray]:
        """Return the arc length, m, and state (10,) at the last sample, at a measured speed, m/s."""
        model = self._model
        now = _present(
            self.state, self._commands, self._task.path.table, self.s, speed, model.middles, model.ahead, model.since
        )
        return self.s + speed * self.delay, now


@jit
def _predict(
    state: np.ndarray, covariance: np.ndarray, rate: np.ndarray, commands: np.ndarray, command: float, table: Table,
    s: float, speed: float, flow: np.ndarray, effect: np.ndarray, noise: np.ndarray, period: float,
) -> None:  # fmt: skip
    """Go on by one period, in place; the rate is that of the state over it."""
    commands[:-1] = commands[1:].copy()
    commands[-1] = command
    curvature = curvature_ahead(table, s, speed, np.array([period / 2]), np.inf)
    after = flow @ state + effect @ np.concatenate((commands[:2], curvature))
    rate[:] = (after - state) / period
    state[:] = after
    covariance[:] = flow @ covariance @ flow.T + noise


@jit
def _present(
    state: np.ndarray, commands: np.ndarray, table: Table, s: float, speed: float, middles: np.ndarray,
    ahead: np.ndarray, since: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """State at the last sample."""
    curvature = curvature_ahead(table, s, speed, middles, np.inf)
    return ahead @ state + since @ np.concatenate((commands[1:], curvature))
