"""Contact and filling of a clearance, fitted to the first windows that show it, and the errors of that fit.

The fit stays wrong by the rig's errors, and tracked parameters by those of the parameters that stay as fitted. Both
errors are the same in all windows, so no number of windows averages them out, and no change shows in them (considered
parameters; Tapley, Schutz and Born, Statistical Orbit Determination, 2004, section 6.2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..forces.restoring import RestoringForce
from ..laws.comparison import fit_families
from ..laws.families import FamilyValues
from ..laws.force_fit import ForceFit, ForceProblem, fit_force, steps_on
from ..laws.measured_motion import MeasuredMotion

__all__ = ["between_family_variance", "covariance_of_fixed", "covariance_of_rig", "fit_law"]

OCCAM = 0.05
"""Probability of the likeliest family, times which less likely ones are excluded (Occam's window; Madigan and Raftery,
Journal of the American Statistical Association 89, 1994)."""


def fit_law(motion: MeasuredMotion, families: FamilyValues | None) -> list[ForceFit]:
    """Return laws fitted to a clearance's motion, likeliest first: of all families not excluded, or of given ones."""
    if families:
        return [fit_force(motion, families.contact, families.filling, [families.values])]
    fits = fit_families(motion)
    return [each.fit for each in fits if each.weight >= OCCAM * fits[0].weight]


def between_family_variance(quantities: np.ndarray) -> np.ndarray:
    """Return the largest squared deviation (n,) of any retained family from the likeliest.

    Parameters
    ----------
    quantities : ndarray
        Quantities (n_families, n) by family, the likeliest first.
    """
    return np.asarray(np.max((quantities - quantities[0]) ** 2, axis=0))


def covariance_of_fixed(fit: ForceFit, free: np.ndarray) -> np.ndarray:
    """Return the covariance (n_free, n_free) of tracked parameters that errors of the fixed ones cause.

    In prior standard deviations, as `ForceFit.point`.
    """
    fixed = np.setdiff1d(np.arange(fit.point.size), free)
    precision = fit.information / fit.correlation_length + np.eye(fit.point.size)
    slope = -np.linalg.solve(precision[np.ix_(free, free)], precision[np.ix_(free, fixed)])
    covariance = np.linalg.inv(precision)[np.ix_(fixed, fixed)]
    return np.asarray(slope @ covariance @ slope.T)


def covariance_of_rig(
    fit: ForceFit, problem: ForceProblem, drawn: Sequence[Sequence[RestoringForce]], free: np.ndarray
) -> np.ndarray:
    """Return the covariance (n_free, n_free) of tracked parameters that errors of the rig cause, to first order.

    Parameters
    ----------
    fit : ForceFit
        Fit to one clearance.
    problem : ForceProblem
        That the fit solved.
    drawn : sequence of sequences of RestoringForce
        Forces in the same windows, on rigs drawn from the rig's posterior.
    free : ndarray
        Indices (n_free,) of the tracked parameters.
    """
    changes = steps_on(fit, problem, [problem.motion.on(forces, forces[0].rig) for forces in drawn])[:, free]
    return np.atleast_2d(changes.T @ changes / max(len(changes), 1))
