"""The harmonic balance of a condensed rig as equations for a continuation, whose parameter may be any of its numbers.

What a motion is found at are five numbers: frequency, 1/s, spin, rad/s, and shares of constant loads, of the
excitation's level and of the gaps. A parameter moves one of them, or frequency and spin together; compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import STRICT, jit
from .dynamics import KNOWN, Linear, seen
from .forces import Laws, Slopes, depths
from .harmonic_balance import Grid, answer, balance

__all__ = ["POWERS", "Balance", "deepest", "left", "widen"]

NEARBY = 1e-6  # share of the parameter by which derivatives by it are found
POWERS = (1, -1, -2, -3)  # of a gap in what laws are of: distances of walls and, of films, their inverses


class Balance(NamedTuple):
    """The equations of one rig along one parameter."""

    linear: Linear
    laws: Laws
    slopes: Slopes
    grid: Grid
    basis: np.ndarray  # (n_rows, r) of the coordinates
    owner: np.ndarray  # (r,) which clearance each is of
    fixed: np.ndarray  # (5,) what a motion is found at where the parameter is 0
    rate: np.ndarray  # (5,) how it changes with the parameter
    numbers: np.ndarray  # (n,) of the laws at the rig's gaps
    widened: np.ndarray  # (4, n) their change by `POWERS` of the share of the gaps; (4, 0) if that stays
    tolerance: float  # of the motion: what the balance may leave
    least: float  # m: smaller motions are measured by it
    bent: float  # distance of a motion from its prediction, over its size, that steps aim at
    longest: float  # step, as a share of parameter and motion
    jacobian: np.ndarray  # (r K + 1, r K + 1) room for its derivatives


@jit(**STRICT)
def left(
    of: Balance, parameter: float, z: np.ndarray, y: np.ndarray, want: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what z leaves of the balance, forces, and displacements beside B z; fill the jacobian if wanted."""
    omega, spin, load, level, gap = of.fixed + parameter * of.rate
    widen(of, gap)
    compliance, driven = seen(of.linear, omega, spin, load, level)
    found, force, beside = balance(
        compliance, driven, of.basis, of.owner, of.grid, of.laws, of.slopes, omega, spin, z, y, want, of.jacobian
    )
    if want:
        step = NEARBY * (parameter if parameter != 0.0 else 1.0)
        omega_2, spin_2, load, level, gap_2 = of.fixed + (parameter + step) * of.rate
        if of.linear.way == KNOWN and gap_2 == gap:
            _, moved = seen(of.linear, omega, spin, load, level)
            changed = np.dot(of.basis.T, driven - moved)
        else:
            widen(of, gap_2)
            compliance, driven = seen(of.linear, omega_2, spin_2, load, level)
            own, _, _ = answer(
                compliance, driven, of.basis, of.grid, of.laws, of.slopes, omega_2, spin_2, z, y, np.bool_(False)
            )
            widen(of, gap)
            changed = z - own - found
        of.jacobian[: z.size, z.size] = changed.ravel() / step
    return found, force, beside


@jit(**STRICT)
def widen(of: Balance, gap: float) -> None:
    """Let walls stand at a share of the rig's gaps."""
    for i in range(of.widened.shape[1]):
        of.laws.numbers[i] = of.numbers[i]
        for j in range(len(POWERS)):
            of.laws.numbers[i] += (gap ** POWERS[j] - 1.0) * of.widened[j, i]


@jit(**STRICT)
def deepest(of: Balance, parameter: float, z: np.ndarray, y: np.ndarray) -> float:
    """Return how deep the deepest end is in its wall over a period, m; below 0 in the gap."""
    widen(of, of.fixed[4] + parameter * of.rate[4])
    return np.max(depths(of.laws, np.dot(np.dot(of.basis, z) + y, of.grid.basis.T)))
