"""Forces of the clearances along one period of a motion, and their derivatives; compiled.

Points stand as in the engines: the clearances' middles (filling), then both ends of each (contact); each has one row,
or two along y and z. Elements with memory are marched over periods until it is periodic; a contact that is open
somewhere forgets there, so that one period suffices. Derivatives are difference quotients: by the motion at the same
sample, or, with memory and where a contact begins or ends, carried along the march to the harmonics of the motion. The
linear system's part is left out: the filling's stiffness and damping of small motions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..clearance.kernel import follow_law
from ..clearance.pointers import at
from ..clearance.record import ClearanceRecord
from ..core.jit import STRICT, jit
from .elements import ONE, depth_at, step_between
from .force_slopes import add_event, add_rows, carry, differences, fill_lasting, keep, keep_lasting, side_of

__all__ = ["Laws", "Sampled", "Slopes", "depths", "equal", "fill_forces"]

PIECES = 64  # steps in which a filling is moved from the unloaded position
MAX_PERIODS = 32  # until the memory is periodic: springs with sliders need one, Bouc-Wen's mean some
PERIODIC = 1e-10  # relative change of a memory from period to period that counts as periodic
DIFFERENCE = 1e-7  # step of difference quotients, over the motion


class Laws(NamedTuple):
    """Laws of fillings and contacts in the clearances."""

    bushings: np.ndarray  # (n_bushings,) records of the kernel
    numbers: np.ndarray  # of the records
    spring: np.ndarray  # (n_bushings,) stiffness that the linear system has already, N/m
    damper: np.ndarray  # (n_bushings,) damping that the linear system has already, N s/m
    memory: np.ndarray  # (n_bushings,) number of state variables of the filling, 0 if they never change
    linear: np.ndarray  # (n_bushings,) True where the filling adds nothing to its spring and damper
    remembers: np.ndarray  # (n_bushings,) True where an end remembers its impact speed or bristles
    room: int  # largest number of state variables of a filling or end
    span: float  # s of a law over time that pass in a period of the motion, however long that takes; else 0
    rows: np.ndarray  # (n_points, 2) rows of each point along y and z; of one coordinate twice the same
    width: np.ndarray  # (n_points,) number of rows

    def rows_of(self, j: int) -> np.ndarray:
        """Return the rows (3, 2) of a clearance's middle and of both its ends."""
        end = len(self.bushings) + 2 * j
        return self.rows[[j, end, end + 1]]


class Sampled(NamedTuple):
    """A periodic motion at the samples of a period."""

    place: np.ndarray  # (n_rows, N) m
    speed: np.ndarray  # (n_rows, N) m/s
    omega: float  # 1/s
    spin: float  # rad/s


class Slopes(NamedTuple):
    """Derivatives of the forces at every sample of a period; changed in place."""

    x: np.ndarray  # (n_points, 2, 2, N) force by displacement at the same sample, N/m
    v: np.ndarray  # (n_points, 2, 2, N) by the velocity, N s/m
    step: np.ndarray  # (n_points, N, m + 2, m + 8) memory, then forces, by memory and a step's inputs
    carried: np.ndarray  # (n_points, N) True where `step` holds instead of `x` and `v`
    rows: np.ndarray  # (n_points, 2, 2, N, K) force at some samples by the harmonics of y and z: carried derivatives
    onto: np.ndarray  # (n_points, N, K) harmonics of a unit force at each of these samples
    used: np.ndarray  # (n_points,) number of these samples


@jit(**STRICT, forceinline=True)
def _fill(place: np.ndarray, speed: np.ndarray, rows: np.ndarray, width: int, last: int, i: int, u: np.ndarray) -> None:
    """Gather a point's inputs of a step from one sample to the next one."""
    for d in range(width):
        row = rows[d]
        u[d], u[width + d] = place[row, last], place[row, i]
        u[2 * width + d], u[3 * width + d] = speed[row, last], speed[row, i]


