"""What contact and grease of a clearance are, learnt from the first windows that show it, and how wrong that may be.

What is learnt stays wrong by what the rig is wrong by, and what is followed by that of the parameters that stay as
learnt: both are alike in all windows, so no number of windows takes them away, and no change shows in them
(considered parameters; Tapley, Schutz and Born, Statistical Orbit Determination, 2004, section 6.2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...estimate.parameter import Parameter
from ...rig import Rig
from ..forces.restoring import RestoringForce
from ..laws.comparison import compared
from ..laws.families import Family
from ..laws.force_fit import ForceFit, Motion, _Fit, fit

__all__ = ["learnt", "of_rigs", "of_rivals", "of_the_rest"]

OCCAM = 0.05
"""of the likeliest family's probability: less likely ones are excluded (Occam's window; Madigan and Raftery, Journal of
the American Statistical Association 89, 1994)"""


def learnt(
    forces: Sequence[RestoringForce], rig: Rig, number: int, gap: Sequence[Parameter],
    families: tuple[Family, Family] | None, values: Mapping[str, float],
) -> tuple[Motion, list[ForceFit]]:  # fmt: skip
    """Motion of a bushing, and laws fitted along it, the likeliest first: of the families told, or of all not excluded.

    ``values``: of parameters by name, where the fit may begin.
    """
    motion = Motion(forces, rig, number, gap)
    if families:
        return motion, [fit(motion, *families, [values] if values else ())]
    found = compared([motion])
    return motion, [each.fits[0] for each in found if each.weight >= OCCAM * found[0].weight]


def of_rivals(quantities: np.ndarray) -> np.ndarray:
    """Variances (n,) of quantities (n_families, n), the likeliest's first, by what other families say.

    How far the furthest family is that is not excluded counts as a standard deviation.
    """
    return np.asarray(np.max((quantities - quantities[0]) ** 2, axis=0))


def of_the_rest(found: ForceFit, free: np.ndarray) -> np.ndarray:
    """Covariance (n_free, n_free) of errors of parameters that are followed by those of the others, which stay.

    In prior standard deviations, as `ForceFit.at`.
    """
    rest = np.setdiff1d(np.arange(found.at.size), free)
    precision = found.information / found.alike + np.eye(found.at.size)
    slope = -np.linalg.solve(precision[np.ix_(free, free)], precision[np.ix_(free, rest)])
    covariance = np.linalg.inv(precision)[np.ix_(rest, rest)]
    return np.asarray(slope @ covariance @ slope.T)


def of_rigs(
    motion: Motion, number: int, found: ForceFit, problem: _Fit, drawn: Sequence[Sequence[RestoringForce]],
    free: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Covariance (n_free, n_free) of what was learnt by what is not known of the rig, to first order.

    ``drawn``: the same windows' forces on other rigs, drawn from what is known.
    """
    at, now = found.at, problem.left([found.at])[:, 0]
    slopes = problem.slopes(at, now)
    weighted = slopes / np.sqrt(1 + now**2)[:, None]
    precision = weighted.T @ slopes + np.eye(at.size) * found.alike * found.misfit**2
    moved = []
    for forces in drawn:
        other = Motion(forces, motion.rig, number, motion.gap)
        left = other.left([problem.law(at)])[motion.kept, 0]
        moved.append(-np.linalg.solve(precision, weighted.T @ (left - now))[free])
    return np.atleast_2d(np.array(moved).T @ np.array(moved) / max(len(moved), 1))
