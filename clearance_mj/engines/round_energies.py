"""Energies of the modal engine in space, step by step.

From one step to the next every mode satisfies M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = f with numbers of the
scheme's own (`ModalRun.equations`), so that with the travel (q₊ - q₋)/2 what forces put in is what is lost and stored,
to rounding. What does not add up is the error of what contacts, bristles and fillings are said to hold and to lose.
"""

from __future__ import annotations

import math

import numpy as np

from ..clearance.pointers import at, call_contact_energy, call_round_energy
from ..clearance.round_kernel import BRISTLES, END_MEMORY
from ..core.jit import jit
from .round_scheme import RoundForces, RoundMotion, RoundShaft, dot

__all__ = ["OF_BUSHING", "OF_END", "OF_RIG", "step_energies"]

OF_RIG = ("input", "weight", "unbalance", "drive", "damping", "kinetic", "strain")
"""J: put in in a step, lost in it, and, the last two, stored"""
OF_BUSHING = ("film", "hysteresis", "contact_loss", "friction", "law_work", "grease", "contact")
"""J: lost in a step, put in, and, the last two, stored"""
OF_END = ("depth", "push", "loss", "n_y", "n_z")
"""m, < 0 in the gap; N; J lost in a step; the direction in which it touches"""


@jit
def step_energies(
    row: np.ndarray, inputs: np.ndarray, cos: float, sin: float, others: np.ndarray, spin: float, h: float,
    shaft: RoundShaft, motion: RoundMotion, total: np.ndarray, travel: np.ndarray, bushings: np.ndarray,
    states: np.ndarray, numbers: np.ndarray, forces: RoundForces,
) -> None:  # fmt: skip
    """Fill a row with the energies of `OF_RIG`, then those of each bushing, then of each end.

    ``others`` are the factors of all inputs but the first one, then of the orders, whose work counts with that of the
    unbalance. ``total`` is the whole force on the modes, which have not moved yet; ``travel`` is overwritten. Contacts
    and fillings have moved already; what they were before is what `keep_step` kept.
    """
    n, n_bushings = travel.size, bushings.size
    kinetic = strain = work = lost = 0.0
    for m in range(n):
        qq, vq, qv, vv = shaft.flow[0, m], shaft.flow[1, m], shaft.flow[2, m], shaft.flow[3, m]
        det, kick = qq * vv - vq * qv, vq * h * shaft.inverse_mass[m]
        before, now = motion.q_before[m], motion.q[m]
        after = qq * now + vq * (motion.v[m] + h * shaft.inverse_mass[m] * total[m])
        travel[m] = 0.5 * (after - before)
        kinetic += 0.125 * (1.0 + det) / kick * ((after - now) ** 2 + (now - before) ** 2)
        strain += 0.25 * (1.0 + det - qq - vv) / kick * now * (before + after)
        lost += (1.0 - det) / kick * travel[m] * travel[m]
        work += total[m] * travel[m]
    row[:] = 0.0
    for r in range(inputs.size):
        row[0] += inputs[r] * dot(shaft.input, r * n, travel, 0, n)
    row[1] = dot(shaft.weight, 0, travel, 0, n)
    row[2] = cos * dot(shaft.unbalance, 0, travel, 0, n) + sin * dot(shaft.unbalance, n, travel, 0, n)
    for r in range(shaft.orders.shape[0]):
        row[2] += others[inputs.size - 1 + r] * dot(shaft.orders, r * n, travel, 0, n)
    if shaft.circulatory.size:
        for m in range(n):
            row[3] -= spin * travel[m] * dot(shaft.circulatory, m * n, motion.q, 0, n)
    if shaft.springs.size:
        for m in range(n):
            row[3] -= travel[m] * dot(shaft.springs, m * n, motion.q, 0, n)
    at_bushings = 0.0
    for p in range(forces.acts.size):
        if forces.acts[p]:
            for d in range(2):
                moved = dot(shaft.at_points, (2 * p + d) * n, travel, shaft.spans[d, 0], shaft.spans[d, 1])
                at_bushings += forces.force[p, d] * moved
    # What couples velocities is all that is left of the whole force's work.
    row[4] = lost + row[0] + row[1] + row[2] + row[3] - at_bushings - work
    row[5], row[6] = kinetic, strain
    for j in range(n_bushings):
        own = row[7 + 7 * j : 14 + 7 * j]
        _fill(own, j, shaft, travel, bushings, states, numbers, forces)
        for end in range(2):
            of_end = row[7 + 7 * n_bushings + 5 * (2 * j + end) :]
            _touch(row, own, of_end, j, end, h, spin, shaft, travel, bushings, states, numbers, forces)


