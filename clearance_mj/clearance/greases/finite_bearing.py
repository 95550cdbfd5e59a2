"""The oil film of a bearing of finite width, in any motion of the journal: Reynolds' equation in a table.

With the velocity v of the journal, w = v - Ω/2 x × r is its velocity relative to the film, of turning and squeeze. Its
power is 12 μ R L (R/C)²/C g(ε, χ) u², with ε = e/C and u = (w_n, κ w_t) = |u| (sin χ n - cos χ t); see `reynolds`.
Forces are the derivatives of half of it, F = -D w, with the symmetric matrix D of its second derivatives, which depends
on the direction of w alone: along u and across it, that is along its derivative by χ,

    D = 12 μ R L (R/C)²/C S [[g, g'/2], [g'/2, g + g''/2]] S,  S = diag(1, κ) in n and t,  ' = ∂/∂χ

The part of v in D w is damping, that of Ω the elastic force of turning.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numba.extending import register_jitable

from ...core.jit import jit
from ..contact import Numbers
from ..grease import Vector, register
from ..oil_bearing import OilBearing
from ..reynolds import DIRECTIONS, RATIOS, STEP, THINNEST, film_table, turning_share
from ..vectors import answer_film, in_plane

__all__ = ["FiniteBearing"]

SCALE, PER_CLEARANCE, MOST, CENTRED, TABLE = range(5)  # indices of parameters
COLUMNS = DIRECTIONS + 2
PER_DIRECTION = (DIRECTIONS - 1) / math.pi  # columns per rad
DIFFERENCE = 1e-5  # of the clearance: central differences of stiffness


@register_jitable
def _weights(s: float) -> tuple[float, float, float, float]:
    """Return cubic B-splines over a piece of length 1."""
    r = 1.0 - s
    return (
        r * r * r / 6.0,
        (4.0 - 3.0 * s * s * (1.0 + r)) / 6.0,
        (4.0 - 3.0 * r * r * (1.0 + s)) / 6.0,
        s * s * s / 6.0,
    )


@register_jitable
def _power(p: Sequence[float], ratio: float, chi: float) -> tuple[float, float, float]:
    """Return g, g' and g'' at an eccentricity ratio and a direction χ between -π/2 and π/2."""
    u, v = -math.log(1.0 - ratio) / STEP, (chi + 0.5 * math.pi) * PER_DIRECTION
    i, j = min(int(u), RATIOS - 2), min(max(int(v), 0), DIRECTIONS - 2)
    s = v - j
    rows, columns = _weights(u - i), _weights(s)
    r = 1.0 - s
    slopes = (-0.5 * r * r, 0.5 * s * (3.0 * s - 4.0), 0.5 * r * (4.0 - 3.0 * r), 0.5 * s * s)
    curvatures = (r, 3.0 * s - 2.0, 1.0 - 3.0 * s, s)
    height = slope = curvature = 0.0
    for a in range(4):
        address = TABLE + (i + a) * COLUMNS + j
        for b in range(4):
            number = rows[a] * p[address + b]
            height += number * columns[b]
            slope += number * slopes[b]
            curvature += number * curvatures[b]
    g, slope, curvature = math.exp(height), slope * PER_DIRECTION, curvature * PER_DIRECTION * PER_DIRECTION
    return g, g * slope, g * (curvature + slope * slope)


@register_jitable
def _resistance(
    p: Sequence[float], y: float, z: float, v_y: float, v_z: float, spin: float
) -> tuple[float, float, float, float, float]:
    """Return D: yy, yz and zz, N s/m, and Ω/2 x × r along y and z, m/s, of a film no thinner than the thinnest."""
    e = math.sqrt(y * y + z * z)
    n_y, n_z = (y / e, z / e) if e > 0.0 else (1.0, 0.0)
    ratio = min(e * p[PER_CLEARANCE], p[MOST])
    turn = 0.5 * spin * ratio / p[PER_CLEARANCE]
    kappa = turning_share(ratio)
    inwards, around = n_y * v_y + n_z * v_z, kappa * (turn - n_y * v_z + n_z * v_y)  # u_n and -u_t
    size = math.sqrt(inwards * inwards + around * around)
    if size == 0.0:
        return p[SCALE] * p[CENTRED], 0.0, p[SCALE] * p[CENTRED], -turn * n_z, turn * n_y
    s, c = inwards / size, around / size  # sin χ, cos χ
    g, slope, bend = _power(p, ratio, math.atan2(s, abs(c)))
    mixed = math.copysign(0.5 * slope, c * slope)  # the mirror image of χ turns the slope round
    bend = 0.5 * bend
    # g + bend of c n + s t, the derivative of u's direction, and g of that itself, s n - c t.
    nn = p[SCALE] * (g + 2.0 * mixed * s * c + bend * c * c)
    nt = p[SCALE] * kappa * (mixed * (s * s - c * c) + bend * s * c)
    tt = p[SCALE] * kappa * kappa * (g - 2.0 * mixed * s * c + bend * s * s)
    yy = nn * n_y * n_y - 2.0 * nt * n_y * n_z + tt * n_z * n_z
    yz = (nn - tt) * n_y * n_z + nt * (n_y * n_y - n_z * n_z)
    zz = nn * n_z * n_z + 2.0 * nt * n_y * n_z + tt * n_y * n_y
    return yy, yz, zz, -turn * n_z, turn * n_y


