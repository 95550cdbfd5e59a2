"""The clearance model with estimates of the steering's twin instead of prior information.

Half-gap, contact stiffness and friction of the compensation follow the twin's estimates (`vehicle.twin`), updated
after each window; it starts from the prior information. All else is as in `clearance_model`.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from ...core.errors import ManoeuvreError
from ..steering import Steering
from ..twin import SteeringTwin, twin_of
from .base import Controller, ControllerRun, Observation, Task
from .clearance_model import ClearanceEstimate, ClearanceModel, with_clearance_model
from .compensation import Compensated, CompensatedRun
from .disturbance_observer import PredictiveWithObserver, SlidingWithObserver
from .mpc import ModelPredictive
from .registry import ClearancePrior, Registration, register
from .smc import SlidingMode

__all__ = ["CompensatedWithTwin", "with_twin"]

SMALLEST_HALF_GAP = math.radians(0.02)  # rad, initial half-gap of the twin where the prior information is smaller


@dataclass(frozen=True)
class CompensatedWithTwin(Controller):
    """A controller compensated by the clearance model, which a twin updates."""

    compensated: Compensated  # with a `ClearanceModel`
    twin: SteeringTwin  # starts from the same

    def start(self, task: Task) -> ControllerRun:
        """Begin a run."""
        return TwinRun(task, self)


class TwinRun(CompensatedRun):
    """A run whose ``twin`` estimates the clearance."""

    def __init__(self, task: Task, settings: CompensatedWithTwin):
        super().__init__(task, settings.compensated)
        model = settings.compensated.lost_motion
        if not isinstance(model, ClearanceModel):
            raise ManoeuvreError(f"the twin keeps a ClearanceModel up to date, not a {type(model).__name__}")
        self.twin = settings.twin.start()
        self._clearance = self._estimate = ClearanceEstimate(model, task)
        self._other_compliance = model.compliance - 1 / settings.twin.lost_motion.stiffness

    def command(self, seen: Observation) -> float:
        """Return the other controller's command, less the lost motion that the twin expects."""
        if seen.signals is None:
            raise ManoeuvreError("a controller with a twin needs the car's signals: Observation.signals is None")
        if self.twin.advance(seen.signals):
            estimate = self.twin.lost_motion
            updates = {name: getattr(estimate, name) for name in ("half_gap", "friction", "stiffness")}
            compliance = self._other_compliance + 1 / estimate.stiffness
            self._clearance.model = dataclasses.replace(self._clearance.model, compliance=compliance, **updates)
        return super().command(seen)


def with_twin(controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
    """Compensate a controller by the clearance model with a twin; for `Registration.adapt`."""
    compensated = with_clearance_model(controller, task, prior)
    assert isinstance(compensated, Compensated)
    nominal = Steering().lost_motion
    gap, stiffness = max(prior.half_gap, SMALLEST_HALF_GAP), 1 / (1 / nominal.stiffness + prior.compliance)
    initial = nominal._replace(half_gap=gap, stiffness=stiffness, friction=prior.friction)
    total_stiffness = nominal.stiffness + nominal.shaft_stiffness
    return CompensatedWithTwin(compensated, twin_of(task.vehicle, initial, total_stiffness, task.period))


PRIOR = "half-gap, stiffness and friction, to begin with; then estimates them from the car's signals"
for _name, _label, _controller, _tuned_as, _colour in (
    ("smc-twin", "SMC-CM, twin", SlidingMode, "smc-cm", "#44aadd"),
    ("mpc-twin", "MPC-CM, twin", ModelPredictive, "mpc-cm", "#117733"),
    ("smc-twin-dob", "SMC-CM-DOB, twin", SlidingWithObserver, "smc-cm-dob", "#7755cc"),
    ("mpc-twin-dob", "MPC-CM-DOB, twin", PredictiveWithObserver, "mpc-cm-dob", "#dd77aa"),
):
    _look: dict[str, Any] = {"prior": PRIOR, "colour": _colour, "line": (0, (5, 1))}
    register(Registration(_name, _label, _controller, tuned_as=_tuned_as, adapt=with_twin, **_look))
