"""Time integration in space: every mode exactly, under forces that are straight lines within a step.

The state after a step is linear in the forces at its end. Those of gyroscopic moments follow from the speeds of few
slopes; those at both ends of each bushing from Newton's method, to convergence.
"""

import cmath
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearance_mj.core.jit import jit

from ..motion import exact_step
from ..structure import Oscillator
from . import physics
from .hidden import Bend, Coupling, with_housings
from .physics import Bushings
from .shaft import Modes, Rotor

ITERATIONS = 60
TOLERANCE = 1e-12  # m, of the bushings' points, before Newton's last correction
EXACT = 1e-15  # m, that needs none
GYROSCOPIC_ITERATIONS = 5  # each gains a factor of Ω h, 0.01 at 3000 rev/min
BASE_Y, BASE_Z, FORCE_Y, FORCE_Z, SPIN, WHIRL_Y, WHIRL_Z = range(7)
"""Columns of the inputs: base accelerations, force of a hammer, spin, and force of a unit unbalance; behind them
cos φ, sin φ, cos 2φ and sin 2φ of the shaft's angle φ, which may be left out"""
INPUTS = 11


class Scheme(NamedTuple):
    """Modes prepared for one time step, the same in both planes; those of housings are behind the shaft's."""

    step: float
    state: np.ndarray  # (4, n) q from q, q from v, v from q, v from v
    forced: np.ndarray  # (4, n) q from the force at the start and at the end of the step, v from the same
    square: np.ndarray  # (n,) ω²
    damping: np.ndarray  # (n,) 2 ζ ω
    drive: np.ndarray  # (n,) modal force per acceleration of the base
    weight: np.ndarray  # (2, n) modal force of gravity
    hit: np.ndarray  # (n,) of the hammer's point
    turning: np.ndarray  # (6, 2, n) of what turns with the shaft, by columns of the inputs from WHIRL_Y on
    slopes: np.ndarray  # (r, n) of gyroscopic moments
    mobility_of_slopes: np.ndarray  # (r, r)
    points: np.ndarray  # (2 n_bushings, n) both ends of each bushing, relative to its housing
    compliance: np.ndarray  # displacement of the points by forces at the end of the step, m/N
    mobility: np.ndarray  # velocity, m/(N s)
    accelerometers: np.ndarray  # (n_stations, n)
    probes: np.ndarray  # (n_bushings, n) relative to the housing


class State(NamedTuple):
    """Changed in place from step to step; first axis y, z."""

    q: np.ndarray  # (2, n)
    v: np.ndarray
    force: np.ndarray  # (2, n) modal, all of it
    pushed: np.ndarray  # (2, n) that of the bushings
    place: np.ndarray  # (2, n_points) of the bushings' ends, m
    pull: np.ndarray  # (2 n_points,) forces at them, y and z of each
    earlier: np.ndarray  # the same a step before
    bristle: np.ndarray  # (n_points,)
    bristle_after: np.ndarray  # of a trial step
    slip: np.ndarray  # (n_bushings, n_elements, 2)
    slip_after: np.ndarray


@dataclass(frozen=True)
class Load:
    """Loads on a shaft: gravity, a hammer, and what turns with it."""

    gravity: tuple[float, float] = (0.0, 0.0)  #: m/s², along y and z
    hammer: float = 0.0  #: m, where it hits
    unbalances: tuple[tuple[float, complex], ...] = ()  #: (m, kg m as a vector from the mark)
    bends: tuple[Bend, ...] = ()  #: of the shaft itself
    couplings: tuple[Coupling, ...] = ()


def scheme(
    rotor: Rotor, ends: np.ndarray, load: Load, stations: Sequence[float], probes: Sequence[float], step: float,
    least_damping: float = 0.0, housings: Sequence[Oscillator] = (),
) -> Scheme:  # fmt: skip
    """Prepare a shaft for a step, s.

    ``ends``: (n_bushings, 2) m; ``least_damping``: ratio of every mode; ``housings``: of the first bushings and probes.
    """
    modes, moved = with_housings(rotor.modes(), housings)
    state, forced = np.empty((2, 4, modes.omega.size))
    ratios = np.maximum(modes.damping, least_damping)
    for k, (frequency, ratio) in enumerate(zip(modes.omega, ratios)):
        state[:, k], forced[:, k] = exact_step(frequency, ratio, step)
    points, watched = modes.at(ends.ravel()), modes.at(probes)
    points[: 2 * len(moved)] -= np.repeat(moved, 2, axis=0)
    watched[: len(moved)] -= moved
    return Scheme(
        step, state, forced, modes.omega**2, 2 * ratios * modes.omega, -modes.participation,
        np.outer(load.gravity, modes.participation), modes.at([load.hammer])[0], _turning(rotor, modes, load),
        modes.slopes, modes.slopes * forced[3] @ modes.slopes.T, points, points * forced[1] @ points.T,
        points * forced[3] @ points.T, modes.at(stations), watched,
    )  # fmt: skip