@jit
def _write_forces(p: Any, r: np.ndarray, v: np.ndarray, spin: float, out: np.ndarray) -> None:
    """Write forces (n, 2) on the journal at positions r with velocities v, (n, 2) each."""
    for i in range(len(r)):
        yy, yz, zz, turn_y, turn_z = _resistance(p, r[i, 0], r[i, 1], v[i, 0], v[i, 1], spin)
        w_y, w_z = v[i, 0] - turn_y, v[i, 1] - turn_z
        out[i, 0], out[i, 1] = -yy * w_y - yz * w_z, -yz * w_y - zz * w_z


@register
class FiniteBearing(OilBearing):
    """A plain bearing of finite width, filled with oil; `force` acts on the journal."""

    name: ClassVar[str] = "finite-bearing"
    fullest: ClassVar[float] = 1 - THINNEST

    @property
    def scale(self) -> float:
        """12 μ R L (R/C)²/C, N s/m."""
        return 12 * self.viscosity * self.radius * self.length * (self.radius / self.clearance) ** 2 / self.clearance

    @property
    def width(self) -> float:
        """L/D, rounded so that values of one bearing share a table."""
        return float(f"{self.length / (2 * self.radius):.9g}")

    def parameters(self) -> tuple[float, ...]:
        """Return the scale, 1/C, the largest ratio, g of a centred film, and the table."""
        return (self.scale, 1 / self.clearance, self.most, self._centred, *film_table(self.width, self.cavitated))

    @property
    def _centred(self) -> float:
        first, second, third = film_table(self.width, self.cavitated)[: 3 * COLUMNS : COLUMNS]
        return math.exp((first + 4 * second + third) / 6)

    def small_motion(self) -> tuple[float, float]:
        """Return no stiffness, and the damping of a centred squeeze film."""
        return 0.0, self.scale * self._centred

    @staticmethod
    def law(p: Sequence[float], state: Numbers, r: Vector, dr: Vector, spin: float, step: float, out: Numbers) -> None:
        """Write the force of turning as elastic force, and damping, with w of the last step; see the module."""
        (y, z), (dy, dz) = in_plane(r), in_plane(dr)
        yy, yz, zz, turn_y, turn_z = _resistance(p, y, z, dy / step, dz / step, spin)
        answer_film(out, r, -yy * turn_y - yz * turn_z, -yz * turn_y - zz * turn_z, yy, yz, yz, zz)

    def force(self, displacement: Any, velocity: Any, spin: float) -> np.ndarray:
        """Return the film's force on the journal, N; see `OilBearing.force`."""
        r, v = np.broadcast_arrays(np.asarray(displacement, dtype=float), np.asarray(velocity, dtype=float))
        out = np.empty(r.shape)
        flat = (np.ascontiguousarray(a).reshape(-1, 2) for a in (r, v))
        _write_forces(np.array(self.parameters()), *flat, float(spin), out.reshape(-1, 2))
        return out

    def coefficients(self, displacement: Any, spin: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the eight coefficients; see `OilBearing.coefficients`. Stiffness is a central difference."""
        position, step = np.asarray(displacement, dtype=float), DIFFERENCE * self.clearance
        steps = step * np.concatenate((np.eye(2), -np.eye(2)))
        force = self.force(position + steps, np.zeros(2), spin)
        yy, yz, zz, *_ = _resistance(self.parameters(), float(position[0]), float(position[1]), 0.0, 0.0, spin)
        return -(force[:2] - force[2:]).T / (2 * step), np.array([[yy, yz], [yz, zz]])
