"""One level of a rattle map in space: what finds its vibrations, and what the round walls do in them."""

from __future__ import annotations

import numpy as np

from ...model import Model
from ..arcs import Vibrations
from ..cells import acting, moved
from . import in_gap  # noqa: F401  # registers what it knows of round clearances
from .condensed import UNBALANCE, round_condensed
from .elements import depths
from .forced import steady_spin
from .forces import Sampled, fill_round_forces
from .solver import RoundSolver

__all__ = ["round_solver"]


def round_solver(
    model: Model, kind: str, level: float, fastest: float, harmonics: int, samples: int, modes: int
) -> RoundSolver:
    """Return the solver of one level, m/s² or N, or a factor of the unbalances; ``fastest`` frequency in 1/s.

    Raises
    ------
    RigError
        As `steady_spin` and `round_condensed`, and so the others.
    ExcitationError
    LawError
    """
    spin = steady_spin(model.rig, kind)
    system = round_condensed(model, kind, [level], harmonics, modes, fastest if kind == UNBALANCE else spin)
    return RoundSolver(system, harmonics, samples, spin)


@moved.register
def _round_moved(solver: RoundSolver, vibrations: Vibrations) -> tuple[np.ndarray, np.ndarray]:
    system, count = solver.system, len(solver.system.rig.bushings)
    x = np.einsum("pr,nrk->npk", system.basis, vibrations.z) + vibrations.y
    place = (x @ solver.grid.basis.T).reshape(len(x), -1, 2, solver.samples)[:, count:]
    depth = np.array([depths(system.laws, each) for each in place])
    return x, depth.reshape(len(x), count, 2, solver.samples).max(axis=2)


@acting.register
def _round_acting(solver: RoundSolver, omega: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    basis, rate, project = solver.grid[:3]
    place, speed = (each.reshape(-1, 2, solver.samples) for each in (x @ basis.T, omega * (x @ rate.T)))
    force, count = np.empty_like(place), len(solver.system.rig.bushings)
    motion = Sampled(place, speed, omega, float(solver.spin_of(omega)))
    fill_round_forces(solver.system.laws, motion, basis, rate, project, False, force, solver.slopes)
    both = force[count:].reshape(count, 2, 2, -1).sum(axis=1)
    return force.reshape(len(x), -1), np.linalg.norm(both, axis=1).max(axis=1)