@jit(**STRICT)
def depths(laws: Laws, place: np.ndarray) -> np.ndarray:
    """Return the penetrations (n_ends, N) of all ends at place (n_rows, N), m; below 0 in the gap."""
    count = laws.bushings.size
    penetration = np.empty((2 * count, place.shape[1]))
    for p in range(2 * count):
        y, z = laws.rows[count + p]
        for i in range(penetration.shape[1]):
            penetration[p, i] = depth_at(laws.bushings[p // 2], laws.numbers, place[y, i], place[z, i])
    return penetration


@jit(**STRICT)
def _find_walls(
    bushing: ClearanceRecord, numbers: np.ndarray, place: np.ndarray, rows: np.ndarray, closed: np.ndarray
) -> tuple[bool, int]:
    """Fill in the wall that an end touches at each sample; return if at any, and the last sample at none, or -1."""
    touches, open_sample, slot = False, -1, bushing.touching == 1
    lower, upper = numbers[bushing.wall], numbers[bushing.wall + 1]
    for i in range(closed.size):
        x = place[rows[1], i]
        if slot:
            closed[i] = 1 if x > upper else -1 if x < lower else 0
        else:
            closed[i] = side_of(bushing, numbers, place[rows[0], i], x)
        if closed[i]:
            touches = True
        else:
            open_sample = i
    return touches, open_sample


@jit(**STRICT)
def _initial_memory(
    bushing: ClearanceRecord, numbers: np.ndarray, contact: bool, width: int, size: int, motion: Sampled,
    rows: np.ndarray, eps: float, memory: np.ndarray, u: np.ndarray, out: np.ndarray, diff: bool, basis: np.ndarray,
    carried: np.ndarray,
) -> None:  # fmt: skip
    """Compute the memory at the last sample of an element moved there from rest, and its derivatives.

    A filling comes from the unloaded position, a contact from the middle of the motion.
    """
    last, rest = motion.place.shape[1] - 1, np.zeros(2)
    if contact:
        for d in range(width):
            rest[d] = np.mean(motion.place[rows[d]])
    pieces = 1 if contact else PIECES
    first = np.zeros(size)
    for shift in range(width, -1 if diff else width - 1, -1):  # the position, then perturbed along each coordinate
        memory[:size] = 0.0
        for piece in range(pieces):
            for d in range(width):
                travel = motion.place[rows[d], last] - rest[d] + (eps if d == shift else 0.0)
                u[d], u[width + d] = rest[d] + travel * piece / pieces, rest[d] + travel * (piece + 1) / pieces
                u[2 * width + d] = u[3 * width + d] = motion.speed[rows[d], last] if contact else 0.0
            step_between(bushing, numbers, contact, size, memory, u, motion.spin, out)
            for k in range(size):
                memory[k] = out[k]
        for k in range(size):
            if shift == width:
                first[k] = memory[k]
            else:
                change = (memory[k] - first[k]) / eps
                for r in range(basis.shape[1]):
                    carried[shift, k, r] = change * (basis[last, r] - (1.0 if contact and r == 0 else 0.0))
    for k in range(size):
        memory[k] = first[k]


@jit(**STRICT)
def _is_periodic(memory: np.ndarray, old: np.ndarray, size: int, contact: bool, reach: float, speed: float) -> bool:
    for k in range(size):
        if abs(memory[k] - old[k]) > PERIODIC * (speed if contact and k == 0 else reach):
            return False
    return True


@jit(**STRICT)
def _add_element(
    laws: Laws, j: int, p: int, motion: Sampled, basis: np.ndarray, rate: np.ndarray, project: np.ndarray,
    diff: bool, force: np.ndarray, slopes: Slopes,
) -> None:  # fmt: skip
    """Add force and slopes of point p: the filling of bushing j, or the contact of one end."""
    n, harmonics, contact = basis.shape[0], basis.shape[1], p >= laws.bushings.size
    bushing, numbers, rows, width = laws.bushings[j], laws.numbers, laws.rows[p], laws.width[p]
    place, speed, spring, damper = motion.place, motion.speed, laws.spring[j], laws.damper[j]
    by_place, by_speed, steps, is_carried = slopes.x[p], slopes.v[p], slopes.step[p], slopes.carried[p]
    of_force, onto, total = slopes.rows[p], slopes.onto[p], np.zeros((width, n))
    open_sample, closed = -1, np.zeros(n, np.int8)
    size = (width if laws.remembers[j] else 0) if contact else laws.memory[j]
    if contact:
        touches, open_sample = _find_walls(bushing, numbers, place, rows, closed)
        if not touches:
            return
    omega, spin = motion.omega, motion.spin
    bushing.step = 2.0 * np.pi / (omega * n)
    skip = width if contact else size  # numbers before the forces in the output of a step
    reach = 0.0
    for d in range(width):
        for i in range(n):
            reach = max(reach, abs(place[rows[d], i]))
    eps = DIFFERENCE * max(reach, 1e-6 * numbers[bushing.reach])
    memory, old, u = np.zeros(max(laws.room, 2)), np.zeros(max(laws.room, 2)), np.zeros(4 * width)
    now, moved = np.zeros(skip + 2 * width), np.zeros(skip + 2 * width)
    slope = np.zeros((skip + 2 * width, skip + 4 * width))
    carried, carried_next = np.zeros((2, skip, harmonics)), np.zeros((2, skip, harmonics))
    weights, by_impact, pending = np.zeros((2, harmonics)), np.zeros(2), False
    row_of, used = np.full(n, -1), 0  # row of each sample in the carried derivatives
    one_period, start = not size or open_sample >= 0, open_sample + 1
    if not one_period:
        _initial_memory(bushing, numbers, contact, width, size, motion, rows, eps, memory, u, now, diff, basis, carried)
    differs, stop, counted = diff, n if one_period else MAX_PERIODS * n, 0 if one_period else n
    for m in range(MAX_PERIODS * n):
        i = (start + m) % n
        last = i - 1 if i > 0 else n - 1
        if m == stop:
            break
        if m % n == 0 and not one_period:
            settled = m > n and _is_periodic(memory, old, size, contact, reach, reach * omega)
            if m == 2 * n:
                if settled:
                    break
                differs = False
            elif m > n and not differs and (settled or m == (MAX_PERIODS - 2) * n):
                if not diff and settled:
                    break
                # A period in which derivatives become periodic, and one that counts.
                differs, stop, counted = diff, m + 2 * n, m + n
            for k in range(size):
                old[k] = memory[k]
            total[:] = 0.0  # the last period alone counts
            used, row_of[:], weights[:], pending = 0, -1, 0.0, False
        if contact and not closed[last] and not closed[i]:
            continue
        _fill(place, speed, rows, width, last, i, u)
        if contact and bushing.rows > 1:
            follow_law(bushing, numbers, laws.span * i / n, ONE)
        lasts = contact and closed[last] * closed[i] > 0
        if lasts and not bushing.rubs:
            fill_lasting(bushing, numbers, width, size, memory, u, omega, spin, eps, differs, now, moved, by_place,
                     by_speed, by_impact, i)  # fmt: skip
            for d in range(width):
                total[d, i] += now[d]
            if differs and size:
                pending = is_carried[i] = True
                keep_lasting(width, by_place, by_speed, by_impact, steps, i, project, weights)
            continue
        if pending and closed[i]:  # at the other wall
            used, pending = carry(onto, of_force, width, used, weights, carried), False
        step_between(bushing, numbers, contact, size, memory, u, spin, now)
        for d in range(width):
            total[d, i] += now[skip + d]
            if contact:
                total[d, last] += now[skip + width + d]
            else:
                total[d, i] -= spring * u[width + d] + damper * u[3 * width + d]
        if differs:
            event = contact and not lasts  # begins or ends
            differences(bushing, numbers, contact, width, skip, size, memory, u, omega, spin, eps, now, moved, slope,
                         size > 0 or event)  # fmt: skip
            if not contact:
                for d in range(width):
                    slope[skip + d, skip + width + d] -= spring
                    slope[skip + d, skip + 3 * width + d] -= damper
            if size > 0:
                if m >= counted:
                    is_carried[i] = True
                    keep(slope, width, skip, steps, i)
                carried_next[:, :size] = 0.0
                for k in range(size):
                    add_rows(slope, k, width, skip, omega, basis, rate, last, i, carried, carried_next, k)
            if m < counted:  # only memory is carried on until the derivatives are periodic
                pass
            elif event and not bushing.rubs:
                add_event(slope, width, skip, size, by_place, by_speed, is_carried, steps, last, i, project, weights)
                if size and closed[last]:
                    used, pending = carry(onto, of_force, width, used, weights, carried), False
            elif size > 0:
                for sample in (i, last) if event else (i, i):
                    if row_of[sample] < 0:
                        row_of[sample] = used
                        for r in range(harmonics):
                            onto[used, r] = project[r, sample]
                            for k in range(width):
                                for d in range(width):
                                    of_force[k, d, used, r] = 0.0
                        used += 1
                for d in range(width):
                    add_rows(slope, skip + d, width, skip, omega, basis, rate, last, i, carried, of_force[d], row_of[i])
                    if event:
                        add_rows(slope, skip + width + d, width, skip, omega, basis, rate, last, i, carried,
                                  of_force[d], row_of[last])  # fmt: skip
            else:
                for a in range(width):
                    for b in range(width):
                        by_place[a, b, i] = slope[skip + a, skip + width + b]
                        by_speed[a, b, i] = slope[skip + a, skip + 3 * width + b]
            if size:
                carried, carried_next = carried_next, carried
        for k in range(size):
            memory[k] = now[k]
    if pending:
        used = carry(onto, of_force, width, used, weights, carried)
    slopes.used[p] = used
    for d in range(width):
        for i in range(n):
            force[rows[d], i] += total[d, i]


@jit(**STRICT)
def equal(values: np.ndarray, p: int, q: int) -> bool:
    """Return True if two rows are equal."""
    for k in range(values.shape[1]):
        if values[p, k] != values[q, k]:
            return False
    return True


@jit(**STRICT, forceinline=True)
def _copy(numbers: np.ndarray, start: int, to: int, count: int) -> None:
    """Copy so many numbers of a contiguous array within it."""
    was, now = at(numbers, start), at(numbers, to)  # slices would take seconds to compile
    for i in range(count):
        now[i] = was[i]


@jit(**STRICT)
def _copy_end(laws: Laws, force: np.ndarray, slopes: Slopes, p: int) -> None:
    """Copy force and slopes of a point to the next one: both ends of a clearance without length."""
    n, harmonics = slopes.onto.shape[1:]
    for d in range(laws.width[p]):
        _copy(force, n * laws.rows[p, d], n * laws.rows[p + 1, d], n)
    for slope in (slopes.x, slopes.v):
        _copy(slope, 4 * n * p, 4 * n * (p + 1), 4 * n)
    used = slopes.used[p]
    slopes.used[p + 1] = used
    carries = False
    for i in range(n):
        slopes.carried[p + 1, i] = slopes.carried[p, i]
        carries = carries or slopes.carried[p, i]
    if carries:
        size = slopes.step.size // slopes.step.shape[0]
        _copy(slopes.step, size * p, size * (p + 1), size)
    if used:
        _copy(slopes.onto, n * harmonics * p, n * harmonics * (p + 1), used * harmonics)
        for block in range(4 * p, 4 * p + 4):  # of harmonics of y and z in forces along y and z
            _copy(slopes.rows, n * harmonics * block, n * harmonics * (block + 4), used * harmonics)


@jit(**STRICT)
def fill_forces(
    laws: Laws, motion: Sampled, basis: np.ndarray, rate: np.ndarray, project: np.ndarray, diff: bool,
    force: np.ndarray, slopes: Slopes,
) -> None:  # fmt: skip
    """Fill force (n_rows, N) and, with ``diff``, slopes along one period.

    ``basis`` and ``rate`` (N, K) are the harmonic functions and their derivatives by the angle, ``project`` (K, N)
    returns the harmonics of N samples.
    """
    force[:] = 0.0
    count = laws.bushings.size
    if diff:
        slopes.carried[:] = False
        slopes.used[:] = 0
        for p in range(laws.width.size):
            for d in range(laws.width[p]):
                for e in range(laws.width[p]):
                    slopes.x[p, d, e] = 0.0
                    slopes.v[p, d, e] = 0.0
    for j in range(count):
        if not laws.linear[j]:
            _add_element(laws, j, j, motion, basis, rate, project, diff, force, slopes)
        p = count + 2 * j
        _add_element(laws, j, p, motion, basis, rate, project, diff, force, slopes)
        same = laws.width[p] == 1 or laws.rows[p, 0] != laws.rows[p + 1, 0]  # both ends slide by one row
        for d in range(laws.width[p]):
            same = same and equal(motion.place, laws.rows[p, d], laws.rows[p + 1, d])
        if same:
            _copy_end(laws, force, slopes, p)
        else:
            _add_element(laws, j, p + 1, motion, basis, rate, project, diff, force, slopes)
