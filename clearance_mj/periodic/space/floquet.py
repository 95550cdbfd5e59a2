"""One period of the linearised motion about an orbit in space, whose eigenvalues are Floquet's multipliers; compiled.

As in the plane: the linear system moves exactly from sample to sample, the derivatives of the clearances' forces act as
kicks, their damping at the velocity in the middle of the kick.
"""

from __future__ import annotations

import numpy as np

from ...core.jit import STRICT, jit
from .elements import INPUTS
from .forces import RoundSlopes

__all__ = ["round_monodromy"]


@jit(**STRICT)
def _remembered(
    slope: np.ndarray, memory: int, start: int, p: int, seen: np.ndarray, before: np.ndarray, state: np.ndarray,
    old: np.ndarray, push: np.ndarray,
) -> None:  # fmt: skip
    """Advance what a point remembers in ``state``, and add to push (2, size) all of its force but what damps now.

    ``seen`` and ``before`` (4, size) are the point's displacements and velocities at this sample and the one before.
    """
    rows, width = slope.shape
    for k in range(memory):
        old[k] = state[start + k]
    for k in range(memory + 2):
        row = k if k < memory else rows - 2 + k - memory
        for c in range(state.shape[1]):
            total = 0.0
            for d in range(memory):
                total += slope[row, d] * old[d, c]
            for d in range(2):
                total += slope[row, width - INPUTS + d] * before[d, c]
                total += slope[row, width - INPUTS + 2 + d] * seen[d, c]
                total += slope[row, width - INPUTS + 4 + d] * before[2 + d, c]
                if k < memory:
                    total += slope[row, width - INPUTS + 6 + d] * seen[2 + d, c]
            if k < memory:
                state[start + k, c] = total
            else:
                push[k - memory, c] += total


@jit(**STRICT)
def round_monodromy(
    flow: np.ndarray, at_points: np.ndarray, step: float, memory: np.ndarray, slopes: RoundSlopes
) -> np.ndarray:
    """Return the derivative of the state after a period by that before.

    The state: modal coordinates, their velocities, then what each point remembers, ``memory`` (n_points,) numbers.
    ``flow`` (2 n, 2 n) moves the linear system by a step, s; ``at_points`` (2 n_points, n).
    """
    rows, n = at_points.shape
    points, samples = rows // 2, slopes.x.shape[3]
    start, size = np.zeros(points, np.int64), 2 * n
    for p in range(points):
        start[p] = size
        size += memory[p]
    state = np.eye(size)
    compliance = np.dot(at_points, at_points.T)
    old = np.empty((max(np.max(memory), 1), size))
    x, v, push = np.empty((rows, size)), np.empty((rows, size)), np.zeros((rows, size))
    x_old, v_old = np.empty((rows, size)), np.empty((rows, size))
    seen, before = np.empty((4, size)), np.empty((4, size))
    moved, damping, damped = np.empty((2 * n, size)), np.zeros((rows, 2)), np.empty((rows, rows))
    for i in range(samples):
        x, x_old, v, v_old = x_old, x, v_old, v
        np.dot(at_points, state[:n], x)
        np.dot(at_points, state[n : 2 * n], v)
        if i == 0:
            x_old[:], v_old[:] = x - step * v, v
        acts = False
        push[:] = 0.0
        damping[:] = 0.0
        for p in range(points):
            carried = slopes.carried[p, i]
            if carried:
                for d in range(2):
                    seen[d], seen[2 + d] = x[2 * p + d], v[2 * p + d]
                    before[d], before[2 + d] = x_old[2 * p + d], v_old[2 * p + d]
                slope = slopes.step[p, i]
                _remembered(slope, memory[p], start[p], p, seen, before, state, old, push[2 * p : 2 * p + 2])
                for d in range(2):
                    for e in range(2):
                        damping[2 * p + d, e] = slope[slope.shape[0] - 2 + d, slope.shape[1] - 2 + e]
                acts = True
                continue
            for k in range(memory[p]):
                state[start[p] + k] = 0.0  # in the gap a contact forgets
            for d in range(2):
                for e in range(2):
                    k_x, k_v = slopes.x[p, d, e, i], slopes.v[p, d, e, i]
                    if k_x != 0.0 or k_v != 0.0:
                        acts = True
                        damping[2 * p + d, e] = k_v
                        for c in range(size):
                            push[2 * p + d, c] += k_x * x[2 * p + e, c]
        if acts:
            for a in range(rows):
                p = a // 2
                for b in range(rows):
                    through = damping[a, 0] * compliance[2 * p, b] + damping[a, 1] * compliance[2 * p + 1, b]
                    damped[a, b] = 0.5 * step * through + (1.0 if a == b else 0.0)
                for c in range(size):
                    push[a, c] += damping[a, 0] * v[2 * p, c] + damping[a, 1] * v[2 * p + 1, c]
            kick = np.dot(at_points.T, np.linalg.solve(damped, push))
            for a in range(n):
                for c in range(size):
                    state[n + a, c] -= step * kick[a, c]
        np.dot(flow, state[: 2 * n], moved)
        state[: 2 * n] = moved
    return state
