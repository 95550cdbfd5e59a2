"""The one compiled kernel of clearances: engines, energy balances and identification take their steps with it.

In every step a loop calls for each clearance `fill` and `follow_law`, and for each of its two ends the wall, `depth_in`
of one coordinate or `touch` of two, and `press` of one coordinate or `rub` of two where it touches. Vectors are tuples
of one coordinate or two, numbers plain or of all lanes (see lanes.py).

Loops give displacements from the unloaded shaft. Where it does not stand in the middle, fillings and amplitude laws are
given its distance from there: that is what thins the film. There the filling's springs are in equilibrium, so that only
what they change by moves it. ``numbers`` are changed in place.

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
from .record import END_MEMORY, Bushing
from .registers import block, load, spread, store
from .vectors import TINY, minus, of_one_or_two, plus

__all__ = [
    "BRISTLES", "answered", "depth_in", "distance", "fill", "follow_law", "forget", "friction_limit", "keep_step",
    "let_go", "press", "rub", "touch",
]  # fmt: skip

BRISTLES = 3  # where an end remembers their deflection

_loaded = of_one_or_two(
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


_stored = of_one_or_two(_store_one, _store_two)
_size = of_one_or_two(lambda r: 1, lambda r: 2)
_nothing = of_one_or_two(lambda r: (0.0,), lambda r: (0.0, 0.0))


@inlined
def keep_step(bushing: Bushing, numbers: np.ndarray) -> None:
    """Keep what a clearance of one case remembers of a step before the next one changes it, for energies."""
    for i in range(bushing.coordinates):
        numbers[bushing.was + i] = numbers[bushing.place + i]
    for i in range(bushing.states):
        numbers[bushing.memory_was + i] = numbers[bushing.memory + i]
    for i in range(bushing.width):
        numbers[bushing.contact_was + i] = numbers[bushing.contact + i]


# What is done lane by lane is called, not inlined: it is seldom needed, and machine code of it takes long to make.


@jit(**OPTIONS)
def _fill_by_lane(like: Any, bushing: Bushing, numbers: np.ndarray, count: int) -> None:
    """Fill in answers of a filling from what was gathered of place, way and spin."""
    own, size = (bushing.room + 6) * count, _size(like)
    for lane in range(count):
        call_law(
            bushing.filling_law, at(numbers, bushing.filling * count + lane * bushing.filling_size),
            at(numbers, bushing.memory * count + lane * bushing.states),
            _of_lane(numbers, bushing.room, like, lane, count), _of_lane(numbers, bushing.room + 2, like, lane, count),
            numbers[(bushing.room + 4) * count + lane], bushing.step, at(numbers, own),
        )  # fmt: skip
        for i in range(size + size * size):
            numbers[(bushing.out + i) * count + lane] = numbers[own + i]


@jit(**OPTIONS)
def _press_by_lane(bushing: Bushing, numbers: np.ndarray, count: int) -> None:
    """Fill in answers of a contact from what was gathered of depth, speed and impact speed."""
    own = (bushing.room + 6) * count
    for lane in range(count):
        given = bushing.room * count + lane
        call_law(
            bushing.contact_law, at(numbers, bushing.contact * count + lane * bushing.width), numbers[given],
            numbers[given + count], numbers[given + 2 * count], at(numbers, own),
        )  # fmt: skip
        for i in range(2):
            numbers[(bushing.out + i) * count + lane] = numbers[own + i]


@jit(**OPTIONS)
def _touch_by_lane(bushing: Bushing, numbers: np.ndarray, count: int) -> None:
    """Fill in answers of a wall from what was gathered of places."""
    own = (bushing.room + 6) * count
    for lane in range(count):
        given = bushing.room * count + lane
        parameters = at(numbers, bushing.wall * count + lane * bushing.wall_size)
        call_law(bushing.wall_law, parameters, (numbers[given], numbers[given + count]), at(numbers, own))
        for i in range(3):
            numbers[(bushing.out + i) * count + lane] = numbers[own + i]


@jit(**OPTIONS)
def _follow_by_lane(bushing: Bushing, numbers: np.ndarray, time: float, count: int) -> None:
    """Interpolate between the rows of laws, from what was gathered of the distance from the middle."""
    last = bushing.rows - 1
    for lane in range(count):
        reached, decay = bushing.envelope * count + lane, numbers[bushing.decay * count + lane]
        numbers[reached] = max(numbers[bushing.room * count + lane], numbers[reached] * decay)
        now, period = numbers[reached] if bushing.by_amplitude else time, numbers[bushing.period * count + lane]
        if period > 0.0:
            now = time % period
        row, after, share = 0, last, 0.0
        if now >= numbers[(bushing.abscissa + last) * count + lane]:
            row = last
        elif now > numbers[bushing.abscissa * count + lane]:
            while after - row > 1:  # numpy.searchsorted would count references
                middle = (row + after) // 2
                if numbers[(bushing.abscissa + middle) * count + lane] <= now:
                    row = middle
                else:
                    after = middle
            low = numbers[(bushing.abscissa + row) * count + lane]
            share = (now - low) / (numbers[(bushing.abscissa + row + 1) * count + lane] - low)
        width = bushing.width
        values = at(numbers, bushing.contact * count + lane * width)
        table = at(numbers, bushing.table * count + (lane * bushing.rows + row) * width)
        for i in range(width):
            values[i] = table[i]
            if share > 0.0:
                values[i] += share * (table[width + i] - table[i])


@inlined
def fill(bushing: Bushing, numbers: np.ndarray, r: Any, spin: Any, lanes: tuple[int, ...]) -> None:
    """Move what fills a clearance to r, m; `answered` is then its force above that of the unloaded shaft, and damping.

    The spin is in rad/s.
    """
    dr = minus(r, _loaded(numbers, bushing.place, r, lanes))
    _stored(numbers, bushing.place, r, lanes)
    place, step = plus(r, _loaded(numbers, bushing.offset, r, lanes)), bushing.step
    if bushing.filling_by_lane:
        _stored(numbers, bushing.room, place, lanes)
        _stored(numbers, bushing.room + 2, dr, lanes)
        store(numbers, bushing.room + 4, spin, lanes)
        _fill_by_lane(_nothing(r), bushing, numbers, len(lanes))
    else:
        parameters, memory = block(numbers, bushing.filling, lanes), block(numbers, bushing.memory, lanes)
        call_law(bushing.filling_law, parameters, memory, place, dr, spin, step, block(numbers, bushing.out, lanes))
    elastic = minus(_loaded(numbers, bushing.out, r, lanes), _loaded(numbers, bushing.preload, r, lanes))
    _stored(numbers, bushing.out, elastic, lanes)


@inlined
def answered(bushing: Bushing, numbers: np.ndarray, i: int, lanes: tuple[int, ...]) -> Any:
    """Return number i of what `fill` found: elastic forces, then damping; of two coordinates yy, yz, zy, zz."""
    return load(numbers, bushing.out + i, lanes)


@inlined
def distance(bushing: Bushing, numbers: np.ndarray, lanes: tuple[int, ...]) -> Any:
    """Return how far the shaft is from the clearance's middle since the last `fill`, m."""
    z = load(numbers, bushing.place, lanes) + load(numbers, bushing.offset, lanes)
    if bushing.coordinates == 1:
        return abs(z)
    y = z
    z = load(numbers, bushing.place + 1, lanes) + load(numbers, bushing.offset + 1, lanes)
    return root(y * y + z * z)


