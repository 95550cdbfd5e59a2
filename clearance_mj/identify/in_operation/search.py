"""Where the search for a clearance's law begins, and the search.

Most windows of most machines do not touch: unbalance, run-out and rig follow from them. The forces that are left in the
others point from the wall to its centre, F = -N n with N = k (e - g): x = g F/|F| + F/k - r, which is linear in the gap
g, the contact's compliance 1/k, the place r at rest and, as friction turns the force, in a part of g across.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...estimate import Parameter, Solution, Stop, solve
from ...rig import Rig
from .forces import Forces, forces_in
from .problem import LawProblem, Place, real
from .windows import Bands, Window

__all__ = ["fitted", "free"]

DRAWS, OILY = 30, 100  # laws drawn, and where oil fills gaps, whose forces point to no wall
SEARCHED = 3  # of them from which a search is made
WIDER = 1.5  # prior standard deviations of gap and place that are drawn from
STRONG = (0.2, 0.35, 0.5, 0.7)  # of the largest force: from there on a force counts as contact
ROUNDS = 3  # in which force and motion are linearised anew about what was found
NEAR, FARTHEST = 0.5, 1.0  # of the gap, motion that hardly touches; prior standard deviations of the rig's numbers
ROBUST = 8  # rounds in which windows that miss much count less
FIRST, STOP = Stop(steps=12, decrease=1e-3), Stop(steps=24, decrease=0.0, gain=0.2, move=0.0)


def free(
    rig: Rig, windows: Sequence[Window], bands: Bands, places: Sequence[Place], uncertain: Sequence[Parameter],
    own: Sequence[Parameter],
) -> dict[str, float]:  # fmt: skip
    """Return unbalance, run-out and rig as the windows have them in which nothing touches.

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
        Of the rig, and of laws without contact.
    """
    known: dict[str, float] = {}
    reach = np.max([_reach(windows, place) for place in places], axis=0)
    for turn in range(3):
        problem = LawProblem(forces_in(rig, windows, uncertain, known, bands), places, own, touching=False)
        at, linear = problem.at(known), _linear(problem)
        if turn == 0:  # unbalance and run-out first: as long as they are wrong, they would bend the rig
            linear = [i for i in linear if _is_motion(problem.names[i])]
        columns, misses = _columns(problem, linear, problem.values(at)), real(problem.misses(problem.values(at)))
        rows = columns.reshape(len(windows), -1, len(linear))
        near = 1 / (1 + (reach / NEAR) ** 6)
        weight = near
        step = np.zeros(len(linear))
        for _ in range(ROBUST):
            by = rows * weight[:, None, None]
            normal = np.einsum("wri,wrj->ij", by, rows) + np.eye(len(linear))
            right = np.einsum("wri,wr->i", by, misses.reshape(len(windows), -1)) + at[linear]
            step = -np.linalg.solve(normal, right)
            left = np.sqrt(np.mean((misses + columns @ step).reshape(len(windows), -1) ** 2, axis=1))
            quiet = np.sqrt(np.sum(near * left**2) / np.sum(near))
            weight = np.maximum(near, 1e-3) / (1 + (left / quiet / 2) ** 6)
        at[linear] += step
        rig_only = [i for i in linear if not _is_motion(problem.names[i])]
        at[rig_only] = np.clip(at[rig_only], -FARTHEST, FARTHEST)
        known = dict(zip(problem.names, problem.values(problem.inside(at)).tolist()))
    return known


def fitted(
    rig: Rig, windows: Sequence[Window], bands: Bands, places: Sequence[Place], uncertain: Sequence[Parameter],
    own: Sequence[Parameter], begin: Mapping[str, float], seed: int = 0,
) -> Solution:  # fmt: skip
    """Return the likeliest laws with contact and what is uncertain of the rig, linearised about them.

    Parameters
    ----------
    rig, windows, bands, places, uncertain
        As `free` takes them.
    own : sequence of Parameter
        Of laws.
    begin : mapping of str to float
        What `free` returns.
    seed : int
        Of the draws.
    """
    weighed = forces_in(rig, windows, uncertain, begin, bands)
    problem = LawProblem(weighed, places, own)
    starts = [problem.at({**begin, **each}) for each in _by_force(weighed, places)]
    starts = [problem.at(begin), *starts, *_drawn(problem, problem.at(begin), seed)]
    found = solve(problem, starts, n_best=SEARCHED, stop=FIRST)
    for _ in range(ROUNDS):
        known = dict(zip(problem.names, found.values.tolist()))
        forces = forces_in(rig, windows, uncertain, known, bands, weighed)
        problem = LawProblem(forces, places, own)
        others = [problem.at(known | each) for each in _by_force(forces, places)]
        found = solve(problem, [problem.at(known), *others], n_best=2, stop=STOP)
    return found


def _by_force(forces: Forces, places: Sequence[Place]) -> list[dict[str, float]]:
    """Gap, place at rest and contact of each clearance as the forces over time have them."""
    slow, over_time = forces.slow, forces.over_time()
    found = []
    for share in STRONG:
        law: dict[str, float] = {}
        for place in places:
            own, at = f"bushings[{place.number}]", slice(2 * place.number, 2 * place.number + 2)
            force = over_time[:, :, at].reshape(-1, 2)
            size = np.hypot(*force.T)
            strong = size > share * size.max()
            x, f, n = slow.x[strong][:, at], force[strong], force[strong] / size[strong][:, None]
            across = n[:, ::-1] * np.array([-1.0, 1.0])
            rows = np.stack([n, across, f, *(np.broadcast_to(-axis, n.shape) for axis in np.eye(2))], axis=2)
            (g, turned, compliance, y, z), *_ = np.linalg.lstsq(rows.reshape(-1, 5), x.ravel(), rcond=None)
            gap = float(np.hypot(g, turned))
            if not 0.2 < gap / place.nominal.gap < 5.0:
                continue
            law |= {f"{own}.gap": gap, f"{own}.rest_y": float(y), f"{own}.rest_z": float(z)}
            law[f"{own}.contact stiffness"] = float(1 / max(compliance, 0.1 / place.nominal.contact.stiffness))
        found.append(law)
    return found


def _reach(windows: Sequence[Window], place: Place) -> np.ndarray:
    """(n_windows,) farthest motion from where the shaft rests, over the gap of the rig file."""
    own = slice(2 * place.number, 2 * place.number + 2)
    return np.array([np.hypot(*w.clear[:, own].T).max() for w in windows]) / place.nominal.gap


def _is_motion(name: str) -> bool:
    return "unbalance" in name or "run-out" in name or "force at rest" in name


def _linear(problem: LawProblem) -> list[int]:
    return [i for i, name in enumerate(problem.names) if i < problem.n_linear or "force at rest" in name]


def _drawn(problem: LawProblem, at: np.ndarray, seed: int) -> list[np.ndarray]:
    """Coordinates (n,) of drawn laws, each with the likeliest of what is shown depends on linearly."""
    rng, linear = np.random.default_rng(seed), _linear(problem)
    law = np.setdiff1d(np.arange(problem.size), linear)
    columns = _columns(problem, linear, problem.values(at))
    precision = columns.T @ columns + np.eye(len(linear))
    found = []
    oil = any(place.filling.round_only for place in problem.places)
    for _ in range(OILY if oil else DRAWS):
        point = at.copy()
        point[law] = WIDER * rng.standard_normal(law.size)
        point = problem.inside(point)
        misses = real(problem.misses(problem.values(point)))
        point[linear] -= np.linalg.solve(precision, columns.T @ misses + point[linear])
        found.append(problem.inside(point))
    return found


def _columns(problem: LawProblem, linear: Sequence[int], values: np.ndarray) -> np.ndarray:
    """(n_residuals, n_linear) derivatives of what is shown, by coordinates."""
    per_force = problem.forces.per_force
    return np.column_stack([real(problem.shown_by(i, values, per_force)) for i in linear])
