"""Implicit time integration of a banded system with nonlinear forces at a few points.

Newmark's scheme (1959) in acceleration form. The effective matrix is factorised once. In each step the whole system
moves freely first; the forces at the points then follow from Newton's method on the condensed compliance of those
points alone, to convergence, and are spread over the system. Nothing is truncated: this is the full model.

With Rayleigh damping C = η1 M + η2 K the effective matrix is A = M + γΔt C + βΔt² K = p M + q K, which saves
the product with M: A⁻¹ M w = (w - q A⁻¹ K w) / p.
"""

from typing import NamedTuple

import numpy as np

from clearance_mj.core.jit import jit
from experiments.testrig import physics
from experiments.testrig.fem import FiniteElements, Points

NEWTON_ITERATIONS = 30
NEWTON_TOLERANCE = 1e-15  # m; far below any gap, far above the rounding of the correction it bounds


class Contacts(NamedTuple):
    """Stops on both sides of the first points, one entry per point; see `physics.contact`."""

    gap: np.ndarray
    offset: np.ndarray  # from the middle between the stops to where the shaft rests
    stiffness: np.ndarray
    exponent: np.ndarray
    dissipation: np.ndarray


class Greases(NamedTuple):
    """Grease at the points after the contacts, one entry per point; see `physics`."""

    stiffness: np.ndarray  # k, N/m, at this moment
    elastic_ratio: np.ndarray  # λ
    model: np.ndarray  # `physics.BOUC_WEN`, `physics.IWAN` or `physics.LUGRE`
    states: np.ndarray  # how many numbers the model remembers
    parameters: np.ndarray  # (n_greases, n) of the model
    damping: np.ndarray
    film_height: np.ndarray
    film_limit: np.ndarray
    offset: np.ndarray  # from the bushing's middle to where the shaft rests


class Scheme(NamedTuple):
    """A system prepared for one time step; made by `scheme`."""

    step: float  # s
    beta: float
    gamma: float
    eta1: float
    eta2: float
    mass_share: float  # p of A = p M + q K
    stiffness_share: float  # q, s²
    rows: np.ndarray  # (n, 7) rows of K, its diagonal in column 3
    lower: np.ndarray  # (n, 3) row i of L in A = L D Lᵀ: L[i, i-1], L[i, i-2], L[i, i-3]
    upper: np.ndarray  # (n, 3) column i of L: L[i+1, i], L[i+2, i], L[i+3, i]
    pivot: np.ndarray  # (n,) 1 / D
    drive: np.ndarray  # (n,) A⁻¹ load: acceleration by a unit excitation
    start: np.ndarray  # (n_points,) see `fem.Points`
    weight: np.ndarray  # (n_points, 4)
    reply: np.ndarray  # (n, n_points) A⁻¹ Bᵀ: acceleration by a unit force at a point
    compliance: np.ndarray  # (n_points, n_points) B A⁻¹ Bᵀ, 1/kg


class Motion(NamedTuple):
    """State of the system, changed in place from step to step."""

    displacement: np.ndarray  # (n,) m and rad
    velocity: np.ndarray  # (n,)
    acceleration: np.ndarray  # (n,) relative to the base
    force: np.ndarray  # (n_points,) N, against positive displacement
    at_points: np.ndarray  # (n_points,) displacement of the points, m
    hysteresis: np.ndarray  # (n_greases, n_states) what the hysteresis remembers, m
    work: np.ndarray  # (n + 6,) scratch, zero in the first and last three places