@inlined
def follow_law(bushing: Bushing, numbers: np.ndarray, time: float, lanes: tuple[int, ...]) -> None:
    """Find the contact's parameters at a time, s: linear between the law's rows, the ends hold beyond."""
    if bushing.rows > 1:
        store(numbers, bushing.room, distance(bushing, numbers, lanes), lanes)
        _follow_by_lane(bushing, numbers, time, len(lanes))


@inlined
def _spring_and_damper(
    bushing: Bushing, numbers: np.ndarray, depth: Any, inwards: Any, impact: Any, lanes: tuple[int, ...]
) -> Any:
    """Return stiffness, N/m, and damping, N s/m, of one end: half of what the clearance's contact law answers."""
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
def depth_in(bushing: Bushing, numbers: np.ndarray, x: Any, lanes: tuple[int, ...]) -> Any:
    """Return the penetration into one of two walls, m, > 0 into the upper one, < 0 into the lower, 0 between."""
    return signed_penetration(x, load(numbers, bushing.wall, lanes), load(numbers, bushing.wall + 1, lanes))


@inlined
def forget(bushing: Bushing, numbers: np.ndarray, end: int, lanes: tuple[int, ...]) -> None:
    """Let the contact of end 0 or 1 be over."""
    memory, none = bushing.ends + END_MEMORY * end, spread(0.0, lanes)
    store(numbers, memory, none, lanes)
    store(numbers, memory + BRISTLES, none, lanes)


