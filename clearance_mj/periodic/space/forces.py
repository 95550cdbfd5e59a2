"""Forces of round clearances along one period of a motion, and their derivatives; compiled.

Points stand as in the engines: the bushings' middles (filling), then both ends of each (contact); each moves along y
and z. What remembers is marched over periods until it is periodic; a contact that is open somewhere forgets there, so
that one period does. Derivatives are differences: by what acts at the same sample, or, of what remembers and where a
contact begins or ends, carried along the march to the harmonics of the motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...clearance.kernel import touch
from ...clearance.pointers import at
from ...clearance.record import Bushing
from ...core.jit import STRICT, jit
from ..forces import Laws
from .elements import INPUTS, ONE, contact_between, contact_now, filling_between

__all__ = ["RoundSlopes", "Sampled", "fill_round_forces"]

PIECES = 64  # of the way on which a filling is moved from the unloaded place
MAX_PERIODS = 32  # until what is remembered is periodic
PERIODIC = 1e-10  # change of a memory from period to period, over its size, that counts as none
DIFFERENCE = 1e-7  # step of difference quotients, over the motion
OUTPUTS = 4  # force along y and z at a sample, and what it adds to the sample before


class Sampled(NamedTuple):
    """A periodic motion at samples."""

    place: np.ndarray  # (n_points, 2, N) m
    speed: np.ndarray  # (n_points, 2, N) m/s
    omega: float  # 1/s
    spin: float  # rad/s


class RoundSlopes(NamedTuple):
    """Derivatives of the forces at every sample of a period; changed in place."""

    x: np.ndarray  # (n_points, 2, 2, N) force by displacement at the same sample, N/m
    v: np.ndarray  # (n_points, 2, 2, N) by the velocity, N s/m
    step: np.ndarray  # (n_points, N, m + 2, m + 8) memory, then both forces, by memory and what a step is given
    carried: np.ndarray  # (n_points, N) whether the latter holds in the place of the former
    rows: np.ndarray  # (n_points, 2, 2, N, K) force at some samples by the harmonics of y and z: what is carried
    onto: np.ndarray  # (n_points, N, K) what a force at each of them is in harmonics
    used: np.ndarray  # (n_points,) how many they are


@jit(**STRICT, forceinline=True)
def _take(motion: Sampled, p: int, last: int, i: int, u: np.ndarray) -> None:
    """Fill in what a step of a point from one sample to the next one is given."""
    for d in range(2):
        u[d], u[2 + d] = motion.place[p, d, last], motion.place[p, d, i]
        u[4 + d], u[6 + d] = motion.speed[p, d, last], motion.speed[p, d, i]


@jit(**STRICT)
def _step(
    bushing: Bushing, numbers: np.ndarray, contact: bool, size: int, memory: np.ndarray,
    u: np.ndarray, spin: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Fill out with memory, force now and what is added to the force before, of one step of a bushing."""
    if contact:
        contact_between(bushing, numbers, memory, u, spin, out)
    else:
        filling_between(bushing, numbers, size, memory, u, spin, out)


@jit(**STRICT)
def _touches(bushing: Bushing, numbers: np.ndarray, y: float, z: float) -> bool:
    """Return whether a point is in the wall."""
    return touch(bushing, numbers, y, z, ONE)[0] > 0.0


