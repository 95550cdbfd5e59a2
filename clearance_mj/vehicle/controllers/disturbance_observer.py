"""Disturbance observer: deviations of the yaw motion from the design model, as an angle of the road wheels.

The yaw equation of the design model with an unknown steering angle d added to the servo's,

    dr/dt = A_rv v_y + A_rr r + b (δ + d),    dd/dt = 0,

is observed from the yaw rate with both poles of the observer at -ω, its bandwidth: the transfer function from d to d̂
is ω²/(s + ω)², exact for constant d. d̂ is subtracted from a controller's command. It needs no model of the clearance
and does not distinguish lost motion, tyres and axle loads.

Chen, Yang, Guo and Li, Disturbance-observer-based control and related methods, IEEE Trans. Ind. Electron. 63, 2016;
the bandwidth as the only setting: Gao, Scaling and bandwidth-parameterization based controller tuning, ACC 2003.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from . import mpc, smc
from .base import ControllerRun, Observation, Task, limited
from .clearance_model import PRIOR as CLEARANCE_PRIOR
from .clearance_model import with_clearance_model
from .design import DesignModel, ServoModel
from .mpc import DASHED, ModelPredictive
from .registry import Registration, register
from .smc import SlidingMode

__all__ = ["PredictiveWithObserver", "SlidingWithObserver", "YawObserver"]


class YawObserver:
    """Disturbance observer on the yaw equation, from yaw rate, lateral speed and servo angle."""

    def __init__(self, model: DesignModel, bandwidth: float):
        A, _, _ = model.continuous
        decay, pole = math.exp(A[3, 3] * model.period), math.exp(-bandwidth * model.period)
        response = (decay - 1) / A[3, 3]  # yaw rate after a period over a constant acceleration
        self._decay, self._drift, self._gain = decay, response * A[3, 2], response * A[3, 4]
        # Gains that place both poles of the corrected estimate's error at exp(-ωT).
        self._angle_gain = (1 - pole) ** 2 / self._gain
        self._rate_gain = 1 - pole**2 / decay
        self._rate, self._disturbance = 0.0, 0.0

    def advance(self, yaw_rate: float, lateral_speed: float, angle: float) -> float:
        """Return d̂, rad, with a sample of the yaw rate, rad/s, and predict the next.

        Lateral speed (m/s) and servo angle (rad) are those of the coming period's start.
        """
        innovation = yaw_rate - self._rate
        self._disturbance += self._angle_gain * innovation
        rate = self._rate + self._rate_gain * innovation
        self._rate = self._decay * rate + self._drift * lateral_speed + self._gain * (angle + self._disturbance)
        return self._disturbance


class ObservedRun(ControllerRun):
    """A run in which the observed disturbance is subtracted from another controller's commands."""

    def __init__(self, task: Task, inner: ControllerRun, bandwidth: float):
        model = DesignModel(task.vehicle, task.servo, task.speed, task.period)
        self._task, self._inner, self._last = task, inner, 0.0
        self._servo, self._observer = ServoModel(model), YawObserver(model, bandwidth)

    def command(self, seen: Observation) -> float:
        """Return the other controller's command less d̂."""
        disturbance = self._observer.advance(seen.yaw_rate, seen.lateral_speed, self._servo.state[0])
        self._last = limited(self._inner.command(seen) - disturbance, self._last, self._task)
        self.excess, self.depth = self._inner.excess, self._inner.depth
        self._servo.follow(self._last - self.excess)
        return self._last


@dataclass(frozen=True)
class SlidingWithObserver(SlidingMode):
    """Sliding mode control less the observed disturbance."""

    bandwidth: float = 16.0  # ω, rad/s

    def start(self, task: Task) -> ControllerRun:  # type: ignore[override]
        """Begin a run."""
        return ObservedRun(task, super().start(task), self.bandwidth)


@dataclass(frozen=True)
class PredictiveWithObserver(ModelPredictive):
    """Model predictive control less the observed disturbance."""

    bandwidth: float = 16.0  # ω, rad/s

    def start(self, task: Task) -> ControllerRun:  # type: ignore[override]
        """Begin a run."""
        return ObservedRun(task, super().start(task), self.bandwidth)


BANDWIDTH = {"bandwidth": (1.0, 60.0)}
PRIOR = "nothing; estimates what turns the vehicle otherwise than expected"
_ALONE: dict[str, Any] = {"prior": PRIOR}
_WITH_CLEARANCE: dict[str, Any] = {"prior": CLEARANCE_PRIOR, "adapt": with_clearance_model}
for _name, _controller, _bounds, _look in (
    ("smc", SlidingWithObserver, smc.BOUNDS | BANDWIDTH, _ALONE | {"colour": "#332288"}),
    ("mpc", PredictiveWithObserver, mpc.BOUNDS | BANDWIDTH, _ALONE | {"colour": "#882255", "line": DASHED}),
    ("smc-cm", SlidingWithObserver, BANDWIDTH, _WITH_CLEARANCE | {"colour": "#aa4499"}),
    ("mpc-cm", PredictiveWithObserver, BANDWIDTH, _WITH_CLEARANCE | {"colour": "#ee3377", "line": DASHED}),
):
    register(Registration(f"{_name}-dob", f"{_name.upper()}-DOB", _controller, bounds=_bounds, tuned_as=_name, **_look))
