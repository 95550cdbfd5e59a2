"""Contact families fitted to orbits, each from where the fit of a linear contact ended."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...clearance.contact import ContactModel
from ...clearance.family import CONTACT_FAMILIES
from ...clearance.grease import GreaseModel
from ...estimate import Parameter, Solution, UnknownScale, log_evidence, solve
from ...estimate.solver import NoModelError
from ...rig import Bushing, Grease
from .problem import ClearanceFamilies, LawProblem
from .search import STOP

__all__ = ["with_likeliest_contacts"]

LIKELIER = 3.0  # logarithm of the odds from which on a contact of another family is believed


class _EarlierLaw(NamedTuple):
    """The law of a clearance from which a fit of another family begins; see `EarlierFit` and `GapForces`."""

    nominal: Bushing
    bushing: Bushing
    contact_model: ContactModel
    filling_model: GreaseModel | Grease
    values: dict[str, float]

    def in_gap(self, bushing: Bushing, fillings: Sequence[GreaseModel]) -> tuple[np.ndarray, np.ndarray]:
        """Return no instants: orbits show no force of the filling alone."""
        return np.zeros((0, len(fillings))), np.zeros(0)


def with_likeliest_contacts(
    best_fit: Solution, touching: Sequence[bool], law_priors: Callable[[Sequence[ClearanceFamilies]], list[Parameter]]
) -> Solution:
    """Return a fit with the likeliest family of contact of each clearance, one after the other.

    Parameters
    ----------
    best_fit : Solution
        Of a `LawProblem` with linear contacts.
    touching : sequence of bool
        True for each clearance whose shaft touches; without contact, its family cannot be identified.
    law_priors : callable
        Returns the open parameters of the laws of clearances.
    """
    for j, touches in enumerate(touching):
        if not touches:
            continue
        linear, problem = best_fit, best_fit.problem
        assert isinstance(problem, LawProblem) and isinstance(linear.loss, UnknownScale)
        correlated, place = max(linear.loss.correlated, 1.0), problem.places[j]
        values = dict(zip(problem.names, linear.values.tolist()))
        case = problem.case(place, values)
        earlier = _EarlierLaw(place.nominal, case.bushing, case.law.contact[0], case.law.grease[0], values)
        threshold = _log_evidence(linear, correlated) + LIKELIER
        for family in CONTACT_FAMILIES.values():
            if family is place.contact:
                continue
            rival_places = [p._replace(contact=family) if p is place else p for p in problem.places]
            rival = LawProblem(problem.forces, rival_places, law_priors(rival_places))
            start = {f"bushings[{place.number}].{name}": v for name, v in family.start(earlier, earlier).items()}
            with contextlib.suppress(NoModelError):
                fit = solve(rival, [rival.at(values | start), rival.at(values)], stop=STOP)
                if (evidence := _log_evidence(fit, correlated)) > threshold:
                    best_fit, threshold = fit, evidence
    return best_fit


def _log_evidence(solution: Solution, correlated: float) -> float:
    """Return the evidence of residuals of which `correlated` count as one observation."""
    assert isinstance(solution.loss, UnknownScale)
    cost = solution.residuals.size / correlated * math.log(float(solution.loss.scale(solution.residuals)))
    return log_evidence(cost, solution.at, solution.information / correlated)
