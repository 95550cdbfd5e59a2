"""MPC with the clearance in its prediction: the contact's side over the horizon is a mode, and modes are enumerated.

The wheel follows the servo with a lost motion d, that of a quasi-static clearance between two periods,

    |T_a| ≤ T_f:         d moves as a play does, by -Δδ within ±h: friction holds the wheel,
    |T_a| > T_f + T_0:   d = -h sign(T_a): the aligning moment T_a presses it to a side,

and in between d is constant. A mode fixes the side for the whole horizon: left, right, or one of them first and the
other from a period j on. For each mode d is known, and MPC's quadratic program gives its best plan. Each plan is then
simulated with the side that follows from it, and the plan of least cost is taken, with its limits. Enumeration with one
crossing stands in for a mixed-integer program (Bemporad and Morari, Control of systems integrating logic, dynamics, and
constraints, Automatica 35, 1999): within 0.2 s there is hardly more than one.

A contact softer than the nominal vehicle's steering makes the front axle softer, as `Vehicle.with_steering` says.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import ManoeuvreError
from ...core.jit import jit
from ..nominal import Vehicle
from .base import Controller, Observation, Task
from .clearance_model import PRIOR, ClearanceModel
from .design import ModelRun
from .mpc import DASHED, ModelPredictive, PredictiveRun, Weights, augmented
from .registry import ClearancePrior, Registration, register

__all__ = ["Backlash", "BacklashPredictive", "modes", "plan_costs"]

SIDE_MOMENT = ClearanceModel.threshold  # T_0, N m, below which the side is unknown, as in the clearance model


class Backlash(NamedTuple):
    """The quasi-static clearance between two periods, and the aligning moment that it depends on."""

    half_gap: float  # h, rad
    friction: float  # T_f, N m
    moment: tuple[float, float, float]  # dT_a of the wheel angle, N m/rad, v_y, N s, and the yaw rate, N m s/rad

    @classmethod
    def of(cls, half_gap: float, friction: float, vehicle: Vehicle, speed: float) -> Backlash:
        """Return the clearance with the moment of a linear front axle at a speed, m/s."""
        stiffness = vehicle.trail * vehicle.cornering_front
        return cls(half_gap, friction, (stiffness, -stiffness / speed, -stiffness * vehicle.lf / speed))


@jit
def lost_motion(previous: float, turn: float, state: np.ndarray, p: Backlash) -> float:
    """Return d a period later, rad, the servo having turned by ``turn``, rad, into a state of the design model."""
    by_angle, by_speed, by_yaw = p.moment
    moment = by_angle * (state[4] + previous) + by_speed * state[2] + by_yaw * state[3]
    if abs(moment) <= p.friction:
        return min(max(previous - turn, -p.half_gap), p.half_gap)
    if abs(moment) > p.friction + SIDE_MOMENT:
        return -p.half_gap if moment > 0 else p.half_gap
    return previous


class BacklashPrediction(NamedTuple):
    """The model and the cost of `mpc` at one speed."""

    A: np.ndarray  # (7, 7)
    B: np.ndarray  # (7,) of the command's change
    E: np.ndarray  # (7,) of the curvature
    D: np.ndarray  # (7,) of the lost motion
    speed: float  # m/s
    weights: Weights
    terminal: np.ndarray  # V, (7, 7)
    turn: np.ndarray  # (7,) state of a steady turn over its curvature


@jit
def plan_costs(
    plans: np.ndarray, state: np.ndarray, lost: float, curvature: np.ndarray, p: BacklashPrediction, backlash: Backlash
) -> np.ndarray:
    """Return the cost of each plan, m² (n,), the lost motion following from it.

    Plans are changes of the command, rad (n, N); state (7,) with the command last and lost motion, rad, are those now,
    the curvature, 1/m (N + 1,), that ahead.
    """
    n, N = plans.shape
    costs = np.zeros(n)
    x, next_x = np.empty(7), np.empty(7)
    for i in range(n):
        x[:] = state
        d = lost
        for k in range(N):
            course = p.speed * x[1] + x[2]
            yaw = x[3] - p.speed * curvature[k]
            z = plans[i, k]
            costs[i] += x[0] ** 2 + p.weights.course * course**2 + p.weights.yaw * yaw**2 + p.weights.effort * z**2
            for a in range(7):
                value = p.B[a] * z + p.E[a] * curvature[k] + p.D[a] * d
                for b in range(7):
                    value += p.A[a, b] * x[b]
                next_x[a] = value
            d = lost_motion(d, next_x[4] - x[4], next_x, backlash)
            x[:] = next_x
        x -= p.turn * curvature[N]
        x[4] += d
        x[6] += d
        costs[i] += np.dot(x, p.terminal @ x)
    return costs


def modes(horizon: int) -> np.ndarray:
    """Return the contact's side σ in each period of each mode, (2 N - 2, N): a side, and the other from a period on."""
    left = np.where(np.arange(horizon) < np.arange(horizon, 1, -1)[:, None], 1.0, -1.0)
    return np.concatenate((left, -left))


