"""One step of what fills a round clearance or of one of its ends, as periodic motions take it; compiled.

The kernel's own functions find stiffness, damping, bristles and films. Here they act along a sampled motion: from one
sample to the next one, whose displacements and velocities are known. In the step in which a contact begins or ends its
force counts for the share in which it acts, at both samples: so the balance follows the motion smoothly, damping that
makes a force begin with a jump included.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...clearance.follower import pushing
from ...clearance.round_kernel import BRISTLES, RoundBushing, RoundState, friction_limit, round_contact, round_filling
from ...core.jit import STRICT, jit

__all__ = ["INPUTS", "RoundLaws", "Y", "Z", "contact_between", "contact_now", "filling_between"]

INPUTS = 8  # y, z before and now, velocities along y and z before and now
Y, Z = 2, 3  # where y and z now stand


class RoundLaws(NamedTuple):
    """What acts in the round clearances."""

    bushings: np.ndarray  # (n_bushings,) records of the kernel
    states: np.ndarray  # (n_bushings,) records of the kernel: where numbers begin
    numbers: np.ndarray  # of the records
    spring: np.ndarray  # (n_bushings,) stiffness that the linear system has already, N/m
    damper: np.ndarray  # (n_bushings,) and damping, N s/m
    memory: np.ndarray  # (n_bushings,) numbers that the filling remembers, 0 if they never change
    linear: np.ndarray  # (n_bushings,) whether the filling adds nothing to its spring and damper
    remembers: np.ndarray  # (n_bushings,) whether an end remembers the speed at which it met the wall, or bristles
    room: int  # for the memory of any filling


@jit(**STRICT, forceinline=True)
def filling_between(
    bushing: RoundBushing, state: RoundState, numbers: np.ndarray, size: int, memory: np.ndarray, u: np.ndarray,
    spin: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Fill out with what the filling remembers of a step, ``size`` numbers, and its force along y and z, N."""
    for k in range(size):
        numbers[state.grease + k] = memory[k]
    y, z, speed_y, speed_z = u[2], u[3], u[6], u[7]
    if size:
        state.y, state.z = u[0], u[1]
    else:  # of what does not remember only the velocity counts
        state.y, state.z = y - speed_y * bushing.step, z - speed_z * bushing.step
    force_y, force_z, yy, yz, zy, zz = round_filling(bushing, state, numbers, y, z, spin)
    for k in range(size):
        out[k] = numbers[state.grease + k]
    out[size] = force_y + yy * speed_y + yz * speed_z
    out[size + 1] = force_z + zy * speed_y + zz * speed_z
    out[size + 2] = out[size + 3] = 0.0


@jit(**STRICT, forceinline=True)
def _end_force(
    bushing: RoundBushing, state: RoundState, numbers: np.ndarray, y: float, z: float, speed_y: float, speed_z: float,
    spin: float, share: float,
) -> tuple[float, float]:  # fmt: skip
    """Force of end 0 along y and z against the displacement, N; bristles of a contact that begins have a share of slip.

    A share below 0 says that the contact did not begin in this step.
    """
    depth, n_y, n_z, k, c, bristles = round_contact(bushing, state, numbers, 0, y, z, speed_y, speed_z, spin)
    if depth == 0.0:
        return 0.0, 0.0
    normal = pushing(k * depth + c * (n_y * speed_y + n_z * speed_z), bushing.adhesion)
    force_y, force_z = normal * n_y, normal * n_z
    if bushing.friction > 0.0:
        sliding = n_y * speed_z - n_z * speed_y + bushing.radius * spin
        if share >= 0.0:
            bristles = share * bushing.step * sliding
        rubbed = bushing.bristle * bristles + bushing.bristle_damping * sliding
        limit = friction_limit(bushing, max(normal, 0.0), sliding)
        rubbed = min(max(rubbed, -limit), limit)
        most = abs(rubbed) / bushing.bristle
        numbers[state.ends + BRISTLES] = min(max(bristles, -most), most)
        force_y -= rubbed * n_z
        force_z += rubbed * n_y
    return force_y, force_z