@jit(**STRICT)
def _flips(bushing: Bushing, numbers: np.ndarray, u: np.ndarray, d: int, change: float, together: bool) -> bool:
    """Return whether moving one place of a step, or both, lets a sample pass the wall."""
    for first in range(0, 4, 2):
        if first == 2 * (d // 2) or together:
            y, z = u[first], u[first + 1]
            was = _touches(bushing, numbers, y, z)
            if d % 2:
                z += change
            else:
                y += change
            if _touches(bushing, numbers, y, z) != was:
                return True
    return False


@jit(**STRICT)
def _differences(
    bushing: Bushing, numbers: np.ndarray, contact: bool, told: int, size: int,
    memory: np.ndarray, u: np.ndarray, omega: float, spin: float, eps: float, now: np.ndarray, moved: np.ndarray,
    slope: np.ndarray, first: int,
) -> None:  # fmt: skip
    """Fill slope (told + 4, told + 8): a step by its memory of ``size`` numbers and its input from ``first`` on."""
    quicker = eps * omega
    for d in range(size):
        kept, change = memory[d], quicker if contact and d == 0 else eps
        memory[d] = kept + change
        _step(bushing, numbers, contact, size, memory, u, spin, moved)
        memory[d] = kept
        for k in range(told + OUTPUTS):
            slope[k, d] = (moved[k] - now[k]) / change
    for d in range(first, INPUTS):
        kept, change = u[d], quicker if d >= 4 else eps
        together = first == 0 and d in (2, 3)  # both places: where nothing moves, a step forgets exactly
        if contact and d < 4 and _flips(bushing, numbers, u, d, change, together):
            change = -change  # a sample stays on its side of the wall
        u[d] = kept + change
        before = u[d - 2] if together else 0.0
        if together:
            u[d - 2] = before + change
        _step(bushing, numbers, contact, size, memory, u, spin, moved)
        u[d] = kept
        if together:
            u[d - 2] = before
        for k in range(told + OUTPUTS):
            slope[k, told + d] = (moved[k] - now[k]) / change - (slope[k, told + d - 2] if together else 0.0)


@jit(**STRICT)
def _add_rows(
    slope: np.ndarray, row: int, size: int, omega: float, was: np.ndarray, basis: np.ndarray, was_rate: np.ndarray,
    rate: np.ndarray, carried: np.ndarray, out: np.ndarray, to: int,
) -> None:  # fmt: skip
    """Add to out (2, n, K), at one of n, what a row of derivatives says by harmonics of y, then z."""
    harmonics = basis.size
    for d in range(2):
        a, b = slope[row, size + d], slope[row, size + 2 + d]
        c, e = omega * slope[row, size + 4 + d], omega * slope[row, size + 6 + d]
        for r in range(harmonics):
            out[d, to, r] += a * was[r] + b * basis[r] + c * was_rate[r] + e * rate[r]
    for k in range(size):
        share = slope[row, k]
        if share != 0.0:
            for d in range(2):
                for r in range(harmonics):
                    out[d, to, r] += share * carried[d, k, r]


@jit(**STRICT)
def _closed(bushing: Bushing, numbers: np.ndarray, place: np.ndarray, closed: np.ndarray) -> tuple[bool, int]:
    """Fill in at which samples an end touches; return whether at any, and the last one at which it does not, or -1."""
    touches, still = False, -1
    for i in range(closed.size):
        closed[i] = _touches(bushing, numbers, place[0, i], place[1, i])
        if closed[i]:
            touches = True
        else:
            still = i
    return touches, still


@jit(**STRICT)
def _begin(
    bushing: Bushing, numbers: np.ndarray, contact: bool, size: int, motion: Sampled, p: int,
    eps: float, memory: np.ndarray, u: np.ndarray, out: np.ndarray, want: bool, basis: np.ndarray, carried: np.ndarray,
) -> None:  # fmt: skip
    """Fill in what is remembered at the last sample by what was moved there from rest, and its derivatives.

    A filling comes from the unloaded place, a contact from the middle of the motion.
    """
    last, rest = motion.place.shape[2] - 1, np.zeros(2)
    if contact:
        for d in range(2):
            rest[d] = np.mean(motion.place[p, d])
    pieces = 1 if contact else PIECES
    first = np.zeros(size)
    for shift in range(2, -1 if want else 1, -1):  # where it is, then a little further along z and y
        for k in range(size):
            memory[k] = 0.0
        for piece in range(pieces):
            for d in range(2):
                way = motion.place[p, d, last] - rest[d] + (eps if d == shift else 0.0)
                u[d], u[2 + d] = rest[d] + way * piece / pieces, rest[d] + way * (piece + 1) / pieces
                u[4 + d] = u[6 + d] = motion.speed[p, d, last] if contact else 0.0
            _step(bushing, numbers, contact, size, memory, u, motion.spin, out)
            for k in range(size):
                memory[k] = out[k]
        for k in range(size):
            if shift == 2:
                first[k] = memory[k]
            else:
                change = (memory[k] - first[k]) / eps
                for r in range(basis.shape[1]):
                    carried[shift, k, r] = change * (basis[last, r] - (1.0 if contact and r == 0 else 0.0))
    for k in range(size):
        memory[k] = first[k]


@jit(**STRICT)
def _settled(memory: np.ndarray, old: np.ndarray, size: int, contact: bool, reach: float, speed: float) -> bool:
    for k in range(size):
        if abs(memory[k] - old[k]) > PERIODIC * (speed if contact and k == 0 else reach):
            return False
    return True


@jit(**STRICT)
def _lasting(
    bushing: Bushing, numbers: np.ndarray, place: np.ndarray, speed: np.ndarray,
    closed: np.ndarray, spin: float, eps: float, quicker: float, want: bool, force: np.ndarray, by_place: np.ndarray,
    by_speed: np.ndarray,
) -> None:  # fmt: skip
    """Add the forces (2, N) of an end that remembers nothing where it touched at the sample before, too."""
    for i in range(closed.size):
        if not (closed[i] and closed[i - 1]):
            continue
        y, z, speed_y, speed_z = place[0, i], place[1, i], speed[0, i], speed[1, i]
        now_y, now_z = contact_now(bushing, numbers, y, z, speed_y, speed_z, spin)
        force[0, i] += now_y
        force[1, i] += now_z
        if not want:
            continue
        for d in range(4):
            a, b = (eps if d == 0 else 0.0), (eps if d == 1 else 0.0)
            c, e = (quicker if d == 2 else 0.0), (quicker if d == 3 else 0.0)
            moved_y, moved_z = contact_now(bushing, numbers, y + a, z + b, speed_y + c, speed_z + e, spin)
            per = 1.0 / (a + b + c + e)
            if d < 2:
                by_place[0, d, i], by_place[1, d, i] = (moved_y - now_y) * per, (moved_z - now_z) * per
            else:
                by_speed[0, d - 2, i], by_speed[1, d - 2, i] = (moved_y - now_y) * per, (moved_z - now_z) * per


@jit(**STRICT)
def _over_period(
    laws: Laws, j: int, p: int, motion: Sampled, basis: np.ndarray, rate: np.ndarray, project: np.ndarray,
    want: bool, force: np.ndarray, slopes: RoundSlopes,
) -> None:  # fmt: skip
    """Add to row p of force and slopes what acts there: the filling of bushing j, or the contact of one end."""
    n, harmonics, contact = motion.place.shape[2], basis.shape[1], p >= laws.bushings.size
    bushing, numbers, still, closed = laws.bushings[j], laws.numbers, -1, np.zeros(n, np.bool_)
    size = (2 if laws.remembers[j] else 0) if contact else laws.memory[j]
    if contact:
        touches, still = _closed(bushing, numbers, motion.place[p], closed)
        if not touches:
            return
    omega, spin = motion.omega, motion.spin
    bushing.step = 2.0 * np.pi / (omega * n)
    told = 2 if contact else size  # numbers before the forces in what a step returns
    reach = np.max(np.abs(motion.place[p]))
    eps = DIFFERENCE * max(reach, 1e-6 * numbers[bushing.reach])
    memory, old, u = np.zeros(max(laws.room, 2)), np.zeros(max(laws.room, 2)), np.zeros(INPUTS)
    now, moved, slope = np.zeros(told + OUTPUTS), np.zeros(told + OUTPUTS), np.zeros((told + OUTPUTS, told + INPUTS))
    carried, later = np.zeros((2, told, harmonics)), np.zeros((2, told, harmonics))
    of_force = slopes.rows[p]
    shown, used = np.full(n, -1), 0  # row of each sample in what is carried
    once, start = not size or still >= 0, still + 1
    if contact and size == 0:
        _lasting(bushing, numbers, motion.place[p], motion.speed[p], closed, spin, eps, eps * omega, want,
                 force[p], slopes.x[p], slopes.v[p])  # fmt: skip
    if not once:
        _begin(bushing, numbers, contact, size, motion, p, eps, memory, u, now, want, basis, carried)
    differs, stop = want, n if once else MAX_PERIODS * n
    for m in range(MAX_PERIODS * n):
        i = (start + m) % n
        last = i - 1 if i > 0 else n - 1
        if m == stop:
            break
        if m % n == 0 and not once:
            settled = m > n and _settled(memory, old, size, contact, reach, reach * omega)
            if m == n:
                differs = False
            elif not differs and (settled or m == (MAX_PERIODS - 2) * n):
                if not want and settled:
                    break
                differs, stop = want, m + 2 * n  # a period in which derivatives become periodic, and one that counts
            for k in range(size):
                old[k] = memory[k]
            force[p] = 0.0  # the last period alone counts
            used, shown[:] = 0, -1
        if contact and (closed[last] == closed[i] if size == 0 else not (closed[last] or closed[i])):
            continue
        _take(motion, p, last, i, u)
        _step(bushing, numbers, contact, size, memory, u, spin, now)
        for d in range(2):
            force[p, d, i] += now[told + d]
            force[p, d, last] += now[told + 2 + d]
            if not contact:
                force[p, d, i] -= laws.spring[j] * u[2 + d] + laws.damper[j] * u[6 + d]
        if differs:
            begins_or_ends = closed[last] != closed[i]
            whole = size > 0 or begins_or_ends
            _differences(bushing, numbers, contact, told, size, memory, u, omega, spin, eps, now, moved, slope,
                         0 if whole else 2)  # fmt: skip
            if not contact:
                for d in range(2):
                    slope[told + d, told + 2 + d] -= laws.spring[j]
                    slope[told + d, told + 6 + d] -= laws.damper[j]
            if whole:
                slopes.carried[p, i] = True
                _keep(slope, told, slopes.step[p, i])
                later[:] = 0.0
                rows = (basis[last], basis[i], rate[last], rate[i])
                for k in range(size):
                    _add_rows(slope, k, told, omega, *rows, carried, later, k)
                for sample in (i, last) if begins_or_ends else (i, i):
                    if shown[sample] < 0:
                        shown[sample] = used
                        of_force[:, :, used] = 0.0
                        slopes.onto[p, used] = project[:, sample]
                        used += 1
                for d in range(2):
                    _add_rows(slope, told + d, told, omega, *rows, carried, of_force[d], shown[i])
                    if begins_or_ends:
                        _add_rows(slope, told + 2 + d, told, omega, *rows, carried, of_force[d], shown[last])
                if size:
                    carried, later = later, carried
            else:
                for a in range(2):
                    for b in range(2):
                        slopes.x[p, a, b, i] = slope[told + a, told + 2 + b]
                        slopes.v[p, a, b, i] = slope[told + a, told + 6 + b]
        for k in range(size):
            memory[k] = now[k]
    slopes.used[p] = used


@jit(**STRICT)
def _keep(slope: np.ndarray, size: int, out: np.ndarray) -> None:
    """Keep derivatives of memory and of the whole force of a step."""
    width = out.shape[1]
    for k in range(size + 2):
        row = k if k < size else out.shape[0] - 2 + k - size
        for d in range(size + INPUTS):
            column = d if d < size else width - INPUTS + d - size
            out[row, column] = slope[k, d] + (slope[k + 2, d] if k >= size else 0.0)


@jit(**STRICT)
def _same(place: np.ndarray, p: int, q: int) -> bool:
    for d in range(2):
        for i in range(place.shape[2]):
            if place[p, d, i] != place[q, d, i]:
                return False
    return True


@jit(**STRICT, forceinline=True)
def _copy(numbers: np.ndarray, start: int, to: int, count: int) -> None:
    """Copy so many numbers of a contiguous array from one place of it to another one."""
    was, now = at(numbers, start), at(numbers, to)  # slices would take seconds to compile
    for i in range(count):
        now[i] = was[i]


@jit(**STRICT)
def _copy_end(force: np.ndarray, slopes: RoundSlopes, p: int) -> None:
    """Fill the row after one of force and slopes with it: both ends of a bushing without length."""
    n, harmonics = slopes.onto.shape[1:]
    _copy(force, 2 * n * p, 2 * n * (p + 1), 2 * n)
    for slope in (slopes.x, slopes.v):
        _copy(slope, 4 * n * p, 4 * n * (p + 1), 4 * n)
    used = slopes.used[p]
    slopes.used[p + 1] = used
    for i in range(n):
        slopes.carried[p + 1, i] = slopes.carried[p, i]
    if used:
        size = slopes.step.size // slopes.step.shape[0]
        _copy(slopes.step, size * p, size * (p + 1), size)
        _copy(slopes.onto, n * harmonics * p, n * harmonics * (p + 1), used * harmonics)
        for block in range(4 * p, 4 * p + 4):  # of harmonics of y and z in forces along y and z
            _copy(slopes.rows, n * harmonics * block, n * harmonics * (block + 4), used * harmonics)


@jit(**STRICT)
def fill_round_forces(
    laws: Laws, motion: Sampled, basis: np.ndarray, rate: np.ndarray, project: np.ndarray, want: bool,
    force: np.ndarray, slopes: RoundSlopes,
) -> None:  # fmt: skip
    """Fill force (n_points, 2, N) and, if wanted, slopes along one period.

    ``basis`` and ``rate`` (N, K) are the harmonic functions and their derivatives by the angle, ``project`` (K, N)
    takes the harmonics of N samples.
    """
    force[:] = 0.0
    if want:
        slopes.x[:] = 0.0
        slopes.v[:] = 0.0
        slopes.carried[:] = False
        slopes.used[:] = 0
    count = laws.bushings.size
    for j in range(count):
        if not laws.linear[j]:
            _over_period(laws, j, j, motion, basis, rate, project, want, force, slopes)
        p = count + 2 * j
        _over_period(laws, j, p, motion, basis, rate, project, want, force, slopes)
        if _same(motion.place, p, p + 1):
            _copy_end(force, slopes, p)
        else:
            _over_period(laws, j, p + 1, motion, basis, rate, project, want, force, slopes)
