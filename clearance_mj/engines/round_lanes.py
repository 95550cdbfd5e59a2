"""The compiled loop of the modal engine in space for several cases side by side, see lanes.py.

Linear parts work on all lanes at once; fillings and contacts are followed lane by lane, by the same functions as in
the loop of one case. Arrays have the lanes as their last axis but for what one lane alone reads: its compliance, and
its records, which stand lane after lane.
"""

from __future__ import annotations

import numpy as np

from ..clearance.lanes import load, spread, store
from ..clearance.round_kernel import RoundClearance
from ..core.jit import OPTIONS, inlined, jit
from .decimating import BLOCK_SAMPLES, decimate, fill_before, padded_taps
from .lane_modes import move_modes, read_motion
from .round_loop import interact, touch
from .round_scheme import ANGLE, SPIN, RoundMotion, RoundShaft

__all__ = ["advance_lanes"]


@jit(**OPTIONS)
def _advance(
    steps: int, excitation: np.ndarray, h: float, lanes: tuple[int, ...], shaft: RoundShaft, coupling: np.ndarray,
    drive: np.ndarray, motion: RoundMotion, clearance: RoundClearance, out: np.ndarray, first: int,
) -> tuple[int, int]:  # fmt: skip
    """Advance all lanes as `advance_round` does one; return the step of a divergence and its record, or -1, -1.

    ``out``: (columns, n, lanes); ``drive``: (lanes, 3); the compliance has the lanes first.
    """
    (
        inverse_mass, flow, at_points, spans, at_sensors, of_sensors, shape, base, weight, unbalance, order, orders,
        compliance, circulatory, springs, readings,
    ) = shaft  # fmt: skip
    q, v, q_before, turning = motion
    bushings, states, numbers = clearance
    count, n, n_sensors, n_points = len(lanes), q.shape[0], at_sensors.shape[0], at_points.shape[0]
    n_bushings, size, half, nothing = n_points // 3, out.shape[1], 0.5 * h, spread(0.0, lanes)
    x, w, force = np.zeros((2 * n_points, count)), np.zeros((2 * n_points, count)), np.zeros((2 * n_points, count))
    total, middle, acceleration = np.zeros((n, count)), np.zeros((n, count)), np.zeros((n, count))
    turns, torque = np.zeros((3, count)), np.zeros(count)  # spin, and what the unbalance is multiplied by
    follows = np.zeros((orders.shape[0], count))  # what the orders are multiplied by
    # What one lane says to the functions that it shares with the loop of one case.
    x_one, w_one, force_one = np.zeros((3, n_points + n_points % 2, 2))
    ends, filling = np.zeros((n_points, 8)), np.zeros((n_bushings, 6))
    acts, any_acts = np.ones((count, n_points), np.bool_), np.ones(n_points, np.bool_)
    for i in range(excitation.shape[0]):
        a, time = excitation[i, 0], (steps + i) * h
        for lane in range(count):
            spin, rate = turning[lane, SPIN], drive[lane, 0] if time < drive[lane, 1] else 0.0
            turns[0, lane], turns[1, lane], turns[2, lane] = spin, 0.0, 0.0
            if spin != 0.0 or rate != 0.0:
                c, s = np.cos(turning[lane, ANGLE]), np.sin(turning[lane, ANGLE])
                turns[1, lane], turns[2, lane] = spin * spin * c + rate * s, spin * spin * s - rate * c
            for k in range(order.shape[0]):
                phase = order[k, lane] * turning[lane, ANGLE]
                follows[2 * k, lane], follows[2 * k + 1, lane] = np.cos(phase), np.sin(phase)
        for m in range(n):
            now = load(shape, m, lanes) * a + load(weight, m, lanes) + load(turns, 1, lanes) * load(unbalance, m, lanes)
            now += load(turns, 2, lanes) * load(unbalance, n + m, lanes)
            for r in range(1, excitation.shape[1]):
                now += load(shape, r * n + m, lanes) * excitation[i, r]
            for r in range(orders.shape[0]):
                now += load(follows, r, lanes) * load(orders, r * n + m, lanes)
            if circulatory.size:
                dragged = nothing
                for r in range(n):
                    dragged += load(circulatory, m * n + r, lanes) * load(q, r, lanes)
                now = now - load(turns, 0, lanes) * dragged
            if springs.size:
                for r in range(n):
                    now = now - load(springs, m * n + r, lanes) * load(q, r, lanes)
            store(total, m, now, lanes)
            store(middle, m, load(v, m, lanes) + half * load(inverse_mass, m, lanes) * now, lanes)
        _at_points(at_points, spans, q, 0, n_points, lanes, x)
        any_acts[n_bushings:] = False
        for lane in range(count):
            for p in range(n_points):
                x_one[p, 0], x_one[p, 1] = x[2 * p, lane], x[2 * p + 1, lane]
            for j in range(n_bushings):
                bushing = bushings[lane * n_bushings + j]
                if not abs(x_one[j, 0]) + abs(x_one[j, 1]) < 1e3 * bushing.gap + 1.0:
                    return i, lane * n_bushings + j
                touch(bushing, n_bushings + 2 * j, x_one, acts[lane])
            for p in range(n_bushings, n_points):
                any_acts[p] = any_acts[p] or acts[lane, p]
        for p in range(n_points):
            if any_acts[p]:
                _at_points(at_points, spans, middle, p, p + 1, lanes, w)
        for lane in range(count):
            for p in range(n_points):
                for d in range(2):
                    x_one[p, d], w_one[p, d], force_one[p, d] = x[2 * p + d, lane], w[2 * p + d, lane], 0.0
            own = slice(lane * n_bushings, (lane + 1) * n_bushings)
            torque[lane] = interact(
                bushings[own], states[own], numbers, compliance[lane], half, turns[0, lane], time, x_one, acts[lane],
                w_one, force_one, ends, filling,
            )  # fmt: skip
            for p in range(n_points):
                force[2 * p, lane], force[2 * p + 1, lane] = force_one[p, 0], force_one[p, 1]
        for p in range(n_points):
            if any_acts[p]:
                for d in range(2):
                    push = load(force, 2 * p + d, lanes)
                    for m in range(spans[d, 0], spans[d, 1]):
                        given = load(at_points, (2 * p + d) * n + m, lanes) * push
                        store(total, m, load(total, m, lanes) - given, lanes)
        move_modes(h, lanes, inverse_mass, flow, coupling, q, v, q_before, total, middle, acceleration)
        for s in range(n_sensors):
            value = load(base, s, lanes) * a
            for r in range(1, excitation.shape[1]):
                value += load(base, r * n_sensors + s, lanes) * excitation[i, r]
            for m in range(of_sensors[s, 0], of_sensors[s, 1]):
                value += load(at_sensors, s * n + m, lanes) * load(acceleration, m, lanes)
            store(out, s * size + first + i, value, lanes)
        if readings.shape[0]:
            read_motion(h, lanes, readings, q, q_before, acceleration, middle, first + i, out)
        for j in range(n_bushings):
            left, right = n_bushings + 2 * j, n_bushings + 2 * j + 1
            for d in range(2):
                row = (n_sensors + 2 * j + d) * size + first + i
                store(out, row, load(x, 2 * j + d, lanes), lanes)
                both = load(force, 2 * left + d, lanes) + load(force, 2 * right + d, lanes)
                store(out, row + 2 * n_bushings * size, both, lanes)
                store(out, row + 4 * n_bushings * size, load(force, 2 * j + d, lanes), lanes)
            for lane in range(count):
                touches = 1.0 if acts[lane, left] or acts[lane, right] else 0.0
                out[n_sensors + 6 * n_bushings + j, first + i, lane] = touches
        if out.shape[0] > n_sensors + 7 * n_bushings:
            store(out, (n_sensors + 7 * n_bushings) * size + first + i, load(turns, 0, lanes), lanes)
        for lane in range(count):
            spin, rate = turns[0, lane], drive[lane, 0] if time < drive[lane, 1] else 0.0
            change = h * (rate - drive[lane, 2] * torque[lane])
            turning[lane, SPIN], turning[lane, ANGLE] = spin + change, turning[lane, ANGLE] + h * (spin + 0.5 * change)
    for lane in range(count):  # without bushings nothing else would stop it
        for m in range(n):
            if not abs(q[m, lane]) < np.inf:
                return excitation.shape[0], lane * max(n_bushings, 1)
    return -1, -1


