"""One period of the linearised motion about an orbit, whose eigenvalues are Floquet's multipliers; compiled.

As the modal engine's steps: the in-gap linear system moves exactly from sample to sample, the derivatives of the
clearances' forces act as kicks, their damping at the velocity in the middle of the kick.
"""

from __future__ import annotations

import numpy as np

from ..core.jit import STRICT, jit
from .forces import Slopes

__all__ = ["monodromy"]


@jit(**STRICT)
def _solve(matrix: np.ndarray, right: np.ndarray) -> None:
    """Solve a small system of equations in place by Gauss's elimination; rows of points without damping are of 1."""
    n = matrix.shape[0]
    for k in range(n):
        for a in range(n):
            if a != k and matrix[a, k] != 0.0:
                share = matrix[a, k] / matrix[k, k]
                for b in range(k, n):
                    matrix[a, b] -= share * matrix[k, b]
                for c in range(right.shape[1]):
                    right[a, c] -= share * right[k, c]
    for k in range(n):
        for c in range(right.shape[1]):
            right[k, c] /= matrix[k, k]


@jit(**STRICT)
def monodromy(flow: np.ndarray, at_points: np.ndarray, step: float, memory: np.ndarray, slopes: Slopes) -> np.ndarray:
    """Return the derivative of the state after a period by that before.

    The state: modal coordinates, their velocities, then of each bushing whose grease remembers m > 0 numbers these and
    the displacement a sample before, then of each end whose contact remembers the speed at which it began. ``flow``
    (2 n, 2 n) moves the linear system by a step, s.
    """
    points, n = at_points.shape
    samples = slopes.x.shape[1]
    first = np.full(memory.size, -1)
    size = 2 * n
    for j in range(memory.size):
        if memory[j]:
            first[j] = size
            size += memory[j] + 1
    begun = np.full(points, -1)
    for p in range(points):
        if np.any(slopes.begun[p] != 0.0):
            begun[p] = size
            size += 1
    state = np.eye(size)
    compliance = np.dot(at_points, at_points.T)
    x, v, force = np.empty((points, size)), np.empty((points, size)), np.empty((points, size))
    x_old, v_old = np.empty((points, size)), np.empty((points, size))
    moved, damped = np.empty((2 * n, size)), np.empty((points, points))
    old = np.empty((np.max(memory) + 1, size))
    for i in range(samples):
        acts = False
        for p in range(points):
            if slopes.x[p, i] != 0.0 or slopes.v[p, i] != 0.0 or begun[p] >= 0 or (p < memory.size and first[p] >= 0):
                acts = True
        if acts:
            x, x_old, v, v_old = x_old, x, v_old, v
            np.dot(at_points, state[:n], x)
            np.dot(at_points, state[n : 2 * n], v)
            for p in range(points):
                for c in range(size):
                    force[p, c] = slopes.x[p, i] * x[p, c] + slopes.v[p, i] * v[p, c]
                if begun[p] >= 0:
                    share = slopes.entry[p, i]
                    if share >= 0.0:
                        for c in range(size):
                            x_before = x_old[p, c] if i > 0 else x[p, c] - step * v[p, c]
                            v_before = v_old[p, c] if i > 0 else v[p, c]
                            place = (1.0 - share) * x_before + share * x[p, c]
                            speed = (1.0 - share) * v_before + share * v[p, c]
                            state[begun[p], c] = speed - slopes.climb[p, i] * place
                    if slopes.begun[p, i] != 0.0:
                        for c in range(size):
                            force[p, c] += slopes.begun[p, i] * state[begun[p], c]
            for j in range(memory.size):
                if first[j] < 0:
                    continue
                start, m = first[j], memory[j]
                slope = slopes.memory[j, i]
                old[: m + 1] = state[start : start + m + 1]
                for k in range(m + 1):
                    row = k if k < m else slope.shape[0] - 1
                    for c in range(size):
                        total = slope[row, -2] * x[j, c] + slope[row, -1] * (x[j, c] - old[m, c])
                        for d in range(m):
                            total += slope[row, d] * old[d, c]
                        if k < m:
                            state[start + k, c] = total
                        else:
                            force[j, c] += total
                state[start + m] = x[j]
            for p in range(points):
                for q in range(points):
                    damped[p, q] = 0.5 * step * slopes.v[p, i] * compliance[p, q] + (1.0 if p == q else 0.0)
            _solve(damped, force)
            for a in range(n):
                for p in range(points):
                    for c in range(size):
                        state[n + a, c] -= step * at_points[p, a] * force[p, c]
        np.dot(flow, state[: 2 * n], moved)
        state[: 2 * n] = moved
    return state
