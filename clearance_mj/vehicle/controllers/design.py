"""The linear design model of controllers, and its predictions.

It is the linear single-track model in path coordinates with the steering servo in it (Rajamani, Vehicle Dynamics and
Control, 2012, chapters 2 and 3), with lateral speed and yaw rate as states in place of the rates of the errors: the
same space, but no derivative of the curvature enters.

The front axle's tyres are not linear: with the slip angle α of the wheels, the force F(α) is less than C_f α. A
controller designed on the linear model requests an angle δ', that is a force C_f (δ' - α_k), α_k the direction in which
the axle moves. The command is the angle that has this force (input linearisation),

    δ = δ' + F⁻¹(C_f (δ' - α_k)) - (δ' - α_k),

and the linear model continues with δ'. The same for the rear axle, as a known force, brought no improvement.
"""

from __future__ import annotations

import functools
from abc import abstractmethod
from dataclasses import dataclass

import control
import numpy as np

from ...core.jit import jit
from ..nominal import Servo, Vehicle
from ..path import Table, curvature_ahead
from .base import ControllerRun, Observation, Task, limited

__all__ = ["DesignModel", "ModelRun", "Predictor", "ServoModel"]


@dataclass(frozen=True)
class DesignModel:
    """Linear single track with servo: state [e_y, e_ψ, v_y, r, δ, dδ/dt], input command, disturbance curvature."""

    vehicle: Vehicle  # nominal
    servo: Servo  # nominal
    speed: float  # m/s, constant
    period: float  # s; command and curvature are held over it

    @functools.cached_property
    def continuous(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A (6, 6), B (6,), E (6,) of dx/dt = A x + B u + E κ."""
        p, v = self.vehicle, self.speed
        front, rear = p.cornering_front, p.cornering_rear
        moment = rear * p.lr - front * p.lf
        natural = 2 * np.pi * self.servo.frequency
        A, B, E = np.zeros((6, 6)), np.zeros(6), np.zeros(6)
        A[0, 1:3] = v, 1.0
        A[1, 3], E[1] = 1.0, -v
        A[2, 2:5] = -(front + rear) / (p.mass * v), moment / (p.mass * v) - v, front / p.mass
        yaw_damping = front * p.lf**2 + rear * p.lr**2
        A[3, 2:5] = np.array([moment / v, -yaw_damping / v, front * p.lf]) / p.yaw_inertia
        A[4, 5] = 1.0
        A[5, 4:], B[5] = (-(natural**2), -2 * self.servo.damping * natural), natural**2
        return A, B, E

    @property
    def discrete(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A (6, 6), B (6,), E (6,) of x⁺ = A x + B u + E κ, command and curvature held."""
        return _discrete(self)

    @functools.cached_property
    def steady_sideslip(self) -> float:
        """Sideslip over curvature in a steady turn, β_ss/κ = lr - m lf v²/(L C_r), m."""
        p = self.vehicle
        return p.lr - p.mass * p.lf * self.speed**2 / ((p.lf + p.lr) * p.cornering_rear)

    @functools.cached_property
    def steady_turn(self) -> np.ndarray:
        """State and command of a steady turn on the path, over its curvature, (7,)."""
        A, B, E = self.continuous
        return np.concatenate(([0.0], np.linalg.solve(np.column_stack((A[:, 1:], B)), -E)))  # with e_y = 0

    def prediction(self, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return P (6, 6), Q (6,), R (6, steps) of x after ``steps`` periods: P x + Q u + R κ, the command held."""
        A, B, E = self.discrete
        powers = [np.linalg.matrix_power(A, i) for i in range(steps + 1)]
        Q = sum((power @ B for power in powers[:-1]), np.zeros(6))
        R = np.column_stack([power @ E for power in powers[-2::-1]]) if steps else np.zeros((6, 0))
        return powers[-1], Q, R


@functools.lru_cache(maxsize=64)
def _discrete(model: DesignModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    A, B, E = model.continuous
    sampled = control.c2d(control.ss(A, np.column_stack((B, E)), np.eye(6), 0), model.period)
    return np.array(sampled.A), np.array(sampled.B[:, 0]), np.array(sampled.B[:, 1])


class ServoModel:
    """The modelled servo during a run."""

    def __init__(self, model: DesignModel):
        A, B, _ = model.discrete
        self._A, self._B = A[4:, 4:].tolist(), B[4:].tolist()
        self.state = (0.0, 0.0)
        """angle, rad at the road wheel, and its rate, rad/s"""

    def follow(self, command: float) -> None:
        """Advance by one period with a command, rad."""
        angle, rate = self.state
        (a, b), (c, d) = self._A
        by_angle, by_rate = self._B
        self.state = a * angle + b * rate + by_angle * command, c * angle + d * rate + by_rate * command


class Predictor:
    """State of the design model during a run: errors and motion as measured, the servo as modelled."""

    def __init__(self, task: Task):
        self.task = task
        self.model = DesignModel(task.vehicle, task.servo, task.speed, task.period)
        self.last = 0.0
        """last command, rad, of the linear model"""
        self._servo = ServoModel(self.model)
        self._seen: Observation | None = None
        self._predicted = np.zeros(6)
        self._model_ahead = self.model.prediction(task.lead)
        self._times = (np.arange(task.lead) + 0.5) * task.period

    def state(self, seen: Observation) -> np.ndarray:
        """Return the state at a sample, (6,)."""
        return np.array((seen.e_y, seen.e_psi, seen.lateral_speed, seen.yaw_rate, *self._servo.state))

    def predicted(self, seen: Observation) -> np.ndarray:
        """Return the state when the wheel has responded to the next command, (6,)."""
        if seen is not self._seen:
            task, state = self.task, self.state(seen)
            self._predicted = _predict(
                state, self.last, task.path.table, seen.s, seen.speed, self._times, task.preview, *self._model_ahead
            )
            self._seen = seen
        return self._predicted

    def excess(self, angle: float, seen: Observation) -> float:
        """Return the additional angle, rad, at which the front tyres have the force of the linear model."""
        p, (_, _, lateral_speed, yaw_rate, _, _) = self.task.vehicle, self.predicted(seen).tolist()
        slip = angle - (lateral_speed + p.lf * yaw_rate) / seen.speed
        return p.tyre.excess(p.cornering_front * slip / p.front_load)

    def follow(self, command: float) -> None:
        """Advance the servo model by the next command, rad, of the linear model."""
        self.last, self._seen = command, None
        self._servo.follow(command)


@jit
def _predict(
    state: np.ndarray, command: float, table: Table, s: float, speed: float, times: np.ndarray, preview: float,
    P: np.ndarray, Q: np.ndarray, R: np.ndarray,
) -> np.ndarray:  # fmt: skip
    return P @ state + Q * command + R @ curvature_ahead(table, s, speed, times, preview)


class ModelRun(ControllerRun):
    """A run of a controller designed on the linear model."""

    def __init__(self, task: Task):
        self.task, self.predictor = task, Predictor(task)
        self.model, self._last = self.predictor.model, 0.0

    @abstractmethod
    def wheel_angle(self, seen: Observation) -> float:
        """Return the road-wheel angle of the linear model, before limits, rad."""

    def command(self, seen: Observation) -> float:
        """Return the limited angle, including the additional angle of the tyres."""
        angle = self.wheel_angle(seen)
        self.excess = self.predictor.excess(angle, seen)
        self._last = limited(angle + self.excess, self._last, self.task)
        self.predictor.follow(self._last - self.excess)
        return self._last
