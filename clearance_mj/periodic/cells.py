"""Quantities of the vibrations in a rattle map: contact, forces and amplitudes at clearances and sensors."""

from __future__ import annotations

from typing import Any

import numpy as np

from .arcs import ArcVibrations
from .continuation import PeriodicMotion
from .following import expanded
from .forces import Sampled, depths, fill_forces
from .in_gap import linear_in_gap
from .stability import TestedPoint

__all__ = ["QUANTITIES", "measured", "nonlinear_forces", "row_displacements"]

QUANTITIES = {
    "contact_share": ("clearance", "1"), "penetration": ("clearance", "m"), "contact_force": ("clearance", "N"),
    "displacement": ("clearance", "m"), "acceleration": ("response", "m s-2"),
}  # fmt: skip


def row_displacements(solver: Any, z: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return harmonics (m, n_rows, K) of the displacements of all rows, and penetrations (m, n_bushings, N), in m.

    Of vibrations with coordinates z (m, r, K) and remainders y (m, n_rows, K). The deeper of a clearance's two ends
    counts at each sample of a period; the penetration is below 0 within the gap.
    """
    system, count = solver.system, len(solver.system.rig.bushings)
    x = np.einsum("pr,nrk->npk", system.basis, z) + y
    depth = np.array([depths(solver.laws, place) for place in x @ solver.grid.basis.T])
    return x, depth.reshape(len(depth), count, 2, solver.samples).max(axis=2)


def nonlinear_forces(solver: Any, omega: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return nonlinear forces, samples (n_rows, N), of a motion (n_rows, K) at a frequency, 1/s, and their peaks, in N.

    The peaks (n_bushings,) are those of the sum over both ends of each clearance; linear fillings are left out.
    """
    laws, count = solver.laws, len(solver.system.rig.bushings)
    motion = Sampled(x @ solver.grid.basis.T, omega * (x @ solver.grid.rate.T), omega, solver.spin_of(omega))
    force = np.empty_like(motion.place)
    fill_forces(laws, motion, *solver.grid[:3], False, force, solver.slopes)
    first, second = force[laws.rows[count::2]], force[laws.rows[count + 1 :: 2]]  # of one coordinate twice the same
    total = np.linalg.norm((first + second) / np.sqrt(3 - laws.width[count::2])[:, None, None], axis=1)
    return force, total.max(axis=1)


def measured(solver: Any, omega: np.ndarray, vibrations: ArcVibrations) -> dict[str, np.ndarray]:
    """Return the `QUANTITIES`, (m, n_bushings or n_sensors), of vibrations at some of the frequencies, 1/s."""
    rig = solver.system.rig
    if not vibrations.cell.size:
        widths = {"response": len(rig.sensors), "clearance": len(rig.bushings)}
        return {name: np.zeros((0, widths[row])) for name, (row, _) in QUANTITIES.items()}
    x, depth = row_displacements(solver, vibrations.z, vibrations.y)
    force, peak, nonlinear = np.zeros_like(x), np.zeros(depth.shape[:2]), not linear_in_gap(solver)
    for i, cell in enumerate(vibrations.cell):
        if nonlinear or np.any(depth[i] > 0):
            samples, peak[i] = nonlinear_forces(solver, float(omega[cell]), x[i])
            force[i] = samples @ solver.grid.project.T
    no_tangent = np.zeros(0)
    points = [
        TestedPoint(PeriodicMotion(float(omega[c]), z, y, f, no_tangent, 0.0), None)
        for c, z, y, f in zip(vibrations.cell, vibrations.z, vibrations.y, force)
    ]
    branch = expanded(solver, points, "")
    return {
        "contact_share": np.mean(depth > 0, axis=-1), "penetration": np.maximum(depth.max(axis=-1), 0.0),
        "contact_force": peak, "displacement": branch.excursion(), "acceleration": branch.amplitude("acceleration"),
    }  # fmt: skip
