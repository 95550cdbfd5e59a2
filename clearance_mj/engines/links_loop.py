"""The loop of the links engine: before every mj_step softness, fillings, friction and rotor forces; compiled.

It calls ``mj_step`` of the MuJoCo library directly, with views of the model's and data's arrays: writing parameters
before every step then costs next to nothing, many simulations run on threads without the interpreter's lock, and
results do not depend on the number of threads.

MuJoCo computes the clearances' normal force, with the softness written for it; the loop computes that of walls without
a geom or tendon. Friction, oil films and gyroscopic moments depend on the velocity so strongly that they act at the
velocity in the middle of their kick: half a step on, predicted by the linear model of the chains under all other
forces. So bristles and films are stable at any damping, and gyroscopic moments do no work.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..clearance.kernel import friction_force, press, save_previous_state
from ..clearance.pointers import at
from ..clearance.record import Clearance
from ..core.jit import OPTIONS, inlined, jit
from .energies import StepRecords, clearance_energies
from .interact import (
    BRISTLES,
    DEPTH,
    ELASTIC,
    ENDS,
    FILLED,
    N_Y,
    N_Z,
    NORMAL,
    RUBBED,
    VISCOUS,
    fill_all,
    find_contacts,
    sweep,
    torque_of_friction,
)  # fmt: skip
from .modal_loop import SPIN, SWEEPS, turn_forces, turn_on
from .mujoco_step import mj_step
from .plant import Driving

__all__ = ["Maps", "VelocityPredictor", "Views", "advance_links"]

ONE = (0,)


class Maps(NamedTuple):
    """Linear maps between the coordinates of chains and the rig's points."""

    order: np.ndarray  # (nv,) MuJoCo's number of each coordinate
    at_rows: np.ndarray  # (n_rows, nv) the clearances' rows: all middles, then both ends of each
    spans: np.ndarray  # (n_rows, 2) first coordinate of each that is not zero, and the one after the last
    places: np.ndarray  # (n_bushings, 5) as of `interact`
    at_sensors: np.ndarray  # (n_sensors, nv) for accelerometers; zeros for others
    influence: np.ndarray  # (nv, 2) force of a unit gravity along y and z
    turning: np.ndarray  # (n_turning, nv) as of `modal_loop.ModalEquations`
    orders: np.ndarray  # (n_orders,) k
    viscous: np.ndarray  # (nv, nv) damping beyond joints and springs; (0, 0) without
    circulatory: np.ndarray  # (nv, nv) H; (0, 0) if there is none
    pairs: np.ndarray  # (2 n_bushings, 2) pairs of geoms that touch at each end of a clearance; -1 for none
    limits: np.ndarray  # (2 n_bushings,) tendon whose limits are the gap there; -1 for none
    readings: np.ndarray  # (n_sensors, 2, nv) readings of other sensors per coordinate and velocity; (0, 2, nv) without


class Views(NamedTuple):
    """Arrays of a MuJoCo model and its data, and their addresses."""

    model: int  # address
    data: int  # address
    gravity: np.ndarray  # (3,)
    of_pairs: np.ndarray  # (n, 2) solref of the pairs of geoms
    of_limits: np.ndarray  # (n, 2) solref of the tendons' limits
    position: np.ndarray  # (nv,)
    velocity: np.ndarray  # (nv,)
    applied: np.ndarray  # (nv,) forces
    constraint: np.ndarray  # (nv,) forces of contacts and supports
    acceleration: np.ndarray  # (nv,)


class VelocityPredictor(NamedTuple):
    """The linear model of a step: the velocity in its middle, and the contacts' part of the constraint forces."""

    needed: bool  # True if any force depends on it
    of_position: np.ndarray  # (nv, nv) change of the velocity over half a step by springs
    of_velocity: np.ndarray  # (nv, nv) the velocity with its dampers'
    of_force: np.ndarray  # (nv, nv) per unit of other forces
    compliance: np.ndarray  # (n_rows, rows, 1) as of `modal_loop.ModalEquations`
    known: np.ndarray  # (n_bushings, 2) as of `sweep`: forces that do not act at that velocity
    contact: np.ndarray  # (n_middles, nv) contact forces of the clearances per the constraint's; (0, nv): unknown


