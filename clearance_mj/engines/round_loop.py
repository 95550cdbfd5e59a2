"""The compiled loop of the modal engine in space: two bending planes, round clearances, a shaft that turns."""

from __future__ import annotations

import numpy as np

from ..clearance.kernel import follow_law
from ..clearance.lanes import load, spread, store
from ..clearance.pointers import at
from ..clearance.round_kernel import (
    BRISTLES,
    END_MEMORY,
    RoundBushing,
    RoundClearance,
    keep_step,
    round_contact,
    round_filling,
)
from ..core.jit import OPTIONS, inlined, jit
from .lane_modes import move_modes, read_motion
from .round_energies import step_energies
from .round_points import fill, gives, push, rub
from .round_scheme import ANGLE, FOUR, ONE, SPIN, RoundForces, RoundMotion, RoundShaft, dot

__all__ = ["advance_round", "interact", "touch"]


@jit(**OPTIONS)
def advance_round(
    steps: int, excitation: np.ndarray, h: float, shaft: RoundShaft, coupling: np.ndarray, drive: np.ndarray,
    motion: RoundMotion, clearance: RoundClearance, out: np.ndarray, first: int, works: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Advance the state by all steps; return (step, bushing) of a divergence, or -1, -1.

    ``excitation``: (n, n_inputs).
    ``coupling``: (n, n) damping and gyroscopic moments per velocity in the middle of all other kicks; (0, 0) for none.
    ``drive``: rate of the spin, rad/s², time at which it ends, s, and 1/inertia of what friction slows down.
    ``out``: (columns, n), filled from column ``first`` on with what `Run.advance` returns.
    ``works``: (n, columns) for the energies of `round_energies.py`, filled from row ``first`` on; (0, 0) for none.
    """
    (
        inverse_mass, flow, at_points, spans, at_sensors, of_sensors, shape, base, weight, unbalance, order, orders,
        compliance, circulatory, springs, readings,
    ) = shaft  # fmt: skip
    bushings, states, numbers = clearance
    turning, n, n_sensors, n_points = motion.turning, motion.q.size, at_sensors.shape[0], at_points.shape[0]
    n_bushings, half, size, even = n_points // 3, 0.5 * h, (n + 3) // 4, n_points + n_points % 2
    n_inputs, n_orders = shape.shape[0], order.size
    pushes, state = np.zeros((3 + n_inputs + 2 * n_orders, n)), np.zeros((3, n))
    pushes[0], pushes[1], pushes[2:4] = shape[0], weight, unbalance
    pushes[4 : 3 + n_inputs], pushes[3 + n_inputs :] = shape[1:], orders
    others = np.zeros(n_inputs - 1 + 2 * n_orders)  # what acts beside the first four
    state[0], state[1], state[2] = motion.q, motion.v, motion.q_before
    masses, flows, given = (
        _modes_by_fours(inverse_mass.reshape((1, n)))[0],
        _modes_by_fours(flow),
        _modes_by_fours(pushes),
    )
    along, moving = _modes_by_fours(at_points.reshape((2 * n_points, n))), _modes_by_fours(state)
    room, uncoupled = np.zeros((3, size, 4)), np.zeros((0, 0))
    q, v, q_before = moving[0].reshape(4 * size), moving[1].reshape(4 * size), moving[2].reshape(4 * size)
    total, middle, acceleration = room[0].reshape(4 * size), room[1].reshape(4 * size), room[2].reshape(4 * size)
    own = RoundMotion(q[:n], v[:n], q_before[:n], turning)
    points, sensors = (_rows_by_fours(at_points[:, 0]), _rows_by_fours(at_points[:, 1])), _rows_by_fours(at_sensors)
    low, high = n, 0
    for s in range(n_sensors):
        low, high = min(low, of_sensors[s, 0]), max(high, of_sensors[s, 1])
    x, w, force = np.zeros((even, 2)), np.zeros((even, 2)), np.zeros((even, 2))
    of_plane, read, ends = np.zeros(4 * len(points[0])), np.zeros(4 * len(sensors)), np.zeros((n_points, 8))
    filling, acts = np.zeros((n_bushings, 6)), np.ones(n_points, np.bool_)
    for i in range(excitation.shape[0]):
        a, spin, angle = excitation[i, 0], turning[SPIN], turning[ANGLE]
        rate = drive[0] if (steps + i) * h < drive[1] else 0.0
        cos, sin = 0.0, 0.0
        if spin != 0.0 or rate != 0.0:
            c, s = np.cos(angle), np.sin(angle)
            cos, sin = spin * spin * c + rate * s, spin * spin * s - rate * c
        for m in range(size):
            now = load(given, m, FOUR) * a + load(given, size + m, FOUR)
            now += load(given, 2 * size + m, FOUR) * cos + load(given, 3 * size + m, FOUR) * sin
            store(total, m, now, FOUR)
        for r in range(1, n_inputs):
            others[r - 1] = excitation[i, r]
        for k in range(n_orders):
            others[n_inputs - 1 + 2 * k] = np.cos(order[k] * angle)
            others[n_inputs + 2 * k] = np.sin(order[k] * angle)
        for r in range(others.size):
            for m in range(size):
                store(total, m, load(total, m, FOUR) + load(given, (4 + r) * size + m, FOUR) * others[r], FOUR)
        if circulatory.size and spin != 0.0:
            for m in range(n):
                total[m] -= spin * dot(circulatory, m * n, q, 0, n)
        if springs.size:
            for m in range(n):
                total[m] -= dot(springs, m * n, q, 0, n)
        for m in range(size):
            kick = half * load(masses, m, FOUR) * load(total, m, FOUR)
            store(middle, m, load(v, m, FOUR) + kick, FOUR)
        for d in range(2):
            _times(points[d], spans[d, 0], spans[d, 1], q, of_plane)
            for p in range(n_points):
                x[p, d] = of_plane[p]
            _times(points[d], spans[d, 0], spans[d, 1], middle, of_plane)
            for p in range(n_points):
                w[p, d], force[p, d] = of_plane[p], 0.0
        for j in range(n_bushings):
            if not abs(x[j, 0]) + abs(x[j, 1]) < 1e3 * bushings[j].gap + 1.0:
                return i, j
            if works.size:
                keep_step(bushings[j], states[j], numbers)
            touch(bushings[j], n_bushings + 2 * j, x, acts)
        torque = interact(
            bushings, states, numbers, compliance, half, spin, (steps + i) * h, x, acts, w, force, ends, filling
        )
        for p in range(n_points):
            if acts[p]:
                y, z = force[p]
                for m in range(size):
                    taken = load(along, 2 * p * size + m, FOUR) * y + load(along, (2 * p + 1) * size + m, FOUR) * z
                    store(total, m, load(total, m, FOUR) - taken, FOUR)
        if coupling.size:  # at the velocity in the middle of the kick of all other forces
            for m in range(n):
                middle[m] = v[m] + half * inverse_mass[m] * total[m]
            for m in range(n):
                total[m] -= dot(coupling, m * n, middle, 0, n)
        if works.size:
            drawn = RoundForces(x, force, ends, filling, acts)
            step_energies(
                works[first + i], excitation[i], cos, sin, others, spin, h, shaft, own, total[:n], middle[:n], bushings,
                states, numbers, drawn,
            )  # fmt: skip
        move_modes(h, FOUR, masses, flows, uncoupled, moving[0], moving[1], moving[2], room[0], room[1], room[2])
        change = h * (rate - drive[2] * torque)
        turning[SPIN], turning[ANGLE] = spin + change, angle + h * (spin + 0.5 * change)
        _times(sensors, low, high, acceleration, read)
        _report(excitation[i], first + i, n_sensors, read, base, x, force, acts, out)
        if readings.shape[0]:
            read_motion(h, ONE, readings, q, q_before[:n], acceleration, middle, first + i, out)
        if out.shape[0] > n_sensors + 7 * n_bushings:
            out[n_sensors + 7 * n_bushings, first + i] = spin
    motion.q[:], motion.v[:], motion.q_before[:] = q[:n], v[:n], q_before[:n]
    for m in range(n):  # without bushings nothing else would stop it
        if not abs(q[m]) < np.inf:
            return excitation.shape[0], 0
    return -1, -1


@jit(**OPTIONS)
def _modes_by_fours(rows: np.ndarray) -> np.ndarray:
    """Return rows (n_rows, n) as (n_rows, n/4, 4); modes that are added have no mass, no stiffness and no shape."""
    count, n = rows.shape
    found = np.zeros((count, (n + 3) // 4, 4))
    for r in range(count):
        for m in range(n):
            found[r, m // 4, m % 4] = rows[r, m]
    return found


@jit(**OPTIONS)
def _rows_by_fours(rows: np.ndarray) -> np.ndarray:
    """Return rows (n_rows, n) as (n_rows/4, n, 4), with zeros where no row is left."""
    found = np.zeros(((rows.shape[0] + 3) // 4, rows.shape[1], 4))
    for r in range(rows.shape[0]):
        found[r // 4, :, r % 4] = rows[r]
    return found


@inlined
def _times(rows: np.ndarray, start: int, stop: int, vector: np.ndarray, out: np.ndarray) -> None:
    """Fill in the products of rows, four by four, and a vector, between two of its numbers."""
    n, values = rows.shape[1], at(vector, 0)
    for c in range(rows.shape[0]):
        found = spread(0.0, FOUR)
        for m in range(start, stop):
            found += load(rows, c * n + m, FOUR) * values[m]
        store(out, c, found, FOUR)


@inlined
def touch(bushing: RoundBushing, first: int, x: np.ndarray, acts: np.ndarray) -> None:
    """Fill in whether both ends of a bushing, which are points ``first`` and the next one, touch."""
    for p in range(first, first + 2):
        y, z = x[p, 0] + bushing.offset_y, x[p, 1] + bushing.offset_z
        acts[p] = y * y + z * z > bushing.gap * bushing.gap


@inlined
def interact(
    bushings: np.ndarray, states: np.ndarray, numbers: np.ndarray, compliance: np.ndarray, half: float, spin: float,
    time: float, x: np.ndarray, acts: np.ndarray, w: np.ndarray, force: np.ndarray, ends: np.ndarray,
    filling: np.ndarray,
) -> float:  # fmt: skip
    """Find the forces of fillings and contacts of a step; return the torque of friction on the shaft, N m.

    ``acts`` says which points matter: all middles, and the ends that touch. There ``w`` holds the velocities in the
    middle of the kick of all other forces; ``force`` is 0 at first. ``ends`` (n_points, 8) is filled with n along y
    and z, elastic force, damping and bristles, then normal force, friction and its limit.
    """
    n_bushings = len(bushings)
    for j in range(n_bushings):
        bushing, state = bushings[j], states[j]
        y, z = x[j]
        found = round_filling(bushing, state, numbers, y, z, spin)
        for k in range(6):
            filling[j, k] = found[k]
        square = (y + bushing.offset_y) ** 2 + (z + bushing.offset_z) ** 2
        follow_law(bushing, state, numbers, np.sqrt(square), time)
        for end in range(2):
            p = n_bushings + 2 * j + end
            depth, n_y, n_z, stiff, damping, bristles = round_contact(
                bushing, state, numbers, end, x[p, 0], x[p, 1], w[p, 0], w[p, 1], spin
            )
            if acts[p]:
                ends[p, 0], ends[p, 1], ends[p, 2], ends[p, 3], ends[p, 4] = (
                    n_y, n_z, stiff * depth, damping, bristles,
                )  # fmt: skip
                ends[p, 5] = ends[p, 6] = 0.0
    for _ in range(2):  # Gauss-Seidel: every force at the velocity that the other forces leave
        for j in range(n_bushings):
            fill(filling[j], compliance, half, j, w, force)
        for j in range(n_bushings):
            for end in range(2):
                p = n_bushings + 2 * j + end
                if acts[p]:
                    _push_off(bushings[j], ends[p], compliance, half, p, spin, w, force)
    torque = 0.0
    for j in range(n_bushings):
        for end in range(2):
            p, bushing = n_bushings + 2 * j + end, bushings[j]
            if acts[p] and bushing.friction > 0.0:
                torque += bushing.radius * ends[p, 6]
                most = ends[p, 7] / bushing.bristle  # beyond it they slide
                at_end = states[j].ends + END_MEMORY * end + BRISTLES
                numbers[at_end] = min(max(ends[p, 4], -most), most)
    return torque


@inlined
def _push_off(
    bushing: RoundBushing, end: np.ndarray, compliance: np.ndarray, half: float, p: int, spin: float, w: np.ndarray,
    force: np.ndarray,
) -> None:  # fmt: skip
    """Find the normal force of a contact, then its friction, at the velocities that they leave."""
    y, z, damping = end[0], end[1], end[3]
    give = half * gives(compliance, p, y, z)
    free = y * w[p, 0] + z * w[p, 1] + give * end[5]
    normal = (end[2] + damping * free) / (1.0 + damping * give)
    if not bushing.adhesion:
        normal = max(normal, 0.0)
    change, end[5] = normal - end[5], normal
    push(compliance, half, p, change * y, change * z, w, force)
    rub(bushing, end, max(normal, 0.0), compliance, half, p, spin, w, force)


@inlined
def _report(
    inputs: np.ndarray, row: int, n_sensors: int, read: np.ndarray, base: np.ndarray, x: np.ndarray, force: np.ndarray,
    acts: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Fill in what `Run.advance` returns of a step."""
    n_bushings = acts.size // 3
    for s in range(n_sensors):
        out[s, row] = base[0, s] * inputs[0] + read[s]
        for r in range(1, inputs.size):
            out[s, row] += base[r, s] * inputs[r]
    for j in range(n_bushings):
        left, right = n_bushings + 2 * j, n_bushings + 2 * j + 1
        for d in range(2):
            column = n_sensors + 2 * j + d
            out[column, row] = x[j, d]
            out[column + 2 * n_bushings, row] = force[left, d] + force[right, d]
            out[column + 4 * n_bushings, row] = force[j, d]
        out[n_sensors + 6 * n_bushings + j, row] = 1.0 if acts[left] or acts[right] else 0.0
