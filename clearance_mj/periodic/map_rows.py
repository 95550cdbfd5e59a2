"""One row of a rattle map: sweeps over frequency at one level of one gap, and the quantities of its vibrations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..model import Model
from .arcs import ArcVibrations, curve
from .condensed import UNBALANCE, condensed
from .continuation import PeriodicMotion
from .excitation import steady_spin
from .following import expanded
from .forces import Sampled, depths, fill_forces
from .in_gap import linear_in_gap
from .solver import Solver
from .stability import TestedPoint

__all__ = ["QUANTITIES", "MapLevel", "MapRow", "nonlinear_forces", "row_displacements", "row_of", "solver_at"]

TOLERANCE = 1e-6  # residual over the size of the motion
QUANTITIES = {
    "contact_share": ("clearance", "1"), "penetration": ("clearance", "m"), "contact_force": ("clearance", "N"),
    "displacement": ("clearance", "m"), "acceleration": ("response", "m s-2"),
}  # fmt: skip
"""Quantities of the vibrations at clearances and sensors: row of a result and unit."""


class MapLevel(NamedTuple):
    """Task for a worker: one level of one gap, and their places on the map."""

    gap: int
    row: int
    model: Model
    level: float


class MapRow(NamedTuple):
    """Result of a task: one row of the map."""

    vibrations: np.ndarray
    arrays: dict[str, np.ndarray]  # (2, n_frequencies, ...)
    jumps: list[tuple[float, str]]
    ended: list[float]


def solver_at(
    model: Model, kind: str, level: float, fastest: float, harmonics: int, samples: int, modes: int
) -> Solver:
    """Return a solver for the vibrations of a rig at one level, m/s² or N, or a factor of rotating excitations.

    ``fastest`` is the highest frequency, 1/s, and of an unbalance the highest speed.
    """
    spin = steady_spin(model.rig, kind)
    system = condensed(model, kind, [level], harmonics, modes, speed=fastest if kind == UNBALANCE else spin)
    return Solver(system, harmonics, samples, spin)


def row_of(
    kind: str, frequency: np.ndarray, harmonics: int, samples: Sequence[int], modes: int, case: MapLevel
) -> MapRow:
    """Compute one row of a rattle map over frequencies, Hz, with as many samples of a period as it needs."""
    fastest, tried = 2 * np.pi * float(frequency[-1]), []
    for count in samples:
        solver = solver_at(case.model, kind, case.level, fastest, harmonics, count, modes)
        solver.tolerance = TOLERANCE * solver.system.fineness
        omega = 2 * np.pi * solver.system.frequency_ratio * frequency
        tried.append((solver, curve(solver, omega)))
        if not tried[-1][1].ended:
            break
    solver, best = max(tried, key=lambda each: (not each[1].ended, np.unique(each[1].order.cell).size))
    vibrations = np.bincount(np.concatenate((best.order.cell, best.detached.cell)), minlength=frequency.size)
    known, first = np.unique(best.order.cell, return_index=True)
    last = best.order.cell.size - 1 - np.unique(best.order.cell[::-1], return_index=True)[1]
    chosen, where = np.unique(np.concatenate((first, last)), return_inverse=True)
    arrays = {}
    for name, values in _measured(solver, omega, best.order.selected(chosen)).items():
        arrays[name] = np.full((2, frequency.size, values.shape[1]), np.nan)
        arrays[name][:, known] = values[where].reshape(2, known.size, values.shape[1])
    hz = 2 * np.pi * solver.system.frequency_ratio
    jumps = [(float(w / hz), "up" if up else "down") for w, up in best.folds]
    return MapRow(vibrations, arrays, jumps, [w / hz for w in best.ended])


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


def _measured(solver: Any, omega: np.ndarray, vibrations: ArcVibrations) -> dict[str, np.ndarray]:
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
    motions = zip(omega[vibrations.cell].tolist(), vibrations.z, vibrations.y, force)
    branch = expanded(solver, [TestedPoint(PeriodicMotion(*each, np.zeros(0), 0.0), None) for each in motions], "")
    return {
        "contact_share": np.mean(depth > 0, axis=-1), "penetration": np.maximum(depth.max(axis=-1), 0.0),
        "contact_force": peak, "displacement": branch.excursion(), "acceleration": branch.amplitude("acceleration"),
    }  # fmt: skip
