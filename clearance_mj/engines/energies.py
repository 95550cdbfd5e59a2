"""Energies of an engine's steps: of the modes, and of forces in the clearances; compiled.

From one step to the next every mode satisfies M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = f with the scheme's
numbers (`ModalRun.equations`), so that with the travel (q₊ - q₋)/2 the work of forces is what is lost and stored, to
rounding. The residual is the error of the energies that contacts, bristles and fillings report.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..clearance.kernel import BRISTLES
from ..clearance.lanes import larger
from ..clearance.pointers import at, call_contact_energy, call_law
from ..clearance.record import END_MEMORY
from ..clearance.registers import joined, load, spread, store
from ..clearance.vectors import TINY
from ..core.jit import OPTIONS, inlined, jit
from .interact import BRISTLES as PREDICTED
from .interact import DEPTH, ELASTIC, ENDS, FILLED, N_Y, N_Z, NORMAL, RUBBED

__all__ = [
    "NOTHING", "OF_CLEARANCE", "OF_END", "OF_RIG", "StepRecords", "clearance_energies", "columns_of", "keep_energies",
]  # fmt: skip

OF_RIG = ("input", "weight", "unbalance", "drive", "damping", "kinetic", "strain")
"""J: put in in a step, lost in it, and, the last two, stored; the work of orders counts with that of the unbalance"""
OF_CLEARANCE = ("film", "hysteresis", "contact_loss", "friction", "law_work", "grease", "contact")
"""J: lost in a step, put in, and, the last two, stored"""
OF_END = ("depth", "push", "loss", "n_y", "n_z")
"""m, < 0 in the gap; N; J lost in a step; the direction in which it touches, of one coordinate along z"""
DRIVE, STORED_FROM = OF_RIG.index("drive"), OF_RIG.index("kinetic")
FOUR, ONE = (0, 1, 2, 3), (0,)


class StepRecords(NamedTuple):
    """Records of the steps of one case; without rows where nothing is recorded."""

    energies: np.ndarray  # (n, columns) of `OF_RIG`, then of each clearance, then of each end
    rows: np.ndarray  # (n, n_rows) displacements of the clearances' rows, m
    coordinates: np.ndarray  # (n, n_coordinates) after each step


NOTHING = StepRecords(*(np.empty((0, 0)) for _ in range(3)))


def columns_of(n_bushings: int) -> int:
    """Return the number of columns of energies."""
    return len(OF_RIG) + n_bushings * (len(OF_CLEARANCE) + 2 * len(OF_END))


@jit(**OPTIONS)
def keep_energies(
    row: int, energies: np.ndarray, h: float, spin: float, n_excited: int, excitation: np.ndarray, i: int,
    factors: np.ndarray, inverse_mass: np.ndarray, flow: np.ndarray, given: np.ndarray, turned: np.ndarray,
    at_rows: np.ndarray, springs: np.ndarray, q: np.ndarray, v: np.ndarray, q_before: np.ndarray, total: np.ndarray,
    travel: np.ndarray, bushings: np.ndarray, numbers: np.ndarray, places: np.ndarray, x: np.ndarray, way: np.ndarray,
    force: np.ndarray, filled: np.ndarray, ends: np.ndarray, acts: np.ndarray,
) -> None:  # fmt: skip
    """Fill a row with the energies of a step of one case, whose modes have not moved yet.

    ``total`` is the whole force on the modes; ``travel`` and ``way`` are overwritten with the travel of modes and rows.
    All others are as in `modal_loop.advance`.
    """
    modes, none = inverse_mass.shape[0], spread(0.0, FOUR)
    out = at(energies, row * energies.shape[1])
    kinetic = strain = work = loss = none
    for m in range(modes):
        mass, now, before = load(inverse_mass, m, FOUR), load(q, m, FOUR), load(q_before, m, FOUR)
        qq, vq = load(flow, m, FOUR), load(flow, modes + m, FOUR)
        qv, vv = load(flow, 2 * modes + m, FOUR), load(flow, 3 * modes + m, FOUR)
        det, kicked = qq * vv - vq * qv, load(v, m, FOUR) + h * mass * load(total, m, FOUR)
        after, kick = qq * now + vq * kicked, larger(vq * mass * h, TINY)  # where lanes are padded without modes
        moved, ahead, behind = 0.5 * (after - before), after - now, now - before
        store(travel, m, moved, FOUR)
        kinetic = kinetic + (0.125 + 0.125 * det) / kick * (ahead * ahead + behind * behind)
        strain = strain + (1.0 + det - qq - vv) / kick * now * (before + after)
        loss = loss + (1.0 - det) / kick * moved * moved
        work = work + load(total, m, FOUR) * moved
    for k in range(STORED_FROM):
        out[k] = 0.0
    for r in range(given.shape[0]):
        out[0 if r < n_excited else 1] += excitation[i, r] * _work_per_force(given, r, modes, travel)
    for r in range(turned.shape[0]):
        out[2] += factors[r, 0] * _work_per_force(turned, r, modes, travel)
    for r in range(springs.shape[0]):
        out[DRIVE] -= at(q, 0)[r] * _work_per_force(springs, r, modes, travel)
    taken = 0.0
    for r in range(at_rows.shape[0]):
        way[r, 0] = _work_per_force(at_rows, r, modes, travel)
        taken += force[r, 0] * way[r, 0]
    # The coupling of velocities is the remainder of the whole force's work.
    put_in = out[0] + out[1] + out[2] + out[DRIVE]
    out[4] = joined(loss, ONE) + put_in - taken - joined(work, ONE)
    out[5], out[6] = joined(kinetic, ONE), 0.25 * joined(strain, ONE)
    clearance_energies(row, energies, h, spin, bushings, numbers, places, x, way, force, filled, ends, acts)


@inlined
def _work_per_force(rows: np.ndarray, row: int, modes: int, travel: np.ndarray) -> float:
    total = spread(0.0, FOUR)
    for m in range(modes):
        total = total + load(rows, row * modes + m, FOUR) * load(travel, m, FOUR)
    return joined(total, ONE)


@inlined
def clearance_energies(
    row: int, energies: np.ndarray, h: float, spin: float, bushings: np.ndarray, numbers: np.ndarray,
    places: np.ndarray, x: np.ndarray, way: np.ndarray, force: np.ndarray, filled: np.ndarray, ends: np.ndarray,
    acts: np.ndarray,
) -> None:  # fmt: skip
    """Fill in the energies stored and lost in each clearance, then each end, in a step in which rows travel ``way``.

    Contacts and fillings have moved already; their states before are those of `save_previous_state`.
    """
    n, whole = bushings.size, at(energies, row * energies.shape[1])
    for j in range(n):
        bushing = bushings[j]
        clearance = at(energies, row * energies.shape[1] + len(OF_RIG) + len(OF_CLEARANCE) * j)
        for k in range(len(OF_CLEARANCE)):
            clearance[k] = 0.0
        _fill_filling(clearance, bushing, numbers, places[j, 0], x, way, force, filled, FILLED * j)
        for end in range(2):
            c = 2 * j + end
            of_end = at(energies, row * energies.shape[1] + len(OF_RIG) + len(OF_CLEARANCE) * n + len(OF_END) * c)
            y, z = places[j, 1 + 2 * end], places[j, 2 + 2 * end]
            of_end[0] = _depth(bushing, numbers, x[y, 0], x[z, 0])
            of_end[1] = of_end[2] = of_end[3] = of_end[4] = 0.0
            if acts[c]:
                _fill_contact(whole, clearance, of_end, bushing, numbers, end, h, spin, y, z, way, at(ends, ENDS * c))
            numbers[bushing.depths + end] = of_end[0]


@inlined
def _depth(bushing: Any, numbers: np.ndarray, y: float, z: float) -> float:
    """Return a point's penetration of the nearest wall, m, below 0 in the gap."""
    if bushing.touching == 1:
        return max(z - numbers[bushing.wall + 1], numbers[bushing.wall] - z)
    place = (0.0, z + numbers[bushing.offset])
    if bushing.coordinates == 2:
        place = (y + numbers[bushing.offset], z + numbers[bushing.offset + 1])
    call_law(bushing.wall_law, at(numbers, bushing.wall), place, at(numbers, bushing.out))
    return numbers[bushing.out]


