"""Time integration in space: every mode exactly, under forces that are straight lines within a step.

The state after a step is linear in the forces at its end. Those of gyroscopic moments follow from the speeds of few
slopes; those at both ends of each bushing from Newton's method, to convergence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from ..motion import _exact
from . import physics
from .physics import Bushings
from .shaft import Rotor

ITERATIONS = 60
TOLERANCE = 1e-12  # m, of the bushings' points, before Newton's last correction
EXACT = 1e-15  # m, that needs none
GYROSCOPIC_ITERATIONS = 5  # each gains a factor of Ω h, 0.01 at 3000 rev/min
BASE_Y, BASE_Z, FORCE_Y, FORCE_Z, SPIN, WHIRL_Y, WHIRL_Z = range(7)
"""Columns of the inputs: base accelerations, force of a hammer, spin, and force of a unit unbalance"""


class Scheme(NamedTuple):
    """Modes prepared for one time step, the same in both planes."""

    step: float
    state: np.ndarray  # (4, n) q from q, q from v, v from q, v from v
    forced: np.ndarray  # (4, n) q from the force at the start and at the end of the step, v from the same
    square: np.ndarray  # (n,) ω²
    damping: np.ndarray  # (n,) 2 ζ ω
    drive: np.ndarray  # (n,) modal force per acceleration of the base
    weight: np.ndarray  # (2, n) modal force of gravity
    hit: np.ndarray  # (n,) of the hammer's point
    unbalance: np.ndarray  # (2, n) along the mark at angle 0, and across it
    slopes: np.ndarray  # (r, n) of gyroscopic moments
    mobility_of_slopes: np.ndarray  # (r, r)
    points: np.ndarray  # (2 n_bushings, n) both ends of each bushing
    compliance: np.ndarray  # displacement of the points by forces at the end of the step, m/N
    mobility: np.ndarray  # velocity, m/(N s)
    accelerometers: np.ndarray  # (n_stations, n)
    probes: np.ndarray  # (n_bushings, n)


class State(NamedTuple):
    """Changed in place from step to step; first axis y, z."""

    q: np.ndarray  # (2, n)
    v: np.ndarray
    force: np.ndarray  # (2, n) modal, all of it
    pushed: np.ndarray  # (2, n) that of the bushings
    place: np.ndarray  # (2, n_points) of the bushings' ends, m
    pull: np.ndarray  # (2 n_points,) forces at them, y and z of each
    bristle: np.ndarray  # (n_points,)
    bristle_after: np.ndarray  # of a trial step
    slip: np.ndarray  # (n_bushings, n_elements, 2)
    slip_after: np.ndarray


@dataclass(frozen=True)
class Load:
    """What acts on a shaft, by modes."""

    gravity: tuple[float, float] = (0.0, 0.0)  #: m/s², along y and z
    hammer: float = 0.0  #: m, where it hits
    unbalances: tuple[tuple[float, complex], ...] = ()  #: (m, kg m as a vector from the mark)


def scheme(
    rotor: Rotor, ends: np.ndarray, load: Load, stations: Sequence[float], probes: Sequence[float], step: float,
    least_damping: float = 0.0,
) -> Scheme:  # fmt: skip
    """Prepare a shaft for a step, s; ``ends``: (n_bushings, 2) m; ``least_damping``: ratio of every mode."""
    places = [load.hammer, *(x for x, _ in load.unbalances), *ends.ravel()]
    modes = rotor.modes(places)
    state, forced = np.empty((2, 4, modes.omega.size))
    ratios = np.maximum(modes.damping, least_damping)
    for k, (own, ratio) in enumerate(zip(modes.omega, ratios)):
        state[:, k], forced[:, k] = _exact(own, ratio, step)
    points = modes.at(ends.ravel())
    heavy = sum((moment * modes.at([x])[0] for x, moment in load.unbalances), np.zeros(modes.omega.size, complex))
    return Scheme(
        step, state, forced, modes.omega**2, 2 * ratios * modes.omega, -modes.participation,
        np.outer(load.gravity, modes.participation), modes.at([load.hammer])[0], np.array([heavy.real, heavy.imag]),
        modes.slopes, modes.slopes * forced[3] @ modes.slopes.T, points, points * forced[1] @ points.T,
        points * forced[3] @ points.T, modes.at(stations), modes.at(probes),
    )  # fmt: skip


def unloaded(on: Scheme, bushings: Bushings) -> State:
    """The shaft straight and at rest, with grease and bristles relaxed."""
    n, points = on.square.size, on.points.shape[0]
    modal = [np.zeros((2, n)) for _ in range(4)]
    slip = np.zeros((bushings.gap.size, bushings.slip.shape[2], 2))
    ends = np.zeros((2, points)), np.zeros(2 * points), np.zeros(points), np.zeros(points)
    return State(*modal, *ends, slip, slip.copy())


def whirl(angle: np.ndarray, spin: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the force along y and z of a unit unbalance (kg m) whose angle from y is ``angle``."""
    c, s = np.cos(angle), np.sin(angle)
    return spin**2 * c + rate * s, spin**2 * s - rate * c


