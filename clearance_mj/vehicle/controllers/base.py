"""What a steering controller is, and what it may know before and during a run.

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
    """What a controller sees at a sample."""

    s: float  # m, foot point's arc length
    e_y: float  # m, lateral position error, left positive
    e_psi: float  # rad, heading error
    lateral_speed: float  # m/s, at the centre of gravity
    yaw_rate: float  # rad/s
    speed: float  # m/s, longitudinal
    signals: Signals | None = None  # what it is made of: what the car's bus has delivered


@dataclass(frozen=True)
class Task:
    """Everything that a controller knows before a run; never the plant's own parameters."""

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
    """Time of driving over which the road ahead is known, s; the same for every controller"""
    largest_angle: float = 0.5
    """Largest angle of the road wheel, rad"""
    largest_rate: float = 0.4
    """Largest rate of the road wheel, rad/s"""

    @property
    def lead(self) -> int:
        """Periods from a command to the wheel's answer: servo lag and half a period of holding, rounded."""
        return round(self.servo.lag / self.period + 0.5)

    def curvature(self, seen: Observation, times: ArrayLike) -> np.ndarray:
        """Curvature, 1/m, where the vehicle will be at times from now, s; beyond the preview it stays as it is."""
        times = np.asarray(times, dtype=float)
        found = curvature_ahead(self.path.table, seen.s, seen.speed, times.ravel(), self.preview)
        return np.asarray(found).reshape(times.shape)


def limited(angle: float, last: float, task: Task) -> float:
    """Return an angle within the limits of angle and of rate from the last command, rad."""
    step = task.largest_rate * task.period
    angle = min(max(angle, last - step), last + step)
    return min(max(angle, -task.largest_angle), task.largest_angle)


class ControllerRun(ABC):
    """A controller during one run of the vehicle."""

    excess: float = 0.0
    """Part of the last command, rad, that the tyres need beyond the linear model, which goes on with the rest"""
    depth: float = math.nan
    """|s|/Φ at the last sample: beyond 1 the switching term has all its size; NaN where nothing slides"""

    @abstractmethod
    def command(self, seen: Observation) -> float:
        """Return the command for the next period, within the limits of angle and rate, rad."""


@dataclass(frozen=True)
class Controller(ABC):
    """A controller with its settings; subclasses are frozen dataclasses whose fields are what is tuned."""

    @abstractmethod
    def start(self, task: Task) -> ControllerRun:
        """Begin a run, wheels straight ahead."""
