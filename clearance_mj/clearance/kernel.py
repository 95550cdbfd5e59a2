"""The compiled kernel of clearances, used by engines, energy balances and identification.

In every step a loop calls for each clearance `film_force` and `follow_law`, and for each of its two ends the wall,
`depth_in` of one coordinate or `touch` of two, and `press` of one coordinate or `friction_force` of two where it
touches. Vectors are tuples of one coordinate or two, numbers plain or of all lanes (see lanes.py).

Displacements are from the unloaded shaft. If that is off the middle, fillings and amplitude laws use the distance
from the middle, which thins the film. The filling's springs are in equilibrium at the unloaded shaft, so that only
changes of their force act. ``numbers`` are changed in place.

Friction acts along t = x × n against the speed ṙ·t + R Ω of the shaft's surface: bristles follow it until their force
is that of friction, then slide. They turn with n, so that a shaft may roll around its bushing.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.jit import OPTIONS, inlined, jit
from .follower import SLOWEST_IMPACT, impact_speed, signed_penetration
from .lanes import any_below, choose, exponential, larger, root, signed, smaller, where_above
from .pointers import at, call_law
from .record import END_MEMORY, ClearanceRecord
from .registers import block, load, spread, store
from .vectors import TINY, minus, of_one_or_two, plus

__all__ = [
    "BRISTLES", "answered", "depth_in", "distance", "film_force", "follow_law", "forget", "friction_force",
    "friction_limit", "limit_bristles", "press", "save_previous_state", "touch",
]  # fmt: skip

BRISTLES = 3  # row of their deflection in an end's state

_load_vector = of_one_or_two(
    lambda numbers, row, like, lanes: (load(numbers, row, lanes),),
    lambda numbers, row, like, lanes: (load(numbers, row, lanes), load(numbers, row + 1, lanes)),
)
_of_lane = of_one_or_two(
    lambda numbers, row, like, lane, count: (numbers[row * count + lane],),
    lambda numbers, row, like, lane, count: (numbers[row * count + lane], numbers[(row + 1) * count + lane]),
)


def _store_one(numbers: Any, row: Any, r: Any, lanes: Any) -> None:
    store(numbers, row, r[0], lanes)


def _store_two(numbers: Any, row: Any, r: Any, lanes: Any) -> None:
    store(numbers, row, r[0], lanes)
    store(numbers, row + 1, r[1], lanes)


_store_vector = of_one_or_two(_store_one, _store_two)
_dimension = of_one_or_two(lambda r: 1, lambda r: 2)
_zero_vector = of_one_or_two(lambda r: (0.0,), lambda r: (0.0, 0.0))


@inlined
def save_previous_state(bushing: ClearanceRecord, numbers: np.ndarray) -> None:
    """Save the state of a clearance of one case before the next step, for energies."""
    for i in range(bushing.coordinates):
        numbers[bushing.was + i] = numbers[bushing.place + i]
    for i in range(bushing.states):
        numbers[bushing.memory_was + i] = numbers[bushing.memory + i]
    for i in range(bushing.width):
        numbers[bushing.contact_was + i] = numbers[bushing.contact + i]


# Functions for single lanes are called, not inlined: they are seldom needed and slow to compile.


@jit(**OPTIONS)
def _fill_by_lane(like: Any, bushing: ClearanceRecord, numbers: np.ndarray, count: int) -> None:
    """Write results of a filling, lane by lane, from gathered displacement, its change and spin."""
    result, size = (bushing.room + 6) * count, _dimension(like)
    for lane in range(count):
        call_law(
            bushing.filling_law, at(numbers, bushing.filling * count + lane * bushing.filling_size),
            at(numbers, bushing.memory * count + lane * bushing.states),
            _of_lane(numbers, bushing.room, like, lane, count), _of_lane(numbers, bushing.room + 2, like, lane, count),
            numbers[(bushing.room + 4) * count + lane], bushing.step, at(numbers, result),
        )  # fmt: skip
        for i in range(size + size * size):
            numbers[(bushing.out + i) * count + lane] = numbers[result + i]


@jit(**OPTIONS)
def _press_by_lane(bushing: ClearanceRecord, numbers: np.ndarray, count: int) -> None:
    """Write results of a contact, lane by lane, from gathered depth, speed and impact speed."""
    result = (bushing.room + 6) * count
    for lane in range(count):
        arguments = bushing.room * count + lane
        call_law(
            bushing.contact_law, at(numbers, bushing.contact * count + lane * bushing.width), numbers[arguments],
            numbers[arguments + count], numbers[arguments + 2 * count], at(numbers, result),
        )  # fmt: skip
        for i in range(2):
            numbers[(bushing.out + i) * count + lane] = numbers[result + i]


@jit(**OPTIONS)
def _touch_by_lane(bushing: ClearanceRecord, numbers: np.ndarray, count: int) -> None:
    """Write results of a wall, lane by lane, from gathered displacements."""
    result = (bushing.room + 6) * count
    for lane in range(count):
        arguments = bushing.room * count + lane
        parameters = at(numbers, bushing.wall * count + lane * bushing.wall_size)
        call_law(bushing.wall_law, parameters, (numbers[arguments], numbers[arguments + count]), at(numbers, result))
        for i in range(3):
            numbers[(bushing.out + i) * count + lane] = numbers[result + i]


@jit(**OPTIONS)
def _follow_by_lane(bushing: ClearanceRecord, numbers: np.ndarray, time: float, count: int) -> None:
    """Interpolate between the rows of laws, lane by lane, from gathered distances from the middle."""
    last = bushing.rows - 1
    for lane in range(count):
        envelope, decay = bushing.envelope * count + lane, numbers[bushing.decay * count + lane]
        numbers[envelope] = max(numbers[bushing.room * count + lane], numbers[envelope] * decay)
        abscissa, period = numbers[envelope] if bushing.by_amplitude else time, numbers[bushing.period * count + lane]
        if period > 0.0:
            abscissa = time % period
        row, upper, fraction = 0, last, 0.0
        if abscissa >= numbers[(bushing.abscissa + last) * count + lane]:
            row = last
        elif abscissa > numbers[bushing.abscissa * count + lane]:
            while upper - row > 1:  # numpy.searchsorted would count references
                middle = (row + upper) // 2
                if numbers[(bushing.abscissa + middle) * count + lane] <= abscissa:
                    row = middle
                else:
                    upper = middle
            low = numbers[(bushing.abscissa + row) * count + lane]
            fraction = (abscissa - low) / (numbers[(bushing.abscissa + row + 1) * count + lane] - low)
        width = bushing.width
        values = at(numbers, bushing.contact * count + lane * width)
        table = at(numbers, bushing.table * count + (lane * bushing.rows + row) * width)
        for i in range(width):
            values[i] = table[i]
            if fraction > 0.0:
                values[i] += fraction * (table[width + i] - table[i])


@inlined
def film_force(bushing: ClearanceRecord, numbers: np.ndarray, r: Any, spin: Any, lanes: tuple[int, ...]) -> None:
    """Advance the filling to r, m; `answered` is then its force above that of the unloaded shaft, and damping.

    The spin is in rad/s.
    """
    dr = minus(r, _load_vector(numbers, bushing.place, r, lanes))
    _store_vector(numbers, bushing.place, r, lanes)
    position, step = plus(r, _load_vector(numbers, bushing.offset, r, lanes)), bushing.step
    if bushing.filling_by_lane:
        _store_vector(numbers, bushing.room, position, lanes)
        _store_vector(numbers, bushing.room + 2, dr, lanes)
        store(numbers, bushing.room + 4, spin, lanes)
        _fill_by_lane(_zero_vector(r), bushing, numbers, len(lanes))
    else:
        parameters, memory = block(numbers, bushing.filling, lanes), block(numbers, bushing.memory, lanes)
        call_law(bushing.filling_law, parameters, memory, position, dr, spin, step, block(numbers, bushing.out, lanes))
    elastic = minus(_load_vector(numbers, bushing.out, r, lanes), _load_vector(numbers, bushing.preload, r, lanes))
    _store_vector(numbers, bushing.out, elastic, lanes)


@inlined
def answered(bushing: ClearanceRecord, numbers: np.ndarray, i: int, lanes: tuple[int, ...]) -> Any:
    """Return number i of what `film_force` stored: elastic forces, then damping; of two coordinates yy, yz, zy, zz."""
    return load(numbers, bushing.out + i, lanes)


@inlined
def distance(bushing: ClearanceRecord, numbers: np.ndarray, lanes: tuple[int, ...]) -> Any:
    """Return the shaft's distance from the clearance's middle at the last `film_force`, m."""
    z = load(numbers, bushing.place, lanes) + load(numbers, bushing.offset, lanes)
    if bushing.coordinates == 1:
        return abs(z)
    y = z
    z = load(numbers, bushing.place + 1, lanes) + load(numbers, bushing.offset + 1, lanes)
    return root(y * y + z * z)


@inlined
def follow_law(bushing: ClearanceRecord, numbers: np.ndarray, time: float, lanes: tuple[int, ...]) -> None:
    """Set the contact's parameters at a time, s: linear between the law's rows, constant beyond the ends."""
    if bushing.rows > 1:
        store(numbers, bushing.room, distance(bushing, numbers, lanes), lanes)
        _follow_by_lane(bushing, numbers, time, len(lanes))


@inlined
def _contact_k_c(
    bushing: ClearanceRecord, numbers: np.ndarray, depth: Any, inwards: Any, impact: Any, lanes: tuple[int, ...]
) -> Any:
    """Return stiffness, N/m, and damping, N s/m, of one end: half of those of the clearance's contact law."""
    if bushing.contact_by_lane:
        store(numbers, bushing.room, depth, lanes)
        store(numbers, bushing.room + 1, inwards, lanes)
        store(numbers, bushing.room + 2, impact, lanes)
        _press_by_lane(bushing, numbers, len(lanes))
    else:
        parameters, out = block(numbers, bushing.contact, lanes), block(numbers, bushing.out, lanes)
        call_law(bushing.contact_law, parameters, depth, inwards, impact, out)
    return 0.5 * load(numbers, bushing.out, lanes), 0.5 * load(numbers, bushing.out + 1, lanes)


