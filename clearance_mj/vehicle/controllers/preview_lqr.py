"""Linear quadratic regulator with preview of the curvature.

The states are those of the design model and the curvature ahead, which shifts by one place per period. The regulator
minimises Σ e_y² + q_c (de_y/dt)² + q_u Δu² over all time, with the last known curvature constant beyond the preview.
The problem is solved in two parts, feedback from a Riccati equation and feedforward from its closed loop; `mpc.program`
has both. The limits are not part of the plan.

Sharp and Valtetsis, Optimal preview car steering control, Vehicle System Dynamics 35 (supplement), 2001.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base import Controller, Observation, Task
from .design import ModelRun
from .mpc import Weights, program
from .registry import Registration, register

__all__ = ["PreviewRegulator"]


@dataclass(frozen=True)
class PreviewRegulator(Controller):
    """LQR with preview; weights are relative to that of the lateral error."""

    course: float = 0.02  # q_c, s²: of the rate of the lateral error
    effort: float = 500.0  # q_u, m²/rad²: of the change of the command in a period

    def start(self, task: Task) -> ModelRun:
        """Begin a run."""
        return _PreviewRun(task, self)


class _PreviewRun(ModelRun):
    def __init__(self, task: Task, settings: PreviewRegulator):
        super().__init__(task)
        periods = max(round(task.preview / task.period), 1)
        gains = program(self.model, Weights(settings.course, 0.0, settings.effort), periods)
        self._feedback, self._feedforward = gains.state[0], gains.curvature[0]
        self._preview_times = np.arange(periods + 1) * task.period

    def wheel_angle(self, seen: Observation) -> float:
        """Feed back the state and forward the curvature."""
        last, curvature = self.predictor.last, self.task.curvature(seen, self._preview_times)
        state = self.predictor.state(seen)
        return last + float(self._feedback[:6] @ state + self._feedback[6] * last + self._feedforward @ curvature)


BOUNDS = {"course": (1e-3, 1.0), "effort": (10.0, 1e5)}
register(Registration("preview-lqr", "preview LQR", PreviewRegulator, bounds=BOUNDS, colour="#999933", line="-."))
