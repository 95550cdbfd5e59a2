"""What a steering controller is, what it is told, and the linear model that all of them are designed on.

Tracking errors are those of the centre of gravity from its foot point on the path. The design model is the linear
single-track model in path coordinates with the steering servo in it (Rajamani, Vehicle Dynamics and Control, 2012,
chapters 2 and 3), with lateral speed and yaw rate as states in place of the rates of the errors: the same space, but
no derivative of the curvature enters.
"""

from __future__ import annotations

import dataclasses
import functools
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import control
import numpy as np

if TYPE_CHECKING:
    from .path import Path
    from .plant import Vehicle

__all__ = ["Controller", "DesignModel", "ModelRun", "Observation", "Run", "Servo", "Task", "limited", "nominal_vehicle"]


class Observation(NamedTuple):
    """What a controller sees at a sample."""

    s: float
    """m, foot point's arc length"""
    e_y: float
    """m, lateral position error, left positive"""
    e_psi: float
    """rad, heading error"""
    lateral_speed: float
    """m/s, at the centre of gravity"""
    yaw_rate: float
    """rad/s"""
    speed: float
    """m/s, longitudinal"""


@dataclass(frozen=True)
class Servo:
    """The steering servo as controllers know it: second order, road-wheel angle over its command."""

    frequency: float = 6.0
    """Hz, natural"""
    damping: float = 0.7
    """of critical"""

    @property
    def lag(self) -> float:
        """Delay of a slow command, 2ζ/ω, s."""
        return self.damping / (np.pi * self.frequency)


def nominal_vehicle(vehicle: Vehicle, stiffness: float) -> Vehicle:
    """Return a vehicle whose front axle holds the steering's compliance, C_f / (1 + C_f t/k).

    The aligning moment turns the wheels back in proportion to the axle's force, which has the effect of a softer axle
    (Pacejka, Tire and Vehicle Dynamics, 2012, section 1.3.4).

    Parameters
    ----------
    vehicle : Vehicle
        With a stiff steering.
    stiffness : float
        k of the steering between servo and road wheel, N m/rad.
    """
    stiff = vehicle.cornering_front
    return dataclasses.replace(vehicle, cornering_front=stiff / (1 + stiff * vehicle.trail / stiffness))


@dataclass(frozen=True)
class Task:
    """Everything that a controller is told before a drive; never the plant's own parameters."""

    vehicle: Vehicle
    """nominal"""
    path: Path
    """to follow"""
    speed: float
    """m/s"""
    servo: Servo = Servo()
    """of the steering"""
    period: float = 0.01
    """s, between commands"""
    preview: float = 0.2
    """s of driving over which the road ahead is known, the same for every controller"""
    largest_angle: float = 0.5
    """rad, of the road wheel"""
    largest_rate: float = 0.4
    """rad/s, of the road wheel"""

    @property
    def lead(self) -> int:
        """Periods from a command to the wheel's answer: servo lag and half a period of holding, rounded."""
        return round(self.servo.lag / self.period + 0.5)

    def curvature(self, seen: Observation, times: np.ndarray) -> np.ndarray:
        """Curvature where the vehicle will be, 1/m; what lies beyond the preview is taken to stay as it is.

        Parameters
        ----------
        seen : Observation
            The sample.
        times : ndarray, shape (n,)
            From the sample, s.
        """
        return self.path.curvature(seen.s + seen.speed * np.minimum(times, self.preview))


@dataclass(frozen=True)
class DesignModel:
    """Linear single track with servo: x = [e_y, e_ψ, v_y, r, δ, dδ/dt], input the command, disturbance the curvature.

    Parameters
    ----------
    vehicle : Vehicle
        Nominal.
    servo : Servo
        Nominal.
    speed : float
        m/s, constant.
    period : float
        s; command and curvature are held over it.
    """

    vehicle: Vehicle
    servo: Servo
    speed: float
    period: float

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

    def prediction(self, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """P (6, 6), Q (6,), R (6, steps) of x after ``steps`` periods: P x + Q u + R κ, the command held.

        Parameters
        ----------
        steps : int
            Periods.
        """
        A, B, E = self.discrete
        powers = [np.linalg.matrix_power(A, i) for i in range(steps + 1)]
        Q = sum((power @ B for power in powers[:-1]), np.zeros(6))
        R = np.column_stack([power @ E for power in powers[-2::-1]]) if steps else np.zeros((6, 0))
        return powers[-1], Q, R


def limited(angle: float, last: float, task: Task) -> float:
    """Return ``angle`` within the limits of angle and of rate from the last command, rad.

    Parameters
    ----------
    angle, last : float
        rad.
    task : Task
        Limits and period.
    """
    step = task.largest_rate * task.period
    angle = min(max(angle, last - step), last + step)
    return min(max(angle, -task.largest_angle), task.largest_angle)


class Run(ABC):
    """One drive of a controller."""

    @abstractmethod
    def command(self, seen: Observation) -> float:
        """Return the command for the next period, within the limits of angle and rate, rad.

        Parameters
        ----------
        seen : Observation
            The sample.
        """


class ModelRun(Run):
    """A drive of a controller that is designed on the linear model; its commands drive its own model of the servo.

    Parameters
    ----------
    task : Task
        What it is told.
    """

    def __init__(self, task: Task):
        self.task = task
        self.model = DesignModel(task.vehicle, task.servo, task.speed, task.period)
        A, B, _ = self.model.discrete
        self._servo, self._servo_A, self._servo_B = np.zeros(2), A[4:, 4:].copy(), B[4:].copy()
        self._P, self._Q, self._R = self.model.prediction(task.lead)
        self._times = (np.arange(task.lead) + 0.5) * task.period
        self._last = 0.0

    @abstractmethod
    def wheel_angle(self, state: np.ndarray, seen: Observation) -> float:
        """The road-wheel angle that the control law asks for, rad.

        Parameters
        ----------
        state : ndarray, shape (6,)
            State of the design model.
        seen : Observation
            The sample.
        """

    def command(self, seen):
        """Ask the control law, limit its answer and let the model of the servo follow it."""
        self._last = limited(self.wheel_angle(self.state(seen), seen), self._last, self.task)
        self._servo = self._servo_A @ self._servo + self._servo_B * self._last
        return self._last

    def state(self, seen: Observation) -> np.ndarray:
        """State of the design model at a sample, (6,): errors and motion as measured, servo as modelled.

        Parameters
        ----------
        seen : Observation
            The sample.
        """
        return np.array((seen.e_y, seen.e_psi, seen.lateral_speed, seen.yaw_rate, *self._servo))

    def predicted(self, state: np.ndarray, seen: Observation) -> np.ndarray:
        """State when the wheel will have answered the next command, (6,).

        Parameters
        ----------
        state : ndarray, shape (6,)
            State now.
        seen : Observation
            The sample.
        """
        curvature = self.task.curvature(seen, self._times)
        return self._P @ state + self._Q * self._last + self._R @ curvature


@dataclass(frozen=True)
class Controller(ABC):
    """A control law with its settings; subclasses are frozen dataclasses whose fields are what is tuned."""

    @abstractmethod
    def start(self, task: Task) -> Run:
        """Begin a drive, wheels straight ahead.

        Parameters
        ----------
        task : Task
            What the controller is told.
        """
