"""Sliding mode control of the lateral error at a point ahead of the vehicle, and its super-twisting variant.

e = e_y + L_s (e_ψ + β_ss), β_ss the sideslip of a steady turn; s = de/dt + λ e. With the design model
d²e/dt² = f + b δ, b = C_f/m + L_s C_f l_f/I_z, the boundary-layer law is

    δ = (-f - λ de/dt - k₁ s - k₂ sat(s/Φ)) / b.

(Slotine and Li, Applied Nonlinear Control, 1991, chapter 7.) e at the centre of gravity (L_s = 0) has poorly damped
zeros; a point a few metres ahead has not. Everything is evaluated for the moment when the wheel will have answered
the command, so that the servo is in the design.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .controller import Controller, ModelRun, Task

__all__ = ["SlidingMode", "SuperTwisting", "Surface"]


class Surface(NamedTuple):
    """Where the motion is in relation to the sliding surface."""

    value: float
    """s, m/s"""
    drift: float
    """ds/dt without steering, f + λ de/dt, m/s²"""
    gain: float
    """d²e/dt² over the wheel angle, b, m/s²"""


class _SlidingRun(ModelRun):
    """What both laws share: the surface."""

    def __init__(self, task: Task, look_ahead: float, convergence: float):
        super().__init__(task)
        A, _, _ = self.model.continuous
        self._lateral, self._yaw = A[2, 2:5].tolist(), A[3, 2:5].tolist()
        self._look_ahead, self._convergence = look_ahead, convergence
        self.gain = self._lateral[2] + look_ahead * self._yaw[2]
        """b, m/s²"""
        centre = min(task.lead, task.preview / task.period - 1)  # the differences need one period more
        self._around = (centre + np.array([-1.0, 0.0, 1.0])) * task.period

    def surface(self, state, seen) -> Surface:
        """Surface at the moment when the wheel will have answered."""
        e_y, e_psi, lateral_speed, yaw_rate, _, _ = self.predicted(state, seen).tolist()
        speed, look_ahead, sideslip = seen.speed, self._look_ahead, self.model.steady_sideslip
        before, curvature, after = self.task.curvature(seen, self._around).tolist()
        turning = (after - before) / (2 * self.task.period)  # dκ/dt
        bending = (after - 2 * curvature + before) / self.task.period**2
        error = e_y + look_ahead * (e_psi + sideslip * curvature)
        rate = lateral_speed + speed * e_psi + look_ahead * (yaw_rate - speed * curvature + sideslip * turning)
        lateral = self._lateral[0] * lateral_speed + self._lateral[1] * yaw_rate
        yaw = self._yaw[0] * lateral_speed + self._yaw[1] * yaw_rate
        drift = lateral + speed * (yaw_rate - speed * curvature)
        drift += look_ahead * (yaw - speed * turning + sideslip * bending)
        return Surface(rate + self._convergence * error, drift + self._convergence * rate, self.gain)

    def wheel_angle(self, state, seen):
        surface = self.surface(state, seen)
        self.sliding = surface.value
        """s at the last sample, m/s"""
        return (-surface.drift - self.reaching(surface.value)) / surface.gain

    @abstractmethod
    def reaching(self, value: float) -> float:
        """What drives s to zero, m/s²."""


@dataclass(frozen=True)
class SlidingMode(Controller):
    """Sliding mode control with a boundary layer."""

    look_ahead: float = 3.0
    """L_s, m"""
    convergence: float = 4.0
    """λ, 1/s"""
    reaching: float = 4.0
    """k₁, 1/s"""
    switching: float = 1.0
    """k₂, m/s²"""
    layer: float = 0.3
    """Φ, half the boundary layer, m/s"""

    def start(self, task):
        """Begin a drive."""
        return _BoundaryLayer(task, self)


class _BoundaryLayer(_SlidingRun):
    def __init__(self, task, law):
        super().__init__(task, law.look_ahead, law.convergence)
        self._law = law

    def reaching(self, value):
        law = self._law
        return law.reaching * value + law.switching * min(max(value / law.layer, -1.0), 1.0)


@dataclass(frozen=True)
class SuperTwisting(Controller):
    """Super-twisting: k₁ √|s| sign(s) + w, dw/dt = k₂ sign(s), with the sign smoothed in a boundary layer.

    Levant, Sliding order and sliding accuracy in sliding mode control, International Journal of Control 58, 1993.
    """

    look_ahead: float = 3.0
    """L_s, m"""
    convergence: float = 4.0
    """λ, 1/s"""
    root: float = 2.0
    """k₁, √m/s^1.5"""
    integral: float = 2.0
    """k₂, m/s³"""
    layer: float = 0.1
    """Φ, m/s"""

    def start(self, task):
        """Begin a drive."""
        return _Twisting(task, self)


class _Twisting(_SlidingRun):
    def __init__(self, task, law):
        super().__init__(task, law.look_ahead, law.convergence)
        self._law, self._integral = law, 0.0

    def reaching(self, value):
        law = self._law
        sign = min(max(value / law.layer, -1.0), 1.0)
        self._integral += law.integral * sign * self.task.period
        return law.root * value / math.sqrt(max(abs(value), law.layer)) + self._integral
