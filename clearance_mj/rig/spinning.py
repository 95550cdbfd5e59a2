"""Rotation of a shaft about its axis, and its unbalance."""

from __future__ import annotations

import math

import numpy as np

from ..core.errors import RigError
from ..core.validation import Count, Number, Positive, checked, seldom
from ..structure import Point

__all__ = ["Spin", "Unbalance"]


@checked(RigError)
class Spin:
    """Turning about the shaft's axis, > 0 from y to z: at one speed, in a ramp to another, or coasting."""

    speed: Number
    """rad/s, at the start"""
    rate: Number = seldom(default=0.0)
    """rad/s², of a ramp"""
    until: Number | None = seldom(default=None)
    """rad/s, at which a ramp ends; None: it does not end"""
    angle: Number = seldom(default=0.0)
    """rad, of the shaft at the start, from y"""
    inertia: Positive | None = seldom(default=None)
    """kg m², about the axis, of all that turns: friction then changes the speed; None: the drive holds the speed"""
    pulses: Count = seldom(default=1)
    """of a keyphasor in a turn: slots, teeth or marks"""

    def __post_init__(self) -> None:
        if self.until is not None and (self.until - self.speed) * self.rate <= 0:
            raise ValueError(
                f"until {self.until:g} rad/s is never reached from speed {self.speed:g} rad/s "
                f"at a rate of {self.rate:g} rad/s²"
            )

    @property
    def mean(self) -> float:
        """Spin, rad/s; of a ramp the middle of its ends."""
        return self.speed if self.until is None else (self.speed + self.until) / 2

    @property
    def fastest(self) -> float:
        """Largest spin of a shaft that its drive holds or slows down, rad/s; of an endless ramp that at its start."""
        return max(abs(self.speed), abs(self.speed if self.until is None else self.until))

    @property
    def ramp_end(self) -> float:
        """Time at which the ramp ends, s; infinite where it does not."""
        return math.inf if self.until is None else (self.until - self.speed) / self.rate

    def speed_at(self, time: np.ndarray) -> np.ndarray:
        """Return the spin that the drive gives at times, s, in rad/s.

        Parameters
        ----------
        time : ndarray, shape (n,)
            s from the start.
        """
        return np.asarray(self.speed + self.rate * np.minimum(time, self.ramp_end))

    def angle_at(self, time: np.ndarray) -> np.ndarray:
        """Return the shaft's angle at times, s, in rad.

        Parameters
        ----------
        time : ndarray, shape (n,)
            s from the start.
        """
        in_ramp = np.minimum(time, self.ramp_end)
        steady = self.speed * time + self.rate * in_ramp * (time - in_ramp / 2)
        return np.asarray(self.angle + steady)


@checked(RigError)
class Unbalance:
    """A mass off the axis of a shaft that turns."""

    position: Point
    """m along the shaft, or a degree of freedom across it such as "12:+Z" """
    moment: Positive
    """kg m, mass times its distance from the axis"""
    phase: Number = 0.0
    """rad, from y where the shaft's angle is 0"""
