"""Time integration: every mode exactly, under forces that are straight lines within a step; bushings implicitly.

With the forces at the bushings' points linear between the ends of a step, the modes' state after it is known in closed
form, linear in the forces at its end. These follow from Newton's method on the points alone, to convergence.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.linalg

from clearance_mj.core.jit import jit
from clearance_mj.rig.sensing import clearance_of

from . import physics
from .bench import Bench
from .physics import Bushings

ITERATIONS = 60
TOLERANCE = 1e-12  # m, of the bushings' points
FORCE = -1


class Scheme(NamedTuple):
    """Modes prepared for one time step."""

    step: float
    state: np.ndarray  # (4, n) q from q, q from v, v from q, v from v
    forced: np.ndarray  # (4, n) q from the force at the start and at the end of the step, v from the same
    square: np.ndarray  # (n,) ω²
    damping: np.ndarray  # (n,) 2 ζ ω
    drive: np.ndarray  # (n, 2) modal force per acceleration of the base, and per its angular acceleration
    levers: np.ndarray  # (n_accelerometers,) m, from where the base turns about
    points: np.ndarray  # (3 n_bushings, n) the bushings' middles, then both ends of each
    compliance: np.ndarray  # displacement of the points by forces at the end of the step, m/N
    mobility: np.ndarray  # velocity, m/(N s)
    accelerometers: np.ndarray  # (n_accelerometers, n) of all sensors of the rig
    orders: np.ndarray  # (n_accelerometers,) derivative that each reads, FORCE of what reads forces in a bushing
    bushings: np.ndarray  # (n_accelerometers,) whose forces these are
    probes: np.ndarray  # (n_probes, n)


class State(NamedTuple):
    """Changed in place from step to step."""

    q: np.ndarray
    v: np.ndarray
    force: np.ndarray  # (n,) modal, with the base's
    place: np.ndarray  # (3 n_bushings,) of the points, m
    z: np.ndarray  # (n_bushings,) of Bouc-Wen
    deflection: np.ndarray  # (n_bushings, n_elements) of Maxwell-slip
    z_after: np.ndarray  # of a trial step
    deflection_after: np.ndarray
    scratch: np.ndarray  # (7, 3 n_bushings)
    jacobian: np.ndarray  # (3 n_bushings, 3 n_bushings)


def scheme(bench: Bench, step: float) -> Scheme:
    """Prepare a bench for a step, s."""
    ends = np.array([(h.position - h.length / 2, h.position + h.length / 2) for h in bench.forces]).reshape(-1, 2)
    accelerometers, probes = ([i.position for i in part] for part in (bench.accelerometers, bench.probes))
    middles, structure = ends.mean(axis=1), bench.structure
    planes = structure.modes(structure.shaft(bench.shaft), [*ends.ravel(), *middles])

    def rows(positions: Sequence[float], curved: bool = False) -> np.ndarray:
        of_housings = np.zeros((len(positions), len(structure.housings)))
        return np.hstack([*(cosine * modes.at(positions, curved) for modes, cosine in planes), of_housings])

    shaft, held = rows([*middles, *ends.ravel()]), structure.housings
    sensors, read = bench.rig.sensors[: len(accelerometers)], rows(accelerometers)
    gauges = np.array([s.quantity == "strain" for s in sensors])
    read[gauges] = -bench.shaft.diameter / 2 * rows(accelerometers, curved=True)[gauges]
    watched, count = rows(probes), sum(modes.omega.size for modes, _ in planes)
    for j, housing in enumerate(held):
        unit = 1 / np.sqrt(housing.mass)
        shaft[[j, len(middles) + 2 * j, len(middles) + 2 * j + 1], count + j] = -unit
        if probes and not structure.probes_on_base:
            watched[j, count + j] = -unit
    omega = np.concatenate([*(m.omega for m, _ in planes), [2 * np.pi * h.frequency for h in held]])
    ratios = np.concatenate([*(m.damping for m, _ in planes), [h.ratio for h in held]])
    along = np.concatenate([*(cosine * m.participation for m, cosine in planes), [np.sqrt(h.mass) for h in held]])
    turned = np.concatenate(
        [*(cosine * m.turning for m, cosine in planes), [x * np.sqrt(h.mass) for h, x in zip(held, middles)]]
    )
    state, forced = np.empty((2, 4, omega.size))
    for k, (frequency, ratio) in enumerate(zip(omega, ratios)):
        state[:, k], forced[:, k] = exact_step(frequency, ratio, step)
    return Scheme(
        step, state, forced, omega**2, 2 * ratios * omega, -np.column_stack((along, turned)), np.array(accelerometers),
        shaft, shaft * forced[1] @ shaft.T, shaft * forced[3] @ shaft.T, read,
        np.array([FORCE if s.quantity == "force" else s.order for s in sensors]),
        np.array([clearance_of(bench.rig, s) or 0 for s in sensors]), watched,
    )  # fmt: skip


def exact_step(omega: float, ratio: float, h: float) -> tuple[np.ndarray, np.ndarray]:
    """One oscillator over a step under p0 + (p1 - p0) t/h: its matrix exponential with p and ṗ as states."""
    system = np.zeros((4, 4))
    system[0, 1] = system[1, 2] = system[2, 3] = 1.0
    system[1, 0], system[1, 1] = -(omega**2), -2 * ratio * omega
    e = scipy.linalg.expm(system * h)
    last = e[:2, 3] / h
    first = e[:2, 2] - last
    return e[:2, :2].ravel(), np.array([first[0], last[0], first[1], last[1]])


def at_rest(scheme: Scheme, bushings: Bushings) -> tuple[State, Bushings]:
    """Static equilibrium with the preload of bushings whose offset is larger than the gap; grease relaxed there."""
    n, count = bushings.gap.size, scheme.square.size
    points = scheme.points[n:]
    static = points / scheme.square @ points.T
    side = np.repeat(np.sign(bushings.offset), 2)
    free, force = np.repeat(np.abs(bushings.offset) - bushings.gap, 2), np.zeros(2 * n)
    for _ in range(200):
        depth = free - side * (static @ (side * force))
        pairs = [physics.contact(d, 0.0, bushings.contact, p // 2)[:2] for p, d in enumerate(depth)]
        wanted, slope = np.reshape(pairs, (-1, 2)).T
        jacobian = np.eye(2 * n) + slope[:, None] * static * np.outer(side, side)
        change = np.linalg.solve(jacobian, wanted - force)
        force = force + change
        if np.abs(change).max(initial=0.0) < 1e-12:
            break
    modal = -points.T @ (side * force)
    q = modal / scheme.square
    place = scheme.points @ q
    slip = np.zeros((n, bushings.slip.shape[2]))
    scratch, jacobian = np.zeros((7, 3 * n)), np.zeros((3 * n, 3 * n))
    state = State(q, np.zeros(count), modal, place, np.zeros(n), slip, np.zeros(n), slip.copy(), scratch, jacobian)
    return state, bushings._replace(rest=place[:n].copy())


@jit(fastmath={"contract", "reassoc", "nsz"})
def march(scheme: Scheme, state: State, bushings: Bushings, base: np.ndarray, out: np.ndarray) -> int:
    """Advance over the base's accelerations (n_steps, 3), straight and angular, and its velocity.

    Returns the number of steps done, fewer if one fails. Fills ``out`` (n_steps, n_accelerometers + n_probes): absolute
    accelerations and velocities, displacements and strains of the shaft on its base, forces of bushings on the shaft,
    then displacements relative to what the probes are fixed to.
    """
    # Compiled code counts references to arrays that it takes out of tuples: all are taken out once.
    q, v, force, m, b, drive = state.q, state.v, state.force, scheme.state, scheme.forced, scheme.drive
    points, accelerometers, probes = scheme.points, scheme.accelerometers, scheme.probes
    square, damping = scheme.square, scheme.damping
    n, n_points, n_sensors, n_probes = q.size, points.shape[0], accelerometers.shape[0], probes.shape[0]
    free, speed, pull, acceleration = np.empty(n_points), np.empty(n_points), np.empty(n_points), np.empty(n)
    levers, orders, holes, n_holes = scheme.levers, scheme.orders, scheme.bushings, scheme.points.shape[0] // 3
    for i in range(base.shape[0]):
        for k in range(n):
            start, end = force[k], drive[k, 0] * base[i, 0] + drive[k, 1] * base[i, 1]
            moved = m[0, k] * q[k] + m[1, k] * v[k] + b[0, k] * start + b[1, k] * end
            v[k] = m[2, k] * q[k] + m[3, k] * v[k] + b[2, k] * start + b[3, k] * end
            q[k] = moved
            force[k] = end
            acceleration[k] = 0.0
        for p in range(n_points):
            x = s = 0.0
            for k in range(n):
                x += points[p, k] * q[k]
                s += points[p, k] * v[k]
            free[p] = x
            speed[p] = s
        if not _solve(scheme, state, bushings, free, speed, pull):
            return i
        for p in range(n_points):
            if pull[p] != 0.0:
                f = pull[p]
                for k in range(n):
                    acceleration[k] -= points[p, k] * f
        for k in range(n):
            q[k] += b[1, k] * acceleration[k]
            v[k] += b[3, k] * acceleration[k]
            force[k] += acceleration[k]
            acceleration[k] = force[k] - damping[k] * v[k] - square[k] * q[k]
        for p in range(n_sensors):
            a = base[i, 0] + levers[p] * base[i, 1]
            for k in range(n):
                a += accelerometers[p, k] * acceleration[k]
            if orders[p] == FORCE:
                j = holes[p]
                a = pull[j] + pull[n_holes + 2 * j] + pull[n_holes + 2 * j + 1]
            elif orders[p] < 2:
                a = base[i, 2] * orders[p]
                for k in range(n):
                    a += accelerometers[p, k] * (v[k] if orders[p] == 1 else q[k])
            out[i, p] = a
        for p in range(n_probes):
            x = 0.0
            for k in range(n):
                x += probes[p, k] * q[k]
            out[i, n_sensors + p] = x
    return base.shape[0]


@jit
def _solve(
    scheme: Scheme, state: State, bushings: Bushings, free: np.ndarray, speed: np.ndarray, pull: np.ndarray
) -> bool:
    """Find the points' forces ``pull`` by Newton's method; points and grease move on."""
    compliance, mobility, jacobian, scratch = scheme.compliance, scheme.mobility, state.jacobian, state.scratch
    x, v, by_place, by_speed, right = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    gap, offset, contacts = bushings.gap, bushings.offset, bushings.contact
    n_points, n = free.size, gap.size
    for p in range(n_points):
        x[p], v[p], pull[p] = free[p], speed[p], 0.0
    for _ in range(ITERATIONS):
        for p in range(n):
            f, dx, dv = _grease(bushings, state, p, x[p], v[p], scheme.step)
            right[p], by_place[p], by_speed[p] = f - pull[p], dx, dv
        for p in range(n, n_points):
            j = (p - n) // 2
            e = x[p] + offset[j]
            side = 1.0 if e > 0.0 else -1.0
            f, dx, dv = physics.contact(side * e - gap[j], side * v[p], contacts, j)
            right[p], by_place[p], by_speed[p] = side * f - pull[p], dx, dv
        for p in range(n_points):
            for o in range(n_points):
                jacobian[p, o] = by_place[p] * compliance[p, o] + by_speed[p] * mobility[p, o]
            jacobian[p, p] += 1.0
        _eliminate(jacobian, right)
        for p in range(n_points):
            x[p], v[p] = free[p], speed[p]
        largest = 0.0
        for o in range(n_points):
            pull[o] += right[o]
            if right[o] != 0.0 or pull[o] != 0.0:
                largest = max(largest, abs(right[o]) * compliance[o, o])
                for p in range(n_points):
                    x[p] -= compliance[p, o] * pull[o]
                    v[p] -= mobility[p, o] * pull[o]
        if largest <= TOLERANCE:
            state.place[:] = x
            state.z[:] = state.z_after
            state.deflection[:] = state.deflection_after
            return True
    return False


@jit(inline="always")
def _grease(
    bushings: Bushings, state: State, j: int, x: float, v: float, time_step: float
) -> tuple[float, float, float]:
    """Force and derivatives at the middle of a bushing; what it remembers of the step goes into the trial's arrays."""
    step = x - state.place[j]
    force, by_place, by_speed = physics.film(x + bushings.offset[j], v, bushings.film, j)
    force += bushings.elastic[j] * (x - bushings.rest[j])
    by_place += bushings.elastic[j]
    k = bushings.bouc_wen[j, 0]
    if k > 0.0:
        shape = bushings.bouc_wen
        state.z_after[j], slope = physics.bouc_wen(step, state.z[j], shape[j, 1], shape[j, 2], shape[j, 3])
        force += k * state.z_after[j]
        by_place += k * slope
    sliders, tangent = physics.slip(
        step, step / time_step, state.deflection, bushings.slip, bushings.stribeck, state.deflection_after, j
    )
    return force + sliders, by_place + tangent, by_speed


@jit(inline="always")
def _eliminate(matrix: np.ndarray, right: np.ndarray) -> None:
    """Solve in place; rows of points without contact are those of the identity, and come last."""
    n = right.size
    for k in range(n):
        for i in range(k + 1, n):
            if matrix[i, k] != 0.0:
                factor = matrix[i, k] / matrix[k, k]
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]