def scheme(
    elements: FiniteElements, load: np.ndarray, points: Points, step: float, beta: float = 0.25, gamma: float = 0.5
) -> Scheme:
    """Prepare a system for integration with a fixed step, s, under a unit excitation's load (n,).

    Forces act at the points: contacts first, then greases. Newmark's beta = 1/4 and gamma = 1/2 (average acceleration)
    neither damp nor can become unstable.
    """
    eta1, eta2 = elements.rayleigh
    p, q = 1 + gamma * step * eta1, gamma * step * eta2 + beta * step**2
    lower, upper, pivot = _factorise(p * elements.mass + q * elements.stiffness)
    places = points.dense(elements.count)
    # Column by column with the scalar solver, not LAPACK: the same bits whatever library is installed.
    reply = np.array([_solve(lower, upper, pivot, row) for row in places]).reshape(places.shape).T
    compliance = np.array(
        [[_at(points.start, points.weight, i, column) for column in reply.T] for i in range(len(places))]
    )
    return Scheme(
        float(step), float(beta), float(gamma), float(eta1), float(eta2), float(p), float(q),
        _rows(elements.stiffness), lower, upper, pivot, _solve(lower, upper, pivot, load), points.start, points.weight,
        np.ascontiguousarray(reply), compliance.reshape(len(places), len(places)),
    )  # fmt: skip


def at_rest(
    elements: FiniteElements, load: np.ndarray, points: Points, greases: Greases, excitation: float = 0.0
) -> Motion:
    """State of a system at rest under its first excitation, which sets the acceleration M⁻¹ load excitation."""
    n, count = elements.count, points.start.size
    hysteresis = np.zeros((greases.states.size, greases.states.max(initial=1)))
    acceleration = _solve(*_factorise(elements.mass), excitation * load)
    zeros = np.zeros
    return Motion(zeros(n), zeros(n), acceleration, zeros(count), zeros(count), hysteresis, zeros(n + 6))


@jit
def step(scheme: Scheme, motion: Motion, contacts: Contacts, greases: Greases, excitation: float) -> bool:
    """Advance ``motion`` by one step to the excitation at its end; return whether Newton's method converged."""
    _move_freely(scheme, motion, excitation)
    converged = _solve_points(scheme, motion, contacts, greases)
    _apply_forces(scheme, motion)
    return converged


@jit
def march(
    scheme: Scheme, motion: Motion, contacts: Contacts, greases: Greases, excitation: np.ndarray, follows: float,
    start: np.ndarray, weight: np.ndarray, out: np.ndarray, touching: np.ndarray,
) -> int:  # fmt: skip
    """Advance over a block of excitation (n_steps,) and return the number of steps done.

    It is less than n_steps if Newton's method failed in the next. ``follows`` is 1 if sensors move with the base, whose
    acceleration is the excitation, else 0; ``start`` and ``weight`` are the sensors' `fem.Points`. Fills ``out``
    (n_steps, n_sensors + 3 n_greases) with absolute accelerations, displacements at the greases, contact and grease
    forces; contacts 2 j and 2 j + 1 are the ends of the bushing with grease j. ``touching`` (n_greases,) counts on the
    steps with contact at one of the two ends.
    """
    sensors, bushings = start.size, touching.size
    for i in range(excitation.size):
        if not step(scheme, motion, contacts, greases, excitation[i]):
            return i
        for s in range(sensors):
            out[i, s] = _at(start, weight, s, motion.acceleration) + follows * excitation[i]
        for j in range(bushings):
            first, second = motion.force[2 * j], motion.force[2 * j + 1]
            out[i, sensors + j] = motion.at_points[2 * bushings + j]
            out[i, sensors + bushings + j] = first + second
            out[i, sensors + 2 * bushings + j] = motion.force[2 * bushings + j]
            touching[j] += first != 0.0 or second != 0.0
    return excitation.size