@jit
def _fill(own, j, shaft, travel, bushings, states, numbers, forces):  # type: ignore[no-untyped-def]
    """Energies of what fills a bushing."""
    bushing, state, n = bushings[j], states[j], travel.size
    y_way = dot(shaft.at_points, 2 * j * n, travel, shaft.spans[0, 0], shaft.spans[0, 1])
    z_way = dot(shaft.at_points, (2 * j + 1) * n, travel, shaft.spans[1, 0], shaft.spans[1, 1])
    f_y, f_z = forces.force[j]
    if not bushing.turned:  # what a turning film does is all its own
        f_y, f_z = f_y - forces.filling[j, 0], f_z - forces.filling[j, 1]
    own[0] = f_y * y_way + f_z * z_way
    y, z = forces.x[j]
    out = at(numbers, state.out)
    call_round_energy(
        bushing.grease_energy, at(numbers, bushing.grease), at(numbers, state.grease_before), at(numbers, state.grease),
        y + bushing.offset_y, z + bushing.offset_z, y - state.was_y, z - state.was_z, out,
    )  # fmt: skip
    own[5] = out[0] - bushing.held - bushing.preload_y * y - bushing.preload_z * z
    own[1] = out[1]


@jit
def _touch(row, own, of_end, j, end, h, spin, shaft, travel, bushings, states, numbers, forces):  # type: ignore[no-untyped-def]
    """Energies of one end in contact: its spring and bristles hold them, its damper and sliding lose them."""
    bushing, state, n = bushings[j], states[j], travel.size
    p = bushings.size + 2 * j + end
    r_y, r_z = forces.x[p, 0] + bushing.offset_y, forces.x[p, 1] + bushing.offset_z
    depth = math.sqrt(r_y * r_y + r_z * r_z) - bushing.gap
    of_end[0] = depth
    if not forces.acts[p]:
        return
    n_y, n_z, elastic, _, predicted, normal, rubbed, _ = forces.ends[p]
    y_way = dot(shaft.at_points, 2 * p * n, travel, shaft.spans[0, 0], shaft.spans[0, 1])
    z_way = dot(shaft.at_points, (2 * p + 1) * n, travel, shaft.spans[1, 0], shaft.spans[1, 1])
    loss = (normal - elastic) * (n_y * y_way + n_z * z_way)
    energy = bushing.contact_energy
    now, was = at(numbers, state.contact), at(numbers, state.contact_before)
    if bushing.rows > 1:
        own[4] += 0.5 * (call_contact_energy(energy, now, depth) - call_contact_energy(energy, was, depth))
    own[6] += 0.5 * call_contact_energy(energy, now, depth)
    own[2] += loss
    if bushing.friction > 0.0:
        bristles = numbers[state.ends + END_MEMORY * end + BRISTLES]
        surface = h * bushing.radius * spin
        own[6] += 0.5 * bushing.bristle * bristles * bristles
        slid = predicted - bristles
        own[3] += rubbed * slid + (rubbed - bushing.bristle * bristles) * (n_y * z_way - n_z * y_way + surface - slid)
        row[3] += rubbed * surface
    of_end[1], of_end[2], of_end[3], of_end[4] = normal, loss, n_y, n_z