@inlined
def _fill_filling(
    clearance: Any, bushing: Any, numbers: np.ndarray, first: int, x: np.ndarray, way: np.ndarray, force: np.ndarray,
    filled: np.ndarray, at_filling: int,
) -> None:  # fmt: skip
    size = bushing.coordinates
    stored = -numbers[bushing.static_energy]
    for d in range(size):
        # The whole force of a turning film counts as its loss.
        push = force[first + d, 0] - (0.0 if bushing.is_circulatory else filled[at_filling + d, 0])
        clearance[0] += push * way[first + d, 0]
        stored -= numbers[bushing.preload + d] * x[first + d, 0]
    out, offset = at(numbers, bushing.out), bushing.offset
    parameters, before, now = (
        at(numbers, bushing.filling), at(numbers, bushing.memory_was), at(numbers, bushing.memory)
    )  # fmt: skip
    y, was = numbers[bushing.place] + numbers[offset], numbers[bushing.place] - numbers[bushing.was]
    if size == 1:
        call_law(bushing.filling_energy, parameters, before, now, (y,), (was,), out)
    else:
        z, went = (
            numbers[bushing.place + 1] + numbers[offset + 1],
            numbers[bushing.place + 1] - numbers[bushing.was + 1],
        )
        call_law(bushing.filling_energy, parameters, before, now, (y, z), (was, went), out)
    clearance[5] = out[0] + stored
    clearance[1] = out[1]


