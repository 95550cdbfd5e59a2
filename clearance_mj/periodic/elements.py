"""Force of a filling or of one end of a clearance over one sampling step of a periodic motion; compiled.

The kernel's functions compute stiffness, damping, bristles and films. Here they act along a sampled motion: from one
sample to the next one, whose displacements and velocities are known. In the step in which a contact begins or ends its
force counts for the fraction in which it acts, at both samples: so the balance depends smoothly on the motion, even
where damping makes the force begin with a jump.

A step takes ``u``: displacements before and now, then velocities before and now, of one coordinate or two each. An
end of one coordinate remembers the speed at which its contact began, with the sign of the wall; one of two coordinates
that speed and its bristles' deflection.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..clearance.follower import SLOWEST_IMPACT, end_values, pushing
from ..clearance.kernel import BRISTLES, depth_in, forget, friction_force, friction_limit, limit_bristles, press, touch
from ..clearance.lanes import signed
from ..clearance.pointers import at, call_law
from ..clearance.record import ClearanceRecord
from ..core.jit import STRICT, jit

__all__ = ["ONE", "contact_now", "depth_at", "slot_now", "step_between"]

ONE = (0,)
"""Lane of the kernel."""


@jit(**STRICT)
def _filling_step(
    bushing: ClearanceRecord, numbers: np.ndarray, size: int, memory: np.ndarray, u: np.ndarray, spin: float,
    out: np.ndarray,
) -> None:  # fmt: skip
    """Fill out with the filling's memory after a step, ``size`` numbers, and its force, N."""
    parameters, state, answer = at(numbers, bushing.filling), at(numbers, bushing.memory), at(numbers, bushing.out)
    offset, preload, step = at(numbers, bushing.offset), at(numbers, bushing.preload), bushing.step
    for k in range(size):
        state[k] = memory[k]
    if bushing.coordinates == 1:  # without memory only the velocity counts
        move = u[1] - u[0] if size else u[3] * step
        call_law(bushing.filling_law, parameters, state, (u[1] + offset[0],), (move,), spin, step, answer)
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
    """Return the contact force of an end of one coordinate at a penetration, N; an impact of 0 begins now."""
    begun = impact if impact > 0.0 else max(inwards, SLOWEST_IMPACT)
    k, c = end_values(law, parameters, answer, depth, inwards, begun)
    return pushing(k * depth + c * inwards, pulls)


@jit(**STRICT, forceinline=True)
def _penetration(bushing: ClearanceRecord, numbers: np.ndarray, y: float, z: float) -> tuple[float, float, float]:
    """Return a point's penetration, m, below 0 in the gap, and the wall's normal along y and z."""
    out = at(numbers, bushing.out)
    if bushing.coordinates == 1:  # what slides along the wall, and what presses
        r = (0.0, z + numbers[bushing.offset])
    else:
        r = (y + numbers[bushing.offset], z + numbers[bushing.offset + 1])
    call_law(bushing.wall_law, at(numbers, bushing.wall), r, out)
    return out[0], out[1], out[2]


@jit(**STRICT)
def depth_at(bushing: ClearanceRecord, numbers: np.ndarray, y: float, z: float) -> float:
    """Return the penetration of an end at y, z, m; below 0 in the gap. A single coordinate is z."""
    if bushing.touching == 1:
        return max(z - numbers[bushing.wall + 1], numbers[bushing.wall] - z)
    return _penetration(bushing, numbers, y, z)[0]


