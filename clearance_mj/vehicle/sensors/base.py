"""Base classes of sensors: they derive a controller's observation from the true motion."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

from ..controllers.base import Observation, Task
from ..plant import Measurement

__all__ = ["Sensors", "SensorsRun"]


class SensorsRun(ABC):
    """Sensors during one run of the vehicle."""

    @abstractmethod
    def observe(self, true: Observation, now: Measurement, servo: float, command: float) -> Observation:
        """Return the controller's observation at the next sample, one period after the last.

        Given the true path errors and motion, the servo's angle, rad, and the command since the last sample, rad.
        """


class Sensors(ABC):
    """Sensors with their errors, of a vehicle whose servo has a motor; subclasses are frozen dataclasses."""

    servo_torque: ClassVar[float] = math.inf
    """N m at the road wheel, largest of the servo's motor: `Steering.torque_limit`"""

    tuned: ClassVar[str] = "ideal"
    """set of tuned settings that controllers use with them"""

    @abstractmethod
    def start(self, task: Task, seed: int = 0) -> SensorsRun:
        """Begin a run of a task; the seed is that of all errors."""
