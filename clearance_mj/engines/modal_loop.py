"""The compiled loop of the modal engine, for one case or several side by side; see modal.py.

Several cases have the lanes (see lanes.py) as the last axis of all arrays, and share the clearances' records. For one
case modes are packed by four, and so are the rows of clearances where all of them change at once. One source serves
both: `packed` arrays are loaded in packs, all other numbers in the lanes of the cases.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..clearance.kernel import save_previous_state
from ..clearance.lanes import larger, where_above
from ..clearance.record import Clearance
from ..clearance.registers import joined, load, packed, spread, store
from ..core.jit import OPTIONS, inlined, jit
from .decimating import BLOCK_SAMPLES, decimate, fill_before, padded_taps
from .energies import StepRecords, keep_energies
from .interact import ENDS, FILLED, fill_all, find_contacts, follow_contacts, sweep, torque_of_friction

__all__ = [
    "ANGLE", "END_TIME", "PER_INERTIA", "RATE", "SPIN", "SWEEPS", "LaneState", "ModalEquations", "advance",
    "advance_whole", "turn_forces", "turn_on",
]  # fmt: skip

SPIN, ANGLE, RATE, END_TIME, PER_INERTIA = range(5)
"""Rotation: rad/s and rad; rate of a ramp, rad/s², until a time, s; 1/inertia of a shaft slowed by friction"""
SWEEPS = 2  # number of sweeps over all forces in a step


class ModalEquations(NamedTuple):
    """The linear part of the equations in modal coordinates; the last axes, of modes, are packed."""

    inverse_mass: np.ndarray  # (n) smaller for high modes, see modal.py
    flow: np.ndarray  # (4, n) exact motion of the free modes over one step: rows q→q, v→q, q→v, v→v
    input: np.ndarray  # (n_inputs, n) force on the modes per unit of each input
    n_excited: int  # number of the excitation's inputs; one more is constant
    turning: np.ndarray  # (n_turning, n) rotating forces: Ω² cos φ and Ω² sin φ, then cos k φ, sin k φ of orders
    orders: np.ndarray  # (n_orders,) k, for all cases
    at_rows: np.ndarray  # (n_rows, n) displacement of the clearances' rows: all middles, then both ends of each
    spans: np.ndarray  # (n_rows, 2) first pack of modes of each that is not zero, and the one after the last
    groups: np.ndarray  # (n, 5) three rows with the same span, its first pack and the one after the last
    compliance: np.ndarray  # (n_rows, rows) velocity of all rows, packed, per unit impulse at each
    at_sensors: np.ndarray  # (n_sensors, n) for accelerometers; zeros for others
    of_sensors: np.ndarray  # (n, 5) as ``groups``
    base: np.ndarray  # (n_inputs, n_sensors) direct feedthrough of inputs to sensors, in the lanes of the cases
    springs: np.ndarray  # (n, n) by columns: stiffness beyond that of the modes; (0, n) where there is none
    coupling: np.ndarray  # (n, n) by columns: damping per velocity in the middle of all other kicks; or (0, n)
    readings: np.ndarray  # (n_sensors, 2, n) readings of other sensors per coordinate and velocity; (0, 2, n) without


class LaneState(NamedTuple):
    """State of the loop, changed in place."""

    q: np.ndarray  # (n) coordinates now, packed, as the next two
    v: np.ndarray  # (n) velocity before the kick
    q_before: np.ndarray  # (n) coordinates a step ago
    turning: np.ndarray  # (5,) see `SPIN`


@jit(**OPTIONS)
def advance(
    steps: int, excitation: np.ndarray, h: float, lanes: tuple[int, ...], turns: bool, linear: ModalEquations,
    motion: LaneState, clearance: Clearance, places: np.ndarray, kept: StepRecords, out: np.ndarray, first: int,
) -> tuple[int, int]:  # fmt: skip
    """Advance the state by all steps; return (step, clearance) of a divergence, or -1, -1.

    ``excitation``: (n, n_inputs). ``turns``: True if a shaft turns. ``places``: as of `interact`. ``out``: (columns, n,
    lanes), filled from its row ``first`` on with the columns of `Run.advance`, forces and touch if there are columns.
    """
    (
        inverse_mass, flow, given, _, turned, orders, at_rows, spans, groups, compliance, at_sensors, of_sensors, base,
        springs, coupling, readings,
    ) = linear  # fmt: skip
    q, v, q_before, turning = motion
    bushings, numbers = clearance
    side = packed(lanes)
    count, modes, width = len(lanes), inverse_mass.shape[0], len(side)
    n_rows, n_bushings, n_sensors, size = at_rows.shape[0], bushings.size, at_sensors.shape[0], out.shape[1]
    half, n_turning, tall = 0.5 * h, turned.shape[0], compliance.shape[1]
    n_middles = places[n_bushings - 1, 0] + bushings[n_bushings - 1].coordinates if n_bushings else 0
    x, w, force = np.zeros((tall, count)), np.zeros((tall, count)), np.zeros((tall, count))
    ends, filled = np.zeros((2 * n_bushings * ENDS, count)), np.zeros((n_bushings * FILLED, count))
    total, middle, acceleration = np.zeros((modes, width)), np.zeros((modes, width)), np.zeros((modes, width))
    acts, pushed, factors = np.ones(2 * n_bushings, np.bool_), np.ones(tall, np.bool_), np.zeros((n_turning, count))
    known, moved = np.zeros((n_bushings, 2), np.bool_), np.zeros(excitation.shape[1], np.bool_)
    for r in range(moved.size):  # direct feedthrough to sensors: of a base, with which they move
        for s in range(n_sensors):
            moved[r] = moved[r] or base[r, s, 0] != 0.0
    for i in range(excitation.shape[0]):
        time = (steps + i) * h
        if n_turning:
            turn_forces(turning, orders, time, count, factors)
        for m in range(modes):
            now = load(given, m, side) * excitation[i, 0]
            for r in range(1, excitation.shape[1]):
                now = now + load(given, r * modes + m, side) * excitation[i, r]
            for r in range(n_turning):
                now = now + load(turned, r * modes + m, side) * load(factors, r, lanes)
            if springs.shape[0]:
                now = now - _column_product(springs, m, modes, q, lanes)
            store(total, m, now, side)
            store(middle, m, load(v, m, side) + half * load(inverse_mass, m, side) * now, side)
        for g in range(groups.shape[0]):
            _three_products(at_rows, groups, g, modes, q, lanes, x, 0, 1)
        if kept.energies.shape[0]:
            for j in range(n_bushings):
                save_previous_state(bushings[j], numbers)
        j = find_contacts(bushings, numbers, places, x, lanes, ends, acts, pushed)
        if j >= 0:
            for lane in range(count):
                if not abs(x[places[j, 0], lane]) < numbers[bushings[j].limit * count + lane]:
                    return i, lane * n_bushings + j
            return i, j
        for row in range(n_rows):
            if pushed[row]:
                store(w, row, _product(at_rows, row, spans[row, 0], spans[row, 1], modes, middle, lanes), lanes)
            store(force, row, spread(0.0, lanes), lanes)
        spin = load(turning, SPIN, lanes)
        fill_all(bushings, numbers, places, x, spin, time, compliance, half, lanes, filled)
        follow_contacts(bushings, numbers, places, x, w, spin, acts, compliance, half, lanes, ends)
        for _ in range(SWEEPS):
            sweep(bushings, numbers, places, compliance, half, spin, acts, pushed, known, filled, ends, w, force, lanes)
        torque = torque_of_friction(bushings, numbers, acts, ends, lanes)
        for row in range(n_rows):
            if pushed[row]:
                push = load(force, row, lanes)
                for m in range(spans[row, 0], spans[row, 1]):
                    store(total, m, load(total, m, side) - load(at_rows, row * modes + m, side) * push, side)
        if coupling.shape[0]:
            _add_coupling(h, lanes, inverse_mass, coupling, v, total, middle)
        row = first + i
        for r in range(kept.rows.shape[1] if kept.rows.shape[0] else 0):
            kept.rows[row, r] = x[r, 0]
        if kept.energies.shape[0]:
            keep_energies(
                row, kept.energies, h, turning[SPIN, 0], linear.n_excited, excitation, i, factors, inverse_mass, flow,
                given, turned, at_rows, springs, q, v, q_before, total, middle, bushings, numbers, places, x, w, force,
                filled, ends, acts,
            )  # fmt: skip
        _step_modes(h, lanes, inverse_mass, flow, q, v, q_before, total, acceleration)
        for g in range(of_sensors.shape[0]):
            _three_products(at_sensors, of_sensors, g, modes, acceleration, lanes, out, row, size)
        for r in range(excitation.shape[1]):
            for s in range(n_sensors if moved[r] else 0):
                value = load(out, s * size + row, lanes) + load(base, r * n_sensors + s, lanes) * excitation[i, r]
                store(out, s * size + row, value, lanes)
        if readings.shape[0]:
            _add_readings(h, lanes, readings, q, q_before, acceleration, middle, row, out)
        for m in range(n_middles):
            store(out, (n_sensors + m) * size + row, load(x, m, lanes), lanes)
        if out.shape[0] > n_sensors + n_middles:
            _store_clearances(bushings, places, n_middles, force, ends, n_sensors, row, lanes, out)
        if turns:
            column = n_sensors + 3 * n_middles + n_bushings
            if out.shape[0] > column:
                store(out, column * size + row, spin, lanes)
            turn_on(turning, torque, time, h, lanes)
    for lane in range(count):  # without clearances no other check stops it
        for m in range(modes * width // count):
            if not abs(q.ravel()[m * count + lane]) < np.inf:
                return excitation.shape[0], lane * max(n_bushings, 1)
    return -1, -1


@inlined
def _product(
    rows: np.ndarray, row: int, start: int, stop: int, modes: int, vector: np.ndarray, lanes: tuple[int, ...]
) -> Any:
    """Return the product of a row and a vector of modes over a range of packs."""
    side = packed(lanes)
    total = spread(0.0, side)
    for m in range(start, stop):
        total = total + load(rows, row * modes + m, side) * load(vector, m, side)
    return joined(total, lanes)


@inlined
def _three_products(
    rows: np.ndarray, groups: np.ndarray, g: int, modes: int, vector: np.ndarray, lanes: tuple[int, ...],
    out: np.ndarray, first: int, stride: int,
) -> None:  # fmt: skip
    """Compute the products of the three rows of a group and a vector of modes, which is loaded once.

    The result of a row is ``stride`` after that of the row before.
    """
    side = packed(lanes)
    a = b = c = spread(0.0, side)
    i, j, k = groups[g, 0], groups[g, 1], groups[g, 2]
    for m in range(groups[g, 3], groups[g, 4]):
        value = load(vector, m, side)
        a = a + load(rows, i * modes + m, side) * value
        b = b + load(rows, j * modes + m, side) * value
        c = c + load(rows, k * modes + m, side) * value
    store(out, first + stride * i, joined(a, lanes), lanes)
    store(out, first + stride * j, joined(b, lanes), lanes)
    store(out, first + stride * k, joined(c, lanes), lanes)


@inlined
def _column_product(columns: np.ndarray, m: int, modes: int, vector: np.ndarray, lanes: tuple[int, ...]) -> Any:
    """Return pack m of the product of a matrix, stored by columns, and a vector of modes."""
    side, n, none = packed(lanes), columns.shape[0], spread(0.0, packed(lanes))
    a, b, c, d = none, none, none, none  # independent sums, for pipelining
    for r in range(0, n - 3, 4):
        a = a + load(columns, r * modes + m, side) * load(vector, r, lanes)
        b = b + load(columns, (r + 1) * modes + m, side) * load(vector, r + 1, lanes)
        c = c + load(columns, (r + 2) * modes + m, side) * load(vector, r + 2, lanes)
        d = d + load(columns, (r + 3) * modes + m, side) * load(vector, r + 3, lanes)
    for r in range(n - n % 4, n):
        a = a + load(columns, r * modes + m, side) * load(vector, r, lanes)
    return (a + b) + (c + d)


@inlined
def turn_forces(turning: np.ndarray, orders: np.ndarray, time: float, count: int, factors: np.ndarray) -> None:
    """Compute the factors of the forces that rotate with a shaft."""
    for lane in range(count):
        spin, angle = turning[SPIN, lane], turning[ANGLE, lane]
        rate = turning[RATE, lane] if time < turning[END_TIME, lane] else 0.0
        cos, sin = np.cos(angle), np.sin(angle)
        factors[0, lane], factors[1, lane] = spin * spin * cos + rate * sin, spin * spin * sin - rate * cos
        for k in range(orders.size):
            factors[2 + 2 * k, lane], factors[3 + 2 * k, lane] = np.cos(orders[k] * angle), np.sin(orders[k] * angle)


@inlined
def turn_on(turning: np.ndarray, torque: Any, time: float, h: float, lanes: tuple[int, ...]) -> None:
    """Advance the shaft's rotation by a step, under the torque of friction, N m."""
    spin, rate = load(turning, SPIN, lanes), load(turning, RATE, lanes)
    rate = where_above(rate, load(turning, END_TIME, lanes) - time)
    change = h * (rate - load(turning, PER_INERTIA, lanes) * torque)
    store(turning, SPIN, spin + change, lanes)
    store(turning, ANGLE, load(turning, ANGLE, lanes) + h * (spin + 0.5 * change), lanes)


