"""The solution of a problem of estimation: bounded, damped Gauss-Newton steps from one or several starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.errors import RecordError
from .estimates import Estimates
from .loss import Loss
from .problem import LinearisedResiduals, Problem

__all__ = ["NoModelError", "Solution", "StoppingCriteria", "solve"]


class NoModelError(RecordError):
    """A search has nowhere to begin: the model diverges at all of its starts."""


DAMPINGS = (0.0, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 50.0)  # times the precision's diagonal (Levenberg, Marquardt)
RETRIES = 6  # damping is increased at most so often, tenfold each time, before a step is given up
RANK = 1e-14  # of the largest eigenvalue of the scaled precision: directions with less are not moved along


@dataclass(frozen=True)
class StoppingCriteria:
    """Rules that end a search; each holds for the step just taken."""

    steps: int = 30
    """largest number of steps"""
    decrease: float = 1e-4
    """relative decrease of the cost at most; negative where linearisations are noisy: it may rise by less"""
    gain: float = 0.0
    """increase of the log-posterior, half of the cost, at most"""
    move: float = 1e-3
    """change of each coordinate at most"""

    def least_fall(self, cost: float) -> float:
        """Return the decrease of a cost by a step that lets the search go on.

        Parameters
        ----------
        cost : float
            Before the step.
        """
        return self.decrease * abs(cost) if self.decrease < 0 else max(self.decrease * abs(cost), 2 * self.gain)


@dataclass(frozen=True, eq=False)
class Solution:
    """End of a search, linearised there."""

    problem: Problem
    """the problem that was solved"""
    at: np.ndarray
    """(n,) coordinates"""
    residuals: np.ndarray
    """(n_residuals,)"""
    jacobian: np.ndarray
    """(n_residuals, n) by coordinates"""
    loss: Loss
    """of the residuals, adapted to them"""
    cost: float
    """minimum of the objective: loss and squared distances from priors"""
    evaluations: int
    """points that the search took, from this start"""
    others: tuple[Solution, ...] = field(default=(), repr=False)
    """of the other starts that were searched from, best first"""

    @property
    def values(self) -> np.ndarray:
        """(n,) SI units."""
        return self.problem.values(self.at)

    @property
    def rows(self) -> np.ndarray:
        """(n_residuals, n) Jacobian times the root of the loss's curvature."""
        return self.jacobian * np.sqrt(self.loss.weights(self.residuals).curvature)[:, None]

    @property
    def scores(self) -> np.ndarray:
        """(n_residuals, n) contribution of each residual to half of the loss's gradient."""
        return self.jacobian * (self.loss.weights(self.residuals).score * self.residuals)[:, None]

    @property
    def information(self) -> np.ndarray:
        """(n, n) of the data as if residuals were independent, in coordinates, without the priors."""
        return _information(self.jacobian, self.loss.weights(self.residuals).curvature)

    @property
    def prior(self) -> np.ndarray:
        """(n, n) information of the priors, in coordinates."""
        return np.diag(self.problem.known.astype(float))

    @property
    def covariance(self) -> np.ndarray:
        """(n, n) of the posterior, in coordinates, for residuals of unit variance."""
        return np.linalg.inv(self.information / self.loss.divisor + self.prior)

    @property
    def at_bound(self) -> np.ndarray:
        """(n,) bool: ended at a bound."""
        return (self.at <= self.problem.low) | (self.at >= self.problem.high)

    def estimates(self, covariance: np.ndarray) -> Estimates:
        """Return values with a covariance (n, n) that is given in coordinates.

        Parameters
        ----------
        covariance : ndarray, shape (n, n)
            Covariance of the coordinates.
        """
        unit = self.problem.unit
        return Estimates.of(self.problem.parameters, self.values, covariance * np.outer(unit, unit))


def solve(
    problem: Problem, starts: Sequence[np.ndarray] | np.ndarray | None = None, *, n_best: int = 1,
    stop: StoppingCriteria | None = None, dampings: Sequence[float] = DAMPINGS, longest: float = np.inf,
) -> Solution:  # fmt: skip
    """Find the parameters of least cost, within their bounds.

    Steps are those of Gauss and Newton, damped by multiples of the precision's diagonal (Levenberg; Marquardt). With
    lanes, all dampings are tried at once and the best is kept; else one after another until the cost falls, beginning
    a little below the last that served. A parameter at a bound that the gradient points beyond stays there.

    Parameters
    ----------
    problem : Problem
        The problem to solve.
    starts : sequence of ndarray (n,), optional
        Coordinates. Default: the parameters' starts.
    n_best : int
        Number of starts, those of least cost, from which a search is made.
    stop : Stop, optional
        Rules that end a search.
    dampings : sequence of float
        Multiples of the diagonal, rising.
    longest : float
        Coordinates by which a step moves each parameter at most.

    Returns
    -------
    Solution
        The best.

    Raises
    ------
    NoModelError
        If the residuals are finite at none of the starts.
    """
    points = problem.inside(np.atleast_2d(np.zeros(problem.size) if starts is None else np.asarray(starts)))
    evaluations_before = problem.evaluations
    if problem.linearise is not None and len(points) == 1:
        order, residuals = np.zeros(1, dtype=int), None
    else:
        residuals = problem.residuals(points)
        costs = problem.cost(points, residuals)
        if not np.isfinite(costs).any():
            names = ", ".join(p.name for p in problem.parameters)
            raise NoModelError(f"there is no model where the search for {names} begins")
        order = np.argsort(costs, kind="stable")[:n_best]
        order = order[np.isfinite(costs[order])]
    compared, ends = problem.evaluations - evaluations_before, []
    for i in order:
        search = _Search(problem, stop or StoppingCriteria(), tuple(dampings), longest)
        ends.append(search.run(points[i], None if residuals is None else residuals[i], compared))
    ends.sort(key=lambda s: s.cost)
    return replace(ends[0], others=tuple(ends[1:]))


