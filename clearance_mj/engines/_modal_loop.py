"""The compiled loop of the modal engine, for one simulation or several side by side; see modal.py.

Every array has the lanes (see _lanes.py) as its last axis; the bushings' records stand lane after lane.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ..clearance._lanes import all_below, larger, load, spread, store
from ..clearance._pointers import OPTIONS, kernel_loop
from ..clearance.kernel import Clearance, contact_step, follow_law, grease_step
from ..clearance.lane_contacts import LaneContacts, contact_in_lanes, penetration_in_lanes
from ..clearance.lane_greases import LaneGreases, grease_in_lanes

__all__ = ["Motion", "Shaft", "advance", "advance_whole"]

SAMPLES = 64
"""that are simulated between two decimations: what lies between them stays in the processor's cache"""
TOGETHER = 4
"""samples that are decimated at once"""


class Shaft(NamedTuple):
    """The linear part of the equations, in modal coordinates."""

    inverse_mass: np.ndarray  # (n,) smaller for high modes, see modal.py
    flow: np.ndarray  # (4, n) exact motion of the free modes over one step: rows q→q, v→q, q→v, v→v
    at_points: np.ndarray  # (3 n_bushings, n) the bushings' middles (grease), then both ends of each (contact)
    at_sensors: np.ndarray  # (n_sensors, n)
    input: np.ndarray  # (n,) force on the modes per unit of excitation
    base: np.ndarray  # (n_sensors,) what sensors read of the excitation itself: of a shaken base, with which they move
    coupling: np.ndarray  # (n, n) damping per velocity in the middle of all other kicks; (0, 0) where it couples none
    compliance: np.ndarray  # (3 n_bushings, 3 n_bushings) velocity of each point per unit impulse at each other
    at_input: np.ndarray  # (3 n_bushings,) velocity of the points per unit impulse of the excitation


class Motion(NamedTuple):
    """Modal coordinates, changed in place."""

    q: np.ndarray  # (n,) now
    v: np.ndarray  # (n,) velocity before the kick
    q_before: np.ndarray  # (n,) a step ago