@jit
def _move_freely(scheme: Scheme, motion: Motion, excitation: float) -> None:
    """Leave Newmark's predictors of displacement and velocity, and the acceleration without point forces."""
    u, v, a, w = motion.displacement, motion.velocity, motion.acceleration, motion.work
    h, n = scheme.step, u.size
    pull, push, ratio = h * h * (0.5 - scheme.beta), h * (1 - scheme.gamma), scheme.stiffness_share / scheme.mass_share
    for i in range(n):
        u[i] += h * v[i] + pull * a[i]
        v[i] += push * a[i]
        damped = scheme.eta1 * v[i]
        w[i + 3] = ratio * damped - u[i] - scheme.eta2 * v[i]
        a[i] = scheme.drive[i] * excitation - damped / scheme.mass_share
    rows, lower, upper, pivot = scheme.rows, scheme.lower, scheme.upper, scheme.pivot
    y1 = y2 = y3 = 0.0
    for i in range(n):
        total = 0.0
        for j in range(7):
            total += rows[i, j] * w[i + j]
        y = total - lower[i, 2] * y3 - lower[i, 1] * y2 - lower[i, 0] * y1
        # w[i] is read for the last time in this row: the solution takes its place.
        w[i] = y
        y1, y2, y3 = y, y1, y2
    x1 = x2 = x3 = 0.0
    for i in range(n - 1, -1, -1):
        x = w[i] * pivot[i] - upper[i, 2] * x3 - upper[i, 1] * x2 - upper[i, 0] * x1
        a[i] += x
        x1, x2, x3 = x, x1, x2
    w[0] = w[1] = w[2] = 0.0


@jit
def _solve_points(scheme: Scheme, motion: Motion, contacts: Contacts, greases: Greases) -> bool:
    """Find the forces at the points by Newton's method on the change y of the points' accelerations, y = G F(y)."""
    h, n_points, n_contacts = scheme.step, scheme.start.size, contacts.gap.size
    to_place, to_speed = scheme.beta * h * h, scheme.gamma * h
    place, speed = np.empty(n_points), np.empty(n_points)
    for p in range(n_points):
        a = _at(scheme.start, scheme.weight, p, motion.acceleration)
        place[p] = _at(scheme.start, scheme.weight, p, motion.displacement) + to_place * a
        speed[p] = _at(scheme.start, scheme.weight, p, motion.velocity) + to_speed * a
    y, slope, residual = np.zeros(n_points), np.empty(n_points), np.empty(n_points)
    jacobian = np.empty((n_points, n_points))
    state = np.empty(motion.hysteresis.shape)
    force = motion.force
    for _ in range(NEWTON_ITERATIONS):
        for p in range(n_points):
            x, v = place[p] - to_place * y[p], speed[p] - to_speed * y[p]
            if p < n_contacts:
                force[p], dx, dv = physics.contact(
                    x + contacts.offset[p], v, contacts.gap[p], contacts.stiffness[p], contacts.exponent[p],
                    contacts.dissipation[p],
                )  # fmt: skip
            else:
                force[p], dx, dv = _grease(greases, motion, p, p - n_contacts, x, v, h, state)
            slope[p] = to_place * dx + to_speed * dv
        for p in range(n_points):
            residual[p] = -y[p]
            for q in range(n_points):
                residual[p] += scheme.compliance[p, q] * force[q]
                jacobian[p, q] = scheme.compliance[p, q] * slope[q]
            jacobian[p, p] += 1.0
        _eliminate(jacobian, residual)
        largest = 0.0
        for p in range(n_points):
            y[p] += residual[p]
            largest = max(largest, abs(residual[p]))
        if largest * h * h <= NEWTON_TOLERANCE:
            for p in range(n_points):
                motion.at_points[p] = place[p] - to_place * y[p]
            motion.hysteresis[:] = state
            return True
    return False