@inlined
def depth_in(bushing: ClearanceRecord, numbers: np.ndarray, x: Any, lanes: tuple[int, ...]) -> Any:
    """Return the penetration into one of two walls, m, > 0 into the upper one, < 0 into the lower, 0 between."""
    return signed_penetration(x, load(numbers, bushing.wall, lanes), load(numbers, bushing.wall + 1, lanes))


@inlined
def forget(bushing: ClearanceRecord, numbers: np.ndarray, end: int, lanes: tuple[int, ...]) -> None:
    """Reset the state of the contact of end 0 or 1."""
    memory, zero = bushing.ends + END_MEMORY * end, spread(0.0, lanes)
    store(numbers, memory, zero, lanes)
    store(numbers, memory + BRISTLES, zero, lanes)


@inlined
def press(bushing: ClearanceRecord, numbers: np.ndarray, end: int, g: Any, speed: Any, lanes: tuple[int, ...]) -> Any:
    """Advance the contact of end 0 or 1 at a signed penetration, m; return stiffness, N/m, and damping, N s/m.

    A contact begins at the end of the gap, or at the other wall, which fixes its impact speed, and ends in the gap.
    Each end has its own speed and half of the clearance's stiffness and damping.
    """
    memory, inwards = bushing.ends + END_MEMORY * end, signed(speed, g)
    impact = impact_speed(load(numbers, memory, lanes), g, inwards)
    store(numbers, memory, signed(impact, g), lanes)
    return _contact_k_c(bushing, numbers, abs(g), inwards, impact, lanes)