def _turning(rotor: Rotor, modes: Modes, load: Load) -> np.ndarray:
    """Forces (6, 2, n) along y and z per column of the inputs from WHIRL_Y on."""
    nothing, rotor_modes = np.zeros(modes.omega.size, complex), slice(len(rotor.modes().omega))
    heavy = sum((moment * modes.at([x])[0] for x, moment in load.unbalances), nothing)
    bent, ahead, back = nothing.copy(), nothing.copy(), nothing.copy()
    for bend in load.bends:
        bent[rotor_modes] += cmath.rect(1.0, bend.phase) * bend.forces(rotor)
    for coupling in load.couplings:
        ahead[rotor_modes] += coupling.forward * coupling.slopes(rotor)
        back[rotor_modes] += coupling.backward * coupling.slopes(rotor)
    columns = heavy, 1j * heavy, bent, 1j * bent, ahead + back, 1j * (ahead - back)
    return np.array([[column.real, column.imag] for column in columns])


def unloaded(on: Scheme, bushings: Bushings) -> State:
    """The shaft straight and at rest, with grease and bristles relaxed."""
    n, points = on.square.size, on.points.shape[0]
    slip = np.zeros((len(bushings.numbers), bushings.slip.shape[2], 2))
    return State(
        q=np.zeros((2, n)), v=np.zeros((2, n)), force=np.zeros((2, n)), pushed=np.zeros((2, n)),
        place=np.zeros((2, points)), pull=np.zeros(2 * points), earlier=np.zeros(2 * points),
        bristle=np.zeros(points), bristle_after=np.zeros(points), slip=slip, slip_after=slip.copy(),
    )  # fmt: skip


