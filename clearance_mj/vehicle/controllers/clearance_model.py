"""The reduced clearance model as compensation: the contact's side follows the aligning moment and friction.

The shaft holds the wheel against a moment T and the wheel stays behind the servo by h σ + T/k: half-gap h, contact side
σ = sign T, contact stiffness k. T is the aligning moment plus friction that opposes the wheel's motion,
T = T_a + T_f sign(dδ/dt): without friction the side follows the aligning moment (torque-driven), with much friction
the motion (friction-driven). While the side is not known, σ = 0, the estimate keeps its last value.

The stiffness of a steering without clearance belongs to the nominal vehicle that all controllers know
(`Vehicle.with_steering`) for the aligning moment; compensated are the rest and the twist T_f/k under
friction. Without clearance and friction there is no compensation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...core.errors import ManoeuvreError
from .base import Controller, Task
from .compensation import Compensated, Direction, Estimate, LostMotionModel
from .registry import ClearancePrior

__all__ = ["PRIOR", "ClearanceModel", "with_clearance_model"]

PRIOR = "half-gap, stiffness and friction"


@dataclass(frozen=True)
class ClearanceModel(LostMotionModel):
    """The reduced clearance model, fed by the aligning moment that the nominal single track predicts."""

    compliance: float = 0.0  # 1/k less that of the nominal vehicle's steering, rad/(N m) at the road wheel
    friction: float = 0.0  # T_f, N m at the road wheel
    threshold: float = 10.0  # N m, moment below which the side is unknown
    slack: float = np.radians(0.1)  # rad, reversal of the servo that changes its direction: twice its noise
    stiffness: float = math.inf  # k, N m/rad at the road wheel, against friction

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.isfinite(self.compliance):
            raise ManoeuvreError(f"ClearanceModel.compliance must be finite, rad/(N m), got {self.compliance!r}")
        if not 0 <= self.friction < math.inf:
            raise ManoeuvreError(f"ClearanceModel.friction must be finite and >= 0 N m, got {self.friction!r}")
        if not self.stiffness > 0:
            raise ManoeuvreError(f"ClearanceModel.stiffness must be > 0 N m/rad, got {self.stiffness!r}")

    def start(self, task: Task) -> Estimate:
        """Begin a run, in the middle of the gap."""
        return ClearanceEstimate(self, task)


class ClearanceEstimate:
    """The estimate during a run; its ``model`` may be replaced."""

    def __init__(self, model: ClearanceModel, task: Task):
        p, self.model, self._speed = task.vehicle, model, task.speed
        self._lf, self._trail, self._stiffness = p.lf, p.trail, p.cornering_front
        self._largest = p.tyre.friction * p.front_load
        self._direction, self._lost = Direction(model.slack), 0.0

    def __call__(self, angle: float, state: np.ndarray) -> float:
        _, _, lateral_speed, yaw_rate, servo, _ = state.tolist()
        force = self._stiffness * (angle - (lateral_speed + self._lf * yaw_rate) / self._speed)
        force = min(max(force, -self._largest), self._largest)
        model, friction = self.model, self.model.friction * self._direction.advance(servo)
        moment = self._trail * force + friction
        if abs(moment) > model.threshold:
            self._lost = -math.copysign(model.half_gap, moment) - moment * model.compliance - friction / model.stiffness
        return self._lost


def with_clearance_model(controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
    """Compensate a controller by the clearance model; for `Registration.adapt`."""
    gap, friction, compliance, stiffness = prior
    return Compensated(controller, ClearanceModel(gap, compliance, friction, stiffness=stiffness))
