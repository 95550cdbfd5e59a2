"""Forces of the clearances along one period of a motion, and their derivatives; compiled.

Laws are marched over periods, of which the last counts, until they have forgotten how the first one began. Their
derivatives by displacement, speed and memory are differences. Points stand as in the engines: the bushings' middles
(grease), then both ends of each (contact). Forces are those that the in-gap linear system has not: the grease's beyond
its stiffness and damping of small motions.

In the step in which a contact begins or ends its force counts for the share in which it acts: so the balance follows
the motion smoothly, damping that makes a force begin with a jump included.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..clearance.follower import end_values, impact_speed, lasting, pushing, signed_penetration
from ..clearance.lanes import signed
from ..clearance.pointers import at, call_law
from ..core.jit import STRICT, jit

__all__ = ["Laws", "Slopes", "equal", "fill_forces"]

PERIODS = 2  # of a contact, which begins anew in each
MAX_PERIODS = 32
"""Periods of greases until what they remember is periodic: springs with sliders need one, Bouc-Wen's mean some."""
PERIODIC = 1e-11  # change of a memory from period to period, over the motion, that counts as none
DIFFERENCE = 1e-7  # step of difference quotients, over the motion


class Laws(NamedTuple):
    """What acts in the clearances."""

    bushings: np.ndarray  # (n_bushings,) records of the kernel
    numbers: np.ndarray  # of the records
    spring: np.ndarray  # (n_bushings,) stiffness that the linear system has already, N/m
    damper: np.ndarray  # (n_bushings,) and damping, N s/m
    memory: np.ndarray  # (n_bushings,) numbers that the filling remembers, 0 if they never change
    linear: np.ndarray  # (n_bushings,) whether the filling adds nothing to its spring and damper
    remembers: np.ndarray  # (n_bushings,) whether an end remembers the speed at which it met the wall, or bristles
    room: int  # for what any filling or end remembers


class Slopes(NamedTuple):
    """Derivatives of the forces at every sample of a period; changed in place."""

    x: np.ndarray  # (n_points, N) by the displacement then, N/m
    v: np.ndarray  # (n_points, N) by the speed then, N s/m
    begun: np.ndarray  # (n_points, N) by the speed at which the contact began, N s/m
    entry: np.ndarray  # (n_points, N) share of the step before this sample at which a contact began, -1 if none did
    climb: np.ndarray  # (n_points, N) acceleration over speed there, 1/s
    memory: np.ndarray  # (n_bushings, N, m + 1, m + 2) of the grease's memory, then of its force, by memory, x and dx
    whole: np.ndarray  # (n_points, K, K) of the force's harmonics by those of the displacement: what remembers
    remembers: np.ndarray  # (n_points,) whether the latter is not zero


@jit(inline="always")
def _contact(law: int, parameters: Any, out: Any, depth: float, speed: float, begun: float, pulls: bool) -> float:
    """Force of one end of a bushing against its penetration, N."""
    k, c = end_values(law, parameters, out, depth, speed, begun)
    return pushing(k * depth + c * speed, pulls)