@numba.njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz"})
def march(scheme: Scheme, state: State, bushings: Bushings, inputs: np.ndarray, out: np.ndarray) -> int:
    """Advance over inputs (n_steps, 7).

    Returns the number of steps done, fewer if one fails. Fills ``out`` (n_steps, 2 n_stations + 2 n_bushings): absolute
    accelerations along y, z of each station, displacements along y, z of each bushing's probe.
    """
    # Compiled code counts references to arrays that it takes out of tuples: all are taken out once.
    m, b, square, damping, drive = scheme.state, scheme.forced, scheme.square, scheme.damping, scheme.drive
    weight, hit, unbalance, slopes, between = (
        scheme.weight, scheme.hit, scheme.unbalance, scheme.slopes, scheme.mobility_of_slopes,
    )  # fmt: skip
    points, stations, probes, pull = scheme.points, scheme.accelerometers, scheme.probes, state.pull
    n, n_points, n_slopes = square.size, points.shape[0], slopes.shape[0]
    free, speed = np.empty((2, n_points)), np.empty((2, n_points))
    acceleration = np.empty((2, n))
    before, turning, trial = np.empty((2, n_slopes)), np.empty((2, n_slopes)), np.empty((2, n_slopes))
    jacobian, right, work = np.empty((2 * n_points, 2 * n_points)), np.empty(2 * n_points), np.empty((3, n_points, 10))
    x, v = np.empty((2, n_points)), np.empty((2, n_points))
    for i in range(inputs.shape[0]):
        spin = inputs[i, SPIN]
        for axis in range(2):
            q, velocity, force = state.q[axis], state.v[axis], state.force[axis]
            base, hammer = inputs[i, BASE_Y + axis], inputs[i, FORCE_Y + axis]
            first, second = inputs[i, WHIRL_Y + axis], inputs[i, WHIRL_Z - axis]
            if axis == 0:
                second = -second
            for k in range(n):
                start = force[k]
                end = weight[axis, k] + drive[k] * base + hit[k] * hammer
                end += unbalance[0, k] * first + unbalance[1, k] * second
                moved = m[0, k] * q[k] + m[1, k] * velocity[k] + b[0, k] * start + b[1, k] * end
                velocity[k] = m[2, k] * q[k] + m[3, k] * velocity[k] + b[2, k] * start + b[3, k] * end
                q[k] = moved
                force[k] = end
            for r in range(n_slopes):
                s = 0.0
                for k in range(n):  # with the bushings' forces of the step before
                    s += slopes[r, k] * (velocity[k] + b[3, k] * state.pushed[axis, k])
                before[axis, r] = turning[axis, r] = s
        if n_slopes > 0 and spin != 0.0:
            for _ in range(GYROSCOPIC_ITERATIONS):
                for r in range(n_slopes):
                    trial[0, r], trial[1, r] = before[0, r], before[1, r]
                    for o in range(n_slopes):
                        trial[0, r] -= spin * between[r, o] * turning[1, o]
                        trial[1, r] += spin * between[r, o] * turning[0, o]
                turning[:] = trial
            for axis in range(2):
                sign = -spin if axis == 0 else spin
                for r in range(n_slopes):
                    moment = sign * turning[1 - axis, r]
                    for k in range(n):
                        f = slopes[r, k] * moment
                        state.q[axis, k] += b[1, k] * f
                        state.v[axis, k] += b[3, k] * f
                        state.force[axis, k] += f
        for axis in range(2):
            q, velocity = state.q[axis], state.v[axis]
            for p in range(n_points):
                at = s = 0.0
                for k in range(n):
                    at += points[p, k] * q[k]
                    s += points[p, k] * velocity[k]
                free[axis, p] = at
                speed[axis, p] = s
        if not _solve(scheme, state, bushings, free, speed, spin, x, v, jacobian, right, work):
            return i
        for axis in range(2):
            q, velocity, force, pushed = state.q[axis], state.v[axis], state.force[axis], state.pushed[axis]
            now = acceleration[axis]
            for k in range(n):
                pushed[k] = 0.0
            for p in range(n_points):
                f = pull[2 * p + axis]
                if f != 0.0:
                    for k in range(n):
                        pushed[k] -= points[p, k] * f
            for k in range(n):
                q[k] += b[1, k] * pushed[k]
                velocity[k] += b[3, k] * pushed[k]
                force[k] += pushed[k]
                now[k] = force[k] - damping[k] * velocity[k] - square[k] * q[k]
            for p in range(stations.shape[0]):
                a = inputs[i, BASE_Y + axis]
                for k in range(n):
                    a += stations[p, k] * now[k]
                out[i, 2 * p + axis] = a
            for p in range(probes.shape[0]):
                at = 0.0
                for k in range(n):
                    at += probes[p, k] * q[k]
                out[i, 2 * stations.shape[0] + 2 * p + axis] = at
    return inputs.shape[0]