@jit(**OPTIONS)
def advance_links(
    steps: int, excitation: np.ndarray, h: float, turns: bool, driven: Driving, lighter: float, views: Views,
    maps: Maps, foresight: VelocityPredictor, coupling: np.ndarray, turning: np.ndarray, clearance: Clearance,
    before: np.ndarray, kept: StepRecords, per_unit: float, out: np.ndarray, first: int,
) -> tuple[int, int]:  # fmt: skip
    """Advance the state by all steps; return (step, clearance) of a divergence, or -1, -1.

    ``excitation``: (n, n_inputs). ``lighter``: factor of gravity for MuJoCo's heavier bodies. ``coupling``: (nv, nv)
    gyroscopic moments per velocity in the middle of all other kicks; (0, 0) for none. ``turning``: (5, 1) as of
    `modal_loop`. ``before``: (nv,) coordinates a step ago. ``out``: (n, columns), filled from row ``first`` on with
    the columns of `Run.advance`.
    """
    model, data, gravity, of_pairs, of_limits, qpos, qvel, applied, constraint, qacc = views
    (
        order, at_rows, spans, places, at_sensors, influence, turned, orders, viscous, circulatory, pairs, limits,
        readings,
    ) = maps  # fmt: skip
    needed, of_position, of_velocity, of_force, compliance, known, from_constraint = foresight
    bushings, numbers = clearance
    lift, shaker, on_base, weight, steady = driven
    nv, n_sensors, n_rows, n_bushings, half = order.size, at_sensors.shape[0], at_rows.shape[0], bushings.size, 0.5 * h
    n_middles = places[n_bushings - 1, 0] + bushings[n_bushings - 1].coordinates if n_bushings else 0
    distinct = from_constraint.shape[0] == n_middles  # else the forces are those that the law asks for
    q, v, middle, total, force, acceleration, travel = np.zeros((7, nv))
    x, w, u, drawn, kicked, way = np.zeros((6, compliance.shape[1], 1))
    ends, filled = np.zeros((2 * n_bushings * ENDS, 1)), np.zeros((n_bushings * FILLED, 1))
    acts, pushed = np.zeros(2 * n_bushings, np.bool_), np.zeros(compliance.shape[1], np.bool_)
    factors, pressed = np.zeros((turned.shape[0], 1)), np.zeros(n_middles)
    for i in range(excitation.shape[0]):
        spin, time = turning[SPIN, 0], (steps + i) * h
        for m in range(nv):
            q[m], v[m] = qpos[order[m]], qvel[order[m]]
            total[m] = steady[m]
        g_y, g_z = weight[0], weight[1]
        for r in range(excitation.shape[1]):
            a = excitation[i, r]
            g_y, g_z = g_y + lift[r, 0] * a, g_z + lift[r, 1] * a
            for m in range(nv):
                total[m] += shaker[r, m] * a
        gravity[1], gravity[2] = lighter * g_y, lighter * g_z
        if turned.shape[0]:
            turn_forces(turning, orders, time, 1, factors)
            for r in range(turned.shape[0]):
                for m in range(nv):
                    total[m] += factors[r, 0] * turned[r, m]
        for m in range(viscous.shape[0]):
            total[m] -= _dot(viscous, m, v, 0, nv)
        for m in range(circulatory.shape[0]):
            total[m] -= spin * _dot(circulatory, m, q, 0, nv)
        for m in range(nv):
            force[m] = total[m]  # and, below, MuJoCo's further forces
        for row in range(n_rows):
            x[row, 0] = _dot(at_rows, row, q, spans[row, 0], spans[row, 1])
            drawn[row, 0] = kicked[row, 0] = 0.0
        if kept.energies.shape[0]:
            for j in range(n_bushings):
                save_previous_state(bushings[j], numbers)
        j = find_contacts(bushings, numbers, places, x, ONE, ends, acts, pushed)
        if j >= 0:
            return i, j
        for row in range(n_rows):
            if pushed[row] or row >= n_middles:
                u[row, 0] = _dot(at_rows, row, v, spans[row, 0], spans[row, 1])
        fill_all(bushings, numbers, places, x, spin, time, compliance, half, ONE, filled)
        for j in range(n_bushings):
            if known[j, 0]:
                _filling_force(filled[FILLED * j :, 0], bushings[j].coordinates, places[j, 0], u, drawn)
                for row in range(places[j, 0], places[j, 0] + bushings[j].coordinates):
                    _push(at_rows, spans, row, drawn[row, 0], total, force)
        for c in range(2 * n_bushings):
            j, y, z = c // 2, places[c // 2, 1 + 2 * (c % 2)], places[c // 2, 2 + 2 * (c % 2)]
            end, stiff, damping = ends[ENDS * c : ENDS * (c + 1), 0], 0.0, 0.0
            if bushings[j].touching == 1:  # also in the gap: MuJoCo detects contact itself
                stiff, damping = press(bushings[j], numbers, c % 2, end[DEPTH], u[z, 0], ONE)
                end[N_Y], end[N_Z], end[BRISTLES] = 0.0, 1.0 if end[DEPTH] > 0.0 else -1.0, 0.0
            elif acts[c]:
                stiff, damping, end[BRISTLES] = friction_force(
                    bushings[j], numbers, c % 2, end[DEPTH], end[N_Y], end[N_Z], x[y, 0], x[z, 0], u[y, 0], u[z, 0],
                    spin, ONE,
                )  # fmt: skip
            _write_softness(of_pairs, of_limits, pairs[c], limits[c], per_unit * max(stiff, 0.5e-9), per_unit * damping)
            if acts[c]:
                end[ELASTIC], end[VISCOUS], end[NORMAL], end[RUBBED] = stiff * abs(end[DEPTH]), damping, 0.0, 0.0
                if known[j, 1]:
                    speed = end[N_Z] * u[z, 0] + (end[N_Y] * u[y, 0] if y != z else 0.0)
                    end[NORMAL] = max(end[ELASTIC] + damping * speed, 0.0)
                    if needed:
                        _push_normal(at_rows, spans, y, z, end, force)
        torque = 0.0
        if needed:
            for m in range(nv):
                force[m] += influence[m, 0] * g_y + influence[m, 1] * g_z
            _predict_velocity(of_position, of_velocity, of_force, q, v, force, middle)
            for row in range(n_rows):
                if pushed[row]:
                    w[row, 0] = _dot(at_rows, row, middle, spans[row, 0], spans[row, 1])
            for _ in range(SWEEPS):
                sweep(
                    bushings, numbers, places, compliance, half, spin, acts, pushed, known, filled, ends, w, kicked, ONE
                )
            torque = torque_of_friction(bushings, numbers, acts, ends, ONE)
            for row in range(n_rows):
                if pushed[row]:
                    _push(at_rows, spans, row, kicked[row, 0], total, force)
            if coupling.size:
                _predict_velocity(of_position, of_velocity, of_force, q, v, force, middle)
                for m in range(nv):
                    total[m] -= _dot(coupling, m, middle, 0, nv)
        for m in range(nv):
            applied[order[m]] = total[m]
        mj_step(model, data)
        for m in range(nv):
            acceleration[m], force[m] = qacc[order[m]], constraint[order[m]]
            middle[m] = 0.5 * (v[m] + qvel[order[m]])  # the mean of before and after: (q₊ - q₋)/(2h)
        row = first + i
        for s in range(n_sensors):
            value = _dot(at_sensors, s, acceleration, 0, nv)
            for r in range(excitation.shape[1]):
                value += on_base[r, s] * excitation[i, r]
            if not abs(value) < np.inf:  # without clearances nothing else would stop it
                return i, 0
            out[row, s] = value
        for s in range(readings.shape[0]):
            out[row, s] += _dot(readings[s], 0, q, 0, nv) + _dot(readings[s], 1, middle, 0, nv)
        _normal_forces(from_constraint, distinct, bushings, places, known, ends, acts, force, pressed)
        for j in range(n_bushings):
            size = bushings[j].coordinates
            for d in range(size):
                m, a, b = places[j, 0] + d, places[j, 3 - size + d], places[j, 5 - size + d]
                out[row, n_sensors + m] = x[m, 0]
                out[row, n_sensors + n_middles + m] = pressed[m] + kicked[a, 0] + kicked[b, 0]
                out[row, n_sensors + 2 * n_middles + m] = drawn[m, 0] + kicked[m, 0]
            out[row, n_sensors + 3 * n_middles + j] = 1.0 if acts[2 * j] or acts[2 * j + 1] else 0.0
        for m in range(nv if kept.coordinates.shape[0] else 0):
            kept.coordinates[row, m] = qpos[order[m]]
        if kept.energies.shape[0]:
            works = kept.energies[row]
            works[:4] = 0.0
            for m in range(nv):
                travel[m], before[m] = 0.5 * (qpos[order[m]] - before[m]), q[m]
                works[1] += (steady[m] + influence[m, 0] * weight[0] + influence[m, 1] * weight[1]) * travel[m]
                for r in range(excitation.shape[1]):
                    lifted = influence[m, 0] * lift[r, 0] + influence[m, 1] * lift[r, 1]
                    works[0] += (shaker[r, m] + lifted) * excitation[i, r] * travel[m]
                for r in range(turned.shape[0]):
                    works[2] += factors[r, 0] * turned[r, m] * travel[m]
                if circulatory.size:
                    works[3] -= spin * _dot(circulatory, m, q, 0, nv) * travel[m]
            for r in range(n_rows):
                way[r, 0] = _dot(at_rows, r, travel, spans[r, 0], spans[r, 1])
            for m in range(n_middles):
                drawn[m, 0] += kicked[m, 0]
            clearance_energies(
                row, kept.energies, h, spin, bushings, numbers, places, x, way, drawn, filled, ends, acts
            )
        if turns:
            out[row, n_sensors + 3 * n_middles + n_bushings] = spin
            turn_on(turning, torque, time, h, ONE)
    return -1, -1