@inlined
def _add_coupling(
    h: float, lanes: tuple[int, ...], inverse_mass: np.ndarray, coupling: np.ndarray, v: np.ndarray, total: np.ndarray,
    middle: np.ndarray,
) -> None:  # fmt: skip
    """Add damping that couples modes, at the velocity in the middle of the kick of all other forces."""
    side, modes, half = packed(lanes), inverse_mass.shape[0], 0.5 * h
    for m in range(modes):
        kick = half * load(inverse_mass, m, side) * load(total, m, side)
        store(middle, m, load(v, m, side) + kick, side)
    for m in range(modes):
        store(total, m, load(total, m, side) - _column_product(coupling, m, modes, middle, lanes), side)


@inlined
def _step_modes(
    h: float, lanes: tuple[int, ...], inverse_mass: np.ndarray, flow: np.ndarray, q: np.ndarray, v: np.ndarray,
    q_before: np.ndarray, total: np.ndarray, acceleration: np.ndarray,
) -> None:  # fmt: skip
    """Kick modes by their forces ``total``, move them freely for a step, and compute their accelerations."""
    side, modes, per_step2 = packed(lanes), inverse_mass.shape[0], 1.0 / (h * h)
    for m in range(modes):
        place = load(q, m, side)
        kicked = load(v, m, side) + h * load(inverse_mass, m, side) * load(total, m, side)
        store(v, m, load(flow, 2 * modes + m, side) * place + load(flow, 3 * modes + m, side) * kicked, side)
        after = load(flow, m, side) * place + load(flow, modes + m, side) * kicked
        # Force less ω² q would be the same, but a small difference of large numbers for high modes.
        store(acceleration, m, (after - 2.0 * place + load(q_before, m, side)) * per_step2, side)
        store(q_before, m, place, side)
        store(q, m, after, side)