@jit
def _grease(
    greases: Greases, motion: Motion, point: int, j: int, x: float, v: float, time_step: float, state: np.ndarray
) -> tuple[float, float, float]:
    """Force and derivatives of the grease at one point; row j of ``state`` becomes what it remembers of the step."""
    values, before, step = greases.parameters[j], motion.hysteresis[j], x - motion.at_points[point]
    bristle = bristle_dv = 0.0
    if greases.model[j] == physics.BOUC_WEN:
        z, dz = physics.bouc_wen(step, before[0], values[0], values[1], values[2], int(values[3]))
        state[j, 0] = z
    elif greases.model[j] == physics.IWAN:
        n = greases.states[j]
        z, dz = physics.iwan(step, before[:n], values[:n], state[j, :n])
    else:
        z, dz, rate, rate_dv = physics.lugre(step, time_step, v, before[0], values[0], values[1], values[2])
        state[j, 0], bristle, bristle_dv = z, values[3] * rate, values[3] * rate_dv
    film, film_dx, film_dv = physics.squeeze_film(
        x + greases.offset[j], v, greases.damping[j], greases.film_height[j], greases.film_limit[j]
    )
    elastic = greases.elastic_ratio[j] * greases.stiffness[j]
    slipping = (1 - greases.elastic_ratio[j]) * greases.stiffness[j]
    force = elastic * x + slipping * z + film + bristle
    return force, elastic + slipping * dz + film_dx, film_dv + bristle_dv


@jit
def _apply_forces(scheme: Scheme, motion: Motion) -> None:
    """Spread the point forces and finish Newmark's step."""
    u, v, a, force = motion.displacement, motion.velocity, motion.acceleration, motion.force
    to_place, to_speed = scheme.beta * scheme.step * scheme.step, scheme.gamma * scheme.step
    for i in range(u.size):
        change = 0.0
        for p in range(force.size):
            change += scheme.reply[i, p] * force[p]
        a[i] -= change
        u[i] += to_place * a[i]
        v[i] += to_speed * a[i]


@jit
def _at(start: np.ndarray, weight: np.ndarray, p: int, vector: np.ndarray) -> float:
    first = start[p]
    return (
        weight[p, 0] * vector[first]
        + weight[p, 1] * vector[first + 1]
        + weight[p, 2] * vector[first + 2]
        + weight[p, 3] * vector[first + 3]
    )


@jit
def _eliminate(matrix: np.ndarray, right: np.ndarray) -> None:
    """Solve in place, without pivoting: the leading minors of I + G S are positive for G positive definite, S >= 0."""
    n = right.size
    for k in range(n):
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]


@jit
def _factorise(band: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return L (as rows and as columns) and 1 / D of L D Lᵀ, the Cholesky factors of a (4, n) lower band."""
    n = band.shape[1]
    lower, upper, pivot = np.zeros((n, 3)), np.zeros((n, 3)), np.empty(n)
    for i in range(n):
        for k in range(min(3, i), 0, -1):
            j = i - k
            total = band[k, j]
            for m in range(max(0, i - 3), j):
                total -= lower[i, i - m - 1] * lower[j, j - m - 1] / pivot[m]
            lower[i, k - 1] = upper[j, k - 1] = total * pivot[j]
        diagonal = band[0, i]
        for m in range(max(0, i - 3), i):
            diagonal -= lower[i, i - m - 1] ** 2 / pivot[m]
        pivot[i] = 1.0 / diagonal
    return lower, upper, pivot


@jit
def _solve(lower: np.ndarray, upper: np.ndarray, pivot: np.ndarray, right: np.ndarray) -> np.ndarray:
    n = right.size
    x = np.empty(n)
    for i in range(n):
        x[i] = right[i]
        for k in range(min(3, i)):
            x[i] -= lower[i, k] * x[i - k - 1]
    for i in range(n - 1, -1, -1):
        x[i] *= pivot[i]
        for k in range(min(3, n - 1 - i)):
            x[i] -= upper[i, k] * x[i + k + 1]
    return x


def _rows(band: np.ndarray) -> np.ndarray:
    """Return the seven diagonals of a symmetric (4, n) lower band as rows, shape (n, 7)."""
    n = band.shape[1]
    rows = np.zeros((n, 7))
    rows[:, 3] = band[0]
    for k in range(1, 4):
        rows[k:, 3 - k] = rows[: n - k, 3 + k] = band[k, : n - k]
    return rows
