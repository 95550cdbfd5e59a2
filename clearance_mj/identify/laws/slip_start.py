"""Where fits of Maxwell-slip elements begin: springs of given slip displacements by non-negative least squares.

Forces of elements add up, in proportion to their springs, so that only the slip displacements need a search. Those of
many narrow elements are found at once, as samples of Iwan's distribution, and put together to the few of a family.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import scipy.optimize

from ...clearance import ContactLaw, MaxwellSlip
from ...clearance.gap import penetration
from .families import ELEMENTS
from .force_fit import ForceFit, Motion

__all__ = ["slip_start"]

NARROWEST, WIDEST = 0.02, 2.0
"""of the gap: slip displacements"""
COUNT = 24
"""of them"""
FILMS = (1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 20.0)
"""gaps: heights of films"""
NOTHING = 1e-9
"""N/m, spring of an element that is not there"""
LEAST = 1e-3
"""of the stiffness: weakest spring to begin with"""


def slip_start(motion: Motion, linear: ForceFit) -> dict[str, float]:
    """Values of grease parameters by name, SI, from the fit of a linear grease, of which gap and contact are taken.

    Only what happens in the gap counts.
    """
    bushing = linear.bushing
    slips = bushing.gap * np.geomspace(NARROWEST, WIDEST, COUNT)
    models = [MaxwellSlip((1.0,), (slip,)) for slip in slips]
    models.append(MaxwellSlip((NOTHING,), (NOTHING,), elastic=1.0))
    models += [MaxwellSlip((NOTHING,), (NOTHING,), damping=1.0, film_height=h * bushing.gap) for h in FILMS]
    free = dataclasses.replace(bushing, gap=1e3 * bushing.gap)  # never to be met
    columns = motion.forces([(free, ContactLaw(linear.law.contact, model)) for model in models])
    ends = np.concatenate([path.x[:: motion.factor, 1:] for path in motion.paths])
    inside = motion.kept[~penetration(ends[motion.kept], *bushing.walls).any(axis=1)]
    weighted = columns[inside] * motion.weight[inside, None]
    right = motion.force[inside] * motion.weight[inside]
    scale = np.linalg.norm(weighted, axis=0)
    normal = weighted / scale
    # The same least squares with as many rows as columns.
    root = np.linalg.cholesky(normal.T @ normal + 1e-9 * np.eye(len(models)))
    found, _ = scipy.optimize.nnls(root.T, np.linalg.solve(root, normal.T @ right))
    springs, stiffness, films = np.split(found / scale, [COUNT, COUNT + 1])
    least = LEAST * (stiffness[0] + springs.sum())
    values = {"grease stiffness": max(float(stiffness[0]), least)}
    if films.any():
        height = bushing.gap / float(films @ (1 / np.array(FILMS)) / films.sum())
        values |= {"grease damping": float(films.sum()), "grease film height": height}
    return values | _together(slips, springs, least)


def _together(slips: np.ndarray, springs: np.ndarray, least: float) -> dict[str, float]:
    """Few elements that slide as many do: neighbours become one where that changes least (Ward 1963)."""
    groups = [(max(float(k), least / springs.size), float(np.log(slip))) for k, slip in zip(springs, slips)]
    while len(groups) > ELEMENTS:
        cost = [a[0] * b[0] / (a[0] + b[0]) * (a[1] - b[1]) ** 2 for a, b in itertools.pairwise(groups)]
        i = int(np.argmin(cost))
        (k, at), (other, beside) = groups[i : i + 2]
        groups[i : i + 2] = [(k + other, (k * at + other * beside) / (k + other))]
    found = {f"grease slip displacement {i + 1}": float(np.exp(at)) for i, (_, at) in enumerate(groups)}
    return found | {f"grease slipping stiffness {i + 1}": max(k, least) for i, (k, _) in enumerate(groups)}