@jit(**STRICT)
def _contact_over_period(
    laws: Laws, j: int, p: int, x: np.ndarray, v: np.ndarray, omega: float, basis: np.ndarray, rate: np.ndarray,
    project: np.ndarray, want: bool, force: np.ndarray, slopes: Slopes,
) -> None:  # fmt: skip
    """Fill row p of force and slopes with the contact of bushing j at point p."""
    bushing, numbers = laws.bushings[j], laws.numbers
    n, harmonics = x.shape[1], basis.shape[1]
    of_x, of_v, of_begun, entry, whole = slopes.x, slopes.v, slopes.begun, slopes.entry, slopes.whole
    lower, upper = numbers[bushing.wall], numbers[bushing.wall + 1]
    law, pulls = bushing.contact_law, bushing.adhesion
    parameters, out = at(numbers, bushing.contact), at(numbers, bushing.out)
    reach, touches, start = 0.0, False, 0
    for i in range(n):
        reach = max(reach, abs(x[p, i]))
        if signed_penetration(x[p, i], lower, upper) != 0.0:
            touches = True
        else:
            start = i  # no contact lasts from before
    if not touches:
        return
    dx, dv = DIFFERENCE * reach, DIFFERENCE * reach * omega
    side, impact, begun, now, by_x, by_v = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    row, sums, pending = np.zeros(harmonics), np.zeros(harmonics), False
    for m in range(start, PERIODS * n):
        i, counts = m if m < n else m - n, m >= n
        last = i - 1 if i > 0 else n - 1
        g, step, climb = signed_penetration(x[p, i], lower, upper), x[p, i] - x[p, last], v[p, i] - v[p, last]
        began = lasting(impact, g) == 0.0
        if impact != 0.0 and began:  # over since the sample before, at a share of the step
            share = ((upper if side > 0.0 else lower) - x[p, last]) / step
            jump = 0.0
            if pulls:
                jump = _contact(law, parameters, out, 0.0, side * (v[p, last] + share * climb), begun, pulls)
            if counts:
                rest = 1.0 - share
                force[p, last] -= side * 0.5 * rest * (now - jump + rest * jump)
                force[p, i] += side * 0.5 * share * share * jump
                of_x[p, last] -= 0.5 * rest * by_x
                of_v[p, last] -= 0.5 * rest * by_v
                sooner = -side * (0.5 * (now - jump) + jump) / step
                of_x[p, last] += rest * sooner
                of_x[p, i] += share * sooner
                if pending:
                    _add_event(sums, row, whole[p])
                    slopes.remembers[p] = True
            pending = False
            impact = 0.0
        if g == 0.0:
            continue
        share, jump = 0.0, 0.0
        if began:
            side = signed(1.0, g)
            met = side * v[p, i]
            if m > 0:
                share = ((upper if g > 0.0 else lower) - x[p, last]) / step
                met = side * (v[p, last] + share * climb)
            begun = impact_speed(impact, g, met)
            impact = signed(begun, g)
            jump = _contact(law, parameters, out, 0.0, met, begun, pulls)
            sums[:] = 0.0
            for k in range(harmonics):
                place = (1.0 - share) * basis[last, k] + share * basis[i, k]
                row[k] = omega * ((1.0 - share) * rate[last, k] + share * rate[i, k]) - climb / step * place
        if m < n - 1:
            continue
        depth, inwards = abs(g), side * v[p, i]
        now, by_begun = _contact(law, parameters, out, depth, inwards, begun, pulls), 0.0
        by_x, by_v = 0.0, 0.0
        if want and now != 0.0:
            by_x = (_contact(law, parameters, out, depth + dx, inwards, begun, pulls) - now) / dx
            by_v = (_contact(law, parameters, out, depth, inwards + dv, begun, pulls) - now) / dv
            by_begun = (_contact(law, parameters, out, depth, inwards, begun + dv, pulls) - now) / dv
        if not counts:
            continue
        force[p, i] += side * now
        of_x[p, i] += by_x
        of_v[p, i] += by_v
        if by_begun != 0.0:
            of_begun[p, i] = by_begun
            pending = True
            for k in range(harmonics):
                sums[k] += by_begun * project[k, i]
        if began:
            entry[p, i], slopes.climb[p, i] = share, climb / step
            rest = 1.0 - share
            force[p, i] -= side * 0.5 * share * (now - jump + share * jump)
            force[p, last] += side * 0.5 * rest * rest * jump
            of_x[p, i] -= 0.5 * share * by_x
            of_v[p, i] -= 0.5 * share * by_v
            sooner = side * (0.5 * (now - jump) + jump) / step
            of_x[p, last] += rest * sooner
            of_x[p, i] += share * sooner
    if pending:
        _add_event(sums, row, whole[p])
        slopes.remembers[p] = True


@jit(**STRICT)
def _add_event(sums: np.ndarray, row: np.ndarray, out: np.ndarray) -> None:
    """Add to (K, K) what the speed at which a contact began does to the harmonics of its force."""
    for k in range(sums.size):
        for r in range(row.size):
            out[k, r] += sums[k] * row[r]


