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
    slope: np.ndarray, memory: int, start: int, u: np.ndarray, state: np.ndarray, old: np.ndarray, push: np.ndarray
) -> None:
    """Advance what a point remembers in ``state``, and add to push (2, size) all of its force but what damps now.

    ``u`` (INPUTS, size): the point's displacements at the sample before and at this one, then its velocities.
    """
    rows, width = slope.shape
    old[:memory] = state[start : start + memory]
    for k in range(memory + 2):
        row, used = (k, INPUTS) if k < memory else (rows - 2 + k - memory, INPUTS - 2)
        first = width - INPUTS
        total = np.dot(slope[row, :memory], old[:memory]) + np.dot(slope[row, first : first + used], u[:used])
        if k < memory:
            state[start + k] = total
        else:
            push[k - memory] += total


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
    u, moved = np.empty((INPUTS, size)), np.empty((2 * n, size))
    damping, damped = np.zeros((rows, 2)), np.empty((rows, rows))
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
            own = slice(2 * p, 2 * p + 2)
            if slopes.carried[p, i]:
                u[:2], u[2:4], u[4:6], u[6:] = x_old[own], x[own], v_old[own], v[own]
                slope = slopes.step[p, i]
                _remembered(slope, memory[p], start[p], u, state, old, push[own])
                damping[own] = slope[-2:, -2:]
                acts = True
                continue
            state[start[p] : start[p] + memory[p]] = 0.0  # in the gap a contact forgets
            for d in range(2):
                for e in range(2):
                    k_x, k_v = slopes.x[p, d, e, i], slopes.v[p, d, e, i]
                    if k_x != 0.0 or k_v != 0.0:
                        acts = True
                        damping[2 * p + d, e] = k_v
                        push[2 * p + d] += k_x * x[2 * p + e]
        if acts:
            for a in range(rows):
                p, of_y, of_z = a // 2, damping[a, 0], damping[a, 1]
                damped[a] = 0.5 * step * (of_y * compliance[2 * p] + of_z * compliance[2 * p + 1])
                damped[a, a] += 1.0
                push[a] += of_y * v[2 * p] + of_z * v[2 * p + 1]
            state[n : 2 * n] -= step * np.dot(at_points.T, np.linalg.solve(damped, push))
        np.dot(flow, state[: 2 * n], moved)
        state[: 2 * n] = moved
    return state
