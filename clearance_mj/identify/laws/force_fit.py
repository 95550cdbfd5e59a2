"""Laws fitted to the restoring force of a bushing: gap, offset, contact and filling.

The motion is measured, so nothing is simulated and impacts are not chaotic: a law's force along the measured motion is
compared with the restoring force instant by instant, its errors of unknown size. They are correlated in time, so that
many samples count as one independent observation: how many shows in the scores of the likelihood over blocks, which
would be as large as the information says if errors were independent (Ribatet, Cooley and Davison, Bayesian inference
from composite likelihoods, Statistica Sinica 22, 2012).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...clearance import ContactLaw
from ...clearance.contact import ContactModel
from ...clearance.family import ContactFamily, FillingFamily
from ...clearance.grease import GreaseModel
from ...estimate.estimates import Estimates
from ...rig import Bushing, Grease
from .measured_motion import MeasuredMotion

__all__ = ["ForceFit", "ForceProblem", "fit_force"]

DIFFERENCE = 1e-3  # prior standard deviations, step of difference quotients
FARTHEST_OFFSET = 0.95  # of the gap: the shaft at rest touches neither wall
DAMPINGS = (0.0, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 50.0)  # Levenberg's and Marquardt's, all tried at once in lanes
SMALLEST_GAIN = 0.2  # of the log-posterior, below which a fit ends
MAX_STEPS = 24
MAX_RESIDUAL = 1e6  # of the expected error: a law that diverges misses no more
MAX_CORRELATION_LENGTH = 10.0  # samples, on the way: far from the optimum all errors are correlated
KNOWN_INFORMATION = 1e-6  # of the largest: directions with less are unknown


@dataclass(frozen=True, eq=False)
class ForceFit:
    """One family of contact and filling at one bushing."""

    contact: ContactFamily  #: family of the contact
    filling: FillingFamily  #: family of the filling
    nominal: Bushing  #: the bushing as the rig file has it
    law: ContactLaw  #: of this bushing
    bushing: Bushing  #: with the gap and offset found
    estimates: Estimates  #: of gap and offset, where the rig file leaves them open, then of contact and filling
    point: np.ndarray  #: (n,) values in prior standard deviations from their starts
    information: np.ndarray  #: (n, n) of `point`, as if errors were independent, without the priors
    size: int  #: samples that were fitted
    correlation_length: float  #: samples that count as one independent observation
    misfit: float  #: of the force, over the error that a law is expected to have: robust mean over what was fitted
    held_out: float  #: the same over what was not

    def log_evidence(self, correlation_length: float) -> float:
        """Return the logarithm of the probability of the records given the family, but for a constant of the bushing.

        In Laplace's approximation, with the size of the errors integrated out.

        Parameters
        ----------
        correlation_length : float
            Samples that count as one independent observation, the same for all families that are compared.
        """
        precision = self.information / correlation_length + np.eye(self.point.size)
        data = self.size / correlation_length * np.log(self.misfit**2)
        return float(-0.5 * (data + self.point @ self.point + np.linalg.slogdet(precision)[1]))

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


class ForceProblem:
    """Posterior of a family's parameters, in prior standard deviations from where they start.

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
        own = [*contact.parameters(motion.nominal), *filling.parameters(motion.nominal)]
        self.parameters = [*motion.gap_parameters, *own]
        self.origin = np.array([p.to_varied(p.start) for p in self.parameters])
        self.width = np.array([p.prior_std for p in self.parameters])
        ends = np.array([[p.to_varied(p.low), p.to_varied(p.high)] for p in self.parameters])
        self.low, self.high = ((ends - self.origin[:, None]) / self.width[:, None]).T

    def values(self, point: np.ndarray) -> list[float]:
        """Return the parameters' values, SI, at a point (n,)."""
        varied = self.origin + self.width * point
        return [float(np.clip(p.from_varied(v), p.low, p.high)) for p, v in zip(self.parameters, varied)]

    def point(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the point (n,) of values by name; those that are not given are at their priors."""
        inside = [np.clip(values.get(p.name, p.start), p.low, p.high) for p in self.parameters]
        return (np.array([p.to_varied(float(v)) for p, v in zip(self.parameters, inside)]) - self.origin) / self.width

    def law(self, point: np.ndarray) -> tuple[Bushing, ContactLaw]:
        """Return bushing and law at a point (n,)."""
        nominal, names = self.motion.nominal, [p.name for p in self.parameters]
        return _bushing_and_law(self.values(point), names, nominal, nominal, self.contact, self.filling)

    def residuals(self, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
        """Return the residuals (n_fitted, n_points) at points, over the error that laws are expected to have."""
        found = self.motion.residuals([self.law(point) for point in points])[self.motion.fitted]
        return np.clip(np.nan_to_num(found, nan=MAX_RESIDUAL), -MAX_RESIDUAL, MAX_RESIDUAL)

    def log_posterior(
        self, points: Sequence[np.ndarray], residuals: np.ndarray, correlation_length: float
    ) -> np.ndarray:
        """Return the logarithm of the posterior (n_points,), but for a constant."""
        data = len(residuals) / correlation_length * np.log(_mean_loss(residuals))
        return -0.5 * (data + np.sum(np.square(points), axis=1))

    def jacobian(self, point: np.ndarray, residuals: np.ndarray) -> np.ndarray:
        """Return the slopes (n_fitted, n) of the residuals at a point; zeros where a step meets a law that diverges."""
        steps = np.where(point + DIFFERENCE > self.high, -DIFFERENCE, DIFFERENCE)
        moved = self.residuals(point + np.diag(steps))
        return np.where(np.abs(moved).max(axis=0) < MAX_RESIDUAL, (moved - residuals[:, None]) / steps, 0.0)

    def score_and_information(
        self, jacobian: np.ndarray, residuals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return score (n,), information (n, n) and correlation length in samples, without the priors."""
        size = _mean_loss(residuals)
        weighted = jacobian / np.sqrt(1 + residuals**2)[:, None]
        scores = weighted * (residuals / size)[:, None]
        information = weighted.T @ jacobian / size
        found, direction = np.linalg.eigh(information)
        known = found > KNOWN_INFORMATION * found[-1]
        of_blocks = np.add.reduceat(scores @ direction[:, known], self.motion.blocks, axis=0)
        length = np.mean(np.sum(of_blocks**2, axis=0) / found[known]) if known.any() else 0.0
        return scores.sum(axis=0), information, max(1.0, float(length))

    def steps(self, point: np.ndarray, gradient: np.ndarray, precision: np.ndarray) -> list[np.ndarray]:
        """Return points to go to, Gauss and Newton's first; what is at a bound and would pass it stays there."""
        free = ~((point <= self.low) & (gradient > 0) | (point >= self.high) & (gradient < 0))
        points = np.tile(point, (len(DAMPINGS), 1))
        for to, damping in zip(points, DAMPINGS):
            damped = precision + damping * np.diag(np.diag(precision))
            to[free] -= np.linalg.solve(damped[np.ix_(free, free)], gradient[free])
        return list(np.clip(points, self.low, self.high))

    def solve(self, starts: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Return where the fit from the likeliest start ends, residuals there, information and correlation length."""
        starts = [np.clip(start, self.low, self.high) for start in starts]
        found, gain = self.residuals(starts), np.inf
        i = int(np.argmax(self.log_posterior(starts, found, len(found) / self.motion.blocks.size)))
        point, residuals = starts[i], found[:, i]
        for _ in range(MAX_STEPS):
            score, information, length = self.score_and_information(self.jacobian(point, residuals), residuals)
            if gain < SMALLEST_GAIN:
                break
            counted = min(length, MAX_CORRELATION_LENGTH)
            points = self.steps(point, score / counted + point, information / counted + np.eye(point.size))
            found = self.residuals(points)
            after = self.log_posterior(points, found, counted)
            i = int(np.argmax(after))
            gain = after[i] - self.log_posterior([point], residuals[:, None], counted)[0]
            if not gain > 0:
                break
            point, residuals = points[i], found[:, i]
        return point, residuals, information, length


def fit_force(
    motion: MeasuredMotion, contact: ContactFamily, filling: FillingFamily, starts: Sequence[Mapping[str, float]] = ()
) -> ForceFit:
    """Fit a family at a bushing, from the likeliest of some values by name or, without any, from the priors."""
    problem = ForceProblem(motion, contact, filling)
    point, residuals, information, length = problem.solve([problem.point(values) for values in (*starts, {})])
    bushing, law = problem.law(point)
    parameters = [motion.with_reach(p, bushing) for p in problem.parameters]
    covariance = np.linalg.inv(information / length + np.eye(point.size)) * np.outer(problem.width, problem.width)
    held_out = motion.residuals([(bushing, law)])[motion.held_out, 0]
    return ForceFit(
        contact, filling, motion.nominal, law, bushing,
        Estimates.of(parameters, problem.values(point), covariance), point, information, residuals.size, length,
        float(_mean_loss(residuals)) ** 0.5, float(_mean_loss(held_out)) ** 0.5,
    )  # fmt: skip


def _mean_loss(residuals: np.ndarray) -> np.ndarray:
    """Mean of the soft L1 loss of residuals (n, ...): squares, but of what is far off the size."""
    return np.mean(2 * (np.sqrt(1 + residuals**2) - 1), axis=0)


def _bushing_and_law(
    values: Sequence[float] | np.ndarray, names: Sequence[str], nominal: Bushing, bushing: Bushing,
    contact: ContactFamily, filling: FillingFamily,
) -> tuple[Bushing, ContactLaw]:  # fmt: skip
    """Bushing with another gap, and another offset short of the wall, and the law of values by their names."""
    known = {n.rpartition(".")[2]: float(v) for n, v in zip(names, values) if n.startswith("bushings[")}
    gap, offset = known.get("gap", bushing.gap), known.get("offset", bushing.offset)
    offset = float(np.clip(offset, -FARTHEST_OFFSET * gap, FARTHEST_OFFSET * gap))
    own, n = [float(v) for v in values[len(known) :]], len(contact.parameters(nominal))
    law = ContactLaw(contact.make(nominal, *own[:n]), filling.make(nominal, *own[n:]))
    return dataclasses.replace(bushing, gap=gap, offset=offset), law
