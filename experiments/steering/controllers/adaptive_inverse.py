"""The inverse of plain play with a half-gap that is estimated on the way, by gradient descent.

The wheel's lost motion behind a servo that crosses a play is d = h φ, with φ between -1 and 1 from the servo's motion:
φ = clip(φ - Δδ/ĥ, -1, 1). The disturbance observer sees it as d̂ = Q d, Q its two poles, so that

    dĥ/dt = γ φ_f (d̂ - ĥ φ_f),    φ_f = Q φ,    0 ≤ ĥ ≤ 1°.

The command leads by ĥ in the direction of motion, as `backlash_inverse` does. That friction decides on the side is
taken for granted; where the moment decides, φ has little to do with d and ĥ remains small.

Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996, chapter 4: gradient law
with projection on the filtered error of a parametrised inverse.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from clearance_mj.vehicle.controllers import smc
from clearance_mj.vehicle.controllers.base import ControllerRun, Observation, Task, limited
from clearance_mj.vehicle.controllers.compensation import Direction
from clearance_mj.vehicle.controllers.design import DesignModel, ModelRun, ServoModel
from clearance_mj.vehicle.controllers.disturbance_observer import BANDWIDTH, YawObserver
from clearance_mj.vehicle.controllers.registry import Registration, register
from clearance_mj.vehicle.controllers.smc import SlidingMode

LARGEST_HALF_GAP = math.radians(1.0)  # rad, upper bound of the estimate
SMALLEST_HALF_GAP = math.radians(0.01)  # rad, half-gap below which φ is computed for this one
SLACK = math.radians(0.1)  # rad that the wanted angle turns back before its direction has changed, as `BacklashInverse`


@dataclass(frozen=True)
class SlidingWithAdaptiveInverse(SlidingMode):
    """Sliding mode control with an adaptive backlash inverse."""

    adaptation: float = 1.0  # γ, 1/s
    bandwidth: float = 16.0  # rad/s, of the disturbance observer

    def start(self, task: Task) -> ControllerRun:  # type: ignore[override]
        """Begin a run."""
        return _AdaptiveRun(task, super().start(task), self.adaptation, self.bandwidth)


class _AdaptiveRun(ControllerRun):
    def __init__(self, task: Task, inner: ModelRun, adaptation: float, bandwidth: float):
        model = DesignModel(task.vehicle, task.servo, task.speed, task.period)
        self._task, self._inner, self._last, self._direction = task, inner, 0.0, Direction(SLACK)
        self._servo, self._observer = ServoModel(model), YawObserver(model, bandwidth)
        self._step, self._pole = adaptation * task.period, math.exp(-bandwidth * task.period)
        self._before, self._play, self._once, self._twice = 0.0, 0.0, 0.0, 0.0
        self.half_gap = 0.0
        """ĥ, rad"""

    def command(self, seen: Observation) -> float:
        """Return the other controller's command, ahead by ĥ."""
        self._adapt(seen)
        ahead = self.half_gap * self._direction.advance(float(self._inner.predictor.predicted(seen)[4]))
        self._last = limited(self._inner.command(seen) + ahead, self._last, self._task)
        self.excess, self.depth = self._inner.excess, self._inner.depth
        self._servo.follow(self._last - self.excess)
        return self._last

    def _adapt(self, seen: Observation) -> None:
        servo = self._servo.state[0]
        lost = self._observer.advance(seen.yaw_rate, seen.lateral_speed, servo)
        # Q of the play a period ago: an angle shows in the yaw rate after one.
        self._once += (1 - self._pole) * (self._play - self._once)
        self._twice += (1 - self._pole) * (self._once - self._twice)
        change = self._step * self._twice * (lost - self.half_gap * self._twice)
        self.half_gap = min(max(self.half_gap + change, 0.0), LARGEST_HALF_GAP)
        play = self._play - (servo - self._before) / max(self.half_gap, SMALLEST_HALF_GAP)
        self._play, self._before = min(max(play, -1.0), 1.0), servo


BOUNDS = smc.BOUNDS | BANDWIDTH | {"adaptation": (0.05, 10.0)}
register(
    Registration(
        "smc-adaptive-inverse", "SMC, adaptive inverse", SlidingWithAdaptiveInverse, bounds=BOUNDS, tuned_as="smc",
        prior="nothing; estimates the half-gap as if friction decided on the side", colour="#aa4499",
        line=(0, (1, 1.2)), settings_file=Path(__file__).with_name("tuned.toml"),
    )
)  # fmt: skip