@inlined
def touch(bushing: ClearanceRecord, numbers: np.ndarray, y: Any, z: Any, lanes: tuple[int, ...]) -> Any:
    """Return the depth of a point in a wall of two coordinates, m, 0 in the gap, and the direction n along y and z."""
    zero = spread(0.0, lanes)
    if bushing.coordinates == 1:  # sliding along the wall, and pressing
        z = z + load(numbers, bushing.offset, lanes)
        y = 0.0 * y
    else:
        y, z = y + load(numbers, bushing.offset, lanes), z + load(numbers, bushing.offset + 1, lanes)
    reach = load(numbers, bushing.reach, lanes)
    if not any_below(reach * reach - (y * y + z * z), 0.0):
        return zero, zero, zero
    if bushing.wall_by_lane:
        store(numbers, bushing.room, y, lanes)
        store(numbers, bushing.room + 1, z, lanes)
        _touch_by_lane(bushing, numbers, len(lanes))
    else:
        out = block(numbers, bushing.out, lanes)
        call_law(bushing.wall_law, block(numbers, bushing.wall, lanes), (y, z), out)
    depth = larger(load(numbers, bushing.out, lanes), 0.0)
    return depth, load(numbers, bushing.out + 1, lanes), load(numbers, bushing.out + 2, lanes)


