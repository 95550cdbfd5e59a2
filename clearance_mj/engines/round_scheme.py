"""What the compiled loop of the modal engine in space knows and changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..clearance.pointers import at
from ..core.jit import inlined

__all__ = ["ANGLE", "FOUR", "ONE", "SPIN", "RoundForces", "RoundMotion", "RoundShaft", "dot"]

SPIN, ANGLE = 0, 1  # of the numbers of the turning
FOUR = (0, 1, 2, 3)  # modes, points or sensors of one case side by side in a register; see lanes.py
ONE = (0,)


class RoundShaft(NamedTuple):
    """The linear part of the equations, in modal coordinates."""

    inverse_mass: np.ndarray  # (n,) smaller for high modes, see modal.py
    flow: np.ndarray  # (4, n) exact motion of the free modes over one step: rows q→q, v→q, q→v, v→v
    at_points: np.ndarray  # (3 n_bushings, 2, n) along y and z: the bushings' middles, then both ends of each
    spans: np.ndarray  # (2, 2) first coordinate that moves along y and z, and the one after the last
    at_sensors: np.ndarray  # (n_sensors, n) of accelerometers; zeros of others
    of_sensors: np.ndarray  # (n_sensors, 2) first coordinate that moves each, and the one after the last
    input: np.ndarray  # (n_inputs, n) force on the modes per unit of each input
    base: np.ndarray  # (n_inputs, n_sensors) what sensors read of an input itself
    weight: np.ndarray  # (n,) constant force on the modes, of gravity and loads
    unbalance: np.ndarray  # (2, n) force on the modes of Ω² cos φ and Ω² sin φ
    order: np.ndarray  # (n_orders,) k, of what follows the shaft's angle
    orders: np.ndarray  # (2 n_orders, n) force on the modes of cos k φ and sin k φ of each
    compliance: np.ndarray  # (3 n_bushings, 2, n, 2) per impulse at a point, velocities of all, an even number
    circulatory: np.ndarray  # (n, n) H; (0, 0) where nothing of the damping turns
    springs: np.ndarray  # (n, n) stiffness that is not of the modes; (0, 0) where there is none
    readings: np.ndarray  # (n_sensors, 2, n) what others read per coordinate and velocity; (0, 2, n) without others


class RoundMotion(NamedTuple):
    """What changes from step to step, in place."""

    q: np.ndarray  # (n,) now
    v: np.ndarray  # (n,) velocity before the kick
    q_before: np.ndarray  # (n,) a step ago
    turning: np.ndarray  # (2,) spin, rad/s, and angle, rad


class RoundForces(NamedTuple):
    """What acts in one step at the points of the bushings: their middles, then both ends of each."""

    x: np.ndarray  # (n_points, 2) m
    force: np.ndarray  # (n_points, 2) against the displacement, N
    ends: np.ndarray  # (n_points, 8) see `advance_round`
    filling: np.ndarray  # (n_bushings, 6) elastic force along y and z, N, and damping yy, yz, zy, zz, N s/m
    acts: np.ndarray  # (n_points,) whether there is a force


@inlined
def dot(rows: np.ndarray, row: int, vector: np.ndarray, start: int, stop: int) -> float:
    """Return the product of a row, which begins at a place of an array, and a vector, between two of its numbers."""
    left, right, total = at(rows, row), at(vector, 0), 0.0  # pointers: no index is looked at for being negative
    for m in range(start, stop):
        total += left[m] * right[m]
    return total