def whirl(angle: np.ndarray, spin: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the force along y and z of a unit unbalance (kg m) whose angle from y is ``angle``."""
    c, s = np.cos(angle), np.sin(angle)
    return spin**2 * c + rate * s, spin**2 * s - rate * c


@jit(fastmath={"contract", "reassoc", "nsz"})
def march(scheme: Scheme, state: State, bushings: Bushings, inputs: np.ndarray, out: np.ndarray) -> int:
    """Advance over inputs (n_steps, 7 to 11).

    Returns the number of steps done, fewer if one fails. Fills ``out`` (n_steps, 2 n_stations + 2 n_bushings): absolute
    accelerations along y, z of each station, displacements along y, z of each bushing's probe.
    """
    # Compiled code counts references to arrays that it takes out of tuples: all are taken out once. Both planes go
    # through each loop together, as sums over few modes wait for themselves.
    step, m, b, square, damping, drive, hit = (
        scheme.step, scheme.state, scheme.forced, scheme.square, scheme.damping, scheme.drive, scheme.hit,
    )  # fmt: skip
    weight, turned, slopes, between = scheme.weight, scheme.turning, scheme.slopes, scheme.mobility_of_slopes
    points, stations, probes = scheme.points, scheme.accelerometers, scheme.probes
    compliance, mobility, place, pull, earlier = (
        scheme.compliance, scheme.mobility, state.place, state.pull, state.earlier,
    )  # fmt: skip
    bristle, bristle_after, slip, slip_after = state.bristle, state.bristle_after, state.slip, state.slip_after
    numbers, elements, table = bushings.numbers, bushings.slip, bushings.table
    qy, qz, vy, vz = state.q[0], state.q[1], state.v[0], state.v[1]
    fy, fz, py, pz = state.force[0], state.force[1], state.pushed[0], state.pushed[1]
    n, n_points, n_slopes, n_stations = square.size, points.shape[0], slopes.shape[0], stations.shape[0]
    points_work, slopes_work, modes_work = np.empty((4, 2, n_points)), np.empty((3, 2, n_slopes)), np.empty((2, n))
    free, speed, x, v = points_work[0], points_work[1], points_work[2], points_work[3]
    before, turning, trial = slopes_work[0], slopes_work[1], slopes_work[2]
    ay, az = modes_work[0], modes_work[1]
    jacobian, right = np.empty((2 * n_points, 2 * n_points)), np.empty(2 * n_points)
    work = np.empty((n_points + 1, 10))
    for i in range(inputs.shape[0]):
        spin, base_y, base_z = inputs[i, SPIN], inputs[i, BASE_Y], inputs[i, BASE_Z]
        force_y, force_z = inputs[i, FORCE_Y], inputs[i, FORCE_Z]
        for k in range(n):
            end = weight[0, k] + drive[k] * base_y + hit[k] * force_y
            for t in range(inputs.shape[1] - WHIRL_Y):
                end += turned[t, 0, k] * inputs[i, WHIRL_Y + t]
            moved = m[0, k] * qy[k] + m[1, k] * vy[k] + b[0, k] * fy[k] + b[1, k] * end
            vy[k] = m[2, k] * qy[k] + m[3, k] * vy[k] + b[2, k] * fy[k] + b[3, k] * end
            qy[k] = moved
            fy[k] = end
            end = weight[1, k] + drive[k] * base_z + hit[k] * force_z
            for t in range(inputs.shape[1] - WHIRL_Y):
                end += turned[t, 1, k] * inputs[i, WHIRL_Y + t]
            moved = m[0, k] * qz[k] + m[1, k] * vz[k] + b[0, k] * fz[k] + b[1, k] * end
            vz[k] = m[2, k] * qz[k] + m[3, k] * vz[k] + b[2, k] * fz[k] + b[3, k] * end
            qz[k] = moved
            fz[k] = end
        if n_slopes > 0 and spin != 0.0:
            for r in range(n_slopes):
                s = t = 0.0
                for k in range(n):  # with the bushings' forces of the step before
                    s += slopes[r, k] * (vy[k] + b[3, k] * py[k])
                    t += slopes[r, k] * (vz[k] + b[3, k] * pz[k])
                before[0, r] = turning[0, r] = s
                before[1, r] = turning[1, r] = t
            for _ in range(GYROSCOPIC_ITERATIONS):
                for r in range(n_slopes):
                    trial[0, r], trial[1, r] = before[0, r], before[1, r]
                    for o in range(n_slopes):
                        trial[0, r] -= spin * between[r, o] * turning[1, o]
                        trial[1, r] += spin * between[r, o] * turning[0, o]
                for r in range(n_slopes):
                    turning[0, r], turning[1, r] = trial[0, r], trial[1, r]
            for r in range(n_slopes):
                s, t = -spin * turning[1, r], spin * turning[0, r]
                for k in range(n):
                    f, g = slopes[r, k] * s, slopes[r, k] * t
                    qy[k] += b[1, k] * f
                    qz[k] += b[1, k] * g
                    vy[k] += b[3, k] * f
                    vz[k] += b[3, k] * g
                    fy[k] += f
                    fz[k] += g
        for p in range(n_points):
            y = z = s = t = 0.0
            for k in range(n):
                y += points[p, k] * qy[k]
                z += points[p, k] * qz[k]
                s += points[p, k] * vy[k]
                t += points[p, k] * vz[k]
            free[0, p], free[1, p], speed[0, p], speed[1, p] = y, z, s, t
        if not _solve(
            step, spin, compliance, mobility, numbers, elements, table, free, speed, pull, earlier, place, bristle,
            bristle_after, slip, slip_after, x, v, jacobian, right, work,
        ):  # fmt: skip
            return i
        for k in range(n):
            f = g = 0.0
            for p in range(n_points):
                f -= points[p, k] * pull[2 * p]
                g -= points[p, k] * pull[2 * p + 1]
            py[k], pz[k] = f, g
            qy[k] += b[1, k] * f
            qz[k] += b[1, k] * g
            vy[k] += b[3, k] * f
            vz[k] += b[3, k] * g
            fy[k] += f
            fz[k] += g
            ay[k] = fy[k] - damping[k] * vy[k] - square[k] * qy[k]
            az[k] = fz[k] - damping[k] * vz[k] - square[k] * qz[k]
        for p in range(n_stations):
            y, z = base_y, base_z
            for k in range(n):
                y += stations[p, k] * ay[k]
                z += stations[p, k] * az[k]
            out[i, 2 * p], out[i, 2 * p + 1] = y, z
        for p in range(probes.shape[0]):
            y = z = 0.0
            for k in range(n):
                y += probes[p, k] * qy[k]
                z += probes[p, k] * qz[k]
            out[i, 2 * (n_stations + p)], out[i, 2 * (n_stations + p) + 1] = y, z
    return inputs.shape[0]


@jit(fastmath={"contract", "reassoc", "nsz"})
def _solve(
    step: float, spin: float, compliance: np.ndarray, mobility: np.ndarray, numbers: np.ndarray, elements: np.ndarray,
    table: np.ndarray, free: np.ndarray, speed: np.ndarray, pull: np.ndarray, earlier: np.ndarray, place: np.ndarray,
    bristle: np.ndarray, bristle_after: np.ndarray, slip: np.ndarray, slip_after: np.ndarray, x: np.ndarray,
    v: np.ndarray, jacobian: np.ndarray, right: np.ndarray, work: np.ndarray,
) -> bool:  # fmt: skip
    """Find the forces ``pull`` at the bushings' ends by Newton's method; bristles and grease move on.

    What fills a bushing acts at the mean of its ends, half of it on each.
    """
    n = numbers.shape[0]
    size = 4 * n
    middle = 2 * n  # row of `work`
    for row in range(size):
        f = pull[row]
        if f != 0.0:
            pull[row] = 2.0 * f - earlier[row]
        earlier[row] = f
    for _ in range(ITERATIONS):
        for axis in range(2):
            for p in range(2 * n):
                at, s = free[axis, p], speed[axis, p]
                for o in range(2 * n):
                    at -= compliance[p, o] * pull[2 * o + axis]
                    s -= mobility[p, o] * pull[2 * o + axis]
                x[axis, p], v[axis, p] = at, s
        largest = 0.0
        for j in range(n):
            first = 2 * j
            oy, oz = numbers[j, physics.OFFSET_Y], numbers[j, physics.OFFSET_Z]
            for p in (first, first + 1):
                for c in range(10):
                    work[p, c] = 0.0
                bristle_after[p] = physics.contact(
                    numbers, j, x[0, p] + oy, x[1, p] + oz, v[0, p], v[1, p], x[0, p] - place[0, p],
                    x[1, p] - place[1, p], numbers[j, physics.RADIUS] * spin * step, bristle[p], work, p,
                )  # fmt: skip
            for c in range(10):
                work[middle, c] = 0.0
            my, mz = 0.5 * (x[0, first] + x[0, first + 1]), 0.5 * (x[1, first] + x[1, first + 1])
            sy, sz = 0.5 * (v[0, first] + v[0, first + 1]), 0.5 * (v[1, first] + v[1, first + 1])
            if numbers[j, physics.FILM] > 0.0:
                physics.film(numbers, table, j, my + oy, mz + oz, sy, sz, spin, work, middle)
            else:
                physics.grease(
                    numbers, elements, j, my, mz, sy, sz, my - 0.5 * (place[0, first] + place[0, first + 1]),
                    mz - 0.5 * (place[1, first] + place[1, first + 1]), slip, slip_after, work, middle,
                )  # fmt: skip
            for p in (first, first + 1):
                touching = work[p, 0] != 0.0 or work[p, 1] != 0.0
                for axis in range(2):
                    row = 2 * p + axis
                    right[row] = work[p, axis] + 0.5 * work[middle, axis] - pull[row]
                    largest = max(largest, abs(right[row]) * compliance[p, p])
                    for o in range(2 * n):
                        by_place = 0.25 * (compliance[first, o] + compliance[first + 1, o])
                        by_speed = 0.25 * (mobility[first, o] + mobility[first + 1, o])
                        for other in range(2):
                            c = 2 + 2 * axis + other
                            slope = work[middle, c] * by_place + work[middle, c + 4] * by_speed
                            if touching:
                                slope += work[p, c] * compliance[p, o] + work[p, c + 4] * mobility[p, o]
                            jacobian[row, 2 * o + other] = slope
                    jacobian[row, row] += 1.0
        if largest > EXACT:
            _eliminate(jacobian, right, size)
            for row in range(size):
                pull[row] += right[row]
        if largest <= TOLERANCE:
            for p in range(2 * n):
                place[0, p], place[1, p], bristle[p] = x[0, p], x[1, p], bristle_after[p]
            for j in range(n):
                for i in range(slip.shape[1]):
                    slip[j, i, 0], slip[j, i, 1] = slip_after[j, i, 0], slip_after[j, i, 1]
            return True
    return False


@jit
def _eliminate(matrix: np.ndarray, right: np.ndarray, n: int) -> None:
    """Solve in place; the matrix is near the identity where steps are short."""
    for k in range(n):
        over = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            if matrix[i, k] != 0.0:
                factor = matrix[i, k] * over
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]