@inlined
def friction_force(
    bushing: ClearanceRecord, numbers: np.ndarray, end: int, depth: Any, n_y: Any, n_z: Any, y: Any, z: Any,
    speed_y: Any, speed_z: Any, spin: Any, lanes: tuple[int, ...],
) -> Any:  # fmt: skip
    """Advance the contact of end 0 or 1, of a depth along n, at y, z, m, and its bristles, without sliding.

    Returns stiffness, N/m, damping, N s/m, and the bristles' deflection, m. A contact begins at the end of the gap or
    on the other side, which fixes its impact speed. Each end carries half of stiffness and damping.
    """
    memory, inwards = bushing.ends + END_MEMORY * end, n_y * speed_y + n_z * speed_z
    previous_y, previous_z = load(numbers, memory + 1, lanes), load(numbers, memory + 2, lanes)
    previous_impact = where_above(load(numbers, memory, lanes), previous_y * n_y + previous_z * n_z)
    impact = where_above(choose(previous_impact, larger(inwards, SLOWEST_IMPACT), previous_impact), depth)
    bristles = 0.0 * depth
    if bushing.rubs:
        # Along the chord of the step: t at its middle follows from n at both ends.
        mean_y, mean_z = previous_y + n_y, previous_z + n_z
        size = larger(root(mean_y * mean_y + mean_z * mean_z), TINY)
        dy, dz = y - load(numbers, memory + 4, lanes), z - load(numbers, memory + 5, lanes)
        deflection = load(numbers, memory + BRISTLES, lanes) + (mean_y * dz - mean_z * dy) / size
        deflection += load(numbers, bushing.friction + 5, lanes) * spin * bushing.step
        bristles = where_above(where_above(deflection, previous_impact), depth)
    store(numbers, memory, impact, lanes)
    store(numbers, memory + 1, n_y, lanes)
    store(numbers, memory + 2, n_z, lanes)
    store(numbers, memory + BRISTLES, bristles, lanes)
    store(numbers, memory + 4, y, lanes)
    store(numbers, memory + 5, z, lanes)
    k, c = _contact_k_c(bushing, numbers, depth, inwards, impact, lanes)
    return k, where_above(c, depth), bristles


@inlined
def friction_limit(
    bushing: ClearanceRecord, numbers: np.ndarray, normal: Any, sliding: Any, lanes: tuple[int, ...]
) -> Any:
    """Return the largest friction, N, under a normal force, N, at a speed of sliding, m/s."""
    limit, excess = load(numbers, bushing.friction, lanes) * normal, load(numbers, bushing.friction + 3, lanes)
    if any_below(0.0 - excess, 0.0):  # a return here avoids the exponential in the other case
        ratio = sliding * load(numbers, bushing.friction + 4, lanes)
        return limit * (1.0 + excess * exponential(0.0 - ratio * ratio))
    return limit


@inlined
def limit_bristles(bushing: ClearanceRecord, numbers: np.ndarray, end: int, force: Any, lanes: tuple[int, ...]) -> None:
    """Limit the deflection of an end's bristles to that of a force, N."""
    memory = bushing.ends + END_MEMORY * end + BRISTLES
    limit = force / larger(load(numbers, bushing.friction + 1, lanes), TINY)
    deflection = load(numbers, memory, lanes)
    store(numbers, memory, smaller(larger(deflection, 0.0 - limit), limit), lanes)
