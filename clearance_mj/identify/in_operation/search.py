"""Search for a clearance's law, and the starting points of the search.

Most windows of most machines do not touch: unbalance, run-out and rig follow from them. The residual forces of the
others point from the wall to its centre, F = -N n with N = k (e - g): x = g F/|F| + F/k - r, which is linear in the gap
g, the contact's compliance 1/k, the place r at rest and, as friction turns the force, in a part of g across.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...estimate import Parameter, Solution, StoppingCriteria, solve
from ...rig import Rig
from .forces import Forces, forces_in
from .problem import ClearanceFamilies, LawProblem, real
from .windows import BandLimits, RecordWindow

__all__ = ["fit_contact_law", "fit_without_contact"]

DRAWS, OILY = 30, 100  # laws drawn, and where oil fills gaps, whose forces point to no wall
SEARCHED = 3  # of them from which a search is made
WIDER = 1.5  # prior standard deviations of gap and place that are drawn from
STRONG = (0.2, 0.35, 0.5, 0.7)  # of the largest force: from there on a force counts as contact
ROUNDS = 3  # in which force and motion are linearised anew about the last solution
NEAR, FARTHEST = 0.5, 1.0  # of the gap, motion that hardly touches; prior standard deviations of the rig's numbers
ROBUST = 8  # rounds in which windows that miss much count less
FIRST, STOP = StoppingCriteria(steps=12, decrease=1e-3), StoppingCriteria(steps=24, decrease=0.0, gain=0.2, move=0.0)


def fit_without_contact(
    rig: Rig, windows: Sequence[RecordWindow], bands: BandLimits, places: Sequence[ClearanceFamilies],
    uncertain: Sequence[Parameter], law_priors: Sequence[Parameter],
) -> dict[str, float]:  # fmt: skip
    """Return unbalance, run-out and rig parameters fitted to the windows without contact.

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
    uncertain, law_priors : sequence of Parameter
        Of the rig, and of laws without contact.
    """
    values: dict[str, float] = {}
    relative_reach = np.max([_relative_reach(windows, place) for place in places], axis=0)
    for iteration in range(3):
        problem = LawProblem(forces_in(rig, windows, uncertain, values, bands), places, law_priors, touching=False)
        at, linear = problem.at(values), _linear_indices(problem)
        if iteration == 0:  # unbalance and run-out first: as long as they are wrong, they would bend the rig
            linear = [i for i in linear if _is_motion(problem.names[i])]
        columns = _columns(problem, linear, problem.values(at))
        misses = real(problem.spectral_residuals(problem.values(at)))
        rows = columns.reshape(len(windows), -1, len(linear))
        closeness = weight = 1 / (1 + (relative_reach / NEAR) ** 6)
        step = np.zeros(len(linear))
        for _ in range(ROBUST):
            weighted_rows = rows * weight[:, None, None]
            normal = np.einsum("wri,wrj->ij", weighted_rows, rows) + np.eye(len(linear))
            right_side = np.einsum("wri,wr->i", weighted_rows, misses.reshape(len(windows), -1)) + at[linear]
            step = -np.linalg.solve(normal, right_side)
            remaining = np.sqrt(np.mean((misses + columns @ step).reshape(len(windows), -1) ** 2, axis=1))
            quiet_rms = np.sqrt(np.sum(closeness * remaining**2) / np.sum(closeness))
            weight = np.maximum(closeness, 1e-3) / (1 + (remaining / quiet_rms / 2) ** 6)
        at[linear] += step
        rig_only = [i for i in linear if not _is_motion(problem.names[i])]
        at[rig_only] = np.clip(at[rig_only], -FARTHEST, FARTHEST)
        values = dict(zip(problem.names, problem.values(problem.inside(at)).tolist()))
    return values


def fit_contact_law(
    rig: Rig, windows: Sequence[RecordWindow], bands: BandLimits, places: Sequence[ClearanceFamilies],
    uncertain: Sequence[Parameter], law_priors: Sequence[Parameter], begin: Mapping[str, float],
) -> Solution:  # fmt: skip
    """Return the likeliest laws with contact and uncertain parameters of the rig, linearised about them.

    Parameters
    ----------
    rig, windows, bands, places, uncertain
        As `fit_without_contact` takes them.
    law_priors : sequence of Parameter
        Of laws.
    begin : mapping of str to float
        Values that `fit_without_contact` returns.
    """
    weighed = forces_in(rig, windows, uncertain, begin, bands)
    problem = LawProblem(weighed, places, law_priors)
    starts = [problem.at({**begin, **each}) for each in _laws_from_forces(weighed, places)]
    starts = [problem.at(begin), *starts, *_draw_points(problem, problem.at(begin))]
    solution = solve(problem, starts, n_best=SEARCHED, stop=FIRST)
    for _ in range(ROUNDS):
        values = dict(zip(problem.names, solution.values.tolist()))
        forces = forces_in(rig, windows, uncertain, values, bands, weighed)
        problem = LawProblem(forces, places, law_priors)
        starts_by_force = [problem.at(values | each) for each in _laws_from_forces(forces, places)]
        solution = solve(problem, [problem.at(values), *starts_by_force], n_best=2, stop=STOP)
    return solution


def _laws_from_forces(forces: Forces, places: Sequence[ClearanceFamilies]) -> list[dict[str, float]]:
    """Return estimates of gap, place at rest and contact of each clearance from the forces over time."""
    slow, over_time = forces.slow, forces.over_time()
    laws = []
    for fraction in STRONG:
        law: dict[str, float] = {}
        for place in places:
            prefix, columns = f"bushings[{place.number}]", slice(2 * place.number, 2 * place.number + 2)
            force = over_time[:, :, columns].reshape(-1, 2)
            magnitude = np.hypot(*force.T)
            strong = magnitude > fraction * magnitude.max()
            x, f, n = slow.x[strong][:, columns], force[strong], force[strong] / magnitude[strong][:, None]
            across = n[:, ::-1] * np.array([-1.0, 1.0])
            rows = np.stack([n, across, f, *(np.broadcast_to(-axis, n.shape) for axis in np.eye(2))], axis=2)
            (g, tangential, compliance, y, z), *_ = np.linalg.lstsq(rows.reshape(-1, 5), x.ravel(), rcond=None)
            gap = float(np.hypot(g, tangential))
            if not 0.2 < gap / place.nominal.gap < 5.0:
                continue
            law |= {f"{prefix}.gap": gap, f"{prefix}.rest_y": float(y), f"{prefix}.rest_z": float(z)}
            law[f"{prefix}.contact stiffness"] = float(1 / max(compliance, 0.1 / place.nominal.contact.stiffness))
        laws.append(law)
    return laws


def _relative_reach(windows: Sequence[RecordWindow], place: ClearanceFamilies) -> np.ndarray:
    """(n_windows,) farthest motion from where the shaft rests, over the gap of the rig file."""
    columns = slice(2 * place.number, 2 * place.number + 2)
    return np.array([np.hypot(*w.clear[:, columns].T).max() for w in windows]) / place.nominal.gap


def _is_motion(name: str) -> bool:
    return "unbalance" in name or "run-out" in name or "force at rest" in name


def _linear_indices(problem: LawProblem) -> list[int]:
    return [i for i, name in enumerate(problem.names) if i < problem.n_linear or "force at rest" in name]


def _draw_points(problem: LawProblem, at: np.ndarray) -> list[np.ndarray]:
    """Coordinates (n,) of drawn laws, each with the likeliest values of the linear parameters."""
    rng, linear = np.random.default_rng(0), _linear_indices(problem)
    law = np.setdiff1d(np.arange(problem.size), linear)
    columns = _columns(problem, linear, problem.values(at))
    precision = columns.T @ columns + np.eye(len(linear))
    points = []
    for _ in range(OILY if any(place.filling.round_only for place in problem.places) else DRAWS):
        point = at.copy()
        point[law] = WIDER * rng.standard_normal(law.size)
        point = problem.inside(point)
        misses = real(problem.spectral_residuals(problem.values(point)))
        point[linear] -= np.linalg.solve(precision, columns.T @ misses + point[linear])
        points.append(problem.inside(point))
    return points


def _columns(problem: LawProblem, linear: Sequence[int], values: np.ndarray) -> np.ndarray:
    """(n_residuals, n_linear) derivatives of the probes' signals by coordinates."""
    per_force = problem.forces.per_force
    return np.column_stack([real(problem.shown_by(i, values, per_force)) for i in linear])
