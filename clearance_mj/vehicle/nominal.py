"""The nominal vehicle that controllers know: single track, tyre and steering servo.

The lateral force of an axle over its slip angle is F/F_z = μ sin(C atan(B α)) with B = c/(C μ), c the slope at α = 0:
the Magic Formula without its curvature factor, which is -0.007 for the nominal vehicle's tyres (Pacejka, Tire and
Vehicle Dynamics, 2012, section 4.3).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .commonroad import GRAVITY, parameters

__all__ = ["Servo", "Tyre", "Vehicle"]


@dataclass(frozen=True)
class Vehicle:
    """Parameters of the single-track model; the axles' stiffness is that of the linear one."""

    mass: float  # kg
    yaw_inertia: float  # kg m²
    lf: float  # m, from the centre of gravity to the front axle
    lr: float  # m, to the rear axle
    cornering_front: float  # N/rad, of the axle
    cornering_rear: float  # N/rad, of the axle
    tyre: Tyre  # of both axles
    trail: float = 0.045  # m, of the aligning moment

    @property
    def wheelbase(self) -> float:
        """Distance of the axles, m."""
        return self.lf + self.lr

    @property
    def front_load(self) -> float:
        """Vertical load of the front axle at rest, N."""
        return self.mass * GRAVITY * self.lr / self.wheelbase

    @classmethod
    def bmw320i(cls, trail: float = 0.045) -> Vehicle:
        """Vehicle 2 of commonroad-vehicle-models; stiffness per axle is the tyre's per load times the static load."""
        p = parameters()
        load = p.m * GRAVITY / (p.a + p.b)
        stiffness = -p.tire.p_ky1 * load * p.b, -p.tire.p_ky1 * load * p.a
        return cls(p.m, p.I_z, p.a, p.b, *stiffness, Tyre(-p.tire.p_ky1, p.tire.p_dy1, p.tire.p_cy1), trail=trail)

    def with_steering(self, stiffness: float) -> Vehicle:
        """Return the vehicle with a steering's compliance in its front axle, C_f / (1 + C_f t/k), k in N m/rad.

        The aligning moment turns the wheels back in proportion to the axle's force, which has the effect of a softer
        axle (Pacejka, Tire and Vehicle Dynamics, 2012, section 1.3.4).
        """
        rigid = self.cornering_front
        return dataclasses.replace(self, cornering_front=rigid / (1 + rigid * self.trail / stiffness))


@dataclass(frozen=True)
class Servo:
    """The steering servo as controllers know it: second order, road-wheel angle over its command."""

    frequency: float = 6.0  # Hz, natural
    damping: float = 0.7  # of critical

    @property
    def lag(self) -> float:
        """Delay of a slow command, 2ζ/ω, s."""
        return self.damping / (np.pi * self.frequency)


LARGEST_SHARE = 0.95
"""Fraction of the largest force up to which a slip angle is given: beyond, steering gains next to nothing."""


class Tyre(NamedTuple):
    """Lateral force over vertical load of a tyre, and of an axle."""

    stiffness: float  # c, 1/rad, slope at no slip
    friction: float  # μ, largest lateral force over load
    shape: float  # C

    def force(self, slip: float) -> float:
        """Return the lateral force over the load at a slip angle, rad."""
        return self.friction * math.sin(self.shape * math.atan(self.stiffness / (self.shape * self.friction) * slip))

    def slip(self, force: float) -> float:
        """Return the slip angle, rad, of a lateral force over the load, taken as at most 95 % of the largest."""
        ratio = min(max(force / self.friction, -LARGEST_SHARE), LARGEST_SHARE)
        return math.tan(math.asin(ratio) / self.shape) * self.shape * self.friction / self.stiffness

    def excess(self, force: float) -> float:
        """Return the slip angle, rad, beyond that of a tyre that keeps its slope, at a lateral force over the load."""
        limit = LARGEST_SHARE * self.friction
        return self.slip(force) - min(max(force, -limit), limit) / self.stiffness
