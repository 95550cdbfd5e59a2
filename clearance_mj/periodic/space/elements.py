"""One step of what fills a round clearance or of one of its ends, as periodic motions take it; compiled.

The kernel's own functions find stiffness, damping, bristles and films. Here they act along a sampled motion: from one
sample to the next one, whose displacements and velocities are known. In the step in which a contact begins or ends its
force counts for the share in which it acts, at both samples: so the balance follows the motion smoothly, damping that
makes a force begin with a jump included.
"""

from __future__ import annotations

import numpy as np

from ...clearance.follower import pushing
from ...clearance.kernel import BRISTLES, fill, forget, friction_limit, let_go, rub, touch
from ...clearance.pointers import at, call_law
from ...clearance.record import Bushing
from ...core.jit import STRICT, jit
from ..forces import Laws

__all__ = ["INPUTS", "ONE", "Y", "Z", "contact_between", "contact_now", "depths", "filling_between"]

INPUTS = 8  # y, z before and now, velocities along y and z before and now
Y, Z = 2, 3  # where y and z now stand
ONE = (0,)  # lane of the kernel


@jit(**STRICT, forceinline=True)
def filling_between(
    bushing: Bushing, numbers: np.ndarray, size: int, memory: np.ndarray, u: np.ndarray, spin: float, out: np.ndarray
) -> None:
    """Fill out with what the filling remembers of a step, ``size`` numbers, and its force along y and z, N."""
    for k in range(size):
        numbers[bushing.memory + k] = memory[k]
    for d in range(2):  # of what does not remember only the velocity counts
        numbers[bushing.place + d] = u[d] if size else u[2 + d] - u[6 + d] * bushing.step
    fill(bushing, numbers, (u[2], u[3]), spin, ONE)
    for k in range(size):
        out[k] = numbers[bushing.memory + k]
    answer = at(numbers, bushing.out)
    out[size] = answer[0] + answer[2] * u[6] + answer[3] * u[7]
    out[size + 1] = answer[1] + answer[4] * u[6] + answer[5] * u[7]
    out[size + 2] = out[size + 3] = 0.0


@jit(**STRICT, forceinline=True)
def _within_wall(bushing: Bushing, numbers: np.ndarray, y: float, z: float) -> tuple[float, float, float]:
    """Return how deep a point is in the wall, m, below 0 in the gap, and the direction n along y and z."""
    out = at(numbers, bushing.out)
    r = (y + numbers[bushing.offset], z + numbers[bushing.offset + 1])
    call_law(bushing.wall_law, at(numbers, bushing.wall), r, out)
    return out[0], out[1], out[2]


