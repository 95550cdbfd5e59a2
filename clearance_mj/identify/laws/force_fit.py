"""Laws fitted to the restoring force of a clearance: gap, offset or where the shaft rests, contact and filling.

The motion is measured, so nothing is simulated and impacts are not chaotic: a law's force along the measured motion is
compared with the restoring force instant by instant, its errors of unknown size. They are correlated in time, so that
many samples count as one independent observation: how many shows in the scores of the likelihood over blocks, which
would be as large as the information says if errors were independent (Ribatet, Cooley and Davison, Bayesian inference
from composite likelihoods, Statistica Sinica 22, 2012).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from ...clearance import ContactLaw
from ...clearance.contact import ContactModel
from ...clearance.family import ContactFamily, FillingFamily
from ...clearance.grease import GreaseModel
from ...estimate import Estimates, Problem, StoppingCriteria, UnknownScale, log_evidence, solve
from ...rig import Bushing, Grease
from .case import OFFSETS, RESTS, ClearanceWithLaw, case_of, fields_of, hole_of, placed
from .measured_motion import MeasuredMotion

__all__ = ["ForceFit", "ForceProblem", "fit_force", "steps_on"]

STOP = StoppingCriteria(steps=24, decrease=0.0, gain=0.2, move=0.0)
MAX_RESIDUAL = 1e6  # of the expected error: a law that misses more diverges
MAX_CORRELATION_LENGTH = 10.0  # samples, on the way: far from the optimum all errors are correlated


@dataclass(frozen=True, eq=False)
class ForceFit:
    """One family of contact and filling at one clearance."""

    contact: ContactFamily  #: family of the contact
    filling: FillingFamily  #: family of the filling
    nominal: Bushing  #: the clearance as the rig file has it
    case: ClearanceWithLaw  #: at the optimum
    bushing: Bushing  #: with the fitted gap, and the offset of the unloaded shaft, once that is known
    estimates: Estimates  #: of the clearance's open parameters, then of contact and filling
    point: np.ndarray  #: (n,) values in prior standard deviations from their starts
    information: np.ndarray  #: (n, n) of `point`, as if errors were independent, without the priors
    loss: UnknownScale  #: of the residuals, as the fit ended
    losses: np.ndarray  #: (n_blocks,) of the force over its expected error, sums over blocks
    size: int  #: values that were fitted
    correlation_length: float  #: values that count as one independent observation
    misfit: float  #: of the force, over the expected error of a law: robust mean over the fitted values
    held_out: float  #: the same over the values that were not fitted

    @property
    def law(self) -> ContactLaw:
        """Contact and filling of this clearance."""
        return self.case.law

    def log_evidence(self, correlation_length: float, counts: ArrayLike = 1.0) -> np.ndarray:
        """Return the logarithm of the probability of the records given the family, but for a constant of the clearance.

        In Laplace's approximation, with the size of the errors integrated out.

        Parameters
        ----------
        correlation_length : float
            Values that count as one independent observation, the same for all families that are compared.
        counts : array_like
            How often each block of the records counts (..., n_blocks).
        """
        variance = np.mean(np.broadcast_to(self.losses * counts, np.shape(counts)[:-1] + self.losses.shape), axis=-1)
        variance *= self.losses.size / self.size
        independent = log_evidence(0.0, self.point, self.information / correlation_length)
        return np.asarray(independent - self.size / correlation_length * np.log(variance) / 2)

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
        fields = fields_of(self.estimates.names, self.estimates.draw(1, seed)[0])
        new, law, _ = case_of(fields, self.nominal, self.contact, self.filling)
        offset = np.array([fields.get(name, getattr(bushing, name)) for name in OFFSETS[-bushing.n_coordinates :]])
        hole = {"shape": new.shape, "wall": new.wall} if bushing.wall else {}
        length = fields.get("length", bushing.length)
        return placed(bushing, offset, gap=new.gap, length=length, friction=new.friction, film=new.film, **hole), law

    def offset_by(self, moved: np.ndarray, spread: np.ndarray) -> ForceFit:
        """Return the fit with the unloaded shaft's offsets in the place of where it rests.

        Parameters
        ----------
        moved : ndarray, shape (d,)
            From the unloaded place to rest along its coordinates, m.
        spread : ndarray, shape (d, d)
            Covariance of that, m².
        """
        if self.case.rest is None:
            return self
        parameters, values = list(self.estimates.parameters), self.estimates.value.copy()
        covariance, at = self.estimates.covariance, [i for i, p in enumerate(parameters) if p.name.endswith(RESTS)]
        for i, shift in zip(at, moved.tolist()):
            p, (prefix, _, field) = parameters[i], parameters[i].name.rpartition(".")
            name = f"{prefix}.{OFFSETS[RESTS.index(field)]}"
            parameters[i] = replace(p, name=name, start=p.start - shift, low=p.low - shift, high=p.high - shift)
        values[at] -= moved
        covariance[np.ix_(at, at)] += spread
        estimates = Estimates.of(parameters, values, covariance)
        bushing = placed(self.bushing, values[at], **hole_of(self.bushing, self.bushing.gap, estimates))
        return replace(self, bushing=bushing, estimates=estimates)

    def widened_by(self, covariance: np.ndarray) -> ForceFit:
        """Return the fit with a further covariance (n, n) added to that of its estimates."""
        e = self.estimates
        return replace(self, estimates=Estimates.of(e.parameters, e.value, e.covariance + covariance))

    @property
    def contact_model(self) -> ContactModel:
        """The fitted contact."""
        return self.law.contact[0]

    @property
    def filling_model(self) -> GreaseModel | Grease:
        """The fitted filling."""
        return self.law.grease[0]

    @property
    def values(self) -> dict[str, float]:
        """All parameters by name, SI: where another fit can start."""
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))


class ForceProblem(Problem):
    """A family's parameters and the residuals of its force, over the errors that laws are expected to have.

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
        self.motion, self.contact, self.filling = motion, contact, filling
        law_parameters = [*contact.parameters(motion.nominal), *filling.parameters(motion.nominal)]
        loss = UnknownScale(motion.blocks, MAX_CORRELATION_LENGTH)
        # All dampings at once, also where laws are followed one by one: along valleys the best of them goes farther.
        super().__init__([*motion.parameters, *law_parameters], self._scaled_residuals, loss=loss)

    def case(self, at: np.ndarray) -> ClearanceWithLaw:
        """Return the clearance and its law at coordinates (n,)."""
        return self._case(self.values(at))

    def _case(self, values: np.ndarray) -> ClearanceWithLaw:
        fields = fields_of([p.name for p in self.parameters], values)
        return case_of(fields, self.motion.nominal, self.contact, self.filling)

    def _scaled_residuals(self, values: np.ndarray) -> np.ndarray:
        residuals = self.motion.residuals([self._case(point) for point in values])[self.motion.fitted].T
        return np.where(np.abs(residuals) < MAX_RESIDUAL, residuals, np.inf)


