"""What a rattle map says of each vibration: contact, forces and amplitudes at clearances and sensors."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from .arcs import Vibrations
from .continuation import Motion, Solver
from .following import expanded
from .forces import fill_forces
from .in_gap import linear_in_gap
from .stability import Located

__all__ = ["QUANTITIES", "Contacts", "contacts", "measured"]

QUANTITIES = {
    "contact_share": ("clearance", "1"), "penetration": ("clearance", "m"), "contact_force": ("clearance", "N"),
    "displacement": ("clearance", "m"), "acceleration": ("response", "m s-2"),
}  # fmt: skip


class Contacts(NamedTuple):
    """What the walls do along the periods of some vibrations."""

    depth: np.ndarray  # (m, n_bushings, N) penetration of the end that is deeper, m
    most: np.ndarray  # (m, n_bushings) largest force of both ends, N
    force: np.ndarray  # (m, n_rows, K) harmonics of what acts beyond linear greases, N


@functools.singledispatch
def contacts(solver: Any, omega: np.ndarray, vibrations: Vibrations) -> Contacts:
    """Return what the walls do in vibrations at some of the frequencies, 1/s, by the kind of solver."""
    raise TypeError(f"no walls of a {type(solver).__name__}")


@contacts.register
def _planar_contacts(solver: Solver, omega: np.ndarray, vibrations: Vibrations) -> Contacts:
    system, count = solver.system, len(solver.system.rig.bushings)
    x = np.einsum("pr,nrk->npk", system.linear.basis, vibrations.z) + vibrations.y
    place = x @ solver.grid.basis.T
    lower, upper = np.repeat([bushing.walls for bushing in system.rig.bushings], 2, axis=0).T[:, :, None]
    depth = np.maximum(np.maximum(place[:, count:] - upper, lower - place[:, count:]), 0.0)
    depth = depth.reshape(len(depth), count, 2, place.shape[2]).max(axis=2)
    force, most = np.zeros_like(x), np.zeros((len(x), count))
    basis, rate, project = solver.grid[:3]
    samples = np.empty(place.shape[1:])
    nonlinear = not linear_in_gap(solver)
    for i, cell in enumerate(vibrations.cell):
        if nonlinear or depth[i].any():
            speed = omega[cell] * (x[i] @ rate.T)
            fill_forces(system.laws, place[i], speed, omega[cell], basis, rate, project, False, samples, solver.slopes)
            force[i] = samples @ project.T
            most[i] = np.abs(samples[count:].reshape(count, 2, -1).sum(axis=1)).max(axis=1)
    return Contacts(depth, most, force)


def measured(solver: Any, omega: np.ndarray, vibrations: Vibrations) -> dict[str, np.ndarray]:
    """Return what `QUANTITIES` names, (m, n_bushings or n_sensors), of vibrations at some of the frequencies, 1/s."""
    rig = solver.system.rig
    if not vibrations.cell.size:
        widths = {"response": len(rig.sensors), "clearance": len(rig.bushings)}
        return {name: np.zeros((0, widths[row])) for name, (row, _) in QUANTITIES.items()}
    depth, most, force = contacts(solver, omega, vibrations)
    still = np.zeros(0)
    points = [
        Located(Motion(float(omega[c]), z, y, f, still, 0.0), None)
        for c, z, y, f in zip(vibrations.cell, vibrations.z, vibrations.y, force)
    ]
    branch = expanded(solver, points, "")
    return {
        "contact_share": np.mean(depth > 0, axis=-1), "penetration": depth.max(axis=-1), "contact_force": most,
        "displacement": branch.excursion(), "acceleration": branch.amplitude("acceleration"),
    }  # fmt: skip
