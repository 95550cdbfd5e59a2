"""The loop of the links engine in space: before every mj_step softness, fillings, friction and what turning does.

Forces that the planar loop has are taken as there. Friction, oil films and gyroscopic moments depend on the velocity so
strongly that they are taken in the middle of their own kick: at the velocity half a step on, which the linear model of
the chains foresees of all other forces. So bristles and films may be as strongly damped as they like, and gyroscopic
moments do no work.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..clearance.kernel import follow_law
from ..clearance.pointers import at
from ..clearance.round_kernel import BRISTLES, END_MEMORY, RoundClearance, round_contact, round_filling
from ..core.jit import OPTIONS, inlined, jit
from .links_plant import SpaceMaps
from .mujoco_step import mj_step
from .plant import Driving
from .round_points import fill, rub, speed_of
from .round_scheme import ANGLE, SPIN, dot

__all__ = ["Foresight", "RoundViews", "advance_links"]


class RoundViews(NamedTuple):
    """Arrays of a MuJoCo model and its data, and where these are."""

    model: int  # address
    data: int  # address
    gravity: np.ndarray  # (3,)
    softness: np.ndarray  # (n, 2) solref of the tendons' limits
    position: np.ndarray  # (nv,)
    velocity: np.ndarray  # (nv,)
    applied: np.ndarray  # (nv,) forces
    constraint: np.ndarray  # (nv,) forces of contacts and supports
    acceleration: np.ndarray  # (nv,)


class Foresight(NamedTuple):
    """The linear model of a step: the velocity in its middle, and what of the chains' forces are contacts'."""

    needed: bool  # whether anything depends on it
    of_position: np.ndarray  # (nv, nv) change of the velocity over half a step by springs
    of_velocity: np.ndarray  # (nv, nv) the velocity with its dampers'
    of_force: np.ndarray  # (nv, nv) per unit of other forces
    compliance: np.ndarray  # as `RoundShaft` has it
    films: np.ndarray  # (n_bushings,) whether a filling is taken at that velocity
    contact: np.ndarray  # (n_bushings, 2, nv) contact forces of the bushings per the constraint's; (0, 2, nv): unknown


@jit(**OPTIONS)
def advance_links(
    steps: int, excitation: np.ndarray, h: float, driven: Driving, lighter: float, views: RoundViews,
    maps: SpaceMaps, foresight: Foresight, coupling: np.ndarray, drive: np.ndarray, turning: np.ndarray,
    clearance: RoundClearance, per_unit: float, out: np.ndarray, first: int,
) -> tuple[int, int]:  # fmt: skip
    """Advance the state by all steps; return (step, bushing) of a divergence, or -1, -1.

    ``excitation``: (n, n_inputs). ``lighter``: what of gravity MuJoCo's heavier bodies get.
    ``coupling``: (nv, nv) gyroscopic moments per velocity in the middle of all other kicks; (0, 0) for none.
    ``drive``: rate of the spin, rad/s², time at which it ends, s, and 1/inertia of what friction slows down.
    ``out``: (n, columns), filled from row ``first`` on with what `Run.advance` returns.
    """
    model, data, gravity, softness, qpos, qvel, applied, constraint, qacc = views
    order, spans, at_points, at_sensors, influence, unbalance, viscous, circulatory, limits, readings = maps
    needed, of_position, of_velocity, of_force, compliance, films, from_constraint = foresight
    bushings, states, numbers = clearance
    lift, shaker, on_base, weight, steady = driven
    nv, n_sensors, n_points = order.size, at_sensors.shape[0], at_points.shape[0]
    n_bushings, half = n_points // 3, 0.5 * h
    known = from_constraint.shape[0] == n_bushings
    q, v, middle, total, force, acceleration = np.zeros((6, nv))
    x, w, u, drawn = np.zeros((4, n_points + n_points % 2, 2))
    # Of each end: n along y and z, bristles in 4, normal force in 5, friction and its limit.
    ends, filling = np.zeros((n_points, 8)), np.zeros((n_bushings, 6))
    acts, touches = np.zeros(n_points, np.bool_), np.zeros(n_points, np.bool_)
    for i in range(excitation.shape[0]):
        spin, angle = turning[SPIN], turning[ANGLE]
        rate = drive[0] if (steps + i) * h < drive[1] else 0.0
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
        if spin != 0.0 or rate != 0.0:
            cos, sin = np.cos(angle), np.sin(angle)
            cos, sin = spin * spin * cos + rate * sin, spin * spin * sin - rate * cos
            for m in range(nv):
                total[m] += cos * unbalance[0, m] + sin * unbalance[1, m]
        for d in range(2):
            for m in range(spans[d, 0], spans[d, 1]):
                if viscous.size:
                    total[m] -= dot(viscous, m * nv, v, spans[d, 0], spans[d, 1])
                if circulatory.size and spin != 0.0:
                    total[m] -= spin * dot(circulatory, m * nv, q, spans[1 - d, 0], spans[1 - d, 1])
        for m in range(nv):
            force[m] = total[m]  # and, below, what MuJoCo adds to what is applied
        for p in range(n_points):
            for d in range(2):
                x[p, d] = dot(at_points, (2 * p + d) * nv, q, spans[d, 0], spans[d, 1])
                u[p, d], drawn[p, d] = 0.0, 0.0
            acts[p] = touches[p] = False
        for j in range(n_bushings):
            bushing, state = bushings[j], states[j]
            y, z = x[j]
            if not abs(y) + abs(z) < 1e3 * bushing.gap + 1.0:
                return i, j
            found = round_filling(bushing, state, numbers, y, z, spin)
            if films[j]:
                acts[j] = True
                for k in range(6):
                    filling[j, k] = found[k]
            else:
                speed_of(at_points, spans, v, j, u)
                drawn[j, 0] = found[0] + found[2] * u[j, 0] + found[3] * u[j, 1]
                drawn[j, 1] = found[1] + found[4] * u[j, 0] + found[5] * u[j, 1]
                _pull(at_points, spans, j, drawn[j, 0], drawn[j, 1], total)
                _pull(at_points, spans, j, drawn[j, 0], drawn[j, 1], force)
            square = (y + bushing.offset_y) ** 2 + (z + bushing.offset_z) ** 2
            follow_law(bushing, state, numbers, np.sqrt(square), (steps + i) * h)
            for end in range(2):
                p = n_bushings + 2 * j + end
                r_y, r_z = x[p, 0] + bushing.offset_y, x[p, 1] + bushing.offset_z
                touches[p] = r_y * r_y + r_z * r_z > bushing.gap * bushing.gap
                if touches[p]:
                    speed_of(at_points, spans, v, p, u)
                depth, n_y, n_z, stiff, damping, bristles = round_contact(
                    bushing, state, numbers, end, x[p, 0], x[p, 1], u[p, 0], u[p, 1], spin
                )
                row = limits[2 * j + end]
                if row >= 0:  # a stiffness of zero would mean MuJoCo's default
                    softness[row, 0], softness[row, 1] = per_unit * max(stiff, 0.5e-9), per_unit * damping
                if touches[p]:
                    normal = max(stiff * depth + damping * (n_y * u[p, 0] + n_z * u[p, 1]), 0.0)
                    ends[p, 0], ends[p, 1], ends[p, 4], ends[p, 5] = n_y, n_z, bristles, normal
                    ends[p, 6] = ends[p, 7] = 0.0
                    acts[p] = bushing.friction > 0.0
                    if needed:
                        _pull(at_points, spans, p, normal * n_y, normal * n_z, force)
        torque = 0.0
        if needed:
            for m in range(nv):
                force[m] += influence[m, 0] * g_y + influence[m, 1] * g_z
            _foresee(of_position, of_velocity, of_force, spans, q, v, force, middle)
            for p in range(n_points):
                if acts[p]:
                    speed_of(at_points, spans, middle, p, w)
            for _ in range(2):  # Gauss-Seidel: every force at the velocity that the other forces leave
                for j in range(n_bushings):
                    if films[j]:
                        fill(filling[j], compliance, half, j, w, drawn)
                    for end in range(2):
                        p = n_bushings + 2 * j + end
                        if acts[p]:
                            rub(bushings[j], ends[p], ends[p, 5], compliance, half, p, spin, w, drawn)
            for p in range(n_points):
                if acts[p]:
                    _pull(at_points, spans, p, drawn[p, 0], drawn[p, 1], total)
                    _pull(at_points, spans, p, drawn[p, 0], drawn[p, 1], force)
                    if p >= n_bushings:
                        j, end = (p - n_bushings) // 2, (p - n_bushings) % 2
                        torque += bushings[j].radius * ends[p, 6]
                        most = ends[p, 7] / bushings[j].bristle  # beyond it they slide
                        numbers[states[j].ends + END_MEMORY * end + BRISTLES] = min(max(ends[p, 4], -most), most)
            if coupling.size:
                _foresee(of_position, of_velocity, of_force, spans, q, v, force, middle)
                for m in range(nv):
                    total[m] -= dot(coupling, m * nv, middle, 0, nv)
        for m in range(nv):
            applied[order[m]] = total[m]
        mj_step(model, data)
        for m in range(nv):
            acceleration[m], force[m] = qacc[order[m]], constraint[order[m]]
        row = first + i
        for s in range(n_sensors):
            value = dot(at_sensors, s * nv, acceleration, 0, nv)
            for r in range(excitation.shape[1]):
                value += on_base[r, s] * excitation[i, r]
            if not abs(value) < np.inf:  # without bushings nothing else would stop it
                return i, 0
            out[row, s] = value
        for m in range(nv if readings.shape[0] else 0):  # the mean of before and after: (q₊ - q₋)/(2h)
            middle[m] = 0.5 * (v[m] + qvel[order[m]])
        for s in range(readings.shape[0]):
            out[row, s] += dot(readings, 2 * s * nv, q, 0, nv) + dot(readings, (2 * s + 1) * nv, middle, 0, nv)
        for j in range(n_bushings):
            left, right = n_bushings + 2 * j, n_bushings + 2 * j + 1
            for d in range(2):
                column, pressed = n_sensors + 2 * j + d, 0.0
                if known:
                    pressed = dot(from_constraint, (2 * j + d) * nv, force, spans[d, 0], spans[d, 1])
                for p in range(left, right + 1):
                    pressed += drawn[p, d]
                    if touches[p] and not known:
                        pressed += ends[p, 5] * ends[p, d]
                out[row, column] = x[j, d]
                out[row, column + 2 * n_bushings] = pressed
                out[row, column + 4 * n_bushings] = drawn[j, d]
            out[row, n_sensors + 6 * n_bushings + j] = 1.0 if touches[left] or touches[right] else 0.0
        if out.shape[1] > n_sensors + 7 * n_bushings:
            out[row, n_sensors + 7 * n_bushings] = spin
        change = h * (rate - drive[2] * torque)
        turning[SPIN], turning[ANGLE] = spin + change, angle + h * (spin + 0.5 * change)
    return -1, -1


@inlined
def _pull(at_points: np.ndarray, spans: np.ndarray, p: int, y: float, z: float, total: np.ndarray) -> None:
    """Add the force y, z, N, at a point, against its displacement, to those on the coordinates."""
    nv = total.size
    along_y, along_z, to = at(at_points, 2 * p * nv), at(at_points, (2 * p + 1) * nv), at(total, 0)
    for m in range(spans[0, 0], spans[0, 1]):
        to[m] -= along_y[m] * y
    for m in range(spans[1, 0], spans[1, 1]):
        to[m] -= along_z[m] * z


@inlined
def _foresee(
    of_position: np.ndarray, of_velocity: np.ndarray, of_force: np.ndarray, spans: np.ndarray, q: np.ndarray,
    v: np.ndarray, force: np.ndarray, middle: np.ndarray,
) -> None:  # fmt: skip
    """Fill in the velocity in the middle of the step under forces beside those of springs and dampers."""
    nv = q.size
    for d in range(2):
        start, stop = spans[d, 0], spans[d, 1]
        for m in range(start, stop):
            middle[m] = (
                dot(of_position, m * nv, q, start, stop)
                + dot(of_velocity, m * nv, v, start, stop)
                + dot(of_force, m * nv, force, start, stop)
            )
