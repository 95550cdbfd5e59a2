"""Laws fitted to the restoring force of a bushing: gap, offset, contact and filling.

The motion is measured, so nothing is simulated and impacts are not chaotic: a law's force along the measured motion is
compared with the restoring force instant by instant, its errors of unknown size. They are correlated in time, so that
many samples count as one independent observation: how many shows in the scores of the likelihood over blocks, which
would be as large as the information says if errors were independent (Ribatet, Cooley and Davison, Bayesian inference
from composite likelihoods, Statistica Sinica 22, 2012).
"""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from ...clearance import ContactLaw
from ...clearance.contact import ContactModel
from ...clearance.family import ContactFamily, FillingFamily
from ...clearance.grease import GreaseModel
from ...estimate import Estimates, Parameter, Problem, Solution, Stop, UnknownScale, log_evidence, solve
from ...rig import Bushing, Grease
from .measured_motion import MeasuredMotion

__all__ = ["FamilyProblem", "ForceFit", "ForceProblem", "fit_force"]

Case = TypeVar("Case")

FARTHEST_OFFSET = 0.95  # of the gap: the shaft at rest touches neither wall
STOP = Stop(steps=24, decrease=0.0, gain=0.2, move=0.0)
MAX_RESIDUAL = 1e6  # of the expected error: a law that misses more diverges
MAX_CORRELATION_LENGTH = 10.0  # samples, on the way: far from the optimum all errors are correlated


@dataclass(frozen=True, eq=False)
class ForceFit:
    """One family of contact and filling at one bushing."""

    contact: ContactFamily  #: family of the contact
    filling: FillingFamily  #: family of the filling
    nominal: Bushing  #: the bushing as the rig file has it
    law: ContactLaw  #: of this bushing
    bushing: Bushing  #: with the gap and offset found
    estimates: Estimates  #: of gap, offset, length, where open, then of contact and filling
    point: np.ndarray  #: (n,) values in prior standard deviations from their starts
    information: np.ndarray  #: (n, n) of `point`, as if errors were independent, without the priors
    losses: np.ndarray  #: (n_blocks,) of the force over its expected error, sums over blocks
    size: int  #: samples that were fitted
    correlation_length: float  #: samples that count as one independent observation
    misfit: float  #: of the force, over the error that a law is expected to have: robust mean over what was fitted
    held_out: float  #: the same over what was not

    def log_evidence(self, correlation_length: float, counts: ArrayLike = 1.0) -> np.ndarray:
        """Return the logarithm of the probability of the records given the family, but for a constant of the bushing.

        In Laplace's approximation, with the size of the errors integrated out.

        Parameters
        ----------
        correlation_length : float
            Samples that count as one independent observation, the same for all families that are compared.
        counts : array_like
            How often each block of the records counts (..., n_blocks).
        """
        variance = np.mean(np.broadcast_to(self.losses * counts, np.shape(counts)[:-1] + self.losses.shape), axis=-1)
        variance *= self.losses.size / self.size
        rest = log_evidence(0.0, self.point, self.information / correlation_length)
        return np.asarray(rest - self.size / correlation_length * np.log(variance) / 2)

    @cached_property
    def covariance(self) -> np.ndarray:
        """(n, n) of `point` after the fit."""
        return np.linalg.inv(self.information / self.correlation_length + np.eye(self.point.size))

    def drawn(self, bushing: Bushing, seed: int) -> tuple[Bushing, ContactLaw]:
        """Draw gap, offset and law from their covariance.

        Parameters
        ----------
        bushing : Bushing
            Everything else is its own.
        seed : int
            Seed of the random numbers.
        """
        values = self.estimates.draw(1, seed)[0]
        return _bushing_and_law(values, self.estimates.names, self.nominal, bushing, self.contact, self.filling)

    @property
    def contact_model(self) -> ContactModel:
        """The contact found."""
        return self.law.contact[0]

    @property
    def filling_model(self) -> GreaseModel | Grease:
        """The filling found."""
        return self.law.grease[0]

    @property
    def values(self) -> dict[str, float]:
        """All parameters by name, SI: where another fit can start."""
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))