def fit_force(
    motion: MeasuredMotion, contact: ContactFamily, filling: FillingFamily, starts: Sequence[Mapping[str, float]] = ()
) -> ForceFit:
    """Fit a family at a clearance, from the likeliest of some values by name or, without any, from the priors.

    Parameters
    ----------
    motion : MeasuredMotion
        What laws are compared with.
    contact : ContactFamily
        Family of the contact.
    filling : FillingFamily
        Family of the filling.
    starts : sequence of mapping
        Values by name, SI.
    """
    problem = ForceProblem(motion, contact, filling)
    result = solve(problem, [problem.at(values) for values in starts or ({},)], stop=STOP)
    case, loss = problem.case(result.at), cast(UnknownScale, result.loss)
    parameters = [motion.with_reach(p, case) for p in problem.parameters]
    correlated = max(loss.correlated, motion.shortest_correlation)
    covariance = np.linalg.inv(result.information / correlated + result.prior) * np.outer(problem.unit, problem.unit)
    held_out_residuals = motion.residuals([case])[motion.held_out, 0]
    misfit, held_out = (float(loss.scale(residuals)) ** 0.5 for residuals in (result.residuals, held_out_residuals))
    return ForceFit(
        contact=contact, filling=filling, nominal=motion.nominal, case=case, bushing=case.bushing,
        estimates=Estimates.of(parameters, result.values, covariance), point=result.at, information=result.information,
        loss=loss, losses=loss.losses(result.residuals), size=result.residuals.size,
        correlation_length=loss.correlated, misfit=misfit, held_out=held_out,
    )  # fmt: skip


def steps_on(fit: ForceFit, problem: ForceProblem, others: Sequence[MeasuredMotion]) -> np.ndarray:
    """Return the changes (n_others, n) of a fit, in prior standard deviations, on other rigs.

    One Gauss-Newton step for each.

    Parameters
    ----------
    fit : ForceFit
        The fit.
    problem : ForceProblem
        That it solved.
    others : sequence of MeasuredMotion
        Motions and forces on rigs drawn from the rig's posterior, see `MeasuredMotion.on`.
    """
    linear = problem.linearised(fit.point)
    weighted = linear.jacobian * fit.loss.weights(linear.residuals).curvature[:, None]
    information = weighted.T @ linear.jacobian / fit.correlation_length + np.eye(fit.point.size)
    shifted = [other.residuals([problem.case(fit.point)])[problem.motion.fitted, 0] for other in others]
    changed = np.reshape(shifted, (-1, linear.residuals.size)) - linear.residuals
    return -np.linalg.solve(information, weighted.T @ changed.T / fit.correlation_length).T
