"""The sensors of a car: on a bus, noisy, with offsets; controllers receive an observer's estimate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...core.errors import ManoeuvreError
from ..commonroad import GRAVITY
from ..controllers.base import Observation, Task
from ..plant import Measurement
from ..signals import Signals
from .base import Sensors, SensorsRun
from .bus import Message, age, draws
from .observer import N_STATES, Deviations, RunObserver

__all__ = ["CarSensors"]

HAND_WHEEL_RATIO = 16.0  # hand-wheel angle over road-wheel angle
CROSS_SLOPE = 0.02
"""Standard deviation of a road's cross slope, which offsets the lateral acceleration by its part of gravity."""

STRAIGHT_BEFORE = 10.0  # s of straight driving before a run, for the observer to settle


@dataclass(frozen=True)
class CarSensors(Sensors):
    """Standard deviations of errors, and the bus; offsets and scale are drawn once, white noise at every sample."""

    servo_torque: ClassVar[float] = 85.0 * HAND_WHEEL_RATIO
    """N m: 85 N m at the column, the largest electric drives at the column (TRW, 2010)"""

    tuned: ClassVar[str] = "car"

    steering_resolution: float = math.radians(0.1) / HAND_WHEEL_RATIO  # rad at the road wheel: 0.1° of the hand wheel
    yaw_rate: float = math.radians(0.1)  # rad/s, white
    yaw_rate_offset: float = math.radians(0.2)  # rad/s
    lateral_acceleration: float = 0.05  # m/s², white
    acceleration_offset: float = 0.1  # m/s²
    acceleration_scale: float = 0.02  # of the lateral acceleration, including the remaining body roll
    speed: float = 0.02  # m/s, white
    position: float = 0.02  # m, white, along x and y
    position_rate: float = 20.0  # Hz, of the fixes
    delay: tuple[float, float] = (0.01, 0.03)  # s, shortest and longest of a message, uniform between them

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name not in ("delay", "position_rate") and not 0 <= value < math.inf:
                raise ManoeuvreError(f"CarSensors.{name} must be finite and >= 0, got {value!r}")
        if not 0 < self.position_rate < math.inf:
            raise ManoeuvreError(f"CarSensors.position_rate must be > 0 Hz, got {self.position_rate!r}")
        if not 0 <= self.delay[0] <= self.delay[1] <= 0.5:
            raise ManoeuvreError(f"CarSensors.delay must be two delays in order within 0..0.5 s, got {self.delay!r}")

    def start(self, task: Task, seed: int = 0) -> SensorsRun:
        """Begin a run."""
        if self.position_rate * task.period > 1:
            raise ManoeuvreError(
                f"CarSensors.position_rate must be at most {1 / task.period:g} Hz, once a period of the controller, "
                f"got {self.position_rate:g}"
            )
        return _CarRun(self, task, seed)


class _CarRun(SensorsRun):
    def __init__(self, sensors: CarSensors, task: Task, seed: int):
        self._sensors, self._period, self._samples = sensors, task.period, 0
        self._noise = np.random.default_rng([seed, 2])
        yaw_rate, acceleration, scale = self._noise.standard_normal(3).tolist()
        self._yaw_rate_offset = sensors.yaw_rate_offset * yaw_rate
        self._acceleration_offset = sensors.acceleration_offset * acceleration
        self._acceleration_scale = 1 + sensors.acceleration_scale * scale
        self._fix_count = -1
        self._angle, self._motion, self._speed, self._position = (
            Message(sensors.delay, np.random.default_rng([seed, 2, i])) for i in range(4)
        )
        self._delay, deviation = age(sensors.delay, task.period)
        angle, slope = sensors.steering_resolution / math.sqrt(12), CROSS_SLOPE * GRAVITY
        white = angle, sensors.yaw_rate, sensors.lateral_acceleration, sensors.position
        steady = sensors.yaw_rate_offset, math.hypot(sensors.acceleration_offset, slope)
        deviations = Deviations(*white, *steady, deviation)
        self._observer = RunObserver(task, self._delay, deviations, STRAIGHT_BEFORE, sensors.position_rate)
        # The initial error of the estimate is drawn from its covariance.
        factor = np.linalg.cholesky(self._observer.covariance + 1e-18 * np.eye(N_STATES))
        offsets = self._yaw_rate_offset, self._acceleration_offset
        self._observer.state += [*[0.0] * 6, *offsets, 0.0, 0.0] + factor @ self._noise.standard_normal(N_STATES)
        self._signals = Signals(0.0, 0.0, 0.0, 0.0, task.speed, delay=self._delay)
        self._draws = draws(lambda count: self._noise.standard_normal((count, 5)))

    def observe(self, true: Observation, now: Measurement, servo: float, command: float) -> Observation:
        time = self._samples * self._period
        self._send(time, now, servo)
        angle, motion, speed, position = (
            message.read(time) for message in (self._angle, self._motion, self._speed, self._position)
        )
        last = self._signals
        yaw_rate, acceleration = motion or (last.yaw_rate, last.lateral_acceleration)
        steering, wheel_speed = last.steering_angle if angle is None else angle, last.speed if speed is None else speed
        self._signals = seen = Signals(time, steering, yaw_rate, acceleration, wheel_speed, position, None, self._delay)
        observer = self._observer
        if self._samples:
            observer.advance(command, seen.speed)
        self._samples += 1
        observer.measure(angle, motion, position)
        s, state = observer.present(seen.speed)
        e_y, e_psi, lateral_speed, yaw_rate = state[:4].tolist()
        return Observation(s, e_y, e_psi, lateral_speed, yaw_rate, seen.speed, seen)

    def _send(self, time: float, now: Measurement, servo: float) -> None:
        """Send the measurements on the bus."""
        sensors, noise = self._sensors, next(self._draws)
        step = sensors.steering_resolution
        self._angle.send(time, step * round(servo / step) if step else servo)
        yaw_rate = now.yaw_rate + self._yaw_rate_offset + sensors.yaw_rate * noise[0]
        acceleration = self._acceleration_scale * now.lateral_acceleration + self._acceleration_offset
        acceleration += sensors.lateral_acceleration * noise[1]
        self._motion.send(time, (yaw_rate, acceleration))
        self._speed.send(time, now.speed + sensors.speed * noise[2])
        fixes = math.floor(time * sensors.position_rate + 1e-9)
        if fixes > self._fix_count:
            self._fix_count = fixes
            self._position.send(time, (now.x + sensors.position * noise[3], now.y + sensors.position * noise[4]))
