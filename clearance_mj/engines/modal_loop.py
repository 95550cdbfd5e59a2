"""The compiled loop of the modal engine, for one simulation or several side by side; see modal.py.

Every array has the lanes (see lanes.py) as its last axis; the bushings' records stand lane after lane.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..clearance.follower import signed_penetration
from ..clearance.kernel import Clearance, contact_step, follow_law, grease_step
from ..clearance.lane_contacts import LaneContacts, contact_in_lanes, penetration_in_lanes
from ..clearance.lane_greases import LaneGreases, grease_in_lanes
from ..clearance.lanes import all_below, larger, load, spread, store, where_above
from ..core.jit import OPTIONS, jit
from .decimating import BLOCK_SAMPLES, decimate, fill_before, padded_taps
from .lane_modes import move_modes, read_motion

__all__ = ["Motion", "Shaft", "advance", "advance_whole"]


class Shaft(NamedTuple):
    """The linear part of the equations, in modal coordinates."""

    inverse_mass: np.ndarray  # (n,) smaller for high modes, see modal.py
    flow: np.ndarray  # (4, n) exact motion of the free modes over one step: rows q→q, v→q, q→v, v→v
    at_points: np.ndarray  # (3 n_bushings, n) the bushings' middles (grease), then both ends of each (contact)
    at_sensors: np.ndarray  # (n_sensors, n) of accelerometers; zeros of others
    input: np.ndarray  # (n_inputs, n) force on the modes per unit of each input
    base: np.ndarray  # (n_inputs, n_sensors) what sensors read of an input itself: of a base, with which they move
    coupling: np.ndarray  # (n, n) damping per velocity in the middle of all other kicks; (0, 0) where it couples none
    compliance: np.ndarray  # (3 n_bushings, 3 n_bushings) velocity of each point per unit impulse at each other
    at_input: np.ndarray  # (n_inputs, 3 n_bushings) velocity of the points per unit impulse of each input
    springs: np.ndarray = np.zeros((0, 0, 1))  # (n, n) stiffness that is not of the modes; (0, 0) where there is none
    readings: np.ndarray = np.zeros((0, 2, 0, 1))  # (n_sensors, 2, n) as `round_scheme.RoundShaft` has them


class Motion(NamedTuple):
    """Modal coordinates, changed in place."""

    q: np.ndarray  # (n,) now
    v: np.ndarray  # (n,) velocity before the kick
    q_before: np.ndarray  # (n,) a step ago


@jit(**OPTIONS)
def advance(
    steps: int, excitation: np.ndarray, h: float, lanes: tuple[int, ...], shaft: Shaft, motion: Motion,
    clearance: Clearance, greases: LaneGreases, contacts: LaneContacts, out: np.ndarray, first: int,
) -> tuple[int, int]:  # fmt: skip
    """Advance the state by all steps; return (step, record of the bushing) of a divergence, or -1, -1.

    ``excitation``: (n, n_inputs). ``out``: (columns, n, lanes), filled from its row ``first`` on with what
    `Run.advance` returns, the forces of the bushings if there are columns for them.
    """
    inverse_mass, flow, at_points, at_sensors, shape, base, coupling, compliance, at_input, springs, readings = shaft
    q, v, q_before = motion
    bushings, states, numbers = clearance
    grease_law, contact_law = greases.law, contacts.law
    count, n, n_sensors, n_points = len(lanes), q.shape[0], at_sensors.shape[0], at_points.shape[0]
    n_bushings, size = n_points // 3, out.shape[1]
    x, w, force = np.zeros((n_points, count)), np.zeros((n_points, count)), np.zeros((n_points, count))
    elastic, viscous = np.zeros((n_points, count)), np.zeros((n_points, count))
    side, least, share = np.ones((n_points, count)), np.full((n_points, count), -np.inf), np.zeros((n_points, count))
    depth, limit = np.zeros((n_points, count)), np.zeros((n_bushings, count))
    lower, upper = np.zeros((n_bushings, count)), np.zeros((n_bushings, count))
    for j in range(n_bushings):
        for lane in range(count):
            bushing = bushings[lane * n_bushings + j]
            limit[j, lane] = 1e3 * bushing.gap + 1.0
            lower[j, lane], upper[j, lane] = bushing.lower, bushing.upper
            for end in range(2):  # without adhesion a wall never pulls
                least[n_bushings + 2 * j + end, lane] = -np.inf if bushing.adhesion else 0.0
    total, acceleration, middle = np.zeros((n, count)), np.zeros((n, count)), np.zeros((n, count))
    acts = np.ones(n_points, np.bool_)
    half, nothing, one = 0.5 * h, spread(0.0, lanes), spread(1.0, lanes)
    for i in range(excitation.shape[0]):
        a = excitation[i, 0]
        for j in range(n_bushings):  # its middle and both ends at once, so that less is loaded
            left = n_bushings + 2 * j
            middle_at, left_at, right_at, speed = nothing, nothing, nothing, half * a * load(at_input, j, lanes)
            for m in range(n):
                place, shape_there = load(q, m, lanes), load(at_points, j * n + m, lanes)
                middle_at += shape_there * place
                speed += shape_there * load(v, m, lanes)
                left_at += load(at_points, left * n + m, lanes) * place
                right_at += load(at_points, (left + 1) * n + m, lanes) * place
            store(w, j, speed, lanes)
            store(x, j, middle_at, lanes)
            store(x, left, left_at, lanes)
            store(x, left + 1, right_at, lanes)
            if not all_below(abs(load(x, j, lanes)), load(limit, j, lanes)):
                for lane in range(count):
                    if not abs(x[j, lane]) < limit[j, lane]:
                        return i, lane * n_bushings + j
            for end in range(2):
                p = left + end
                acts[p] = contact_law[j] == 0 or penetration_in_lanes(contacts, j, end, x, p, lanes, depth)
        for p in range(n_points):
            store(force, p, nothing, lanes)
            if p >= n_bushings and acts[p]:
                speed = half * a * load(at_input, p, lanes)
                for m in range(n):
                    speed += load(at_points, p * n + m, lanes) * load(v, m, lanes)
                store(w, p, speed, lanes)
        _add_others(at_input, n_points, excitation, i, half, lanes, w, 0, 1)
        for j in range(n_bushings):
            if grease_law[j]:
                grease_in_lanes(greases, j, x, h, lanes, elastic, viscous)
            else:
                for lane in range(count):
                    record = lane * n_bushings + j
                    found = grease_step(bushings[record], states[record], numbers, x[j, lane])
                    elastic[j, lane], viscous[j, lane] = found
            for end in range(2):
                p = n_bushings + 2 * j + end
                if contact_law[j]:
                    if acts[p]:
                        contact_in_lanes(contacts, j, end, depth, w, p, lanes, elastic, viscous, side)
                    continue
                acts[p] = False
                for lane in range(count):
                    record = lane * n_bushings + j
                    bushing, state = bushings[record], states[record]
                    if end == 0:
                        follow_law(bushing, state, numbers, x[j, lane], (steps + i) * h)
                    g, k, c = contact_step(bushing, state, numbers, end, x[p, lane], w[p, lane], False)
                    elastic[p, lane], viscous[p, lane] = k * g, c
                    if g != 0.0:
                        acts[p], side[p, lane] = True, 1.0 if g > 0.0 else -1.0
        for p in range(n_points):
            if acts[p]:
                own = half * load(compliance, p * n_points + p, lanes)
                store(share, p, 1.0 / (1.0 + load(viscous, p, lanes) * own), lanes)
        for _ in range(2):  # Gauss-Seidel: every force at the velocity that the other forces leave
            for p in range(n_points):
                if not acts[p]:
                    continue
                now, own = load(force, p, lanes), half * load(compliance, p * n_points + p, lanes)
                free = load(w, p, lanes) + own * now
                new = (load(elastic, p, lanes) + load(viscous, p, lanes) * free) * load(share, p, lanes)
                if p >= n_bushings:
                    new = load(side, p, lanes) * larger(load(side, p, lanes) * new, load(least, p, lanes))
                change = half * (new - now)
                for r in range(n_points):
                    if acts[r]:
                        store(w, r, load(w, r, lanes) - load(compliance, r * n_points + p, lanes) * change, lanes)
                store(force, p, new, lanes)
        for m in range(n):
            store(total, m, load(shape, m, lanes) * a, lanes)
        _add_others(shape, n, excitation, i, 1.0, lanes, total, 0, 1)
        if springs.size:
            for m in range(n):
                for r in range(n):
                    pull = load(springs, m * n + r, lanes) * load(q, r, lanes)
                    store(total, m, load(total, m, lanes) - pull, lanes)
        for p in range(n_points):
            if acts[p]:
                push = load(force, p, lanes)
                for m in range(n):
                    store(total, m, load(total, m, lanes) - load(at_points, p * n + m, lanes) * push, lanes)
        move_modes(h, lanes, inverse_mass, flow, coupling, q, v, q_before, total, middle, acceleration)
        row = first + i
        for s in range(0, n_sensors, 3):  # three at once, the last one twice if need be
            second, third = min(s + 1, n_sensors - 1), min(s + 2, n_sensors - 1)
            value = load(base, s, lanes) * a
            value_2, value_3 = load(base, second, lanes) * a, load(base, third, lanes) * a
            for m in range(n):
                moved = load(acceleration, m, lanes)
                value += load(at_sensors, s * n + m, lanes) * moved
                value_2 += load(at_sensors, second * n + m, lanes) * moved
                value_3 += load(at_sensors, third * n + m, lanes) * moved
            store(out, s * size + row, value, lanes)
            store(out, second * size + row, value_2, lanes)
            store(out, third * size + row, value_3, lanes)
        _add_others(base, n_sensors, excitation, i, 1.0, lanes, out, row, size)
        if readings.shape[0]:
            read_motion(h, lanes, readings, q, q_before, acceleration, middle, row, out)
        for j in range(n_bushings):
            ends, column = n_bushings + 2 * j, n_sensors + j
            store(out, column * size + row, load(x, j, lanes), lanes)
            if out.shape[0] == n_sensors + n_bushings:
                continue
            contact = load(force, ends, lanes) + load(force, ends + 1, lanes)
            store(out, (column + n_bushings) * size + row, contact, lanes)
            store(out, (column + 2 * n_bushings) * size + row, load(force, j, lanes), lanes)
            low, high, deep = load(lower, j, lanes), load(upper, j, lanes), nothing
            for end in range(2):
                deep += abs(signed_penetration(load(x, ends + end, lanes), low, high))
            store(out, (column + 3 * n_bushings) * size + row, where_above(one, deep), lanes)
    for lane in range(count):  # without bushings nothing else would stop it
        for m in range(n):
            if not abs(q[m, lane]) < np.inf:
                return excitation.shape[0], lane * max(n_bushings, 1)
    return -1, -1


@jit(inline="always")
def _add_others(
    rows: np.ndarray, count: int, excitation: np.ndarray, i: int, factor: float, lanes: tuple[int, ...],
    out: np.ndarray, first: int, stride: int,
) -> None:  # fmt: skip
    """Add what all inputs but the first one do in a step, by their ``rows`` of so many numbers each."""
    for r in range(1, excitation.shape[1]):
        amount = factor * excitation[i, r]
        for m in range(count):
            place = first + m * stride
            store(out, place, load(out, place, lanes) + amount * load(rows, r * count + m, lanes), lanes)


@jit(**OPTIONS)
def advance_whole(
    excitation: np.ndarray, factor: int, taps: np.ndarray, h: float, lanes: tuple[int, ...], shaft: Shaft,
    motion: Motion, clearance: Clearance, greases: LaneGreases, contacts: LaneContacts, before: np.ndarray,
    out: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Advance by a whole excitation, decimated by a factor; return what `advance` returns.

    ``taps`` are those of `lowpass`, ``before`` (columns, lanes) what the columns are at rest; ``out``: (lanes, columns,
    n) samples at the record's rate.
    """
    padded, (count, columns, last) = padded_taps(taps, factor), out.shape
    steps = np.zeros((columns, padded.size + (BLOCK_SAMPLES + 1) * factor, count))
    filled, done, samples = taps.size // 2, 0, 0
    fill_before(before, filled, lanes, steps)
    while samples < last and done < excitation.shape[0]:
        part = excitation[done : done + BLOCK_SAMPLES * factor]
        failed, record = advance(done, part, h, lanes, shaft, motion, clearance, greases, contacts, steps, filled)
        if failed >= 0:
            return done + failed, record
        done, filled = done + part.shape[0], filled + part.shape[0]
        ready = decimate(steps, filled, padded, taps.size, factor, lanes, out, samples)
        samples, filled = samples + ready, filled - ready * factor
    return -1, -1