class FamilyProblem(Problem, Generic[Case]):
    """A family's parameters and the residuals of its force, over the errors that laws are expected to have.

    Parameters
    ----------
    motion : MeasuredMotion or RoundMotion
        What laws are compared with.
    shape : sequence of Parameter
        What is open of the clearance itself.
    contact : ContactFamily
        Family of the contact.
    filling : FillingFamily
        Family of the filling.
    """

    lanes = True
    """whether many laws take hardly longer than one"""

    def __init__(self, motion: Any, shape: Sequence[Parameter], contact: ContactFamily, filling: FillingFamily) -> None:
        self.motion, self.contact, self.filling = motion, contact, filling
        own = [*contact.parameters(motion.nominal), *filling.parameters(motion.nominal)]
        loss = UnknownScale(motion.blocks, MAX_CORRELATION_LENGTH)
        super().__init__([*shape, *own], self._over_errors, loss=loss, lanes=self.lanes)

    @abstractmethod
    def case(self, values: np.ndarray) -> Case:
        """Return the clearance and its law of values (n,)."""

    def _over_errors(self, values: np.ndarray) -> np.ndarray:
        found = self.motion.residuals([self.case(each) for each in values])[self.motion.fitted].T
        return np.where(np.abs(found) < MAX_RESIDUAL, found, np.inf)

    def parts_of_fit(self, found: Solution, parameters: Sequence[Parameter], correlated: float) -> dict[str, Any]:
        """Return fields of `ForceFit`, but for the law, of a solution of which so many samples are one observation."""
        loss, motion = cast(UnknownScale, found.loss), self.motion
        covariance = np.linalg.inv(found.information / correlated + found.prior) * np.outer(self.unit, self.unit)
        aside = motion.residuals([self.case(found.values)])[motion.held_out, 0]
        misfit, held_out = (float(loss.scale(residuals)) ** 0.5 for residuals in (found.residuals, aside))
        return {
            "contact": self.contact, "filling": self.filling, "nominal": motion.nominal,
            "estimates": Estimates.of(parameters, found.values, covariance), "point": found.at,
            "information": found.information, "losses": loss.losses(found.residuals), "size": found.residuals.size,
            "correlation_length": loss.correlated, "misfit": misfit, "held_out": held_out,
        }  # fmt: skip


class ForceProblem(FamilyProblem[tuple[Bushing, ContactLaw]]):
    """The problem of a family at a bushing whose measured motion is along one line.

    Parameters
    ----------
    motion : MeasuredMotion
        What laws are compared with.
    contact : ContactFamily
        Family of the contact.
    filling : FillingFamily
        Family of the filling.
    """

    def __init__(self, motion: MeasuredMotion, contact: ContactFamily, filling: FillingFamily) -> None:
        super().__init__(motion, motion.gap_parameters, contact, filling)

    def law(self, at: np.ndarray) -> tuple[Bushing, ContactLaw]:
        """Return bushing and law at coordinates (n,)."""
        return self.case(self.values(at))

    def case(self, values: np.ndarray) -> tuple[Bushing, ContactLaw]:
        """Return bushing and law of values (n,)."""
        nominal, names = self.motion.nominal, [p.name for p in self.parameters]
        return _bushing_and_law(values, names, nominal, nominal, self.contact, self.filling)


def fit_force(
    motion: MeasuredMotion, contact: ContactFamily, filling: FillingFamily, starts: Sequence[Mapping[str, float]] = ()
) -> ForceFit:
    """Fit a family at a bushing, from the likeliest of some values by name or, without any, from the priors."""
    problem = ForceProblem(motion, contact, filling)
    found = solve(problem, [problem.at(values) for values in (*starts, {})], stop=STOP)
    bushing, law = problem.law(found.at)
    parameters = [motion.with_reach(p, bushing) for p in problem.parameters]
    correlated = cast(UnknownScale, found.loss).correlated
    return ForceFit(law=law, bushing=bushing, **problem.parts_of_fit(found, parameters, correlated))


def _bushing_and_law(
    values: Sequence[float] | np.ndarray, names: Sequence[str], nominal: Bushing, bushing: Bushing,
    contact: ContactFamily, filling: FillingFamily,
) -> tuple[Bushing, ContactLaw]:  # fmt: skip
    """Bushing with another gap and length, and another offset short of the wall, and the law of values by name."""
    known = {n.rpartition(".")[2]: float(v) for n, v in zip(names, values) if n.startswith("bushings[")}
    gap, offset = known.get("gap", bushing.gap), known.get("offset", bushing.offset)
    offset = float(np.clip(offset, -FARTHEST_OFFSET * gap, FARTHEST_OFFSET * gap))
    own, n = [float(v) for v in values[len(known) :]], len(contact.parameters(nominal))
    law = ContactLaw(contact.make(nominal, *own[:n]), filling.make(nominal, *own[n:]))
    return dataclasses.replace(bushing, gap=gap, offset=offset, length=known.get("length", bushing.length)), law