@inlined
def press(bushing: Bushing, numbers: np.ndarray, end: int, g: Any, speed: Any, lanes: tuple[int, ...]) -> Any:
    """Follow the contact of end 0 or 1 at a signed penetration, m; return stiffness, N/m, and damping, N s/m.

    A contact begins when the gap is used up, or at the other wall, which fixes its impact speed, and is over in the
    gap. Each end, with a speed of its own, carries half of the clearance's stiffness and damping.
    """
    memory, inwards = bushing.ends + END_MEMORY * end, signed(speed, g)
    impact = impact_speed(load(numbers, memory, lanes), g, inwards)
    store(numbers, memory, signed(impact, g), lanes)
    return _spring_and_damper(bushing, numbers, abs(g), inwards, impact, lanes)


@inlined
def touch(bushing: Bushing, numbers: np.ndarray, y: Any, z: Any, lanes: tuple[int, ...]) -> Any:
    """Return how deep a point is in a wall of two coordinates, m, 0 in the gap, and the direction n along y and z."""
    none = spread(0.0, lanes)
    if bushing.coordinates == 1:  # what slides along the wall, and what presses
        z = z + load(numbers, bushing.offset, lanes)
        y = 0.0 * y
    else:
        y, z = y + load(numbers, bushing.offset, lanes), z + load(numbers, bushing.offset + 1, lanes)
    reach = load(numbers, bushing.reach, lanes)
    if not any_below(reach * reach - (y * y + z * z), 0.0):
        return none, none, none
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
def rub(
    bushing: Bushing, numbers: np.ndarray, end: int, depth: Any, n_y: Any, n_z: Any, y: Any, z: Any, speed_y: Any,
    speed_z: Any, spin: Any, lanes: tuple[int, ...],
) -> Any:  # fmt: skip
    """Follow the contact of end 0 or 1, of a depth along n, at y, z, m, and its bristles, as if nothing slid.

    Returns stiffness, N/m, damping, N s/m, and the bristles' deflection, m. A contact begins when the gap is used up,
    or on the other side, which fixes its impact speed. Each end carries half of stiffness and damping.
    """
    memory, inwards = bushing.ends + END_MEMORY * end, n_y * speed_y + n_z * speed_z
    then_y, then_z = load(numbers, memory + 1, lanes), load(numbers, memory + 2, lanes)
    before = where_above(load(numbers, memory, lanes), then_y * n_y + then_z * n_z)
    impact = where_above(choose(before, larger(inwards, SLOWEST_IMPACT), before), depth)
    bristles = 0.0 * depth
    if bushing.rubs:
        # Along the chord of the step: t in its middle is that of n at both its ends.
        mean_y, mean_z = then_y + n_y, then_z + n_z
        size = larger(root(mean_y * mean_y + mean_z * mean_z), TINY)
        way_y, way_z = y - load(numbers, memory + 4, lanes), z - load(numbers, memory + 5, lanes)
        slid = load(numbers, memory + BRISTLES, lanes) + (mean_y * way_z - mean_z * way_y) / size
        slid += load(numbers, bushing.friction + 5, lanes) * spin * bushing.step
        bristles = where_above(where_above(slid, before), depth)
    store(numbers, memory, impact, lanes)
    store(numbers, memory + 1, n_y, lanes)
    store(numbers, memory + 2, n_z, lanes)
    store(numbers, memory + BRISTLES, bristles, lanes)
    store(numbers, memory + 4, y, lanes)
    store(numbers, memory + 5, z, lanes)
    k, c = _spring_and_damper(bushing, numbers, depth, inwards, impact, lanes)
    return k, where_above(c, depth), bristles


@inlined
def friction_limit(bushing: Bushing, numbers: np.ndarray, normal: Any, sliding: Any, lanes: tuple[int, ...]) -> Any:
    """Return the largest friction, N, under a normal force, N, at a speed of sliding, m/s."""
    most, excess = load(numbers, bushing.friction, lanes) * normal, load(numbers, bushing.friction + 3, lanes)
    if any_below(0.0 - excess, 0.0):  # returning here keeps the compiler from finding the exponential every time
        ratio = sliding * load(numbers, bushing.friction + 4, lanes)
        return most * (1.0 + excess * exponential(0.0 - ratio * ratio))
    return most


@inlined
def let_go(bushing: Bushing, numbers: np.ndarray, end: int, force: Any, lanes: tuple[int, ...]) -> None:
    """Let the bristles of an end slide to the deflection of a force, N, if they are bent beyond it."""
    memory = bushing.ends + END_MEMORY * end + BRISTLES
    most = force / larger(load(numbers, bushing.friction + 1, lanes), TINY)
    bent = load(numbers, memory, lanes)
    store(numbers, memory, smaller(larger(bent, 0.0 - most), most), lanes)
