"""The families of contact that orbits tell: each is fitted from where that with a linear contact ended."""

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
from .problem import LawProblem, Place
from .search import STOP

__all__ = ["with_likeliest_contacts"]

LIKELIER = 3.0  # logarithm of the odds from which on a contact of another family is believed


class _Begun(NamedTuple):
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
    found: Solution, touching: Sequence[bool], own: Callable[[Sequence[Place]], list[Parameter]]
) -> Solution:
    """Return a fit with the likeliest family of contact of each clearance, one after the other.

    Parameters
    ----------
    found : Solution
        Of a `LawProblem` with linear contacts.
    touching : sequence of bool
        Of each clearance whether its shaft touches; where it does not, nothing tells the family.
    own : callable
        Returns what is open of the laws of clearances.
    """
    for j, touches in enumerate(touching):
        if not touches:
            continue
        linear, problem = found, found.problem
        assert isinstance(problem, LawProblem) and isinstance(linear.loss, UnknownScale)
        correlated, place = max(linear.loss.correlated, 1.0), problem.places[j]
        known = dict(zip(problem.names, linear.values.tolist()))
        case = problem.case(place, known)
        begun = _Begun(place.nominal, case.bushing, case.law.contact[0], case.law.grease[0], known)
        best = _log_evidence(linear, correlated) + LIKELIER
        for family in CONTACT_FAMILIES.values():
            if family is place.contact:
                continue
            places = [p._replace(contact=family) if p is place else p for p in problem.places]
            rival = LawProblem(problem.forces, places, own(places))
            names = {p.name: f"bushings[{place.number}].{p.name}" for p in family.parameters(place.nominal)}
            start = {names[name]: value for name, value in family.start(begun, begun).items()}
            with contextlib.suppress(NoModelError):
                other = solve(rival, [rival.at(known | start), rival.at(known)], stop=STOP)
                if (evidence := _log_evidence(other, correlated)) > best:
                    found, best = other, evidence
    return found


def _log_evidence(found: Solution, correlated: float) -> float:
    """Of residuals of which so many count as one."""
    assert isinstance(found.loss, UnknownScale)
    cost = found.residuals.size / correlated * math.log(float(found.loss.scale(found.residuals)))
    return log_evidence(cost, found.at, found.information / correlated)
