"""Harmonic-balance residual and Jacobian of a condensed rig, for continuation along any of five numbers; compiled.

A motion is determined by frequency, 1/s, spin, rad/s, and the factors of constant loads, of the excitation's level and
of the gaps. The continuation parameter moves one of them, or frequency and spin together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import STRICT, jit
from .dynamics import KNOWN, LinearDynamics, receptances
from .forces import Laws, Slopes, depths
from .harmonic_balance import Grid, add_jacobian, blocks, reduce_matrices, response

__all__ = ["POWERS", "Balance", "deepest_penetration", "residual", "set_gaps"]

NEARBY = 1e-6  # relative step of the difference quotient with respect to the parameter
POWERS = (1, -1, -2, -3)  # of the gap in the laws' numbers: distances of walls and, of films, their inverses


class Balance(NamedTuple):
    """The harmonic-balance equations of one rig along one parameter."""

    linear: LinearDynamics
    laws: Laws
    slopes: Slopes
    grid: Grid
    basis: np.ndarray  # (n_rows, r) of the coordinates
    owner: np.ndarray  # (r,) clearance of each coordinate
    fixed: np.ndarray  # (5,) the five numbers where the parameter is 0
    rate: np.ndarray  # (5,) their derivatives with respect to the parameter
    numbers: np.ndarray  # (n,) of the laws at the rig's gaps
    widened: np.ndarray  # (4, n) their change with `POWERS` of the gaps' factor; (4, 0) if that is constant
    tolerance: float  # residual over the size of the motion at which the corrector stops
    least: float  # m: scale of smaller motions
    bent: float  # distance of corrector from predictor, over the motion's size, that the step control aims at
    longest: float  # longest step, relative to parameter and motion
    jacobian: np.ndarray  # (r K + 1, r K + 1) overwritten with the Jacobian


@jit(**STRICT)
def residual(
    of: Balance, parameter: float, z: np.ndarray, y: np.ndarray, diff: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the residual of the balance at z, forces, and displacements outside B z; fill the Jacobian if asked."""
    omega, spin, load, level, gap = of.fixed + parameter * of.rate
    set_gaps(of, gap)
    compliance, driven = receptances(of.linear, omega, spin, load, level)
    z_new, y_new, force = response(compliance, driven, of.basis, of.grid, of.laws, of.slopes, omega, spin, z, y, diff)
    residual = z - z_new
    if diff:
        by_coordinates = blocks(of.laws, of.basis, of.owner, of.grid, omega, of.slopes)
        add_jacobian(reduce_matrices(compliance, of.basis), by_coordinates, of.owner, of.jacobian)
        step = NEARBY * (parameter if parameter != 0.0 else 1.0)
        omega_2, spin_2, load, level, gap_2 = of.fixed + (parameter + step) * of.rate
        if of.linear.way == KNOWN and gap_2 == gap:
            _, driven_2 = receptances(of.linear, omega, spin, load, level)
            difference = np.dot(of.basis.T, driven - driven_2)
        else:
            set_gaps(of, gap_2)
            compliance, driven = receptances(of.linear, omega_2, spin_2, load, level)
            response_2, _, _ = response(
                compliance, driven, of.basis, of.grid, of.laws, of.slopes, omega_2, spin_2, z, y, np.bool_(False)
            )
            set_gaps(of, gap)
            difference = z - response_2 - residual
        of.jacobian[: z.size, z.size] = difference.ravel() / step
    return residual, force, y_new


@jit(**STRICT)
def set_gaps(of: Balance, gap: float) -> None:
    """Set the walls' distances to a factor times the rig's gaps."""
    for i in range(of.widened.shape[1]):
        of.laws.numbers[i] = of.numbers[i]
        for j in range(len(POWERS)):
            of.laws.numbers[i] += (gap ** POWERS[j] - 1.0) * of.widened[j, i]


@jit(**STRICT)
def deepest_penetration(of: Balance, parameter: float, z: np.ndarray, y: np.ndarray) -> float:
    """Return how deep the deepest end is in its wall over a period, m; below 0 in the gap."""
    set_gaps(of, of.fixed[4] + parameter * of.rate[4])
    return np.max(depths(of.laws, np.dot(np.dot(of.basis, z) + y, of.grid.basis.T)))
