"""The one compiled kernel of round clearances: engines, energy balances and periodic motions take their steps with it.

Loops give displacements r along y and z from the line of the unloaded shaft; with the offset added they are from the
bushing's middle. An end of a bushing touches where e = |r| > gap: the depth δ = e - gap and its rate along n = r/e go
to the same contact models as in the plane, and on a line through the middle the force is the same to the last bits.

Friction acts along t = x × n against the speed ṙ·t + R Ω of the shaft's surface: bristles follow it until their force
is that of friction, then slide. They turn with n, so that a shaft may roll around its bushing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, get_type_hints

import numpy as np

from ..core.jit import inlined
from ..rig import Grease, Rig
from ..rig.dimensions import shaft_radius
from .follower import SLOWEST_IMPACT, end_values
from .grease import GreaseModel
from .greases.oil_film import film_bearing
from .kernel import WithTable, joined, one_each, tabulate
from .pointers import at, call_law

__all__ = [
    "BRISTLES", "END_MEMORY", "RoundClearance", "fillings_of", "friction_limit", "keep_step", "round_contact",
    "round_filling", "round_records", "rounds_side_by_side",
]  # fmt: skip

BRISTLES = 3  # where an end remembers their deflection
END_MEMORY = 6  # numbers that an end remembers: impact speed, n along y and z, bristles, displacement along y and z


class RoundBushing:
    """Record of what compiled loops know of a round bushing."""

    gap: float  # m
    offset_y: float  # m from the bushing's middle to the unloaded shaft
    offset_z: float
    offset: float  # 0: `follow_law` is given the distance from the middle
    preload_y: float  # of the filling's springs at the offset, N
    preload_z: float
    held: float  # by them there, J
    step: float  # s
    decay: float  # of the envelope in a step
    by_amplitude: bool  # the law's abscissa is the envelope, m, instead of time, s
    adhesion: bool  # the contact may pull
    rows: int  # of the law's table
    abscissa: int  # where it begins in the numbers
    table: int  # where the contact's parameters begin, row after row
    width: int  # how many they are in a row
    grease: int  # where the filling's parameters begin
    states: int  # how many numbers the filling remembers
    contact_law: int  # addresses of the models' functions
    contact_energy: int
    grease_law: int
    grease_energy: int
    turned: bool  # the filling's elastic force is what turning does to it: it holds no energy
    radius: float  # m, of the shaft where it rubs
    friction: float  # coefficient; 0 of a bushing without friction
    bristle: float  # N/m, of one end
    bristle_damping: float  # N s/m, of one end
    excess: float  # of friction where sliding begins, over that of fast sliding
    per_stribeck: float  # s/m


class RoundState:
    """Record of what a round bushing remembers."""

    y: float  # displacement of its middle in the last step, m
    z: float
    was_y: float  # the same a step before, for energies
    was_z: float
    envelope: float  # of the motion, m
    ends: int  # where the memories of both ends begin
    grease: int  # where the state of the filling begins
    contact: int  # where the contact's parameters begin that hold now
    grease_before: int  # where the filling's state and the contact's parameters of a step before begin, for energies
    contact_before: int
    out: int  # where models write their six answers


BUSHING, STATE = (np.dtype(list(get_type_hints(kind).items()), align=True) for kind in (RoundBushing, RoundState))


class RoundClearance(NamedTuple):
    """A rig's round bushings in records, and the numbers that belong to them; as `kernel.Clearance`."""

    bushings: np.ndarray  # (n_bushings,) `RoundBushing`
    states: np.ndarray  # (n_bushings,) `RoundState`, changed in place
    numbers: np.ndarray  # (n,) memories of all ends, then what the records point at; changed in place


def fillings_of(rig: Rig, law: WithTable) -> list[GreaseModel]:
    """Return what fills each bushing: the law's grease, if it has one, or else the rig's film or grease."""
    n = len(rig.bushings)
    return one_each([_own_filling(rig, j) for j in range(n)] if law.grease is None else law.grease, n)


def _own_filling(rig: Rig, j: int) -> Grease | GreaseModel:
    bushing = rig.bushings[j]
    return bushing.grease if bushing.film is None else film_bearing(bushing, shaft_radius(rig, j))


def round_records(rig: Rig, law: WithTable, step: float) -> RoundClearance:
    """Put together what compiled loops with a step, s, know of a spatial rig's bushings, without load."""
    n = len(rig.bushings)
    table, bushings, states = law.table(n), np.zeros(n, BUSHING), np.zeros(n, STATE)
    numbers: list[float] = [0.0] * (2 * END_MEMORY * n)
    place = tabulate(bushings, table, step, numbers)
    states["ends"] = 2 * END_MEMORY * np.arange(n)
    for j, (bushing, model) in enumerate(zip(rig.bushings, fillings_of(rig, law))):
        record, state = bushings[j], states[j]
        record["gap"], record["offset_y"], record["offset_z"] = bushing.gap, bushing.offset_y, bushing.offset
        record["grease_law"], record["grease_energy"] = model.round_addresses()
        record["grease"], record["states"] = place(model.parameters()), model.round_states()
        record["preload_y"], record["preload_z"], record["held"] = at_offset(model, bushing.offset_y, bushing.offset)
        record["table"] = place(table.parameters[:, j].ravel())
        record["radius"] = shaft_radius(rig, j)
        if friction := bushing.friction:
            record["friction"] = friction.coefficient
            record["bristle"] = (friction.stiffness or bushing.contact.stiffness) / 2
            record["bristle_damping"] = friction.damping / 2
            record["excess"] = friction.static_ratio - 1
            record["per_stribeck"] = 1 / friction.stribeck_speed if friction.stribeck_speed else 0.0
        record["turned"] = model.turned
        for before in ("", "_before"):
            state[f"grease{before}"] = place([0.0] * model.round_states())
            state[f"contact{before}"] = place(table.parameters[0, j])
        state["out"] = place([0.0] * 6)
    return RoundClearance(bushings, states, np.array(numbers, dtype=float))


