"""A round wall with two lobes: an out-of-round bore."""

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence
from typing import ClassVar

from ...core.validation import Number
from ...rig.walls import Wall, register

__all__ = ["Oval"]

ITERATIONS = 5  # of Newton's method at most; each doubles the digits
CLOSE = 1e-9  # rad, the last change


@register
class Oval(Wall):
    """A wall whose distance from the middle in the direction θ from y is gap + wide cos 2θ + across sin 2θ."""

    name: ClassVar[str] = "oval"
    wide: Number = 0.0
    """m, excess over the mean radius along y"""
    across: Number = 0.0
    """m, excess over the mean radius at 45° between y and z"""

    @staticmethod
    def law(p: Sequence[float], r: tuple[float, float], out: MutableSequence[float]) -> None:
        """Return the distance to the foot point, where the wall's tangent is normal to the connecting line."""
        e, angle = math.sqrt(r[0] * r[0] + r[1] * r[1]), math.atan2(r[1], r[0])
        theta, g, slope = angle, p[0], 0.0
        for _ in range(ITERATIONS):
            cos, sin = math.cos(2.0 * theta), math.sin(2.0 * theta)
            curvature = p[1] * cos + p[2] * sin
            g, slope, curvature = p[0] + curvature, 2.0 * (p[2] * cos - p[1] * sin), -4.0 * curvature
            normal, tangential = e * math.cos(angle - theta) - g, e * math.sin(angle - theta)
            # Distance along the wall's tangent, and its derivative by the angle.
            residual = normal * slope + tangential * g
            derivative = normal * (curvature - g) + 2.0 * tangential * slope - slope * slope - g * g
            theta -= residual / derivative
            if abs(residual) <= CLOSE * abs(derivative):
                break
        cos, sin = math.cos(theta), math.sin(theta)
        g = p[0] + p[1] * math.cos(2.0 * theta) + p[2] * math.sin(2.0 * theta)
        slope = 2.0 * (p[2] * math.cos(2.0 * theta) - p[1] * math.sin(2.0 * theta))
        size = math.sqrt(g * g + slope * slope)
        n_y, n_z = (g * cos + slope * sin) / size, (g * sin - slope * cos) / size
        out[0] = (r[0] - g * cos) * n_y + (r[1] - g * sin) * n_z
        out[1] = n_y
        out[2] = n_z

    def reach(self, gap: float) -> float:
        """Return the smallest distance of the wall from the middle."""
        return gap - math.hypot(self.wide, self.across)
