"""Floquet's multipliers of periodic motions in space."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..condensed import grid
from ..continuation import Motion
from ..stability import multipliers, samples_of_period
from .condensed import round_slopes
from .floquet import round_monodromy
from .forces import Sampled, fill_round_forces
from .solver import RoundSolver

__all__ = ["all_points", "floquet"]


def floquet(solver: Any, omega: float, spin: float, x: np.ndarray) -> np.ndarray:
    """Return Floquet's multipliers (2 n,) about the motion with harmonics x (2 n_points, K), the largest first.

    What fillings and contacts remember adds multipliers, of which the smallest are left out.
    """
    system, samples = solver.system, samples_of_period(solver, omega)
    fine, laws, points = grid(solver.harmonics, samples), system.laws, solver.rows // 2
    slopes = round_slopes(laws, points, samples, solver.harmonics)
    shape = points, 2, samples
    place, speed = (x @ fine.basis.T).reshape(shape), (omega * (x @ fine.rate.T)).reshape(shape)
    motion = Sampled(place, speed, omega, spin)
    fill_round_forces(laws, motion, fine.basis, fine.rate, fine.project, True, np.empty(shape), slopes)
    step = 2 * np.pi / (omega * samples)
    memory = np.concatenate((laws.memory, np.repeat(np.where(laws.remembers, 2, 0), 2)))
    flow = system.driven.model.flow(step, spin)
    found = np.linalg.eigvals(round_monodromy(flow, system.driven.model.at_points, step, memory, slopes))
    return found[np.argsort(-np.abs(found), kind="stable")][: len(flow)]


@multipliers.register
def _round_multipliers(solver: RoundSolver, motion: Motion) -> np.ndarray:
    """As `stability.multipliers`."""
    omega = solver.frequency(motion)
    return floquet(solver, omega, solver.spin_of(omega), all_points(solver, motion))


def all_points(solver: RoundSolver, motion: Motion) -> np.ndarray:
    """Return the harmonics (2 n_points, K) of all points, m."""
    return solver.system.basis @ motion.z + motion.y
