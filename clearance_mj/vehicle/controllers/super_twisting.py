"""Super-twisting sliding mode control: k₁ √|s| sign(s) + w, dw/dt = k₂ sign(s), on the surface of `smc`.

Levant, Sliding order and sliding accuracy in sliding mode control, International Journal of Control 58, 1993.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .base import Controller, Task
from .registry import Registration, register
from .smc import SURFACE_BOUNDS, SlidingRun, saturation

__all__ = ["SuperTwisting"]


@dataclass(frozen=True)
class SuperTwisting(Controller):
    """Super-twisting, with the sign smoothed in a boundary layer."""

    look_ahead: float = 3.0  # L_s, m
    convergence: float = 4.0  # λ, 1/s
    root: float = 2.0  # k₁, √m/s^1.5
    integral: float = 2.0  # k₂, m/s³
    layer: float = 0.1  # Φ, m/s

    def start(self, task: Task) -> SlidingRun:
        """Begin a run."""
        return _Twisting(task, self)


class _Twisting(SlidingRun):
    _integral = 0.0

    def reaching(self, value: float) -> float:
        p: SuperTwisting = self.settings
        self._integral += p.integral * saturation(value / p.layer) * self.task.period
        return p.root * value / math.sqrt(max(abs(value), p.layer)) + self._integral


BOUNDS = SURFACE_BOUNDS | {"root": (0.2, 10.0), "integral": (0.05, 10.0), "layer": (0.02, 1.0)}
register(Registration("super-twisting", "super-twisting", SuperTwisting, bounds=BOUNDS, colour="#8c8c8c", line="-."))