@inlined
def _at_points(
    at_points: np.ndarray, spans: np.ndarray, of_modes: np.ndarray, first: int, last: int, lanes: tuple[int, ...],
    out: np.ndarray,
) -> None:  # fmt: skip
    """Fill rows 2 p and 2 p + 1 of out with what modes are at points first <= p < last."""
    n = of_modes.shape[0]
    for row in range(2 * first, 2 * last):
        value, d = spread(0.0, lanes), row % 2
        for m in range(spans[d, 0], spans[d, 1]):
            value += load(at_points, row * n + m, lanes) * load(of_modes, m, lanes)
        store(out, row, value, lanes)


@jit(**OPTIONS)
def advance_lanes(
    excitation: np.ndarray, factor: int, taps: np.ndarray, h: float, lanes: tuple[int, ...], shaft: RoundShaft,
    coupling: np.ndarray, drive: np.ndarray, motion: RoundMotion, clearance: RoundClearance, before: np.ndarray,
    out: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Advance by a whole excitation, decimated by a factor; return the step and record of a divergence, or -1, -1.

    ``taps`` are those of `lowpass`, ``before`` (columns, lanes) what the columns are at rest; ``out``: (lanes, columns,
    n) samples at the record's rate.
    """
    padded, (count, columns, last) = padded_taps(taps, factor), out.shape
    steps = np.zeros((columns, padded.size + (BLOCK_SAMPLES + 1) * factor, count))
    filled, done, samples = taps.size // 2, 0, 0
    fill_before(before, filled, lanes, steps)
    while samples < last and done < excitation.shape[0]:
        part = excitation[done : done + BLOCK_SAMPLES * factor]
        failed, record = _advance(done, part, h, lanes, shaft, coupling, drive, motion, clearance, steps, filled)
        if failed >= 0:
            return done + failed, record
        done, filled = done + part.shape[0], filled + part.shape[0]
        ready = decimate(steps, filled, padded, taps.size, factor, lanes, out, samples)
        samples, filled = samples + ready, filled - ready * factor
    return -1, -1