def rounds_side_by_side(parts: Sequence[RoundClearance]) -> RoundClearance:
    """Return copies of the records of several rigs as those of one, rig after rig."""
    of_states = ("ends", "grease", "contact", "grease_before", "contact_before", "out")
    return RoundClearance(*joined(parts, ("abscissa", "table", "grease"), of_states))


def at_offset(model: GreaseModel, y: float, z: float) -> tuple[float, float, float]:
    """Return force along y and z, N, and energy, J, of a filling's springs with the shaft at rest off the middle."""
    parameters, states = model.parameters(), [0.0] * model.round_states()
    force, energy = [0.0] * 6, [0.0, 0.0]
    if y or z:
        model.round_law(parameters, list(states), y, z, 0.0, 0.0, 0.0, 1.0, force)
        model.round_energy(parameters, states, states, y, z, 0.0, 0.0, energy)
    return force[0], force[1], energy[0]


@inlined
def keep_step(bushing: RoundBushing, state: RoundState, numbers: np.ndarray) -> None:
    """Keep what a bushing remembers of a step before the next one changes it, for energies."""
    state.was_y, state.was_z = state.y, state.z
    for i in range(bushing.states):
        numbers[state.grease_before + i] = numbers[state.grease + i]
    for i in range(bushing.width):
        numbers[state.contact_before + i] = numbers[state.contact + i]


@inlined
def round_filling(
    bushing: RoundBushing, state: RoundState, numbers: np.ndarray, y: float, z: float, spin: float
) -> tuple[float, float, float, float, float, float]:
    """Move what fills a bushing to y, z, m; return its elastic force above that of the unloaded shaft, N, and damping.

    The damping, N s/m, is yy, yz, zy, zz. ``state`` and ``numbers`` are changed in place, here and below.
    """
    dy, dz = y - state.y, z - state.z
    state.y, state.z = y, z
    out = at(numbers, state.out)
    call_law(
        bushing.grease_law, at(numbers, bushing.grease), at(numbers, state.grease), y + bushing.offset_y,
        z + bushing.offset_z, dy, dz, spin, bushing.step, out,
    )  # fmt: skip
    return out[0] - bushing.preload_y, out[1] - bushing.preload_z, out[2], out[3], out[4], out[5]


@inlined
def round_contact(
    bushing: RoundBushing, state: RoundState, numbers: np.ndarray, end: int, y: float, z: float, speed_y: float,
    speed_z: float, spin: float,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Follow the contact of end 0 or 1 at y, z, m, and its bristles, as if nothing slid.

    Returns depth, m, which is 0 in the gap, the direction n along y and z, stiffness, N/m, damping, N s/m, and the
    bristles' deflection, m. A contact begins when the gap is used up, or on the other side, which fixes its impact
    speed. Each end carries half of the bushing's stiffness and damping.
    """
    memory = state.ends + END_MEMORY * end
    r_y, r_z = y + bushing.offset_y, z + bushing.offset_z
    square = r_y * r_y + r_z * r_z
    if not square > bushing.gap * bushing.gap:
        numbers[memory] = numbers[memory + BRISTLES] = 0.0
        return 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    e = math.sqrt(square)
    depth, n_y, n_z = e - bushing.gap, r_y / e, r_z / e
    inwards = n_y * speed_y + n_z * speed_z
    bristles = 0.0
    if numbers[memory] > 0.0 and numbers[memory + 1] * n_y + numbers[memory + 2] * n_z > 0.0:
        if bushing.friction > 0.0:
            # Along the chord of the step: t in its middle is that of n at both its ends.
            mean_y, mean_z = numbers[memory + 1] + n_y, numbers[memory + 2] + n_z
            size = math.sqrt(mean_y * mean_y + mean_z * mean_z)
            along = (mean_y * (z - numbers[memory + 5]) - mean_z * (y - numbers[memory + 4])) / size
            bristles = numbers[memory + BRISTLES] + along + bushing.radius * spin * bushing.step
    else:
        numbers[memory] = max(inwards, SLOWEST_IMPACT)
    numbers[memory + 1], numbers[memory + 2] = n_y, n_z
    numbers[memory + 4], numbers[memory + 5] = y, z
    parameters, out = at(numbers, state.contact), at(numbers, state.out)
    k, c = end_values(bushing.contact_law, parameters, out, depth, inwards, numbers[memory])
    return depth, n_y, n_z, k, c, bristles


@inlined
def friction_limit(bushing: RoundBushing, normal: float, sliding: float) -> float:
    """Return the largest friction, N, under a normal force, N, at a speed of sliding, m/s."""
    if bushing.excess > 0.0:
        ratio = sliding * bushing.per_stribeck
        return bushing.friction * normal * (1.0 + bushing.excess * math.exp(-ratio * ratio))
    return bushing.friction * normal
