"""The oil film of a short bearing, in polar coordinates of the journal in its clearance.

With ε = e/C and the journal at the angle φ, both from the bearing's middle, and B = μ R L³/(2 C²),

    F_r = -B [2 ε² |Ω - 2φ'| / (1-ε²)² + π (1+2ε²) ε' / (1-ε²)^2.5]
    F_t =  B [π ε (Ω - 2φ') / (2 (1-ε²)^1.5) + 4 ε ε' / (1-ε²)²]

is Ocvirk's solution of Reynolds' equation where the pressure is positive on the half that the turning draws oil into
(Ocvirk, NACA TN 2808, 1952; Childs, Turbomachinery Rotordynamics, 1993, chapter 3). Near steady rotation it is exact;
the shift of the half with pressure by a squeeze faster than the rotation is neglected. An uncavitated film has pressure
all around.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numba.extending import register_jitable

from ..contact import Numbers
from ..grease import Vector, register
from ..lanes import choose, larger, power, smaller
from ..oil_bearing import OilBearing
from ..vectors import TINY, answer_film, in_plane, length

__all__ = ["ShortBearing"]

DIFFERENCE = 1e-30  # m and m/s, of complex-step derivatives


@register_jitable
def _film(ratio: Any, cavitated: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Return the film's factors at an eccentricity: of Ω radial, tangential; of speeds radial, coupled, tangential."""
    thin = 1.0 - ratio * ratio
    root = power(thin, 0.5)
    halves = 2.0 - cavitated  # an uncavitated film has pressure on both halves
    return (
        cavitated * 2.0 * ratio * ratio / (thin * thin),
        halves * np.pi * ratio / (2.0 * thin * root),
        halves * np.pi * (1.0 + 2.0 * ratio * ratio) / (thin * thin * root),
        cavitated * 4.0 * ratio / (thin * thin),
        halves * np.pi / (thin * root),
    )


@register
class ShortBearing(OilBearing):
    """A plain bearing that is short for its diameter, filled with oil; `force` acts on the journal."""

    name: ClassVar[str] = "short-bearing"
    fullest: ClassVar[float] = 1 - 1e-9

    @property
    def scale(self) -> float:
        """B = μ R L³/(2 C²), N s."""
        return self.viscosity * self.radius * self.length**3 / (2 * self.clearance**2)

    def parameters(self) -> tuple[float, ...]:
        """Return B, 1/C, the largest ratio, and 1 for a cavitated film, else 0."""
        return self.scale, 1 / self.clearance, self.most, float(self.cavitated)

    def small_motion(self) -> tuple[float, float]:
        """Return no stiffness, and the damping of a centred squeeze film."""
        return 0.0, self.scale * _film(0.0, float(self.cavitated))[2] / self.clearance

    @staticmethod
    def law(p: Sequence[float], state: Numbers, r: Vector, dr: Vector, spin: float, step: float, out: Numbers) -> None:
        """Write the force of turning as elastic force, and damping; the half with pressure is that of the last step."""
        (y, z), (dy, dz), e = in_plane(r), in_plane(dr), length(r)
        n_y, n_z = choose(y / larger(e, TINY), 1.0, e), choose(z / larger(e, TINY), 0.0, e)
        ratio = smaller(e * p[1], p[2])
        spin_radial, wedge, squeeze, mixed, tangential_damping = _film(ratio, p[3])
        turn_rate = (n_y * dz - n_z * dy) / step * p[1]
        side = choose(-1.0, 1.0, 2.0 * turn_rate - ratio * spin)
        radial, tangential = p[0] * side * spin_radial * spin, p[0] * wedge * spin
        scale = p[0] * p[1]
        rr, tt, rt, tr = scale * squeeze, scale * tangential_damping, 0.0 - scale * side * mixed, 0.0 - scale * mixed
        yy = rr * n_y * n_y - (rt + tr) * n_y * n_z + tt * n_z * n_z
        yz = (rr - tt) * n_y * n_z + rt * n_y * n_y - tr * n_z * n_z
        zy = (rr - tt) * n_y * n_z - rt * n_z * n_z + tr * n_y * n_y
        zz = rr * n_z * n_z + (rt + tr) * n_y * n_z + tt * n_y * n_y
        answer_film(out, r, radial * n_y + tangential * n_z, radial * n_z - tangential * n_y, yy, yz, zy, zz)

    def force(self, displacement: Any, velocity: Any, spin: float) -> np.ndarray:
        """Return the film's force on the journal, N.

        Parameters
        ----------
        displacement : array_like, shape (..., 2)
            y and z from the bearing's middle, m; beyond the asperities the film thickness is constant.
        velocity : array_like, shape (..., 2)
            m/s.
        spin : float
            Ω, rad/s, from y to z.

        Returns
        -------
        ndarray, shape (..., 2)
            Along y and z.
        """
        r, v = np.asarray(displacement), np.asarray(velocity)
        e = np.sqrt(np.sum(r * r, axis=-1))
        nonzero = e != 0
        size = np.where(nonzero, e, 1.0)
        n = np.stack((np.where(nonzero, r[..., 0] / size, 1.0), np.where(nonzero, r[..., 1] / size, 0.0)), axis=-1)
        t = np.stack((-n[..., 1], n[..., 0]), axis=-1)
        ratio = e / self.clearance
        ratio = np.where(ratio.real > self.most, self.most, ratio)
        radial_speed, tangential_speed = (np.sum(v * axis, axis=-1) / self.clearance for axis in (n, t))
        spin_radial, wedge, squeeze, mixed, tangential_damping = _film(ratio, float(self.cavitated))
        side = np.where((ratio * spin - 2 * tangential_speed).real < 0, -1.0, 1.0)
        radial = side * (spin_radial * spin - mixed * tangential_speed) + squeeze * radial_speed
        tangential = wedge * spin - tangential_damping * tangential_speed + mixed * radial_speed
        return np.asarray(self.scale * (tangential[..., None] * t - radial[..., None] * n))

    def coefficients(self, displacement: Any, spin: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the film's stiffness and damping for small motions about a journal at rest: the eight coefficients.

        Parameters
        ----------
        displacement : array_like, shape (2,)
            y and z from the bearing's middle, m.
        spin : float
            Ω, rad/s.

        Returns
        -------
        stiffness : ndarray, shape (2, 2)
            N/m: force against each direction, per displacement in each.
        damping : ndarray, shape (2, 2)
            N s/m.
        """
        steps = 1j * DIFFERENCE * np.eye(2)
        position, zero = np.asarray(displacement, dtype=float), np.zeros((2, 2))
        stiffness = -self.force(position + steps, zero, spin).imag.T / DIFFERENCE
        return stiffness, -self.force(position + np.zeros((2, 2)), steps, spin).imag.T / DIFFERENCE
