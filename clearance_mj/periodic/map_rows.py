"""One row of a rattle map: what sweeps over frequency do at one level of one gap."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..model import Model
from .arcs import Vibrations, curve
from .condensed import condensed
from .continuation import Motion, Solver
from .following import expanded
from .forces import fill_forces
from .in_gap import linear_in_gap
from .stability import Located

__all__ = ["QUANTITIES", "Case", "Row", "row_of"]

QUANTITIES = {
    "contact_share": ("clearance", "1"), "penetration": ("clearance", "m"), "contact_force": ("clearance", "N"),
    "displacement": ("clearance", "m"), "acceleration": ("response", "m s-2"),
}  # fmt: skip
TOLERANCE = 1e-6  # of the motion: what the balance may leave


class Case(NamedTuple):
    """One level of one gap."""

    gap: int
    row: int
    model: Model
    kind: str
    level: float
    frequencies: bytes
    harmonics: int
    samples: tuple[int, ...]
    modes: int


class Row(NamedTuple):
    """What is found there."""

    vibrations: np.ndarray
    arrays: dict[str, np.ndarray]  # (2, n_frequencies, ...)
    jumps: list[tuple[float, str]]
    ended: list[float]


def row_of(case: Case) -> Row:
    """Return what is found at one level of one gap."""
    frequency = np.frombuffer(case.frequencies)
    system = condensed(case.model, case.kind, [case.level], case.harmonics, case.modes)
    tried = []
    for count in case.samples:
        solver = Solver(system, case.harmonics, count)
        solver.tolerance = TOLERANCE
        tried.append((solver, curve(solver, 2 * np.pi * frequency)))
        if not tried[-1][1].ended:
            break
    solver, found = max(tried, key=lambda each: (not each[1].ended, np.unique(each[1].order.cell).size))
    cells = np.concatenate((found.order.cell, found.beside.cell))
    vibrations = np.bincount(cells, minlength=frequency.size)
    known, first = np.unique(found.order.cell, return_index=True)
    last = found.order.cell.size - 1 - np.unique(found.order.cell[::-1], return_index=True)[1]
    chosen, where = np.unique(np.concatenate((first, last)), return_inverse=True)
    of_chosen = _measured(solver, 2 * np.pi * frequency, found.order[chosen])
    arrays = {}
    for name, values in of_chosen.items():
        arrays[name] = np.full((2, frequency.size, values.shape[1]), np.nan)
        arrays[name][:, known] = values[where].reshape(2, known.size, values.shape[1])
    jumps = [(float(w / (2 * np.pi)), "up" if up else "down") for w, up in found.folds]
    return Row(vibrations, arrays, jumps, [w / (2 * np.pi) for w in found.ended])


def _measured(solver: Solver, omega: np.ndarray, vibrations: Vibrations) -> dict[str, np.ndarray]:
    """What `QUANTITIES` names, (m, n_bushings or n_sensors)."""
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
    still = np.zeros(0)
    points = [
        Located(Motion(float(omega[c]), z, y, f, still, 0.0), None)
        for c, z, y, f in zip(vibrations.cell, vibrations.z, vibrations.y, force)
    ]
    if not points:
        widths = {"response": len(system.rig.sensors), "clearance": count}
        return {name: np.zeros((0, widths[row])) for name, (row, _) in QUANTITIES.items()}
    branch = expanded(solver, points, "")
    return {
        "contact_share": np.mean(depth > 0, axis=-1), "penetration": depth.max(axis=-1), "contact_force": most,
        "displacement": branch.amplitude("clearance_displacement"), "acceleration": branch.amplitude("acceleration"),
    }  # fmt: skip
