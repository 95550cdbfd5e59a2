"""The tyre model of commonroad-vehicle-models, Pacejka's Magic Formula of 2002, in fewer operations.

Functions, arguments and results are those of the library's ``tire_model``, which they replace, up to rounding:
cos(atan z) is 1/√(1 + z²), zero shifts are omitted. Slip κ, slip angle α and camber γ in rad, load F_z in N.
"""

from __future__ import annotations

import math
from typing import Any

from ..core.jit import STRICT, jit

__all__ = ["formula_lateral", "formula_lateral_comb", "formula_longitudinal", "formula_longitudinal_comb"]


@jit(**STRICT)
def _phase(slip: float, B: float, C: float, E: float) -> float:
    z = B * slip
    return C * math.atan(z - E * (z - math.atan(z)))


@jit(**STRICT)
def formula_longitudinal(kappa: float, gamma: float, F_z: float, p: Any) -> float:
    """Return the longitudinal force at pure slip, N."""
    largest = p.p_dx1 * (1 - p.p_dx3 * gamma**2) * F_z
    B = F_z * p.p_kx1 / (p.p_cx1 * largest)
    return largest * math.sin(_phase(p.p_hx1 - kappa, B, p.p_cx1, p.p_ex1) + F_z * p.p_vx1)


@jit(**STRICT)
def formula_lateral(alpha: float, gamma: float, F_z: float, p: Any) -> tuple[float, float]:
    """Return the lateral force at pure slip, N, and the coefficient of friction."""
    side = 1.0 if gamma > 0 else -1.0 if gamma < 0 else 0.0
    friction = p.p_dy1 * (1 - p.p_dy3 * gamma**2)
    B = F_z * p.p_ky1 / (p.p_cy1 * friction * F_z)
    turn = _phase(alpha + side * (p.p_hy1 + p.p_hy3 * abs(gamma)), B, p.p_cy1, p.p_ey1)
    return friction * F_z * math.sin(turn) + side * F_z * (p.p_vy1 + p.p_vy3 * abs(gamma)), friction


@jit(**STRICT)
def formula_longitudinal_comb(kappa: float, alpha: float, F0: float, p: Any) -> float:
    """Return the longitudinal force at combined slip, N, from that at pure slip."""
    B, C, E, shift = p.r_bx1 / math.sqrt(1 + (p.r_bx2 * kappa) ** 2), p.r_cx1, p.r_ex1, p.r_hx1
    return F0 * math.cos(_phase(alpha + shift, B, C, E)) / math.cos(_phase(shift, B, C, E))


@jit(**STRICT)
def formula_lateral_comb(kappa: float, alpha: float, gamma: float, mu: float, F_z: float, F0: float, p: Any) -> float:
    """Return the lateral force at combined slip, N, from force and coefficient of friction at pure slip."""
    B, C, E, shift = p.r_by1 / math.sqrt(1 + (p.r_by2 * (alpha - p.r_by3)) ** 2), p.r_cy1, p.r_ey1, p.r_hy1
    force = F0 * math.cos(_phase(kappa + shift, B, C, E))
    if shift != 0.0:
        force /= math.cos(_phase(shift, B, C, E))
    ply_steer = mu * F_z * (p.r_vy1 + p.r_vy3 * gamma) / math.sqrt(1 + (p.r_vy4 * alpha) ** 2)
    return force if ply_steer == 0.0 else force + ply_steer * math.sin(p.r_vy5 * math.atan(p.r_vy6 * kappa))
