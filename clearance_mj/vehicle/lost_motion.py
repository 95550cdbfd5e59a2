"""Lost motion of the road wheel: the shaft in its bushings reduced to one degree of freedom, quasi-static.

With d the wheel angle less the servo's, h the half-gap, g the gap function (Eq. 11), M the moment that turns the wheel
back and T_f its Coulomb friction against the ground,

    c dd/dt + k_s d + k g(d, h) + M + T_f sign(dδ/dt) = 0.

In contact and without friction d = -h σ - M/k, σ = ±1 the side: the clearance is torque-driven, its side follows the
moment. Where T_f exceeds the moment the wheel stays until the shaft has crossed the play and pushes: friction-driven.
Steps are implicit (backward Euler), so that contacts of any stiffness are stable; the step's equation is piecewise
linear and solved exactly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..core.jit import jit

__all__ = ["LostMotion", "lost_motion_step"]


class LostMotion(NamedTuple):
    """The reduced clearance, at the road wheel."""

    half_gap: float  # h, rad
    stiffness: float  # k of the contact, N m/rad
    shaft_stiffness: float = 0.0  # k_s, N m/rad, of the shaft within the play
    damping: float = 0.0  # c, N m s/rad: grease in the bushings and rack
    friction: float = 0.0  # T_f, N m


@jit(inline="always")
def _resistance(d: float, previous: float, h: float, p: LostMotion) -> float:
    """Return the torque with which the shaft resists a lost motion d after one step."""
    penetration = max(d - p.half_gap, 0.0) + min(d + p.half_gap, 0.0)
    return p.damping / h * (d - previous) + p.shaft_stiffness * d + p.stiffness * penetration


@jit(inline="always")
def _balance(moment: float, previous: float, h: float, p: LostMotion) -> float:
    """Return the lost motion at which the shaft's resistance balances a moment after one step."""
    slope = p.damping / h + p.shaft_stiffness
    torque = p.damping / h * previous - moment
    if torque > slope * p.half_gap:
        return (torque + p.stiffness * p.half_gap) / (slope + p.stiffness)
    if torque < -slope * p.half_gap:
        return (torque - p.stiffness * p.half_gap) / (slope + p.stiffness)
    return torque / slope if slope > 0.0 else previous


@jit
def lost_motion_step(d: float, turn: float, moment: float, h: float, p: LostMotion) -> tuple[float, int]:
    """Return d after one step, and σ: 1 where the shaft pushes the wheel to the left, -1 to the right, 0 in the play.

    The servo turns by ``turn``, rad, against M, N m, in the step h, s.
    """
    stuck = d - turn
    load = _resistance(stuck, d, h, p) + moment
    # A wheel that friction does not hold turns against the load: dδ/dt has the opposite sign.
    d_after = stuck if abs(load) <= p.friction else _balance(moment - math.copysign(p.friction, load), d, h, p)
    return d_after, (1 if d_after < -p.half_gap else -1 if d_after > p.half_gap else 0)