@inlined
def _fill_contact(
    whole: Any, clearance: Any, of_end: Any, bushing: Any, numbers: np.ndarray, end: int, h: float, spin: float, y: int,
    z: int, way: np.ndarray, contact: Any,
) -> None:  # fmt: skip
    """Fill in the energies of one end in contact: stored in spring and bristles, lost in damper and sliding."""
    depth, n_z, normal = abs(contact[DEPTH]), contact[N_Z], contact[NORMAL]
    n_y = contact[N_Y] if bushing.touching == 2 else 0.0
    y_travel = way[y, 0] if bushing.touching == 2 else 0.0
    loss = (normal - abs(contact[ELASTIC])) * (n_y * y_travel + n_z * way[z, 0])
    energy = bushing.contact_energy
    now, was = at(numbers, bushing.contact), at(numbers, bushing.contact_was)
    if bushing.rows > 1:
        common = np.sqrt(max(depth * numbers[bushing.depths + end], 0.0))
        clearance[4] += 0.5 * (call_contact_energy(energy, now, common) - call_contact_energy(energy, was, common))
    clearance[6] += 0.5 * call_contact_energy(energy, now, depth)
    clearance[2] += loss
    if bushing.rubs:
        bristles, stiffness = numbers[bushing.ends + END_MEMORY * end + BRISTLES], numbers[bushing.friction + 1]
        surface = h * numbers[bushing.friction + 5] * spin
        clearance[6] += 0.5 * stiffness * bristles * bristles
        slid = contact[PREDICTED] - bristles
        across = n_y * way[z, 0] - n_z * y_travel + surface - slid
        clearance[3] += contact[RUBBED] * slid + (contact[RUBBED] - stiffness * bristles) * across
        whole[DRIVE] += contact[RUBBED] * surface
    of_end[1], of_end[2], of_end[3], of_end[4] = normal, loss, n_y, n_z