@inlined
def _add_readings(
    h: float, lanes: tuple[int, ...], readings: np.ndarray, q: np.ndarray, q_before: np.ndarray,
    acceleration: np.ndarray, speed: np.ndarray, row: int, out: np.ndarray,
) -> None:  # fmt: skip
    """Add the readings of sensors other than accelerometers at the time of the accelerations.

    The velocity is that of (q₊ - 2q + q₋)/h²: (q₊ - q₋)/(2h), with q₊ in ``q`` and q in ``q_before``;
    ``speed`` is overwritten with it.
    """
    side, modes, size = packed(lanes), q.shape[0], out.shape[1]
    for m in range(modes):
        moved = load(q, m, side) - load(q_before, m, side)
        store(speed, m, moved / h - 0.5 * h * load(acceleration, m, side), side)
    for s in range(readings.shape[0]):
        value = load(out, s * size + row, lanes) + _product(readings, 2 * s, 0, modes, modes, q_before, lanes)
        store(out, s * size + row, value + _product(readings, 2 * s + 1, 0, modes, modes, speed, lanes), lanes)


@inlined
def _store_clearances(
    bushings: np.ndarray, places: np.ndarray, n_middles: int, force: np.ndarray, ends: np.ndarray, first: int,
    row: int, lanes: tuple[int, ...], out: np.ndarray,
) -> None:  # fmt: skip
    """Fill in the forces of contacts and fillings, and flags of touching clearances."""
    size, touching = out.shape[1], spread(1.0, lanes)
    for j in range(bushings.size):
        middle, size_j = places[j, 0], bushings[j].coordinates
        for d in range(size_j):
            a, b = places[j, 3 - size_j + d], places[j, 5 - size_j + d]
            column = first + n_middles + middle + d
            store(out, column * size + row, load(force, a, lanes) + load(force, b, lanes), lanes)
            store(out, (column + n_middles) * size + row, load(force, middle + d, lanes), lanes)
        penetration = larger(abs(load(ends, ENDS * 2 * j, lanes)), abs(load(ends, ENDS * (2 * j + 1), lanes)))
        store(out, (first + 3 * n_middles + j) * size + row, where_above(touching, penetration), lanes)


