"""Energies of an engine's steps: of the modes, and of what acts in the clearances; compiled.

From one step to the next every mode satisfies M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = f with numbers of the
scheme's own (`ModalRun.equations`), so that with the travel (q₊ - q₋)/2 what forces put in is what is lost and stored,
to rounding. What does not add up is the error of what contacts, bristles and fillings are said to hold and to lose.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from ..clearance.kernel import BRISTLES, keep_step
from ..clearance.pointers import at, call_contact_energy, call_law
from ..clearance.record import END_MEMORY
from ..core.jit import jit
from .interact import BRISTLES as PREDICTED
from .interact import DEPTH, ELASTIC, ENDS, FILLED, N_Y, N_Z, NORMAL, RUBBED

__all__ = [
    "NOTHING",
    "OF_CLEARANCE",
    "OF_END",
    "OF_RIG",
    "Kept",
    "clearance_energies",
    "columns_of",
    "keep",
    "remember",
]

OF_RIG = ("input", "weight", "unbalance", "drive", "damping", "kinetic", "strain")
"""J: put in in a step, lost in it, and, the last two, stored; the work of orders counts with that of the unbalance"""
OF_CLEARANCE = ("film", "hysteresis", "contact_loss", "friction", "law_work", "grease", "contact")
"""J: lost in a step, put in, and, the last two, stored"""
OF_END = ("depth", "push", "loss", "n_y", "n_z")
"""m, < 0 in the gap; N; J lost in a step; the direction in which it touches, of one coordinate along z"""
DRIVE = OF_RIG.index("drive")


class Kept(NamedTuple):
    """What a loop of one case keeps of its steps; without rows where nothing is to be kept."""

    energies: np.ndarray  # (n, columns) of `OF_RIG`, then of each clearance, then of each end
    rows: np.ndarray  # (n, n_rows) displacements of the clearances' rows, m
    coordinates: np.ndarray  # (n, n_coordinates) after each step


NOTHING = Kept(*(np.empty((0, 0)) for _ in range(3)))


def columns_of(n_bushings: int) -> int:
    """Return the number of columns of energies."""
    return len(OF_RIG) + n_bushings * (len(OF_CLEARANCE) + 2 * len(OF_END))


def remember(bushings, numbers, kept, lanes):  # type: ignore[no-untyped-def]
    """Let the records of one case remember the step before, if energies are kept."""
    raise NotImplementedError


@overload(remember)
def _remember(bushings, numbers, kept, lanes):  # type: ignore[no-untyped-def]
    def of_one(bushings, numbers, kept, lanes):  # type: ignore[no-untyped-def]
        if kept.energies.shape[0]:
            for j in range(bushings.size):
                keep_step(bushings[j], numbers)

    return of_one if lanes.count == 1 else (lambda bushings, numbers, kept, lanes: None)


def keep(kept, row, i, h, lanes, spin, linear, motion, factors, excitation, total, travel, way, bushings, numbers,
         places, x, force, filled, ends, acts):  # type: ignore[no-untyped-def]  # fmt: skip
    """Keep of a step of one case what is asked for, before its modes move: in ``row`` of what is kept."""
    raise NotImplementedError


@overload(keep)
def _keep(kept, row, i, h, lanes, spin, linear, motion, factors, excitation, total, travel, way, bushings, numbers,
          places, x, force, filled, ends, acts):  # type: ignore[no-untyped-def]  # fmt: skip
    def of_one(kept, row, i, h, lanes, spin, linear, motion, factors, excitation, total, travel, way, bushings,
               numbers, places, x, force, filled, ends, acts):  # type: ignore[no-untyped-def]  # fmt: skip
        if kept.rows.shape[0]:
            for r in range(kept.rows.shape[1]):
                kept.rows[row, r] = x[r, 0]
        if kept.energies.shape[0]:
            found = kept.energies[row]
            found[:] = 0.0
            _of_modes(
                found, h, linear, motion.q.ravel(), motion.v.ravel(), motion.q_before.ravel(), factors, excitation[i],
                total.ravel(), travel.ravel(), force, way,
            )  # fmt: skip
            clearance_energies(
                found, h, spin, bushings, numbers, places, x, way, force, filled, ends, acts
            )  # fmt: skip

    def nothing(kept, row, i, h, lanes, spin, linear, motion, factors, excitation, total, travel, way, bushings,
                numbers, places, x, force, filled, ends, acts):  # type: ignore[no-untyped-def]  # fmt: skip
        return None

    return of_one if lanes.count == 1 else nothing


@jit
def _of_modes(
    row: np.ndarray, h: float, linear: Any, q: np.ndarray, v: np.ndarray, q_before: np.ndarray, factors: np.ndarray,
    inputs: np.ndarray, total: np.ndarray, travel: np.ndarray, force: np.ndarray, way: np.ndarray,
) -> None:  # fmt: skip
    """Fill a row with `OF_RIG`, and the travel of the modes and of the clearances' rows in the step.

    ``total`` is the whole force on the modes, which have not moved yet.
    """
    mass, flow = linear.inverse_mass.ravel(), linear.flow.reshape(4, -1)
    kinetic = strain = work = lost = 0.0
    for m in range(mass.size):
        travel[m] = 0.0
        if mass[m] == 0.0:
            continue
        qq, vq, qv, vv = flow[0, m], flow[1, m], flow[2, m], flow[3, m]
        det, kick = qq * vv - vq * qv, vq * h * mass[m]
        before, now = q_before[m], q[m]
        after = qq * now + vq * (v[m] + h * mass[m] * total[m])
        travel[m] = 0.5 * (after - before)
        kinetic += 0.125 * (1.0 + det) / kick * ((after - now) ** 2 + (now - before) ** 2)
        strain += 0.25 * (1.0 + det - qq - vv) / kick * now * (before + after)
        lost += (1.0 - det) / kick * travel[m] * travel[m]
        work += total[m] * travel[m]
    given, turned, at_rows = linear.input, linear.turning, linear.at_rows
    for r in range(given.shape[0]):
        row[0 if r < linear.n_excited else 1] += inputs[r] * _product(given[r], travel)
    for r in range(turned.shape[0]):
        row[2] += factors[r, 0] * _product(turned[r], travel)
    for r in range(linear.springs.shape[0]):
        row[DRIVE] -= q[r] * _product(linear.springs[r], travel)
    taken = 0.0
    for r in range(at_rows.shape[0]):
        way[r, 0] = _product(at_rows[r], travel)
        taken += force[r, 0] * way[r, 0]
    # What couples velocities is all that is left of the whole force's work.
    row[4] = lost + row[0] + row[1] + row[2] + row[DRIVE] - taken - work
    row[5], row[6] = kinetic, strain


@jit
def _product(row: np.ndarray, travel: np.ndarray) -> float:
    total, along = 0.0, row.ravel()
    for m in range(travel.size):
        total += along[m] * travel[m]
    return total


@jit
def clearance_energies(
    row: np.ndarray, h: float, spin: float, bushings: np.ndarray, numbers: np.ndarray, places: np.ndarray,
    x: np.ndarray, way: np.ndarray, force: np.ndarray, filled: np.ndarray, ends: np.ndarray, acts: np.ndarray,
) -> None:  # fmt: skip
    """Add to a row what each clearance, then each end, holds and loses in a step, in which its rows travel ``way``.

    Contacts and fillings have moved already; what they were before is what `keep_step` kept.
    """
    n = bushings.size
    for j in range(n):
        own = row[len(OF_RIG) + len(OF_CLEARANCE) * j : len(OF_RIG) + len(OF_CLEARANCE) * (j + 1)]
        _of_filling(own, bushings[j], numbers, places[j, 0], x, way, force, filled[FILLED * j :, 0])
        for end in range(2):
            c = 2 * j + end
            of_end = row[len(OF_RIG) + len(OF_CLEARANCE) * n + len(OF_END) * c :]
            y, z = places[j, 1 + 2 * end], places[j, 2 + 2 * end]
            of_end[0] = _depth(bushings[j], numbers, x[y, 0], x[z, 0])
            if acts[c]:
                _of_contact(row, own, of_end, bushings[j], numbers, end, h, spin, y, z, way, ends[ENDS * c :, 0])
            numbers[bushings[j].depths + end] = of_end[0]


@jit
def _depth(bushing, numbers, y, z):  # type: ignore[no-untyped-def]
    """How deep a point is in the nearest wall, m, below 0 in the gap."""
    if bushing.touching == 1:
        return max(z - numbers[bushing.wall + 1], numbers[bushing.wall] - z)
    place = (0.0, z + numbers[bushing.offset])
    if bushing.coordinates == 2:
        place = (y + numbers[bushing.offset], z + numbers[bushing.offset + 1])
    call_law(bushing.wall_law, at(numbers, bushing.wall), place, at(numbers, bushing.out))
    return numbers[bushing.out]


@jit
def _of_filling(own, bushing, numbers, first, x, way, force, filled):  # type: ignore[no-untyped-def]
    size = bushing.coordinates
    stored = -numbers[bushing.held]
    for d in range(size):
        push = force[first + d, 0] - (0.0 if bushing.turned else filled[d])  # what a turning film does is all its own
        own[0] += push * way[first + d, 0]
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
    own[5] = numbers[bushing.out] + stored
    own[1] = numbers[bushing.out + 1]


@jit
def _of_contact(row, own, of_end, bushing, numbers, end, h, spin, y, z, way, found):  # type: ignore[no-untyped-def]
    """Energies of one end in contact: its spring and bristles hold them, its damper and sliding lose them."""
    depth, n_z, normal = abs(found[DEPTH]), found[N_Z], found[NORMAL]
    n_y = found[N_Y] if bushing.touching == 2 else 0.0
    y_way = way[y, 0] if bushing.touching == 2 else 0.0
    loss = (normal - abs(found[ELASTIC])) * (n_y * y_way + n_z * way[z, 0])
    energy = bushing.contact_energy
    now, was = at(numbers, bushing.contact), at(numbers, bushing.contact_was)
    if bushing.rows > 1:
        common = np.sqrt(max(depth * numbers[bushing.depths + end], 0.0))
        own[4] += 0.5 * (call_contact_energy(energy, now, common) - call_contact_energy(energy, was, common))
    own[6] += 0.5 * call_contact_energy(energy, now, depth)
    own[2] += loss
    if bushing.rubs:
        bristles, stiffness = numbers[bushing.ends + END_MEMORY * end + BRISTLES], numbers[bushing.friction + 1]
        surface = h * numbers[bushing.friction + 5] * spin
        own[6] += 0.5 * stiffness * bristles * bristles
        slid = found[PREDICTED] - bristles
        across = n_y * way[z, 0] - n_z * y_way + surface - slid
        own[3] += found[RUBBED] * slid + (found[RUBBED] - stiffness * bristles) * across
        row[DRIVE] += found[RUBBED] * surface
    of_end[1], of_end[2], of_end[3], of_end[4] = normal, loss, n_y, n_z
