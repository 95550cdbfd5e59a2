"""Where the search for a clearance's law begins: drawn laws, each with the likeliest unbalance, run-out and rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...estimate import Parameter, Solution, Stop, solve
from ...estimate.loss import UnknownScale
from ...rig import Rig
from .forces import forces_in
from .problem import LawProblem, Place, real
from .windows import Bands, Window

__all__ = ["fitted"]

DRAWS = 160  # laws drawn
SEARCHED = 3  # of them from which a search is made
WIDER = 1.5  # prior standard deviations of gap and place that are drawn from
ROUNDS = 3  # in which force and motion are linearised anew about what was found
STOP = Stop(steps=24, decrease=0.0, gain=0.2, move=0.0)


def fitted(
    rig: Rig, windows: Sequence[Window], bands: Bands, places: Sequence[Place], uncertain: Sequence[Parameter],
    own: Sequence[Parameter], touching: bool, begin: Mapping[str, float] | None = None, seed: int = 0,
) -> Solution:  # fmt: skip
    """Return the likeliest laws, with what is uncertain of the rig, linearised about it.

    Parameters
    ----------
    rig : Rig
        The rig.
    windows : sequence of Window
        Of its records.
    bands : Bands
        Of forces and motion.
    places : sequence of Place
        The clearances.
    uncertain, own : sequence of Parameter
        Of the rig and of the laws.
    touching : bool
        Whether the laws have contact.
    begin : mapping of str to float, optional
        Values from which the search begins beside what is drawn.
    seed : int
        Of the draws.
    """
    known = dict(begin or {})
    found: Solution | None = None
    for turn in range(ROUNDS):
        problem = LawProblem(forces_in(rig, windows, uncertain, known, bands), places, own, touching)
        starts = [problem.at(known)]
        count = SEARCHED
        if turn == 0:
            starts += _drawn(problem, seed)
        elif turn == 1 and found is not None:
            starts = [problem.at(known), *(problem.at(other.values) for other in found.others)]
        else:
            count = 1
        found = solve(problem, starts, n_best=min(count, len(starts)), stop=STOP)
        known = dict(zip(problem.names, found.values.tolist()))
    assert found is not None
    return found


def _drawn(problem: LawProblem, seed: int) -> list[np.ndarray]:
    """Coordinates (n,) of drawn laws, each with the likeliest of what forces depend on linearly."""
    rng = np.random.default_rng(seed)
    linear = [i for i, name in enumerate(problem.names) if i < problem.n_linear or "force at rest" in name]
    law = np.setdiff1d(np.arange(problem.size), linear)
    columns = _columns(problem, linear)
    precision = columns.T @ columns + np.diag(problem.known[linear].astype(float))
    found = []
    for _ in range(DRAWS):
        at = np.zeros(problem.size)
        at[law] = WIDER * rng.standard_normal(law.size)
        at = problem.inside(at)
        misses = real(problem.misses(problem.values(at)))
        at[linear] = -np.linalg.solve(precision, columns.T @ misses)
        found.append(problem.inside(at))
    return found


def _columns(problem: LawProblem, linear: Sequence[int]) -> np.ndarray:
    """(n_residuals, n_linear) derivatives of the measured forces over their errors, by coordinates."""
    origin = problem.values(np.zeros(problem.size))
    forces = problem.forces
    columns = np.empty((2 * forces.shown.size, len(linear)))
    for k, i in enumerate(linear):
        unit = problem.unit[i]
        if i < problem.n_linear:
            p = problem.parameters[i]
            by = forces.shown_by[:, :, :, i] * (unit if p.transform == "linear" else unit * origin[i])
        else:
            name = problem.names[i]
            row = 2 * int(name[name.index("[") + 1 : name.index("]")]) + name.endswith("z")
            by = unit * forces.one[:, :, None] * forces.per_force[:, :, :, row]
        columns[:, k] = real(by)
    return columns


def correlated(found: Solution) -> float:
    """Number of residuals that count as one observation."""
    assert isinstance(found.loss, UnknownScale)
    return found.loss.correlated
