"""Forces at the points of round bushings that depend on the velocity which they leave; compiled.

A point's force changes the velocity of every point by the compliance, velocity per unit impulse: loops look for the
velocity in the middle of the kick, ``half`` the step after its begin, sweep by sweep.
"""

from __future__ import annotations

import numpy as np

from ..clearance.lanes import load, store
from ..clearance.round_kernel import RoundBushing, friction_limit
from ..core.jit import inlined
from .round_scheme import FOUR, dot

__all__ = ["fill", "gives", "push", "rub", "speed_of"]


@inlined
def speed_of(at_points: np.ndarray, spans: np.ndarray, middle: np.ndarray, p: int, w: np.ndarray) -> None:
    """Fill in the velocity of a point in the middle of the kick of what does not depend on it."""
    for d in range(2):
        w[p, d] = dot(at_points, (2 * p + d) * middle.size, middle, spans[d, 0], spans[d, 1])


@inlined
def push(compliance: np.ndarray, half: float, p: int, y: float, z: float, w: np.ndarray, force: np.ndarray) -> None:
    """Let the force at a point change by y, z, N, against the displacement."""
    force[p, 0] += y
    force[p, 1] += z
    half_y, half_z, fours = half * y, half * z, w.size // 4
    for r in range(fours):
        slower = (
            load(compliance, 2 * p * fours + r, FOUR) * half_y
            + load(compliance, (2 * p + 1) * fours + r, FOUR) * half_z
        )
        store(w, r, load(w, r, FOUR) - slower, FOUR)


@inlined
def gives(compliance: np.ndarray, p: int, y: float, z: float) -> float:
    """Return the velocity of a point along a direction per unit impulse along it."""
    yy, yz, zy, zz = compliance[p, 0, p, 0], compliance[p, 0, p, 1], compliance[p, 1, p, 0], compliance[p, 1, p, 1]
    return yy * y * y + (yz + zy) * y * z + zz * z * z


@inlined
def fill(found: np.ndarray, compliance: np.ndarray, half: float, p: int, w: np.ndarray, force: np.ndarray) -> None:
    """Find the force of a filling at the velocity that it leaves."""
    yy, yz, zy, zz = found[2], found[3], found[4], found[5]
    y_by_y, z_by_y = half * compliance[p, 0, p, 0], half * compliance[p, 0, p, 1]
    y_by_z, z_by_z = half * compliance[p, 1, p, 0], half * compliance[p, 1, p, 1]
    free_y = w[p, 0] + y_by_y * force[p, 0] + y_by_z * force[p, 1]
    free_z = w[p, 1] + z_by_y * force[p, 0] + z_by_z * force[p, 1]
    a, b = 1.0 + yy * y_by_y + yz * z_by_y, yy * y_by_z + yz * z_by_z
    c, d = zy * y_by_y + zz * z_by_y, 1.0 + zy * y_by_z + zz * z_by_z
    y, z = found[0] + yy * free_y + yz * free_z, found[1] + zy * free_y + zz * free_z
    share = 1.0 / (a * d - b * c)
    new_y, new_z = (d * y - b * z) * share, (a * z - c * y) * share
    push(compliance, half, p, new_y - force[p, 0], new_z - force[p, 1], w, force)


@inlined
def rub(
    bushing: RoundBushing, end: np.ndarray, normal: float, compliance: np.ndarray, half: float, p: int, spin: float,
    w: np.ndarray, force: np.ndarray,
) -> None:  # fmt: skip
    """Find the friction of a contact under a normal force, N, at the velocity that it leaves.

    ``end`` holds n along y and z and the bristles' deflection in 4; 6 and 7 become the friction and its limit, N.
    """
    if bushing.friction > 0.0:
        y, z, damping = -end[1], end[0], bushing.bristle_damping
        give = half * gives(compliance, p, y, z)
        free = y * w[p, 0] + z * w[p, 1] + give * end[6] + bushing.radius * spin
        rubbed = (bushing.bristle * end[4] + damping * free) / (1.0 + damping * give)
        limit = friction_limit(bushing, normal, free - give * rubbed)
        rubbed = min(max(rubbed, -limit), limit)
        end[7], change, end[6] = limit, rubbed - end[6], rubbed
        push(compliance, half, p, change * y, change * z, w, force)