@dataclass(frozen=True)
class BacklashPredictive(ModelPredictive):
    """MPC with the clearance as a mode; with h = 0 it is MPC."""

    half_gap: float = 0.0  # h, rad
    friction: float = 0.0  # T_f, N m
    compliance: float = 0.0  # rad/(N m), of the contact beyond that of the nominal vehicle's steering

    def __post_init__(self) -> None:
        if not 0 <= self.half_gap < np.inf or not 0 <= self.friction < np.inf:
            raise ManoeuvreError(
                "BacklashPredictive.half_gap (rad) and friction (N m) must be finite and >= 0, "
                f"got {self.half_gap!r} and {self.friction!r}"
            )

    def start(self, task: Task) -> ModelRun:
        """Begin a run, in the middle of the gap."""
        if self.compliance:
            task = dataclasses.replace(task, vehicle=task.vehicle.with_steering(1 / self.compliance))
        return _BacklashRun(task, self)


class _BacklashRun(PredictiveRun):
    def __init__(self, task: Task, settings: BacklashPredictive):
        self._settings, self._lost, self._servo = settings, 0.0, 0.0
        super().__init__(task, settings.weights, settings.horizon)
        self._sides = -settings.half_gap * modes(settings.horizon)

    def linearise(self, speed: float) -> None:
        """Make program and prediction for a speed, m/s."""
        super().linearise(speed)
        task, p = self.task, self._settings
        model = dataclasses.replace(self.model, speed=speed)
        self._backlash = Backlash.of(p.half_gap, p.friction, task.vehicle, speed)
        self._prediction = BacklashPrediction(
            *augmented(model), speed, self.weights, self.program.terminal, model.steady_turn
        )  # fmt: skip

    def changes(self, seen: Observation) -> np.ndarray:
        """Return the plan of the best mode, rad (N,)."""
        state, last, curvature = self.predictor.state(seen), self.predictor.last, self.curvature(seen)
        self._lost = lost_motion(self._lost, state[4] - self._servo, state, self._backlash)
        self._servo = state[4]
        self._sides[:, 0] = self._lost
        plans = self.free(seen, curvature) + self._sides @ self.program.lost.T
        state = np.append(state, last)
        costs = plan_costs(
            self.limited.clipped(plans, last), state, self._lost, curvature, self._prediction, self._backlash
        )
        return self.limited.best(plans[np.argmin(costs)], last)


def _with_backlash(controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
    clearance = {"half_gap": prior.half_gap, "friction": prior.friction, "compliance": prior.compliance}
    return dataclasses.replace(controller, **clearance)


_LOOK: dict[str, Any] = {"prior": PRIOR, "colour": "#661100", "line": DASHED}
register(
    Registration("mpc-backlash", "MPC, modes", BacklashPredictive, tuned_as="mpc-cm", adapt=_with_backlash, **_LOOK)
)
