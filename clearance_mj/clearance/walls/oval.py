"""A round wall with two lobes: a bore that is out of round."""

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence
from typing import ClassVar

from ...core.validation import Number
from ...rig.walls import Wall, register

__all__ = ["Oval"]

ITERATIONS = 5  # of Newton's method, which doubles the digits each time, at most
CLOSE = 1e-9  # rad, the last change


@register
class Oval(Wall):
    """A wall whose distance from the middle in the direction θ from y is gap + wide cos 2θ + across sin 2θ."""

    name: ClassVar[str] = "oval"
    wide: Number = 0.0
    """m, by which it is wider along y than on the mean"""
    across: Number = 0.0
    """m, by which it is wider at 45° between y and z"""

    @staticmethod
    def law(p: Sequence[float], r: tuple[float, float], out: MutableSequence[float]) -> None:
        """Return the distance to the foot point on the wall, at which the wall's tangent is across the way there."""
        e, angle = math.sqrt(r[0] * r[0] + r[1] * r[1]), math.atan2(r[1], r[0])
        at, g, slope = angle, p[0], 0.0
        for _ in range(ITERATIONS):
            cos, sin = math.cos(2.0 * at), math.sin(2.0 * at)
            bend = p[1] * cos + p[2] * sin
            g, slope, bend = p[0] + bend, 2.0 * (p[2] * cos - p[1] * sin), -4.0 * bend
            beyond, beside = e * math.cos(angle - at) - g, e * math.sin(angle - at)
            # The way to the wall along its tangent, and the derivative of that by the angle.
            off = beyond * slope + beside * g
            change = beyond * (bend - g) + 2.0 * beside * slope - slope * slope - g * g
            at -= off / change
            if abs(off) <= CLOSE * abs(change):
                break
        cos, sin = math.cos(at), math.sin(at)
        g = p[0] + p[1] * math.cos(2.0 * at) + p[2] * math.sin(2.0 * at)
        slope = 2.0 * (p[2] * math.cos(2.0 * at) - p[1] * math.sin(2.0 * at))
        size = math.sqrt(g * g + slope * slope)
        n_y, n_z = (g * cos + slope * sin) / size, (g * sin - slope * cos) / size
        out[0] = (r[0] - g * cos) * n_y + (r[1] - g * sin) * n_z
        out[1] = n_y
        out[2] = n_z

    def reach(self, gap: float) -> float:
        """Return the smallest distance of the wall from the middle."""
        return gap - math.hypot(self.wide, self.across)
