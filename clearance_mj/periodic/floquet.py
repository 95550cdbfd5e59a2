"""The monodromy matrix of an orbit, whose eigenvalues are the Floquet multipliers; compiled.

As in the modal engine's steps, the linear system moves exactly from sample to sample, and the derivatives of the
clearances' forces act as kicks, their damping at the velocity in the middle of the kick.
"""

from __future__ import annotations

import numpy as np

from ..core.jit import STRICT, jit
from .forces import Laws, Slopes

__all__ = ["monodromy"]


@jit(**STRICT)
def _solve(matrix: np.ndarray, rhs: np.ndarray) -> None:
    """Solve a small system of equations in place by Gaussian elimination; undamped points have rows of the identity."""
    n = matrix.shape[0]
    for k in range(n):
        for a in range(n):
            if a != k and matrix[a, k] != 0.0:
                factor = matrix[a, k] / matrix[k, k]
                for b in range(k, n):
                    matrix[a, b] -= factor * matrix[k, b]
                for c in range(rhs.shape[1]):
                    rhs[a, c] -= factor * rhs[k, c]
    for k in range(n):
        for c in range(rhs.shape[1]):
            rhs[k, c] /= matrix[k, k]


@jit(**STRICT)
def _advance_memory(
    slope: np.ndarray, memory: int, start: int, width: int, now: np.ndarray, before: np.ndarray, state: np.ndarray,
    old: np.ndarray, push: np.ndarray,
) -> None:  # fmt: skip
    """Advance a point's memory in ``state``, and add its force without the damping now to push (2, size).

    ``now`` and ``before`` (4, size) are the point's displacements and velocities at this sample and the one before.
    """
    rows, inputs = slope.shape[0] - width, slope.shape[1] - 4 * width
    for k in range(memory):
        old[k] = state[start + k]
    for k in range(memory + width):
        row = k if k < memory else rows + k - memory
        for c in range(state.shape[1]):
            total = 0.0
            for d in range(memory):
                total += slope[row, d] * old[d, c]
            for d in range(width):
                total += slope[row, inputs + d] * before[d, c]
                total += slope[row, inputs + width + d] * now[d, c]
                total += slope[row, inputs + 2 * width + d] * before[2 + d, c]
                if k < memory:
                    total += slope[row, inputs + 3 * width + d] * now[2 + d, c]
            if k < memory:
                state[start + k, c] = total
            else:
                push[k - memory, c] = total


@jit(**STRICT)
def monodromy(
    flow: np.ndarray, at_rows: np.ndarray, step: float, memory: np.ndarray, laws: Laws, slopes: Slopes
) -> np.ndarray:
    """Return the monodromy matrix, the derivative of the state after a period with respect to that before.

    The state: modal coordinates, their velocities, then the memory of each point, ``memory`` (n_points,) numbers, for
    fillings and rubbing ends with the displacements a sample before.
    ``flow`` (2 n, 2 n) moves the linear system by a step, s; ``at_rows`` (n_rows, n).
    """
    rows, n = at_rows.shape
    points, samples = memory.size, slopes.x.shape[3]
    start, size = np.zeros(points, np.int64), 2 * n
    places, count = np.zeros(points, np.int64), laws.bushings.size  # number of remembered displacements
    for p in range(points):
        if memory[p] and (p < count or laws.bushings[(p - count) // 2].rubs):
            places[p] = laws.width[p]
        start[p] = size
        size += memory[p] + places[p]
    state = np.eye(size)
    compliance = np.dot(at_rows, at_rows.T)
    old = np.empty((max(np.max(memory), 1), size))
    x, v, push = np.empty((rows, size)), np.empty((rows, size)), np.zeros((rows, size))
    x_old, v_old = np.empty((rows, size)), np.empty((rows, size))
    now, before, pushed = np.empty((4, size)), np.empty((4, size)), np.empty((2, size))
    moved, damping, damped = np.empty((2 * n, size)), np.zeros((rows, rows)), np.empty((rows, rows))
    for i in range(samples):
        active = False
        for p in range(points):
            active = active or slopes.carried[p, i] or (i < samples - 1 and slopes.carried[p, i + 1])
            for d in range(laws.width[p]):
                for e in range(laws.width[p]):
                    active = active or slopes.x[p, d, e, i] != 0.0 or slopes.v[p, d, e, i] != 0.0
        x, x_old, v, v_old = x_old, x, v_old, v
        if active or i == 0:
            np.dot(at_rows, state[:n], x)
            np.dot(at_rows, state[n : 2 * n], v)
        if i == 0:
            x_old[:], v_old[:] = x - step * v, v
            for p in range(points):
                for d in range(places[p]):
                    x_old[laws.rows[p, d]] = state[start[p] + memory[p] + d]
        if active:
            push[:] = 0.0
            damping[:] = 0.0
            for p in range(points):
                width, row = laws.width[p], laws.rows[p]
                if slopes.carried[p, i]:
                    for d in range(width):
                        now[d], now[2 + d] = x[row[d]], v[row[d]]
                        before[d], before[2 + d] = x_old[row[d]], v_old[row[d]]
                    slope = slopes.step[p, i]
                    _advance_memory(slope, memory[p], start[p], width, now, before, state, old, pushed)
                    for d in range(places[p]):
                        state[start[p] + memory[p] + d] = x[row[d]]
                    for d in range(width):
                        for e in range(width):
                            damping[row[d], row[e]] += slope[slope.shape[0] - width + d, slope.shape[1] - width + e]
                        for c in range(size):
                            push[row[d], c] += pushed[d, c]
                    continue
                for d in range(width):
                    for e in range(width):
                        k_x = slopes.x[p, d, e, i]
                        damping[row[d], row[e]] += slopes.v[p, d, e, i]
                        if k_x != 0.0:
                            for c in range(size):
                                push[row[d], c] += k_x * x[row[e], c]
            for a in range(rows):
                for b in range(rows):
                    damped[a, b] = 1.0 if a == b else 0.0
                for b in range(rows):
                    if damping[a, b] != 0.0:
                        for c in range(rows):
                            damped[a, c] += 0.5 * step * damping[a, b] * compliance[b, c]
                        for c in range(size):
                            push[a, c] += damping[a, b] * v[b, c]
            _solve(damped, push)
            for a in range(n):
                for b in range(rows):
                    factor = step * at_rows[b, a]
                    if factor != 0.0:
                        for c in range(size):
                            state[n + a, c] -= factor * push[b, c]
        for p in range(points):
            if not slopes.carried[p, i] and p >= laws.bushings.size:
                for k in range(memory[p]):
                    state[start[p] + k] = 0.0  # in the gap a contact forgets
        np.dot(flow, state[: 2 * n], moved)
        state[: 2 * n] = moved
    return state
