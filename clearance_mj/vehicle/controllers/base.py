"""Base classes of steering controllers, and their knowledge before and during a run.

Tracking errors are those of the centre of gravity from its foot point on the path.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..nominal import Servo, Vehicle
from ..path import Path, curvature_ahead
from ..signals import Signals

__all__ = ["Controller", "ControllerRun", "Observation", "Task", "limited"]


class Observation(NamedTuple):
    """A controller's input at a sample."""

    s: float  # m, foot point's arc length
    e_y: float  # m, lateral position error, left positive
    e_psi: float  # rad, heading error
    lateral_speed: float  # m/s, at the centre of gravity
    yaw_rate: float  # rad/s
    speed: float  # m/s, longitudinal
    signals: Signals | None = None  # of the car's bus, from which it is derived


@dataclass(frozen=True)
class Task:
    """Knowledge of a controller before a run; never the plant's parameters."""

    vehicle: Vehicle
    """nominal"""
    path: Path
    """Path to follow"""
    speed: float
    """Speed, m/s"""
    servo: Servo = Servo()  # noqa: RUF009
    """Servo of the steering"""
    period: float = 0.01
    """Time between commands, s"""
    preview: float = 0.2
    """Preview time of the road ahead, s; the same for every controller"""
    largest_angle: float = 0.5
    """Largest angle of the road wheel, rad"""
    largest_rate: float = 0.4
    """Largest rate of the road wheel, rad/s"""

    @property
    def lead(self) -> int:
        """Periods from a command to the wheel's response: servo lag and half a period of hold, rounded."""
        return round(self.servo.lag / self.period + 0.5)

    def curvature(self, seen: Observation, times: ArrayLike) -> np.ndarray:
        """Return the curvature, 1/m, at the vehicle at times from now, s; constant beyond the preview."""
        times = np.asarray(times, dtype=float)
        curvature = curvature_ahead(self.path.table, seen.s, seen.speed, times.ravel(), self.preview)
        return np.asarray(curvature).reshape(times.shape)


def limited(angle: float, last: float, task: Task) -> float:
    """Return an angle within the limits of angle and of rate from the last command, rad."""
    step = task.largest_rate * task.period
    angle = min(max(angle, last - step), last + step)
    return min(max(angle, -task.largest_angle), task.largest_angle)


class ControllerRun(ABC):
    """A controller during one run of the vehicle."""

    excess: float = 0.0
    """Part of the last command, rad, that the tyres need beyond the linear model, which continues without it"""
    depth: float = math.nan
    """|s|/Φ at the last sample: beyond 1 the switching term is saturated; NaN without sliding mode"""

    @abstractmethod
    def command(self, seen: Observation) -> float:
        """Return the command for the next period, within the limits of angle and rate, rad."""


@dataclass(frozen=True)
class Controller(ABC):
    """A controller with its settings; subclasses are frozen dataclasses whose fields are the settings."""

    @abstractmethod
    def start(self, task: Task) -> ControllerRun:
        """Begin a run, wheels straight ahead."""
