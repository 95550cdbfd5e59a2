"""Ideal sensors: every state of the design model, at once, with white noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..controllers.base import Observation, Task
from ..plant import Measurement
from ..signals import Signals
from .base import Sensors, SensorsRun

__all__ = ["IdealSensors"]


@dataclass(frozen=True)
class IdealSensors(Sensors):
    """Standard deviations of the white noise that is added to the true values."""

    position: float = 0.0  # m, lateral
    heading: float = 0.0  # rad
    lateral_speed: float = 0.0  # m/s
    yaw_rate: float = 0.0  # rad/s

    @classmethod
    def inertial(cls) -> IdealSensors:
        """Inertial navigation with corrected satellite positions: 10 mm, 0.05°, 0.02 m/s, 0.1 °/s."""
        return cls(0.01, np.radians(0.05), 0.02, np.radians(0.1))

    def start(self, task: Task, seed: int = 0) -> SensorsRun:
        """Begin a run."""
        return _IdealRun(self, task.period, seed)


class _IdealRun(SensorsRun):
    def __init__(self, sensors: IdealSensors, period: float, seed: int):
        self._deviations = sensors.position, sensors.heading, sensors.lateral_speed, sensors.yaw_rate
        self._period, self._noise, self._samples = period, np.random.default_rng([seed, 1]), 0

    def observe(self, true: Observation, now: Measurement, servo: float, command: float) -> Observation:
        draws = zip(true[1:5], self._deviations, self._noise.standard_normal(4))
        e_y, e_psi, lateral_speed, yaw_rate = (value + deviation * draw for value, deviation, draw in draws)
        offset, heading = e_y - true.e_y, now.heading + e_psi - true.e_psi
        path_heading = now.heading - true.e_psi
        position = now.x - offset * math.sin(path_heading), now.y + offset * math.cos(path_heading)
        time, self._samples = self._samples * self._period, self._samples + 1
        signals = Signals(time, servo, yaw_rate, now.lateral_acceleration, now.speed, position, heading)
        return Observation(true.s, e_y, e_psi, lateral_speed, yaw_rate, true.speed, signals)
