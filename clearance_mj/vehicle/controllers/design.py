"""The linear model that controllers are designed on, and what it predicts.

It is the linear single-track model in path coordinates with the steering servo in it (Rajamani, Vehicle Dynamics and
Control, 2012, chapters 2 and 3), with lateral speed and yaw rate as states in place of the rates of the errors: the
same space, but no derivative of the curvature enters.

The front axle's tyres are not linear: with the slip angle α of the wheels, the force F(α) is less than C_f α. A
controller that is designed on the linear model asks for an angle δ', and with it for the force C_f (δ' - α_k), α_k the
direction in which the axle moves. The command is the angle that has this force (input linearisation),

    δ = δ' + F⁻¹(C_f (δ' - α_k)) - (δ' - α_k),

and the linear model goes on under δ'. Doing the same for the rear axle, as a force of known size, gained nothing.
"""

from __future__ import annotations

import functools
from abc import abstractmethod
from dataclasses import dataclass

import control
import numba
import numpy as np

from ..nominal import Servo, Vehicle
from .base import ControllerRun, Observation, Task, limited

__all__ = ["DesignModel", "ModelRun", "Predictor"]


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

    @functools.cached_property
    def discrete(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A (6, 6), B (6,), E (6,) of x⁺ = A x + B u + E κ, command and curvature held."""
        A, B, E = self.continuous
        sampled = control.c2d(control.ss(A, np.column_stack((B, E)), np.eye(6), 0), self.period)
        return np.array(sampled.A), np.array(sampled.B[:, 0]), np.array(sampled.B[:, 1])

    @functools.cached_property
    def steady_sideslip(self) -> float:
        """Sideslip over curvature in a steady turn, β_ss/κ = lr - m lf v²/(L C_r), m."""
        p = self.vehicle
        return p.lr - p.mass * p.lf * self.speed**2 / ((p.lf + p.lr) * p.cornering_rear)

    @functools.cached_property
    def steady_turn(self) -> np.ndarray:
        """State of a steady turn on the path, over its curvature, (6,)."""
        A, B, E = self.continuous
        found = np.linalg.solve(np.column_stack((A[:, 1:], B)), -E)  # with e_y = 0, and the command beside the state
        return np.concatenate(([0.0], found[:5]))

    @property
    def steady_angle(self) -> float:
        """Steering angle over curvature in a steady turn, m."""
        return float(self.steady_turn[4])

    def prediction(self, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """P (6, 6), Q (6,), R (6, steps) of x after ``steps`` periods: P x + Q u + R κ, the command held."""
        A, B, E = self.discrete
        powers = [np.linalg.matrix_power(A, i) for i in range(steps + 1)]
        Q = sum((power @ B for power in powers[:-1]), np.zeros(6))
        R = np.column_stack([power @ E for power in powers[-2::-1]]) if steps else np.zeros((6, 0))
        return powers[-1], Q, R


class Predictor:
    """State of the design model during a run: errors and motion as measured, the servo as modelled."""

    def __init__(self, task: Task):
        self.task = task
        self.model = DesignModel(task.vehicle, task.servo, task.speed, task.period)
        self.last = 0.0
        """last command, rad, as the linear model takes it"""
        A, B, _ = self.model.discrete
        self._servo, self._servo_A, self._servo_B = np.zeros(2), A[4:, 4:].copy(), B[4:].copy()
        self._seen: Observation | None = None
        self._predicted = np.zeros(6)
        self._P, self._Q, self._R = self.model.prediction(task.lead)
        self._times = (np.arange(task.lead) + 0.5) * task.period

    def state(self, seen: Observation) -> np.ndarray:
        """State at a sample, (6,)."""
        return np.array((seen.e_y, seen.e_psi, seen.lateral_speed, seen.yaw_rate, *self._servo))

    def predicted(self, seen: Observation) -> np.ndarray:
        """State when the wheel will have answered the next command, (6,)."""
        if seen is not self._seen:
            curvature = self.task.curvature(seen, self._times)
            self._predicted = _after(self._P, self.state(seen), self._Q, self.last, self._R, curvature)
            self._seen = seen
        return self._predicted

    def excess(self, angle: float, seen: Observation) -> float:
        """Return what the front tyres need beyond an angle for the force that the linear model has with it, rad."""
        p, (_, _, lateral_speed, yaw_rate, _, _) = self.task.vehicle, self.predicted(seen).tolist()
        slip = angle - (lateral_speed + p.lf * yaw_rate) / seen.speed
        return p.tyre.excess(p.cornering_front * slip / p.front_load)

    def follow(self, command: float) -> None:
        """Let the model of the servo follow the next command, rad, as the linear model takes it."""
        self.last, self._seen = command, None
        self._servo = self._servo_A @ self._servo + self._servo_B * command


@numba.njit(cache=True, nogil=True)
def _after(
    P: np.ndarray, state: np.ndarray, Q: np.ndarray, command: float, R: np.ndarray, curvature: np.ndarray
) -> np.ndarray:
    return P @ state + Q * command + R @ curvature


class ModelRun(ControllerRun):
    """A run of a controller that is designed on the linear model."""

    def __init__(self, task: Task):
        self.task, self.predictor = task, Predictor(task)
        self.model, self._last = self.predictor.model, 0.0

    @abstractmethod
    def wheel_angle(self, seen: Observation) -> float:
        """Return the road-wheel angle that is wanted of the linear model, before limits, rad."""

    def command(self, seen: Observation) -> float:
        """Limit the angle that is wanted, with what the tyres need beyond it."""
        angle = self.wheel_angle(seen)
        self.excess = self.predictor.excess(angle, seen)
        self._last = limited(angle + self.excess, self._last, self.task)
        self.predictor.follow(self._last - self.excess)
        return self._last
