"""One level of a rattle map in space: what finds its vibrations, and what the round walls do in them."""

from __future__ import annotations

import numpy as np

from ...model import Model
from ..arcs import Vibrations
from ..cells import Contacts, contacts
from ..in_gap import linear_in_gap
from .condensed import UNBALANCE, round_condensed
from .forced import steady_spin
from .forces import Sampled, fill_round_forces
from .in_gap import ends_of
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


@contacts.register
def _round_contacts(solver: RoundSolver, omega: np.ndarray, vibrations: Vibrations) -> Contacts:
    system, count = solver.system, len(solver.system.rig.bushings)
    x = np.einsum("pr,nrk->npk", system.basis, vibrations.z) + vibrations.y
    place = (x @ solver.grid.basis.T).reshape(len(x), -1, 2, solver.samples)
    offset, gap = ends_of(system.rig)
    away = np.linalg.norm(place[:, count:] + offset[..., None], axis=2)
    depth = np.maximum(away - gap[:, None], 0.0).reshape(len(x), count, 2, -1).max(axis=2)
    force, most = np.zeros_like(x), np.zeros((len(x), count))
    basis, rate, project = solver.grid[:3]
    samples = np.empty(place.shape[1:])
    nonlinear = not linear_in_gap(solver)
    for i, cell in enumerate(vibrations.cell):
        if nonlinear or depth[i].any():
            speed = (omega[cell] * (x[i] @ rate.T)).reshape(place.shape[1:])
            motion = Sampled(place[i], speed, float(omega[cell]), float(solver.spin_of(omega[cell])))
            fill_round_forces(system.laws, motion, basis, rate, project, False, samples, solver.slopes)
            force[i] = samples.reshape(len(force[i]), -1) @ project.T
            most[i] = np.linalg.norm(samples[count:].reshape(count, 2, 2, -1).sum(axis=1), axis=1).max(axis=1)
    return Contacts(depth, most, force)