class _Search:
    """One search from one start."""

    def __init__(self, problem: Problem, stop: StoppingCriteria, dampings: tuple[float, ...], longest: float) -> None:
        self.problem, self.stop, self.longest, self.lanes = problem, stop, longest, problem.lanes
        stronger = () if self.lanes else tuple(dampings[-1] * 10.0**i for i in range(1, RETRIES + 1))
        self.dampings = (*dampings, *stronger)
        self.first = 0
        """number of the damping to begin with, where one is tried after another"""

    def run(self, at: np.ndarray, residuals: np.ndarray | None, compared: int) -> Solution:
        problem, evaluations_before, stop = self.problem, self.problem.evaluations, self.stop
        self._move_to(at, problem.linearised(at, residuals))
        for _ in range(stop.steps):
            before, least_fall = self.at, stop.least_fall(self.cost)
            if not self._step() > least_fall or np.max(np.abs(self.at - before), initial=0.0) <= stop.move:
                break
        evaluations = problem.evaluations - evaluations_before + compared
        return Solution(problem, self.at, self.residuals, self.jacobian, self.loss, self.cost, evaluations)

    def _move_to(self, at: np.ndarray, linearised: LinearisedResiduals) -> None:
        """Move to a point and linearise there."""
        self.at, (self.residuals, self.jacobian) = at, linearised
        self.loss = self.problem.loss.adapted(self.residuals, self.jacobian)
        self.cost = self._cost(at, self.residuals)

    def _cost(self, at: np.ndarray, residuals: np.ndarray) -> float:
        return float(self.problem.cost(at[None], residuals[None], self.loss)[0])

    def _step(self) -> float:
        """Move to a point of lower cost, if there is one, and return the decrease; else at most 0."""
        points = self._damped_points()
        if self.lanes:
            rows = self.problem.residuals(points)
            costs = self.problem.cost(points, rows, self.loss)
            i = int(np.argmin(costs))
            return self._try_at(points[i], rows[i], float(costs[i]))
        for i in range(self.first, len(points)):
            if np.max(np.abs(points[i] - self.at), initial=0.0) <= self.stop.move * (i > self.first):
                return 0.0
            rows = self.problem.residuals(points[i : i + 1])
            if (fall := self._try_at(points[i], rows[0], float(self.problem.cost(points[i], rows, self.loss)[0]))) > 0:
                self.first = max(i - 1, 0)
                return fall
        return 0.0

    def _try_at(self, at: np.ndarray, residuals: np.ndarray, cost: float) -> float:
        """Move to a point if its cost is lower, and return the decrease."""
        if self.problem.linearise is None:
            if (fall := self.cost - cost) > 0:
                self._move_to(at, self.problem.linearised(at, residuals))
            return fall
        # Residuals of a problem's linearisation may be means, with which those of a single point do not compare.
        if not np.isfinite(cost):
            return -np.inf
        linearised = self.problem.linearised(at)
        fall = self.cost - self._cost(at, linearised.residuals)
        if fall > min(0.0, self.stop.least_fall(self.cost)):
            self._move_to(at, linearised)
        return fall

    def _damped_points(self) -> np.ndarray:
        """Return the points (n_dampings, n) after damped steps, the least damped first, within the bounds."""
        problem, at, weights = self.problem, self.at, self.loss.weights(self.residuals)
        divisor = self.loss.divisor
        gradient = (self.jacobian.conj().T @ (weights.score * self.residuals)).real / divisor + problem.known * at
        precision = _information(self.jacobian, weights.curvature) / divisor + np.diag(problem.known.astype(float))
        free = ~((at <= problem.low) & (gradient > 0) | (at >= problem.high) & (gradient < 0))
        scale = np.sqrt(np.diag(precision)[free])
        scale = np.where(scale > 0, scale, 1.0)
        value, vector = np.linalg.eigh(precision[np.ix_(free, free)] / np.outer(scale, scale))
        along = vector.T @ (gradient[free] / scale)
        regular = value > RANK * value[-1] if value.size else value > 0
        points = np.tile(at, (len(self.dampings), 1))
        for point, damping in zip(points, self.dampings):
            step = vector @ np.where(regular, along / np.where(regular, value + damping, 1.0), 0.0) / scale
            point[free] -= step * min(1.0, self.longest / max(np.max(np.abs(step), initial=0.0), 1e-300))
        return problem.inside(points)


def _information(jacobian: np.ndarray, curvature: np.ndarray) -> np.ndarray:
    return np.asarray(((jacobian.conj().T * curvature) @ jacobian).real)