@jit(**STRICT)
def _grease_over_period(
    laws: Laws, j: int, x: np.ndarray, v: np.ndarray, omega: float, basis: np.ndarray, project: np.ndarray, want: bool,
    force: np.ndarray, slopes: Slopes,
) -> None:  # fmt: skip
    """Fill row j of force and slopes with the grease of bushing j."""
    bushing, numbers = laws.bushings[j], laws.numbers
    n, harmonics, size = x.shape[1], basis.shape[1], laws.memory[j]
    parameters, law = at(numbers, bushing.filling), bushing.filling_law
    offset, preload = numbers[bushing.offset], numbers[bushing.preload]
    spring, damper, step = laws.spring[j], laws.damper[j], 2.0 * np.pi / (omega * n)
    reach = 0.0
    for i in range(n):
        reach = max(reach, abs(x[j, i]))
    eps = DIFFERENCE * max(reach, 1e-6 * numbers[bushing.reach])
    held, moved, answers = np.zeros(laws.room), np.zeros(laws.room), np.zeros(2)
    memory, shifted, out = at(held, 0), at(moved, 0), at(answers, 0)
    sensitive, later = np.zeros((size, harmonics)), np.zeros((size, harmonics))
    of_force = np.zeros((n, harmonics))
    slope = np.zeros((size + 1, size + 2))
    first, old, begun = (0 if size else n), np.zeros(laws.room), np.zeros(laws.room)
    i = n - 1
    for m in range(first, MAX_PERIODS * n):
        last, counts = i, m >= n
        i = i + 1 if i < n - 1 else 0
        here, speed = x[j, i], v[j, i]
        dx = here - x[j, last] if m > 0 else here
        if i == 0 and m > n:
            change = 0.0
            for k in range(size):
                change = max(change, abs(held[k] - begun[k]))
            if change <= PERIODIC * reach:
                break
        if i == 0:
            begun[:] = held
        old[:] = held
        call_law(law, parameters, memory, (here + offset,), (dx,), 0.0, step, out)
        now = answers[0] + answers[1] * speed
        viscous = answers[1]
        if counts:
            force[j, i] = now - preload - spring * here - damper * speed
        if not want:
            continue
        for d in range(size + 2):
            moved[:] = old
            if d < size:
                moved[d] += eps
            further, longer = eps if d == size else 0.0, eps if d == size + 1 else 0.0
            call_law(law, parameters, shifted, (here + offset + further,), (dx + longer,), 0.0, step, out)
            for k in range(size):
                slope[k, d] = (moved[k] - held[k]) / eps
            slope[size, d] = (answers[0] + answers[1] * speed - now) / eps
        if not size:
            slopes.x[j, i] = slope[0, 0] - spring
            slopes.v[j, i] = viscous + slope[0, 1] * step - damper
            continue
        if counts:
            slopes.v[j, i] = viscous - damper
            slope[size, size] -= spring
            shown = slopes.memory[j, i]
            for k in range(size + 1):
                to = k if k < size else shown.shape[0] - 1
                for d in range(size + 2):
                    shown[to, d if d < size else shown.shape[1] - 2 + d - size] = slope[k, d]
        for k in range(size + 1):
            row = later[k] if k < size else of_force[i]
            for r in range(harmonics):
                change = basis[i, r] - (basis[last, r] if m > 0 else 0.0)
                row[r] = slope[k, size] * basis[i, r] + slope[k, size + 1] * change
            for d in range(size):
                if slope[k, d] != 0.0:
                    for r in range(harmonics):
                        row[r] += slope[k, d] * sensitive[d, r]
        sensitive, later = later, sensitive
    if want and size:
        whole = slopes.whole[j]
        for k in range(harmonics):
            for i in range(n):
                for r in range(harmonics):
                    whole[k, r] += project[k, i] * of_force[i, r]
        slopes.remembers[j] = True


@jit(**STRICT)
def equal(values: np.ndarray, p: int, q: int) -> bool:
    """Return whether two rows are equal."""
    for k in range(values.shape[1]):
        if values[p, k] != values[q, k]:
            return False
    return True


@jit(**STRICT)
def _copy_end(force: np.ndarray, slopes: Slopes, source: int) -> None:
    """Fill the row after one of force and slopes with it: both ends of a bushing without length."""
    p = source + 1
    for rows in (force, slopes.x, slopes.v, slopes.begun, slopes.entry, slopes.climb):
        rows[p] = rows[source]
    slopes.whole[p], slopes.remembers[p] = slopes.whole[source], slopes.remembers[source]


@jit(**STRICT)
def fill_forces(
    laws: Laws, x: np.ndarray, v: np.ndarray, omega: float, basis: np.ndarray, rate: np.ndarray, project: np.ndarray,
    want: bool, force: np.ndarray, slopes: Slopes,
) -> None:  # fmt: skip
    """Fill force (n_points, N) and, if wanted, slopes along displacements and speeds (n_points, N) of one period.

    ``basis`` and ``rate`` (N, K) are the harmonic functions and their derivatives by the angle, ``project`` (K, N)
    takes the harmonics of N samples.
    """
    force[:] = 0.0
    slopes.x[:] = 0.0
    slopes.v[:] = 0.0
    slopes.begun[:] = 0.0
    slopes.entry[:] = -1.0
    slopes.whole[:] = 0.0
    slopes.remembers[:] = False
    n_bushings = laws.bushings.size
    for j in range(n_bushings):
        if not laws.linear[j]:
            _grease_over_period(laws, j, x, v, omega, basis, project, want, force, slopes)
        p = n_bushings + 2 * j
        _contact_over_period(laws, j, p, x, v, omega, basis, rate, project, want, force, slopes)
        if equal(x, p, p + 1):
            _copy_end(force, slopes, p)
        else:
            _contact_over_period(laws, j, p + 1, x, v, omega, basis, rate, project, want, force, slopes)