@jit(**STRICT, forceinline=True)
def _end_force(
    bushing: ClearanceRecord, numbers: np.ndarray, y: float, z: float, speed_y: float, speed_z: float, spin: float,
    tau: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the force of end 0 along y and z against the displacement, N.

    Bristles of a contact that begins slip during the fraction ``tau`` of the step; below 0 it began before.
    """
    depth, n_y, n_z = touch(bushing, numbers, y, z, ONE)
    if depth == 0.0:
        forget(bushing, numbers, 0, ONE)
        return 0.0, 0.0
    k, c, bristles = friction_force(bushing, numbers, 0, depth, n_y, n_z, y, z, speed_y, speed_z, spin, ONE)
    normal = pushing(k * depth + c * (n_y * speed_y + n_z * speed_z), bushing.adhesion)
    force_y, force_z = normal * n_y, normal * n_z
    if bushing.rubs:
        sliding = n_y * speed_z - n_z * speed_y + numbers[bushing.friction + 5] * spin
        if tau >= 0.0:
            bristles = tau * bushing.step * sliding
            numbers[bushing.ends + BRISTLES] = bristles
        rubbed = numbers[bushing.friction + 1] * bristles + numbers[bushing.friction + 2] * sliding
        limit = friction_limit(bushing, numbers, max(normal, 0.0), sliding, ONE)
        rubbed = min(max(rubbed, -limit), limit)
        limit_bristles(bushing, numbers, 0, limit, ONE)
        force_y -= rubbed * n_z
        force_z += rubbed * n_y
    return force_y, force_z


@jit(**STRICT, forceinline=True)
def _slot_force(bushing: ClearanceRecord, numbers: np.ndarray, x: float, speed: float) -> float:
    """Return the force of end 0 of one coordinate against its displacement, N."""
    g = depth_in(bushing, numbers, x, ONE)
    if g == 0.0:
        forget(bushing, numbers, 0, ONE)
        return 0.0
    k, c = press(bushing, numbers, 0, g, speed, ONE)
    return signed(pushing(k * abs(g) + c * signed(speed, g), bushing.adhesion), g)


@jit(**STRICT, forceinline=True)
def _grazing_force(bushing: ClearanceRecord, numbers: np.ndarray, inwards: float, impact: float) -> float:
    """Return the force of an end that just touches, N: that of its damping."""
    _, c = end_values(bushing.contact_law, at(numbers, bushing.contact), at(numbers, bushing.out), 0.0, inwards, impact)
    return pushing(c * inwards, bushing.adhesion)


@jit(**STRICT)
def contact_now(
    bushing: ClearanceRecord, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, spin: float, out: np.ndarray
) -> None:
    """Fill out with the force now of an end along y and z in lasting contact: its memory does not change."""
    _restore_contact(bushing, numbers, memory, u[0], u[1])
    out[0], out[1] = _end_force(bushing, numbers, u[2], u[3], u[6], u[7], spin, -1.0)


@jit(**STRICT, forceinline=True)
def _restore_contact(bushing: ClearanceRecord, numbers: np.ndarray, memory: np.ndarray, y: float, z: float) -> float:
    """Restore the contact of end 0 at y, z from its memory; return its penetration."""
    depth, n_y, n_z = _penetration(bushing, numbers, y, z)
    end = at(numbers, bushing.ends)
    if depth > 0.0:
        end[0], end[BRISTLES] = memory[0], memory[1]
        end[1], end[2], end[4], end[5] = n_y, n_z, y, z
    else:
        end[0] = 0.0
    return depth


@jit(**STRICT)
def _slot_step(
    bushing: ClearanceRecord, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, out: np.ndarray
) -> None:
    """Fill out as `_round_step` does, for one coordinate."""
    lower, upper = numbers[bushing.wall], numbers[bushing.wall + 1]
    was, now = depth_in(bushing, numbers, u[0], ONE), depth_in(bushing, numbers, u[1], ONE)
    out[0] = out[1] = out[2] = 0.0
    lasts = was * now > 0.0
    numbers[bushing.ends] = memory[0]
    if was != 0.0 and not lasts:
        tau = ((upper if was > 0.0 else lower) - u[0]) / (u[1] - u[0])
        last = signed(_slot_force(bushing, numbers, u[0], u[2]), was)
        inwards = signed(u[2] + tau * (u[3] - u[2]), was)
        jump = _grazing_force(bushing, numbers, inwards, abs(numbers[bushing.ends])) if bushing.adhesion else 0.0
        remain = 1.0 - tau
        out[2] = -signed(0.5 * remain * (last - tau * jump), was)
        out[1] = signed(0.5 * tau * tau * jump, was)
    if now == 0.0:
        return
    if lasts:
        out[1] = _slot_force(bushing, numbers, u[1], u[3])
    else:
        tau = ((upper if now > 0.0 else lower) - u[0]) / (u[1] - u[0])
        numbers[bushing.ends] = 0.0
        speed = u[2] + tau * (u[3] - u[2])
        press(bushing, numbers, 0, now, speed, ONE)  # begins the contact at the speed at which the wall is met
        jump = _grazing_force(bushing, numbers, signed(speed, now), abs(numbers[bushing.ends]))
        force, remain = signed(_slot_force(bushing, numbers, u[1], u[3]), now), 1.0 - tau
        out[1] += signed(force - 0.5 * tau * (force - jump + tau * jump), now)
        out[2] += signed(0.5 * remain * remain * jump, now)
    out[0] = numbers[bushing.ends]


@jit(**STRICT, forceinline=True)
def _wall_force(
    bushing: ClearanceRecord, numbers: np.ndarray, u: np.ndarray, tau: float, spin: float, begins: float
) -> tuple[float, float]:
    """Return the force along y and z where an end passes the wall at a fraction of a step, N.

    ``begins`` is the fraction of `_end_force`.
    """
    y, z = u[0] + tau * (u[2] - u[0]), u[1] + tau * (u[3] - u[1])
    # The chord lies a little within the arc: the jump is the force just beyond the gap.
    depth, n_y, n_z = _penetration(bushing, numbers, y, z)
    beyond = 1e-12 * numbers[bushing.reach] - depth
    speed_y, speed_z = u[4] + tau * (u[6] - u[4]), u[5] + tau * (u[7] - u[5])
    return _end_force(bushing, numbers, y + beyond * n_y, z + beyond * n_z, speed_y, speed_z, spin, begins)


@jit(**STRICT)
def _round_step(
    bushing: ClearanceRecord, numbers: np.ndarray, memory: np.ndarray, u: np.ndarray, spin: float, out: np.ndarray
) -> None:
    """Fill out with an end's memory, its force now, N, and the correction of its force before."""
    before, now = _restore_contact(bushing, numbers, memory, u[0], u[1]), _penetration(bushing, numbers, u[2], u[3])[0]
    out[0] = out[1] = out[2] = out[3] = out[4] = out[5] = 0.0
    tau, jump_y, jump_z = before / (before - now) if (before > 0.0) != (now > 0.0) else -1.0, 0.0, 0.0
    remain = 1.0 - tau
    if now <= 0.0:
        if before > 0.0:
            step, bushing.step = bushing.step, 0.0
            last_y, last_z = _end_force(bushing, numbers, u[0], u[1], u[4], u[5], spin, -1.0)
            if bushing.adhesion:
                jump_y, jump_z = _wall_force(bushing, numbers, u, tau, spin, -1.0)
            bushing.step = step
            out[2], out[3] = 0.5 * tau * tau * jump_y, 0.5 * tau * tau * jump_z
            out[4], out[5] = (-0.5 * remain * (last_y - tau * jump_y), -0.5 * remain * (last_z - tau * jump_z))
        return
    if before <= 0.0:
        jump_y, jump_z = _wall_force(bushing, numbers, u, tau, spin, 0.0)
    now_y, now_z = _end_force(bushing, numbers, u[2], u[3], u[6], u[7], spin, 1.0 - tau if tau >= 0.0 else -1.0)
    out[0], out[1], out[2], out[3] = numbers[bushing.ends], numbers[bushing.ends + BRISTLES], now_y, now_z
    if tau >= 0.0:
        out[2] -= 0.5 * tau * (now_y - jump_y + tau * jump_y)
        out[3] -= 0.5 * tau * (now_z - jump_z + tau * jump_z)
        out[4], out[5] = 0.5 * remain * remain * jump_y, 0.5 * remain * remain * jump_z


@jit(**STRICT, forceinline=True)
def step_between(
    bushing: ClearanceRecord, numbers: np.ndarray, contact: bool, size: int, memory: np.ndarray, u: np.ndarray,
    spin: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Fill out with memory, force now and correction of the force before, for one step of a filling or an end."""
    if not contact:
        _filling_step(bushing, numbers, size, memory, u, spin, out)
    elif bushing.touching == 1:
        _slot_step(bushing, numbers, memory, u, out)
    else:
        _round_step(bushing, numbers, memory, u, spin, out)