@jit(**OPTIONS)
def advance_whole(
    excitation: np.ndarray, factor: int, taps: np.ndarray, h: float, lanes: tuple[int, ...], turns: bool,
    linear: ModalEquations, motion: LaneState, clearance: Clearance, places: np.ndarray, kept: StepRecords,
    before: np.ndarray, out: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Advance by a whole excitation, decimated by a factor; return the result of `advance`.

    ``taps`` are those of `lowpass`, ``before`` (columns, lanes) the columns at rest; ``out``: (lanes, columns,
    n) samples at the record's rate.
    """
    padded, (count, columns, last) = padded_taps(taps, factor), out.shape
    steps = np.zeros((columns, padded.size + (BLOCK_SAMPLES + 1) * factor, count))
    filled, done, samples = taps.size // 2, 0, 0
    fill_before(before, filled, lanes, steps)
    while samples < last and done < excitation.shape[0]:
        part = excitation[done : done + BLOCK_SAMPLES * factor]
        failed, record = advance(done, part, h, lanes, turns, linear, motion, clearance, places, kept, steps, filled)
        if failed >= 0:
            return done + failed, record
        done, filled = done + part.shape[0], filled + part.shape[0]
        ready = decimate(steps, filled, padded, taps.size, factor, lanes, out, samples)
        samples, filled = samples + ready, filled - ready * factor
    return -1, -1