@numba.njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz"})
def _solve(
    scheme: Scheme, state: State, bushings: Bushings, free: np.ndarray, speed: np.ndarray, spin: float, x: np.ndarray,
    v: np.ndarray, jacobian: np.ndarray, right: np.ndarray, work: np.ndarray,
) -> bool:  # fmt: skip
    """Find the forces ``pull`` at the bushings' ends by Newton's method; bristles and grease move on.

    What fills a bushing acts at the mean of its ends, half of it on each.
    """
    compliance, mobility, pull, place = scheme.compliance, scheme.mobility, state.pull, state.place
    n = bushings.gap.size
    size = 4 * n
    walls, middle = work[0], work[1, 0]
    for _ in range(ITERATIONS):
        for axis in range(2):
            for p in range(2 * n):
                at, s = free[axis, p], speed[axis, p]
                for o in range(2 * n):
                    at -= compliance[p, o] * pull[2 * o + axis]
                    s -= mobility[p, o] * pull[2 * o + axis]
                x[axis, p], v[axis, p] = at, s
        largest = 0.0
        jacobian[:] = 0.0
        for j in range(n):
            first = 2 * j
            oy, oz = bushings.offset[j, 0], bushings.offset[j, 1]
            for p in (first, first + 1):
                for c in range(10):
                    walls[p, c] = 0.0
                state.bristle_after[p] = physics.contact(
                    bushings, j, x[0, p] + oy, x[1, p] + oz, v[0, p], v[1, p], x[0, p] - place[0, p],
                    x[1, p] - place[1, p], bushings.radius[j] * spin * scheme.step, state.bristle[p], walls[p],
                )  # fmt: skip
            for c in range(10):
                middle[c] = 0.0
            my, mz = 0.5 * (x[0, first] + x[0, first + 1]), 0.5 * (x[1, first] + x[1, first + 1])
            sy, sz = 0.5 * (v[0, first] + v[0, first + 1]), 0.5 * (v[1, first] + v[1, first + 1])
            if bushings.film[j] > 0.0:
                physics.film(bushings, j, my + oy, mz + oz, sy, sz, spin, middle)
            else:
                physics.grease(
                    bushings, j, my, mz, sy, sz, my - 0.5 * (place[0, first] + place[0, first + 1]),
                    mz - 0.5 * (place[1, first] + place[1, first + 1]), state.slip, state.slip_after, middle,
                )  # fmt: skip
            for p in (first, first + 1):
                touching = walls[p, 0] != 0.0 or walls[p, 1] != 0.0
                for axis in range(2):
                    row = 2 * p + axis
                    right[row] = walls[p, axis] + 0.5 * middle[axis] - pull[row]
                    largest = max(largest, abs(right[row]) * compliance[p, p])
                    for o in range(2 * n):
                        by_place = 0.25 * (compliance[first, o] + compliance[first + 1, o])
                        by_speed = 0.25 * (mobility[first, o] + mobility[first + 1, o])
                        for other in range(2):
                            c = 2 + 2 * axis + other
                            slope = middle[c] * by_place + middle[c + 4] * by_speed
                            if touching:
                                slope += walls[p, c] * compliance[p, o] + walls[p, c + 4] * mobility[p, o]
                            jacobian[row, 2 * o + other] = slope
                    jacobian[row, row] += 1.0
        if largest > EXACT:
            _eliminate(jacobian, right, size)
            for row in range(size):
                pull[row] += right[row]
        if largest <= TOLERANCE:
            place[:] = x
            state.bristle[:] = state.bristle_after
            state.slip[:] = state.slip_after
            return True
    return False


@numba.njit(cache=True, nogil=True, inline="always")
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
