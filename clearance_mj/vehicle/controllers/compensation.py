"""Compensation of the steering clearance: an estimate of the lost motion, subtracted from any controller's command."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.errors import ManoeuvreError
from .base import Controller, ControllerRun, Observation, Task, limited
from .design import Predictor

__all__ = ["Compensated", "Estimate", "LostMotionModel"]


Estimate = Callable[[float, np.ndarray], float]
"""Lost motion, rad, when the wheel has responded to the next command; called at every sample with the linear model's
road-wheel angle, rad, and its state (6,), both predicted for that time"""


@dataclass(frozen=True)
class LostMotionModel(ABC):
    """A model of the lost motion, as prior information of a controller."""

    half_gap: float  # h, rad at the road wheel

    def __post_init__(self) -> None:
        if not 0 <= self.half_gap < math.inf:
            raise ManoeuvreError(
                f"{type(self).__name__}.half_gap must be a finite angle >= 0 rad, got {self.half_gap!r}"
            )

    @abstractmethod
    def start(self, task: Task) -> Estimate:
        """Begin a run, in the middle of the gap."""


@dataclass(frozen=True)
class Compensated(Controller):
    """A controller whose commands are corrected for the lost motion; it is tuned without the correction."""

    controller: Controller
    lost_motion: LostMotionModel

    def start(self, task: Task) -> ControllerRun:
        """Begin a run."""
        return CompensatedRun(task, self)


class CompensatedRun(ControllerRun):
    """A run of a compensated controller."""

    def __init__(self, task: Task, settings: Compensated):
        self._task, self._last, self._predictor = task, 0.0, Predictor(task)
        self._inner, self._estimate = settings.controller.start(task), settings.lost_motion.start(task)

    def command(self, seen: Observation) -> float:
        state = self._predictor.predicted(seen)
        angle = self._inner.command(seen)
        self.excess, self.depth = self._inner.excess, self._inner.depth
        linear = angle - self.excess
        self._predictor.follow(linear)
        self._last = limited(angle - self._estimate(linear, state), self._last, self._task)
        return self._last


class Direction:
    """Direction of a noisy signal: it changes when the signal has turned back by more than a slack."""

    def __init__(self, slack: float):
        self._slack, self._extreme, self._sign = slack, 0.0, 0

    def advance(self, value: float) -> int:
        """Return the direction with the next value: -1, 1, or 0 before the first motion."""
        change = value - self._extreme
        if abs(change) > self._slack:
            self._sign = 1 if change > 0 else -1
        if change * self._sign > 0:
            self._extreme = value
        return self._sign