@kernel_loop(**OPTIONS)
def advance(
    steps: int, excitation: np.ndarray, h: float, lanes: tuple[int, ...], shaft: Shaft, motion: Motion,
    clearance: Clearance, greases: LaneGreases, contacts: LaneContacts, out: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Advance the state by ``excitation.size`` steps; return (step, record of the bushing) of a divergence, or -1, -1.

    ``out``: (excitation.size, columns, lanes), filled with what `Run.advance` returns.
    """
    inverse_mass, flow, at_points, at_sensors, shape, base, coupling, compliance, at_input = shaft
    q, v, q_before = motion
    bushings, states, numbers = clearance
    grease_law, contact_law = greases.law, contacts.law
    count, n, n_sensors, n_points = len(lanes), q.shape[0], at_sensors.shape[0], at_points.shape[0]
    n_bushings, columns = n_points // 3, out.shape[1]
    x, w, force = np.zeros((n_points, count)), np.zeros((n_points, count)), np.zeros((n_points, count))
    elastic, viscous = np.zeros((n_points, count)), np.zeros((n_points, count))
    side, least, share = np.ones((n_points, count)), np.full((n_points, count), -np.inf), np.zeros((n_points, count))
    depth, limit = np.zeros((n_points, count)), np.zeros((n_bushings, count))
    for j in range(n_bushings):
        for lane in range(count):
            bushing = bushings[lane * n_bushings + j]
            limit[j, lane] = 1e3 * bushing.gap + 1.0
            for end in range(2):  # without adhesion a wall never pulls
                least[n_bushings + 2 * j + end, lane] = -np.inf if bushing.adhesion else 0.0
    total, acceleration, middle = np.zeros((n, count)), np.zeros((n, count)), np.zeros((n, count))
    acts = np.ones(n_points, np.bool_)
    half, per_step2, nothing = 0.5 * h, 1.0 / (h * h), spread(0.0, lanes)
    for i in range(excitation.size):
        a = excitation[i]
        for p in range(n_points):
            position = nothing
            for m in range(n):
                position += load(at_points, p * n + m, lanes) * load(q, m, lanes)
            store(x, p, position, lanes)
            store(force, p, nothing, lanes)
        for j in range(n_bushings):
            if not all_below(abs(load(x, j, lanes)), load(limit, j, lanes)):
                for lane in range(count):
                    if not abs(x[j, lane]) < limit[j, lane]:
                        return i, lane * n_bushings + j
            for end in range(2):
                p = n_bushings + 2 * j + end
                acts[p] = contact_law[j] == 0 or penetration_in_lanes(contacts, j, end, x, p, lanes, depth)
        for p in range(n_points):
            if acts[p]:
                speed = half * a * load(at_input, p, lanes)
                for m in range(n):
                    speed += load(at_points, p * n + m, lanes) * load(v, m, lanes)
                store(w, p, speed, lanes)
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
        for p in range(n_points):
            if acts[p]:
                push = load(force, p, lanes)
                for m in range(n):
                    store(total, m, load(total, m, lanes) - load(at_points, p * n + m, lanes) * push, lanes)
        if coupling.size:  # at the velocity in the middle of the kick of all other forces
            for m in range(n):
                kick = half * load(inverse_mass, m, lanes) * load(total, m, lanes)
                store(middle, m, load(v, m, lanes) + kick, lanes)
            for m in range(n):
                damped = load(total, m, lanes)
                for r in range(n):
                    damped = damped - load(coupling, m * n + r, lanes) * load(middle, r, lanes)
                store(total, m, damped, lanes)
        for m in range(n):
            place = load(q, m, lanes)
            kicked = load(v, m, lanes) + h * load(inverse_mass, m, lanes) * load(total, m, lanes)
            store(v, m, load(flow, 2 * n + m, lanes) * place + load(flow, 3 * n + m, lanes) * kicked, lanes)
            after = load(flow, m, lanes) * place + load(flow, n + m, lanes) * kicked
            # Force less ω² q would be the same, but a small difference of large numbers for high modes.
            store(acceleration, m, (after - 2.0 * place + load(q_before, m, lanes)) * per_step2, lanes)
            store(q_before, m, place, lanes)
            store(q, m, after, lanes)
        row = i * columns
        for s in range(n_sensors):
            value = load(base, s, lanes) * a
            for m in range(n):
                value += load(at_sensors, s * n + m, lanes) * load(acceleration, m, lanes)
            store(out, row + s, value, lanes)
        for j in range(n_bushings):
            ends, column = n_bushings + 2 * j, row + n_sensors + j
            store(out, column, load(x, j, lanes), lanes)
            store(out, column + n_bushings, load(force, ends, lanes) + load(force, ends + 1, lanes), lanes)
            store(out, column + 2 * n_bushings, load(force, j, lanes), lanes)
    for lane in range(count):  # without bushings nothing else would stop it
        for m in range(n):
            if not abs(q[m, lane]) < np.inf:
                return excitation.size, lane * max(n_bushings, 1)
    return -1, -1


@kernel_loop(**OPTIONS)
def advance_whole(
    excitation: np.ndarray, factor: int, taps: np.ndarray, h: float, lanes: tuple[int, ...], shaft: Shaft,
    motion: Motion, clearance: Clearance, greases: LaneGreases, contacts: LaneContacts, out: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Advance by a whole excitation, decimated by a factor; return what `advance` returns.

    ``taps`` are those of `lowpass`; ``out``: (lanes, columns, n) samples at the record's rate.
    """
    padded = np.zeros(taps.size + 2 * (TOGETHER - 1) * factor)
    padded[(TOGETHER - 1) * factor : (TOGETHER - 1) * factor + taps.size] = taps
    # Rows of all lanes: those under the next sample's filter, then those of the next steps, then some that count zero.
    rows = np.zeros((padded.size + (SAMPLES + 1) * factor, out.shape[1], out.shape[0]))
    flat, row, filled, done, samples = rows.ravel(), out.shape[1] * out.shape[0], taps.size // 2, 0, 0
    while samples < out.shape[2] and done < excitation.size:
        steps = min(SAMPLES * factor, excitation.size - done)
        part, now = excitation[done : done + steps], rows[filled : filled + steps]
        failed, record = advance(done, part, h, lanes, shaft, motion, clearance, greases, contacts, now)
        if failed >= 0:
            return done + failed, record
        done, filled = done + steps, filled + steps
        ready = min(max(0, (filled - taps.size) // factor + 1), out.shape[2] - samples)
        for i in range(0, ready, TOGETHER):
            for column in range(out.shape[1]):
                _decimate(rows, i * factor, column, padded, factor, lanes, out, samples + i, min(TOGETHER, ready - i))
        samples, start = samples + ready, ready * factor
        for i in range((filled - start) * row):
            flat[i] = flat[i + start * row]
        filled -= start
    return -1, -1


@numba.njit(cache=True, nogil=True, inline="always")
def _decimate(
    rows: np.ndarray, start: int, column: int, padded: np.ndarray, factor: int, lanes: tuple[int, ...],
    out: np.ndarray, sample: int, count: int,
) -> None:  # fmt: skip
    """Fill up to `TOGETHER` samples of a column, of which the first begins at a row."""
    columns, first = rows.shape[1], (TOGETHER - 1) * factor
    a = b = c = d = spread(0.0, lanes)
    for j in range(padded.size - first):
        x, tap = load(rows, (start + j) * columns + column, lanes), first + j
        a += padded[tap] * x
        b += padded[tap - factor] * x
        c += padded[tap - 2 * factor] * x
        d += padded[tap - 3 * factor] * x
    found = np.empty((TOGETHER, len(lanes)))
    store(found, 0, a, lanes)
    store(found, 1, b, lanes)
    store(found, 2, c, lanes)
    store(found, 3, d, lanes)
    for k in range(count):
        for lane in range(len(lanes)):
            out[lane, column, sample + k] = found[k, lane]
