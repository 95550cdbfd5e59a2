"""The nominal tyre: lateral force of an axle over its slip angle.

F/F_z = μ sin(C atan(B α)) with B = c/(C μ), c the slope at α = 0: the Magic Formula without its curvature factor, which
is -0.007 for the nominal vehicle's tyres (Pacejka, Tire and Vehicle Dynamics, 2012, section 4.3).
"""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["Tyre"]

LARGEST_SHARE = 0.95
"""Share of the largest force up to which a slip angle is given: beyond, steering gains next to nothing."""


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
        share = min(max(force / self.friction, -LARGEST_SHARE), LARGEST_SHARE)
        return math.tan(math.asin(share) / self.shape) * self.shape * self.friction / self.stiffness

    def excess(self, force: float) -> float:
        """Return the slip angle, rad, beyond that of a tyre that keeps its slope, at a lateral force over the load."""
        share = LARGEST_SHARE * self.friction
        return self.slip(force) - min(max(force, -share), share) / self.stiffness
