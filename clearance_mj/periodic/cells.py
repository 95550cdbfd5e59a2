"""What a rattle map says of each vibration: contact, forces and amplitudes at clearances and sensors."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from .arcs import Vibrations
from .continuation import Motion
from .following import expanded
from .forces import fill_forces
from .in_gap import linear_in_gap
from .stability import Located

__all__ = ["QUANTITIES", "acting", "measured", "moved"]

QUANTITIES = {
    "contact_share": ("clearance", "1"), "penetration": ("clearance", "m"), "contact_force": ("clearance", "N"),
    "displacement": ("clearance", "m"), "acceleration": ("response", "m s-2"),
}  # fmt: skip


@functools.singledispatch
def moved(solver: Any, vibrations: Vibrations) -> tuple[np.ndarray, np.ndarray]:
    """Return harmonics (m, n_rows, K) of the places of all points, and how deep ends are: (m, n_bushings, N), in m.

    Of the two ends of a bushing the deeper one counts, at each sample of a period; it is below 0 within the gap.
    """
    system, count = solver.system, len(solver.system.rig.bushings)
    x = np.einsum("pr,nrk->npk", system.linear.basis, vibrations.z) + vibrations.y
    place = (x @ solver.grid.basis.T)[:, count:]
    lower, upper = np.repeat([bushing.walls for bushing in system.rig.bushings], 2, axis=0).T[:, :, None]
    depth = np.maximum(place - upper, lower - place)
    return x, depth.reshape(len(depth), count, 2, solver.samples).max(axis=2)


@functools.singledispatch
def acting(solver: Any, omega: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what acts beyond linear greases in a motion (n_rows, K) at a frequency, 1/s: samples (n_rows, N), in N.

    With the largest force (n_bushings,) of both ends of each bushing.
    """
    basis, rate, project = solver.grid[:3]
    place, speed, count = x @ basis.T, omega * (x @ rate.T), len(solver.system.rig.bushings)
    force = np.empty_like(place)
    fill_forces(solver.system.laws, place, speed, omega, basis, rate, project, False, force, solver.slopes)
    return force, np.abs(force[count:].reshape(count, 2, -1).sum(axis=1)).max(axis=1)


def measured(solver: Any, omega: np.ndarray, vibrations: Vibrations) -> dict[str, np.ndarray]:
    """Return what `QUANTITIES` names, (m, n_bushings or n_sensors), of vibrations at some of the frequencies, 1/s."""
    rig = solver.system.rig
    if not vibrations.cell.size:
        widths = {"response": len(rig.sensors), "clearance": len(rig.bushings)}
        return {name: np.zeros((0, widths[row])) for name, (row, _) in QUANTITIES.items()}
    x, depth = moved(solver, vibrations)
    force, most, nonlinear = np.zeros_like(x), np.zeros(depth.shape[:2]), not linear_in_gap(solver)
    for i, cell in enumerate(vibrations.cell):
        if nonlinear or np.any(depth[i] > 0):
            samples, most[i] = acting(solver, float(omega[cell]), x[i])
            force[i] = samples @ solver.grid.project.T
    still = np.zeros(0)
    points = [
        Located(Motion(float(omega[c]), z, y, f, still, 0.0), None)
        for c, z, y, f in zip(vibrations.cell, vibrations.z, vibrations.y, force)
    ]
    branch = expanded(solver, points, "")
    return {
        "contact_share": np.mean(depth > 0, axis=-1), "penetration": np.maximum(depth.max(axis=-1), 0.0),
        "contact_force": most, "displacement": branch.excursion(), "acceleration": branch.amplitude("acceleration"),
    }  # fmt: skip