@jit(**STRICT, forceinline=True)
def _recall(bushing: RoundBushing, state: RoundState, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray) -> None:
    """Let end 0 be in the contact of which impact speed and bristles are remembered, at the sample before."""
    at = state.ends
    y, z = u[0] + bushing.offset_y, u[1] + bushing.offset_z
    e = math.sqrt(y * y + z * z)
    numbers[at], numbers[at + 3] = memory[0], memory[1]
    numbers[at + 1], numbers[at + 2], numbers[at + 4], numbers[at + 5] = y / e, z / e, u[0], u[1]


@jit(**STRICT, forceinline=True)
def contact_now(
    bushing: RoundBushing, state: RoundState, numbers: np.ndarray, y: float, z: float, speed_y: float, speed_z: float,
    spin: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the force along y and z of an end that touched before, too, and remembers nothing, N."""
    numbers[state.ends] = 0.0
    return _end_force(bushing, state, numbers, y, z, speed_y, speed_z, spin, -1.0)


@jit(**STRICT, forceinline=True)
def contact_between(
    bushing: RoundBushing, state: RoundState, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, spin: float,
    out: np.ndarray,
) -> None:  # fmt: skip
    """Fill out with an end's impact speed and bristles, its force now along y and z, N, and what it was more before."""
    before_y, before_z = u[0] + bushing.offset_y, u[1] + bushing.offset_z
    now_y, now_z = u[2] + bushing.offset_y, u[3] + bushing.offset_z
    before, now = math.sqrt(before_y**2 + before_z**2) - bushing.gap, math.sqrt(now_y**2 + now_z**2) - bushing.gap
    first, at = state.ends, state.ends
    out[0] = out[1] = out[2] = out[3] = out[4] = out[5] = 0.0
    if now <= 0.0:
        if before > 0.0 and bushing.adhesion:  # a force that does not pull is over before the contact is
            _recall(bushing, state, numbers, memory, u)
            step, bushing.step = bushing.step, 0.0
            last_y, last_z = _end_force(bushing, state, numbers, u[0], u[1], u[4], u[5], spin, -1.0)
            bushing.step = step
            rest = 1.0 - before / (before - now)
            out[4], out[5] = -0.5 * rest * last_y, -0.5 * rest * last_z
        return
    share, jump_y, jump_z = -1.0, 0.0, 0.0
    if before > 0.0:
        _recall(bushing, state, numbers, memory, u)
    else:
        share = before / (before - now)
        numbers[first] = 0.0
        y, z = u[0] + share * (u[2] - u[0]), u[1] + share * (u[3] - u[1])
        speed_y, speed_z = u[4] + share * (u[6] - u[4]), u[5] + share * (u[7] - u[5])
        r_y, r_z = y + bushing.offset_y, z + bushing.offset_z
        # The chord lies a little within the arc: the jump is the force just beyond the gap.
        outwards = bushing.gap * (1.0 + 1e-12) / math.sqrt(r_y * r_y + r_z * r_z)
        y, z = r_y * outwards - bushing.offset_y, r_z * outwards - bushing.offset_z
        jump_y, jump_z = _end_force(bushing, state, numbers, y, z, speed_y, speed_z, spin, 0.0)
    now_y, now_z = _end_force(
        bushing, state, numbers, u[2], u[3], u[6], u[7], spin, 1.0 - share if share >= 0.0 else -1.0
    )
    out[0], out[1], out[2], out[3] = numbers[at], numbers[at + BRISTLES], now_y, now_z
    if share >= 0.0:
        rest = 1.0 - share
        out[2] -= 0.5 * share * (now_y - jump_y + share * jump_y)
        out[3] -= 0.5 * share * (now_z - jump_z + share * jump_z)
        out[4], out[5] = 0.5 * rest * rest * jump_y, 0.5 * rest * rest * jump_z
