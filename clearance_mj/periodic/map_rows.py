"""One row of a rattle map: sweeps over frequency at one level of one gap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..model import Model
from .arcs import curve
from .cells import measured
from .condensed import UNBALANCE, condensed
from .excitation import steady_spin
from .solver import Solver

__all__ = ["MapLevel", "MapRow", "row_of", "solver_at"]

TOLERANCE = 1e-6  # residual over the size of the motion


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
    of_chosen = measured(solver, omega, best.order.selected(chosen))
    arrays = {}
    for name, values in of_chosen.items():
        arrays[name] = np.full((2, frequency.size, values.shape[1]), np.nan)
        arrays[name][:, known] = values[where].reshape(2, known.size, values.shape[1])
    hz = 2 * np.pi * solver.system.frequency_ratio
    jumps = [(float(w / hz), "up" if up else "down") for w, up in best.folds]
    return MapRow(vibrations, arrays, jumps, [w / hz for w in best.ended])