@inlined
def _dot(rows: np.ndarray, row: int, vector: np.ndarray, start: int, stop: int) -> float:
    """Return the product of a row and a vector over a range of coordinates."""
    left, right, total = at(rows, row * vector.size), at(vector, 0), 0.0  # pointers: no index is checked
    for m in range(start, stop):
        total += left[m] * right[m]
    return total


@inlined
def _push(at_rows: np.ndarray, spans: np.ndarray, row: int, push: float, total: np.ndarray, force: np.ndarray) -> None:
    """Add a force at a row, N, against its displacement, to two sums of generalised forces."""
    along, to, also = at(at_rows, row * total.size), at(total, 0), at(force, 0)
    for m in range(spans[row, 0], spans[row, 1]):
        to[m] -= along[m] * push
        also[m] -= along[m] * push


@inlined
def _push_normal(at_rows: np.ndarray, spans: np.ndarray, y: int, z: int, end: np.ndarray, force: np.ndarray) -> None:
    """Add the expected normal force of an end to the forces of the predicted velocity."""
    for m in range(spans[z, 0], spans[z, 1]):
        force[m] -= at_rows[z, m] * end[NORMAL] * end[N_Z]
    if y != z:
        for m in range(spans[y, 0], spans[y, 1]):
            force[m] -= at_rows[y, m] * end[NORMAL] * end[N_Y]


