"""One step of what fills a clearance or of one of its ends, as periodic motions take it; compiled.

The kernel's own functions find stiffness, damping, bristles and films. Here they act along a sampled motion: from one
sample to the next one, whose displacements and velocities are known. In the step in which a contact begins or ends its
force counts for the share in which it acts, at both samples: so the balance follows the motion smoothly, damping that
makes a force begin with a jump included.

A step is given ``u``: displacements before and now, then velocities before and now, of one coordinate or two each. An
end of one coordinate remembers the speed at which its contact began, with the sign of the wall; one of two coordinates
that speed and its bristles' deflection.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..clearance.follower import SLOWEST_IMPACT, end_values, pushing
from ..clearance.kernel import BRISTLES, depth_in, forget, friction_limit, let_go, press, rub, touch
from ..clearance.lanes import signed
from ..clearance.pointers import at, call_law
from ..clearance.record import Bushing
from ..core.jit import STRICT, jit

__all__ = ["ONE", "contact_now", "depth_at", "slot_now", "step_between"]

ONE = (0,)
"""Lane of the kernel."""


@jit(**STRICT)
def _filling_between(
    bushing: Bushing, numbers: np.ndarray, size: int, memory: np.ndarray, u: np.ndarray, spin: float, out: np.ndarray
) -> None:
    """Fill out with what the filling remembers of a step, ``size`` numbers, and its force, N."""
    parameters, state, answer = at(numbers, bushing.filling), at(numbers, bushing.memory), at(numbers, bushing.out)
    offset, preload, step = at(numbers, bushing.offset), at(numbers, bushing.preload), bushing.step
    for k in range(size):
        state[k] = memory[k]
    if bushing.coordinates == 1:  # of what does not remember only the velocity counts
        way = u[1] - u[0] if size else u[3] * step
        call_law(bushing.filling_law, parameters, state, (u[1] + offset[0],), (way,), spin, step, answer)
        out[size] = answer[0] - preload[0] + answer[1] * u[3]
        out[size + 1] = 0.0
    else:
        y, z = (u[2] - u[0], u[3] - u[1]) if size else (u[6] * step, u[7] * step)
        place = (u[2] + offset[0], u[3] + offset[1])
        call_law(bushing.filling_law, parameters, state, place, (y, z), spin, step, answer)
        out[size] = answer[0] - preload[0] + answer[2] * u[6] + answer[3] * u[7]
        out[size + 1] = answer[1] - preload[1] + answer[4] * u[6] + answer[5] * u[7]
        out[size + 2] = out[size + 3] = 0.0
    for k in range(size):
        out[k] = state[k]


@jit(inline="always")
def slot_now(law: int, parameters: Any, answer: Any, pulls: bool, depth: float, inwards: float, impact: float) -> float:
    """Return the force of an end of one coordinate at a depth in its wall, N; an impact of 0 begins now."""
    begun = impact if impact > 0.0 else max(inwards, SLOWEST_IMPACT)
    k, c = end_values(law, parameters, answer, depth, inwards, begun)
    return pushing(k * depth + c * inwards, pulls)


@jit(**STRICT, forceinline=True)
def _within_wall(bushing: Bushing, numbers: np.ndarray, y: float, z: float) -> tuple[float, float, float]:
    """Return how deep a point is in the wall, m, below 0 in the gap, and the direction n along y and z."""
    out = at(numbers, bushing.out)
    if bushing.coordinates == 1:  # what slides along the wall, and what presses
        r = (0.0, z + numbers[bushing.offset])
    else:
        r = (y + numbers[bushing.offset], z + numbers[bushing.offset + 1])
    call_law(bushing.wall_law, at(numbers, bushing.wall), r, out)
    return out[0], out[1], out[2]


@jit(**STRICT)
def depth_at(bushing: Bushing, numbers: np.ndarray, y: float, z: float) -> float:
    """Return how deep an end at y, z is in its wall, m; below 0 in the gap. One coordinate alone is z."""
    if bushing.touching == 1:
        return max(z - numbers[bushing.wall + 1], numbers[bushing.wall] - z)
    return _within_wall(bushing, numbers, y, z)[0]


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
        let_go(bushing, numbers, 0, limit, ONE)
        force_y -= rubbed * n_z
        force_z += rubbed * n_y
    return force_y, force_z


@jit(**STRICT, forceinline=True)
def _slot_force(bushing: Bushing, numbers: np.ndarray, x: float, speed: float) -> float:
    """Force of end 0 of one coordinate against its displacement, N."""
    g = depth_in(bushing, numbers, x, ONE)
    if g == 0.0:
        forget(bushing, numbers, 0, ONE)
        return 0.0
    k, c = press(bushing, numbers, 0, g, speed, ONE)
    return signed(pushing(k * abs(g) + c * signed(speed, g), bushing.adhesion), g)


@jit(**STRICT, forceinline=True)
def _at_wall(bushing: Bushing, numbers: np.ndarray, inwards: float, impact: float) -> float:
    """Force of an end that just touches, N: that of its damping."""
    _, c = end_values(bushing.contact_law, at(numbers, bushing.contact), at(numbers, bushing.out), 0.0, inwards, impact)
    return pushing(c * inwards, bushing.adhesion)


@jit(**STRICT)
def contact_now(
    bushing: Bushing, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, spin: float, out: np.ndarray
) -> None:
    """Fill out with the force now of an end along y and z that touched before, too: its memory does not change."""
    _recall(bushing, numbers, memory, u[0], u[1])
    out[0], out[1] = _end_force(bushing, numbers, u[2], u[3], u[6], u[7], spin, -1.0)


@jit(**STRICT, forceinline=True)
def _recall(bushing: Bushing, numbers: np.ndarray, memory: np.ndarray, y: float, z: float) -> float:
    """Let end 0 be in the contact that it remembers, at y, z; return how deep it is there."""
    depth, n_y, n_z = _within_wall(bushing, numbers, y, z)
    end = at(numbers, bushing.ends)
    if depth > 0.0:
        end[0], end[BRISTLES] = memory[0], memory[1]
        end[1], end[2], end[4], end[5] = n_y, n_z, y, z
    else:
        end[0] = 0.0
    return depth


@jit(**STRICT)
def _slot_between(bushing: Bushing, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, out: np.ndarray) -> None:
    """Fill out as `_round_between`, of one coordinate."""
    lower, upper = numbers[bushing.wall], numbers[bushing.wall + 1]
    was, now = depth_in(bushing, numbers, u[0], ONE), depth_in(bushing, numbers, u[1], ONE)
    out[0] = out[1] = out[2] = 0.0
    lasts = was * now > 0.0
    numbers[bushing.ends] = memory[0]
    if was != 0.0 and not lasts:
        share = ((upper if was > 0.0 else lower) - u[0]) / (u[1] - u[0])
        last = signed(_slot_force(bushing, numbers, u[0], u[2]), was)
        inwards = signed(u[2] + share * (u[3] - u[2]), was)
        jump = _at_wall(bushing, numbers, inwards, abs(numbers[bushing.ends])) if bushing.adhesion else 0.0
        rest = 1.0 - share
        out[2] = -signed(0.5 * rest * (last - share * jump), was)
        out[1] = signed(0.5 * share * share * jump, was)
    if now == 0.0:
        return
    if lasts:
        out[1] = _slot_force(bushing, numbers, u[1], u[3])
    else:
        share = ((upper if now > 0.0 else lower) - u[0]) / (u[1] - u[0])
        numbers[bushing.ends] = 0.0
        met = u[2] + share * (u[3] - u[2])
        press(bushing, numbers, 0, now, met, ONE)  # begins the contact at the speed at which the wall is met
        jump = _at_wall(bushing, numbers, signed(met, now), abs(numbers[bushing.ends]))
        force, rest = signed(_slot_force(bushing, numbers, u[1], u[3]), now), 1.0 - share
        out[1] += signed(force - 0.5 * share * (force - jump + share * jump), now)
        out[2] += signed(0.5 * rest * rest * jump, now)
    out[0] = numbers[bushing.ends]


@jit(**STRICT, forceinline=True)
def _met(
    bushing: Bushing, numbers: np.ndarray, u: np.ndarray, share: float, spin: float, begins: float
) -> tuple[float, float]:
    """Force along y and z where an end passes the wall at a share of a step, N; ``begins`` as of `_end_force`."""
    y, z = u[0] + share * (u[2] - u[0]), u[1] + share * (u[3] - u[1])
    # The chord lies a little within the arc: the jump is the force just beyond the gap.
    depth, n_y, n_z = _within_wall(bushing, numbers, y, z)
    beyond = 1e-12 * numbers[bushing.reach] - depth
    speed_y, speed_z = u[4] + share * (u[6] - u[4]), u[5] + share * (u[7] - u[5])
    return _end_force(bushing, numbers, y + beyond * n_y, z + beyond * n_z, speed_y, speed_z, spin, begins)


@jit(**STRICT)
def _round_between(
    bushing: Bushing, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, spin: float, out: np.ndarray
) -> None:
    """Fill out with what an end remembers, its force now, N, and what it was more before."""
    before, now = _recall(bushing, numbers, memory, u[0], u[1]), _within_wall(bushing, numbers, u[2], u[3])[0]
    out[0] = out[1] = out[2] = out[3] = out[4] = out[5] = 0.0
    share, jump_y, jump_z = before / (before - now) if (before > 0.0) != (now > 0.0) else -1.0, 0.0, 0.0
    rest = 1.0 - share
    if now <= 0.0:
        if before > 0.0:
            step, bushing.step = bushing.step, 0.0
            last_y, last_z = _end_force(bushing, numbers, u[0], u[1], u[4], u[5], spin, -1.0)
            if bushing.adhesion:
                jump_y, jump_z = _met(bushing, numbers, u, share, spin, -1.0)
            bushing.step = step
            out[2], out[3] = 0.5 * share * share * jump_y, 0.5 * share * share * jump_z
            out[4], out[5] = -0.5 * rest * (last_y - share * jump_y), -0.5 * rest * (last_z - share * jump_z)
        return
    if before <= 0.0:
        jump_y, jump_z = _met(bushing, numbers, u, share, spin, 0.0)
    now_y, now_z = _end_force(bushing, numbers, u[2], u[3], u[6], u[7], spin, 1.0 - share if share >= 0.0 else -1.0)
    out[0], out[1], out[2], out[3] = numbers[bushing.ends], numbers[bushing.ends + BRISTLES], now_y, now_z
    if share >= 0.0:
        out[2] -= 0.5 * share * (now_y - jump_y + share * jump_y)
        out[3] -= 0.5 * share * (now_z - jump_z + share * jump_z)
        out[4], out[5] = 0.5 * rest * rest * jump_y, 0.5 * rest * rest * jump_z


@jit(**STRICT, forceinline=True)
def step_between(
    bushing: Bushing, numbers: np.ndarray, contact: bool, size: int, memory: np.ndarray, u: np.ndarray, spin: float,
    out: np.ndarray,
) -> None:  # fmt: skip
    """Fill out with memory, force now and what is added to the force before, of one step of filling or end."""
    if not contact:
        _filling_between(bushing, numbers, size, memory, u, spin, out)
    elif bushing.touching == 1:
        _slot_between(bushing, numbers, memory, u, out)
    else:
        _round_between(bushing, numbers, memory, u, spin, out)