@jit(**STRICT)
def depths(laws: Laws, place: np.ndarray) -> np.ndarray:
    """Return how deep (n_ends, N) all ends at place (n_ends, 2, N), m, are in their walls; below 0 in the gap."""
    found = np.empty((place.shape[0], place.shape[2]))
    for p in range(found.shape[0]):
        for i in range(found.shape[1]):
            found[p, i] = _within_wall(laws.bushings[p // 2], laws.numbers, place[p, 0, i], place[p, 1, i])[0]
    return found


@jit(**STRICT, forceinline=True)
def _end_force(
    bushing: Bushing, numbers: np.ndarray, y: float, z: float, speed_y: float, speed_z: float, spin: float,
    share: float,
) -> tuple[float, float]:  # fmt: skip
    """Force of end 0 along y and z against the displacement, N; bristles of a contact that begins have a share of slip.

    A share below 0 says that the contact did not begin in this step.
    """
    depth, n_y, n_z = touch(bushing, numbers, y, z, ONE)
    if depth == 0.0:
        forget(bushing, numbers, 0, ONE)
        return 0.0, 0.0
    k, c, bristles = rub(bushing, numbers, 0, depth, n_y, n_z, y, z, speed_y, speed_z, spin, ONE)
    normal = pushing(k * depth + c * (n_y * speed_y + n_z * speed_z), bushing.adhesion)
    force_y, force_z = normal * n_y, normal * n_z
    if bushing.rubs:
        sliding = n_y * speed_z - n_z * speed_y + numbers[bushing.friction + 5] * spin
        if share >= 0.0:
            bristles = share * bushing.step * sliding
            numbers[bushing.ends + BRISTLES] = bristles
        rubbed = numbers[bushing.friction + 1] * bristles + numbers[bushing.friction + 2] * sliding
        limit = friction_limit(bushing, numbers, max(normal, 0.0), sliding, ONE)
        rubbed = min(max(rubbed, -limit), limit)
        let_go(bushing, numbers, 0, abs(rubbed), ONE)
        force_y -= rubbed * n_z
        force_z += rubbed * n_y
    return force_y, force_z


@jit(**STRICT, forceinline=True)
def _recall(
    bushing: Bushing, numbers: np.ndarray, memory: np.ndarray, y: float, z: float, n_y: float, n_z: float
) -> None:
    """Let end 0 be in the contact of which impact speed and bristles are remembered, at y, z along n."""
    end = at(numbers, bushing.ends)
    end[0], end[BRISTLES] = memory[0], memory[1]
    end[1], end[2], end[4], end[5] = n_y, n_z, y, z


@jit(**STRICT, forceinline=True)
def contact_now(
    bushing: Bushing, numbers: np.ndarray, y: float, z: float, speed_y: float, speed_z: float, spin: float
) -> tuple[float, float]:
    """Return the force along y and z of an end that touched before, too, and remembers nothing, N."""
    numbers[bushing.ends] = 0.0
    return _end_force(bushing, numbers, y, z, speed_y, speed_z, spin, -1.0)


@jit(**STRICT, forceinline=True)
def contact_between(
    bushing: Bushing, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, spin: float, out: np.ndarray
) -> None:
    """Fill out with an end's impact speed and bristles, its force now along y and z, N, and what it was more before."""
    before, n_y, n_z = _within_wall(bushing, numbers, u[0], u[1])
    now = _within_wall(bushing, numbers, u[2], u[3])[0]
    out[0] = out[1] = out[2] = out[3] = out[4] = out[5] = 0.0
    if before > 0.0:
        _recall(bushing, numbers, memory, u[0], u[1], n_y, n_z)
    else:
        numbers[bushing.ends] = 0.0
    if now <= 0.0:
        if before > 0.0 and bushing.adhesion:  # a force that does not pull is over before the contact is
            step, bushing.step = bushing.step, 0.0
            last_y, last_z = _end_force(bushing, numbers, u[0], u[1], u[4], u[5], spin, -1.0)
            bushing.step = step
            rest = 1.0 - before / (before - now)
            out[4], out[5] = -0.5 * rest * last_y, -0.5 * rest * last_z
        return
    share, jump_y, jump_z = -1.0, 0.0, 0.0
    if before <= 0.0:
        share = before / (before - now)
        y, z = u[0] + share * (u[2] - u[0]), u[1] + share * (u[3] - u[1])
        speed_y, speed_z = u[4] + share * (u[6] - u[4]), u[5] + share * (u[7] - u[5])
        # The chord lies a little within the arc: the jump is the force just beyond the gap.
        depth, n_y, n_z = _within_wall(bushing, numbers, y, z)
        beyond = 1e-12 * numbers[bushing.reach] - depth
        y, z = y + beyond * n_y, z + beyond * n_z
        jump_y, jump_z = _end_force(bushing, numbers, y, z, speed_y, speed_z, spin, 0.0)
    now_y, now_z = _end_force(bushing, numbers, u[2], u[3], u[6], u[7], spin, 1.0 - share if share >= 0.0 else -1.0)
    out[0], out[1], out[2], out[3] = numbers[bushing.ends], numbers[bushing.ends + BRISTLES], now_y, now_z
    if share >= 0.0:
        rest = 1.0 - share
        out[2] -= 0.5 * share * (now_y - jump_y + share * jump_y)
        out[3] -= 0.5 * share * (now_z - jump_z + share * jump_z)
        out[4], out[5] = 0.5 * rest * rest * jump_y, 0.5 * rest * rest * jump_z
