"""Derivatives of the forces of one step of a filling or an end of a clearance, and their storage; compiled.

They are difference quotients with respect to the motion at the same sample, to the memory, and, where a contact begins
or ends, to the motion at both samples of the step.
"""

from __future__ import annotations

import numpy as np

from ..clearance.kernel import depth_in, touch
from ..clearance.pointers import at
from ..clearance.record import ClearanceRecord
from ..core.jit import STRICT, jit
from .elements import ONE, contact_now, slot_now, step_between

__all__ = ["add_event", "add_rows", "carry", "differences", "fill_lasting", "keep", "keep_lasting", "side_of"]


@jit(**STRICT)
def side_of(bushing: ClearanceRecord, numbers: np.ndarray, y: float, z: float) -> int:
    """Return the wall that an end at y, z touches: 1, of one coordinate -1 for the lower one, or 0 in the gap."""
    if bushing.touching == 2:
        return 1 if touch(bushing, numbers, y, z, ONE)[0] > 0.0 else 0
    g = depth_in(bushing, numbers, z, ONE)
    return 1 if g > 0.0 else -1 if g < 0.0 else 0


@jit(**STRICT)
def _passes(bushing: ClearanceRecord, numbers: np.ndarray, u: np.ndarray, width: int, d: int, change: float) -> bool:
    """Return True if a change of displacement d of a step moves a sample across the wall."""
    first = width * (d // width)
    y, z = u[first], u[first + width - 1]
    was = side_of(bushing, numbers, y, z)
    if d == first + width - 1:
        z += change
    else:
        y += change
    return side_of(bushing, numbers, y, z) != was


@jit(**STRICT)
def differences(
    bushing: ClearanceRecord, numbers: np.ndarray, contact: bool, width: int, offset: int, size: int,
    memory: np.ndarray, u: np.ndarray, omega: float, spin: float, eps: float, now: np.ndarray, moved: np.ndarray,
    slope: np.ndarray, whole: bool,
) -> None:  # fmt: skip
    """Fill slope (offset + 2 w, offset + 4 w): derivatives of a step by its memory of ``size`` numbers and its inputs.

    If not ``whole``, by displacements and velocities now alone.
    """
    quicker, answers = eps * omega, offset + 2 * width
    if not contact:  # its damping is known from the call; velocities before do not count
        for k in range(width):
            for d in range(width):
                slope[offset + k, offset + 3 * width + d] = numbers[bushing.out + width + width * k + d]
    for d in range(size):
        original, change = memory[d], quicker if contact and d == 0 else eps
        memory[d] = original + change
        step_between(bushing, numbers, contact, size, memory, u, spin, moved)
        memory[d] = original
        for k in range(answers):
            slope[k, d] = (moved[k] - now[k]) / change
    for d in range(0 if whole else width, 4 * width if contact or not size else 2 * width):
        if 2 * width <= d < 3 * width and not (whole and contact):
            continue
        original, change = u[d], quicker if d >= 2 * width else eps
        joint = whole and width <= d < 2 * width  # both displacements: where nothing moves, a step forgets exactly
        if contact and d < 2 * width:
            passes = _passes(bushing, numbers, u, width, d, change)
            if passes or (joint and _passes(bushing, numbers, u, width, d - width, change)):
                change = -change  # a sample stays on its side of the wall
        u[d] = original + change
        before = 0.0
        if joint:
            before = u[d - width]
            u[d - width] = before + change
        step_between(bushing, numbers, contact, size, memory, u, spin, moved)
        u[d] = original
        if joint:
            u[d - width] = before
        for k in range(answers):
            slope[k, offset + d] = (moved[k] - now[k]) / change - (slope[k, offset + d - width] if joint else 0.0)


@jit(**STRICT)
def add_rows(
    slope: np.ndarray, row: int, width: int, size: int, omega: float, basis: np.ndarray, rate: np.ndarray, last: int,
    i: int, carried: np.ndarray, out: np.ndarray, to: int,
) -> None:  # fmt: skip
    """Add a row of derivatives, by harmonics of the coordinates, to out (2, n, K) at one of n."""
    harmonics = basis.shape[1]
    for d in range(width):
        a, b = slope[row, size + d], slope[row, size + width + d]
        c, e = omega * slope[row, size + 2 * width + d], omega * slope[row, size + 3 * width + d]
        if a != 0.0 or b != 0.0:
            for r in range(harmonics):
                out[d, to, r] += a * basis[last, r] + b * basis[i, r]
        if c != 0.0 or e != 0.0:
            for r in range(harmonics):
                out[d, to, r] += c * rate[last, r] + e * rate[i, r]
    for k in range(size):
        slope_k = slope[row, k]
        if slope_k != 0.0:
            for d in range(width):
                for r in range(harmonics):
                    out[d, to, r] += slope_k * carried[d, k, r]


@jit(**STRICT)
def fill_lasting(
    bushing: ClearanceRecord, numbers: np.ndarray, width: int, size: int, memory: np.ndarray, u: np.ndarray,
    omega: float, spin: float, eps: float, differs: bool, now: np.ndarray, moved: np.ndarray, by_place: np.ndarray,
    by_speed: np.ndarray, by_impact: np.ndarray, i: int,
) -> None:  # fmt: skip
    """Compute the force of an end whose memory does not change in a step, and its derivatives."""
    if width == 1:
        law, pulls = bushing.contact_law, bushing.adhesion
        parameters, answer = at(numbers, bushing.contact), at(numbers, bushing.out)
        above, below = u[1] - numbers[bushing.wall + 1], numbers[bushing.wall] - u[1]
        side, depth, impact = (1.0, above, memory[0]) if above > 0.0 else (-1.0, below, -memory[0])
        inwards = side * u[3]
        force = slot_now(law, parameters, answer, pulls, depth, inwards, impact)
        now[0] = side * force
        if differs:
            quick = eps * omega
            by_place[0, 0, i] = (slot_now(law, parameters, answer, pulls, depth + eps, inwards, impact) - force) / eps
            faster = slot_now(law, parameters, answer, pulls, depth, inwards + quick, impact)
            by_speed[0, 0, i] = (faster - force) / quick
            if size:
                faster = slot_now(law, parameters, answer, pulls, depth, inwards, impact + quick)
                by_impact[0] = (faster - force) / quick
        return
    contact_now(bushing, numbers, memory, u, spin, now)
    if not differs:
        return
    for d in range(2):
        original = u[2 + d]
        u[2 + d] = original + eps
        contact_now(bushing, numbers, memory, u, spin, moved)
        u[2 + d] = original
        for k in range(2):
            by_place[k, d, i] = (moved[k] - now[k]) / eps
        original = u[6 + d]
        u[6 + d] = original + eps * omega
        contact_now(bushing, numbers, memory, u, spin, moved)
        u[6 + d] = original
        for k in range(2):
            by_speed[k, d, i] = (moved[k] - now[k]) / (eps * omega)
    if size:
        original = memory[0]
        memory[0] = original + eps * omega
        contact_now(bushing, numbers, memory, u, spin, moved)
        memory[0] = original
        for k in range(2):
            by_impact[k] = (moved[k] - now[k]) / (eps * omega)


@jit(**STRICT)
def keep_lasting(
    width: int, by_place: np.ndarray, by_speed: np.ndarray, by_impact: np.ndarray, steps: np.ndarray, i: int,
    project: np.ndarray, weights: np.ndarray,
) -> None:  # fmt: skip
    """Store derivatives of step i, in which the memory of an end does not change.

    ``weights`` (2, K) gets the derivative of the force's harmonics by the speed at which its contact began.
    """
    _, rows, columns = steps.shape
    steps[i] = 0.0
    forces, inputs = rows - width, columns - 4 * width
    for k in range(width):
        steps[i, k, k], steps[i, forces + k, 0] = 1.0, by_impact[k]
        for d in range(width):
            steps[i, forces + k, inputs + width + d] = by_place[k, d, i]
            steps[i, forces + k, inputs + 3 * width + d] = by_speed[k, d, i]
        for r in range(project.shape[0]):
            weights[k, r] += by_impact[k] * project[r, i]


@jit(**STRICT)
def add_event(
    slope: np.ndarray, width: int, offset: int, size: int, by_place: np.ndarray, by_speed: np.ndarray,
    is_carried: np.ndarray, steps: np.ndarray, last: int, i: int, project: np.ndarray, weights: np.ndarray,
) -> None:  # fmt: skip
    """Add derivatives of the forces of a step in which a contact begins or ends to those at both samples.

    The change of both forces with a displacement acts at its sample: so a spring without damping takes no energy.
    """
    _, rows, columns = steps.shape
    forces, inputs = rows - width, columns - 4 * width
    for a in range(width):
        first, second = offset + a, offset + width + a
        for b in range(width):
            was = offset + b
            before = slope[first, was] + slope[second, was]
            faster = slope[first, was + 2 * width] + slope[second, was + 2 * width]
            by_place[a, b, last] += before
            by_speed[a, b, last] += faster
            by_place[a, b, i] += slope[first, was + width] + slope[second, was + width]
            by_speed[a, b, i] += slope[first, was + 3 * width] + slope[second, was + 3 * width]
            if size:
                steps[i, forces + a, inputs + b] = steps[i, forces + a, inputs + 2 * width + b] = 0.0
                if is_carried[last]:
                    steps[last, forces + a, inputs + width + b] += before
                    steps[last, forces + a, inputs + 3 * width + b] += faster
        if size:
            for r in range(project.shape[0]):
                weights[a, r] += slope[first, 0] * project[r, i] + slope[second, 0] * project[r, last]


@jit(**STRICT)
def carry(
    onto: np.ndarray, of_force: np.ndarray, width: int, used: int, weights: np.ndarray, carried: np.ndarray
) -> int:
    """Add the derivatives by the speed at which a contact began to the carried ones, for all of its samples at once."""
    for k in range(width):
        acts = False
        for r in range(weights.shape[1]):
            acts = acts or weights[k, r] != 0.0
            onto[used, r] = weights[k, r]
            weights[k, r] = 0.0
        if acts:
            for d in range(width):
                for other in range(width):
                    for r in range(weights.shape[1]):
                        of_force[other, d, used, r] = carried[d, 0, r] if other == k else 0.0
            used += 1
    return used


@jit(**STRICT)
def keep(slope: np.ndarray, width: int, size: int, steps: np.ndarray, i: int) -> None:
    """Store derivatives of memory and of the whole force of step i."""
    _, rows, columns = steps.shape
    for k in range(size + width):
        row = k if k < size else rows - width + k - size
        for d in range(size + 4 * width):
            column = d if d < size else columns - 4 * width + d - size
            steps[i, row, column] = slope[k, d] + (slope[k + width, d] if k >= size else 0.0)
