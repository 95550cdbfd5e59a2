"""Forces at the points of round bushings that depend on the velocity which they leave; compiled.

A point's force changes the velocity of every point by the compliance, velocity per unit impulse: loops look for the
velocity in the middle of the kick, ``half`` the step after its begin, sweep by sweep.
"""

from __future__ import annotations

import numba
import numpy as np

from ..clearance.round_kernel import RoundBushing, friction_limit
from .round_scheme import dot

__all__ = ["fill", "push", "rub", "speed_of"]


@numba.njit(cache=True, nogil=True, inline="always")
def speed_of(at_points: np.ndarray, spans: np.ndarray, middle: np.ndarray, p: int, w: np.ndarray) -> None:
    """Fill in the velocity of a point in the middle of the kick of what does not depend on it."""
    for d in range(2):
        w[p, d] = dot(at_points, (2 * p + d) * middle.size, middle, spans[d, 0], spans[d, 1])


@numba.njit(cache=True, nogil=True, inline="always")
def push(
    compliance: np.ndarray, acts: np.ndarray, half: float, p: int, y: float, z: float, w: np.ndarray, force: np.ndarray
) -> None:
    """Let the force at a point change by y, z, N, against the displacement."""
    force[p, 0] += y
    force[p, 1] += z
    for r in range(acts.size):
        if acts[r]:
            w[r, 0] -= half * (compliance[r, p, 0, 0] * y + compliance[r, p, 0, 1] * z)
            w[r, 1] -= half * (compliance[r, p, 1, 0] * y + compliance[r, p, 1, 1] * z)


@numba.njit(cache=True, nogil=True, inline="always")
def fill(
    found: np.ndarray, compliance: np.ndarray, acts: np.ndarray, half: float, p: int, w: np.ndarray, force: np.ndarray
) -> None:
    """Find the force of a filling at the velocity that it leaves."""
    own, yy, yz, zy, zz = compliance[p, p], found[2], found[3], found[4], found[5]
    free_y = w[p, 0] + half * (own[0, 0] * force[p, 0] + own[0, 1] * force[p, 1])
    free_z = w[p, 1] + half * (own[1, 0] * force[p, 0] + own[1, 1] * force[p, 1])
    a = 1.0 + half * (yy * own[0, 0] + yz * own[1, 0])
    b = half * (yy * own[0, 1] + yz * own[1, 1])
    c = half * (zy * own[0, 0] + zz * own[1, 0])
    d = 1.0 + half * (zy * own[0, 1] + zz * own[1, 1])
    y, z = found[0] + yy * free_y + yz * free_z, found[1] + zy * free_y + zz * free_z
    share = 1.0 / (a * d - b * c)
    new_y, new_z = (d * y - b * z) * share, (a * z - c * y) * share
    push(compliance, acts, half, p, new_y - force[p, 0], new_z - force[p, 1], w, force)


@numba.njit(cache=True, nogil=True, inline="always")
def rub(
    bushing: RoundBushing, end: np.ndarray, normal: float, compliance: np.ndarray, acts: np.ndarray, half: float,
    p: int, spin: float, w: np.ndarray, force: np.ndarray,
) -> None:  # fmt: skip
    """Find the friction of a contact under a normal force, N, at the velocity that it leaves.

    ``end`` holds n along y and z and the bristles' deflection in 4; 6 and 7 become the friction and its limit, N.
    """
    if bushing.friction > 0.0:
        own, y, z, damping = compliance[p, p], -end[1], end[0], bushing.bristle_damping
        give = half * (own[0, 0] * y * y + (own[0, 1] + own[1, 0]) * y * z + own[1, 1] * z * z)
        free = y * w[p, 0] + z * w[p, 1] + give * end[6] + bushing.radius * spin
        rubbed = (bushing.bristle * end[4] + damping * free) / (1.0 + damping * give)
        limit = friction_limit(bushing, normal, free - give * rubbed)
        rubbed = min(max(rubbed, -limit), limit)
        end[7], change, end[6] = limit, rubbed - end[6], rubbed
        push(compliance, acts, half, p, change * y, change * z, w, force)
