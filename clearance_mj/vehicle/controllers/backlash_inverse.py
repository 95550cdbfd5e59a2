"""The inverse of plain play: half a gap towards the direction of motion, whatever the moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base import Controller, Task
from .compensation import Compensated, Direction, Estimate, LostMotionModel
from .registry import ClearancePrior, Registration, register
from .smc import SlidingMode

__all__ = ["BacklashInverse"]


@dataclass(frozen=True)
class BacklashInverse(LostMotionModel):
    """Lost motion of a play whose side is decided by friction."""

    slack: float = np.radians(0.1)  # rad, as in `ClearanceModel`

    def start(self, task: Task) -> Estimate:
        """Begin a run, in the middle of the gap."""
        direction = Direction(self.slack)
        return lambda angle, state: -self.half_gap * direction.advance(state[4])


def _with_inverse(controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
    return Compensated(controller, BacklashInverse(prior.half_gap))


register(Registration("smc-inverse", "SMC, backlash inverse", SlidingMode, tuned_as="smc", adapt=_with_inverse,
                      prior="half-gap", colour="#cc79a7", line=(0, (1, 1.2))))  # fmt: skip