@inlined
def _filling_force(filled: np.ndarray, coordinates: int, row: int, u: np.ndarray, drawn: np.ndarray) -> None:
    """Compute the force of a filling at the velocities u."""
    if coordinates == 1:
        drawn[row, 0] = filled[0] + filled[1] * u[row, 0]
    else:
        drawn[row, 0] = filled[0] + filled[2] * u[row, 0] + filled[3] * u[row + 1, 0]
        drawn[row + 1, 0] = filled[1] + filled[4] * u[row, 0] + filled[5] * u[row + 1, 0]


@inlined
def _write_softness(
    of_pairs: np.ndarray, of_limits: np.ndarray, pairs: np.ndarray, limit: int, stiff: float, damping: float
) -> None:
    """Write the softness of an end of a clearance; a stiffness of zero would mean MuJoCo's default."""
    for side in range(pairs.size):
        if pairs[side] >= 0:
            of_pairs[pairs[side], 0], of_pairs[pairs[side], 1] = stiff, damping
    if limit >= 0:
        of_limits[limit, 0], of_limits[limit, 1] = stiff, damping


@inlined
def _normal_forces(
    from_constraint: np.ndarray, distinct: bool, bushings: np.ndarray, places: np.ndarray, known: np.ndarray,
    ends: np.ndarray, acts: np.ndarray, force: np.ndarray, pressed: np.ndarray,
) -> None:  # fmt: skip
    """Compute the normal forces of the clearances: MuJoCo's, or those of the law."""
    for m in range(pressed.size):
        pressed[m] = _dot(from_constraint, m, force, 0, force.size) if distinct else 0.0
    for c in range(0 if distinct else 2 * bushings.size):
        if acts[c] and known[c // 2, 1]:
            size, middle, normal = bushings[c // 2].coordinates, places[c // 2, 0], ends[ENDS * c + NORMAL, 0]
            for d in range(size):
                pressed[middle + d] += normal * ends[ENDS * c + N_Z + 1 - size + d, 0]


@inlined
def _predict_velocity(
    of_position: np.ndarray, of_velocity: np.ndarray, of_force: np.ndarray, q: np.ndarray, v: np.ndarray,
    force: np.ndarray, middle: np.ndarray,
) -> None:  # fmt: skip
    """Predict the velocity in the middle of the step under forces other than those of springs and dampers."""
    nv = q.size
    for m in range(nv):
        middle[m] = _dot(of_position, m, q, 0, nv) + _dot(of_velocity, m, v, 0, nv) + _dot(of_force, m, force, 0, nv)
