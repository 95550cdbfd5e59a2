"""Estimation of the progress and rate of wear from a history of the gap.

A life predicted with some coefficient of wear gives the gap over its hours, G(H). With another coefficient the machine
passes the same gaps at another rate, dH/dt = κ, the coefficient over that of the prediction. So a history determines H
and κ: gaps g_i = G(H(t_i)) + errors. The logarithm of κ is not quite constant, as materials, load and lubricant are
not: it is a random walk, with a standard deviation σ over a time as long as the history. H(0), log κ(0) and the walk's
steps are fitted by weighted least squares; σ is integrated over a grid, each value with the evidence of the history
(Laplace) and a half-normal prior; errors that were given too small are scaled up by the misfit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

__all__ = ["HORIZON", "PaceSamples", "fit_wear_rate"]

Curve: TypeAlias = Callable[[np.ndarray], np.ndarray]

MOST_POINTS = 60  # of a history; more are averaged in groups
DRIFTS = np.array([0.1, 0.25, 0.5, 1.0, 1.5, 2.0])  # of σ over its prior's scale
STEPS, HORIZON = 60, 100.0  # steps of the walk over a history's length, and largest prediction in such lengths


@dataclass(frozen=True)
class PaceSamples:
    """Posterior of the wear at a history's end: samples of equal weight."""

    worn: np.ndarray
    """(m,) H, hours of the predicted life"""
    log_pace: np.ndarray
    """(m,) log κ"""
    drift: np.ndarray
    """(m,) σ of log κ over a time as long as the history"""
    span: float
    """h, the history's length"""
    misfit: float
    """RMS of the history's residuals, over its errors"""
    log_evidence: float
    """logarithm of the evidence of the history for the predicted life, up to a constant"""

    def hours_to(self, worn: float, rng: np.random.Generator) -> np.ndarray:
        """Return the hours (m,) to an amount of wear, with the random walk continued; infinite beyond the horizon.

        Parameters
        ----------
        worn : float
            H, hours of the predicted life.
        rng : Generator
            Random numbers of the walks.
        """
        step = self.span / STEPS
        now, pace, hours = self.worn.copy(), self.log_pace.copy(), np.full(self.worn.size, np.inf)
        hours[now >= worn] = 0.0
        time = 0.0
        while np.isinf(hours).any() and time < HORIZON * self.span:
            after = pace + self.drift * np.sqrt(step / self.span) * rng.standard_normal(pace.size)
            moved = step * (np.exp(pace) + np.exp(after)) / 2
            crosses = np.isinf(hours) & (now + moved >= worn)
            hours[crosses] = time + step * (worn - now[crosses]) / moved[crosses]
            now, pace, time = now + moved, after, time + step
            step = max(step, time / STEPS)
        return hours


def fit_wear_rate(
    hours: np.ndarray, gap: np.ndarray, std: np.ndarray, gap_of: Curve, slope_of: Curve, start: float,
    prior: tuple[float, float], drift: float, n: int, rng: np.random.Generator,
) -> PaceSamples:  # fmt: skip
    """Estimate the wear at the end of a history, and its rate.

    Parameters
    ----------
    hours, gap, std : ndarray, shape (m,)
        The history: h, m and m.
    gap_of, slope_of : callable
        G and its derivative, m and m/h, at hours of the predicted life, beyond both ends too.
    start : float
        Approximate H of the first gap.
    prior : tuple of float
        Mean and standard deviation of log κ before any history; infinite if it is not known.
    drift : float
        Scale of the prior of σ.
    n : int
        Number of samples.
    rng : Generator
        Random numbers.
    """
    hours, gap, std = _average_groups(hours, gap, std)
    span = float(hours[-1] - hours[0])
    pieces = np.diff(hours)
    fits: list[tuple[float, _Problem, OptimizeResult]] = []
    for sigma in drift * DRIFTS:
        problem = _Problem(pieces, gap, std, gap_of, slope_of, sigma * np.sqrt(pieces / span), prior)
        starts = problem.starts(start)
        if fits:  # the walk of the narrower prior, in this one's steps
            starts = [np.append(fits[-1][2].x[:2], fits[-1][2].x[2:] * fits[-1][0] / sigma)]
        fits.append((sigma, problem, problem.solve(starts)))
    best = min(fits, key=lambda each: each[2].cost)
    misfit = float(np.sqrt(np.mean(best[2].fun[: gap.size] ** 2)))
    error_scale = max(1.0, float(np.sqrt(np.sum(best[2].fun[: gap.size] ** 2) / max(gap.size - 2, 1))))
    log_weights = np.array([_log_evidence(s, error_scale) - 0.5 * (sigma / drift) ** 2 for sigma, _, s in fits])
    weights = np.exp(log_weights - log_weights.max()) * np.gradient(drift * DRIFTS)
    evidence = float(log_weights.max() + np.log(weights.sum()) - gap.size * np.log(error_scale))
    counts = rng.multinomial(n, weights / weights.sum())
    parts = [problem.samples(s, error_scale, count, rng) for (_, problem, s), count in zip(fits, counts)]
    worn, pace = np.concatenate(parts, axis=1)
    return PaceSamples(worn, pace, np.repeat(drift * DRIFTS, counts), span, misfit, evidence)


def _average_groups(*columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Average hours, gaps and errors in groups, with weights."""
    hours, gap, std = columns
    if hours.size <= MOST_POINTS:
        return hours, gap, std
    groups = np.array_split(np.arange(hours.size), MOST_POINTS)
    weights = [1 / std[g] ** 2 for g in groups]
    means = [[np.average(c[g], weights=w) for g, w in zip(groups, weights)] for c in (hours, gap)]
    return np.array(means[0]), np.array(means[1]), np.array([1 / np.sqrt(w.sum()) for w in weights])


class _Problem:
    """Least-squares problem in H(0), log κ(0) and the walk's standardised steps."""

    def __init__(
        self, pieces: np.ndarray, gap: np.ndarray, std: np.ndarray, gap_of: Curve, slope_of: Curve, walk: np.ndarray,
        prior: tuple[float, float],
    ):  # fmt: skip
        self.pieces, self.gap, self.std, self.walk, self.prior = pieces, gap, std, walk, prior
        self.gap_of, self.slope_of = gap_of, slope_of

    def worn(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return H and log κ (m,) at the times of the history."""
        pace = p[1] + np.concatenate(([0.0], np.cumsum(self.walk * p[2:])))
        speed = np.exp(np.clip(pace, -50.0, 50.0))
        return p[0] + np.concatenate(([0.0], np.cumsum(self.pieces * (speed[1:] + speed[:-1]) / 2))), pace

    def residuals(self, p: np.ndarray) -> np.ndarray:
        """Return the residuals: of the gaps, of the walk, of the prior."""
        worn, _ = self.worn(p)
        centre, spread = self.prior
        of_prior = [(p[1] - centre) / spread] if np.isfinite(spread) else []
        return np.concatenate(((self.gap_of(worn) - self.gap) / self.std, p[2:], of_prior))

    def jacobian(self, p: np.ndarray) -> np.ndarray:
        """Return the derivatives of the residuals."""
        m = self.gap.size
        worn, pace = self.worn(p)
        speed = np.exp(np.clip(pace, -50.0, 50.0))
        of_log = np.column_stack((np.zeros(m), np.ones(m), np.tri(m, m - 1, -1) * self.walk))  # of log κ
        of_speed = speed[:, None] * of_log
        of_worn = np.zeros((m, p.size))
        of_worn[1:] = np.cumsum(self.pieces[:, None] * (of_speed[1:] + of_speed[:-1]) / 2, axis=0)
        of_worn[:, 0] = 1.0
        rows = [(self.slope_of(worn) / self.std)[:, None] * of_worn, np.eye(p.size)[2:]]
        if np.isfinite(self.prior[1]):
            rows.append(np.eye(p.size)[1:2] / self.prior[1])
        return np.vstack(rows)

    def starts(self, start: float) -> list[np.ndarray]:
        """Return initial guesses of steady rates: that of the history's straight line, and slower and faster ones."""
        span = self.pieces.sum()
        slope = np.polyfit(np.concatenate(([0.0], np.cumsum(self.pieces))), self.gap, 1)[0]
        predicted = float(np.mean(self.slope_of(np.array([start, start + 1e-3 * span]))))
        first = np.log(max(slope, 1e-3 * self.std.mean() / span) / max(predicted, 1e-300))
        steady = np.zeros(self.pieces.size)
        return [np.concatenate(([start, log], steady)) for log in (first, first - 1.0, first + 1.0)]

    def solve(self, starts: list[np.ndarray]) -> OptimizeResult:
        """Return the best of the solutions from several starts."""
        fits = [least_squares(self.residuals, p, self.jacobian, x_scale="jac", max_nfev=200) for p in starts]
        return min(fits, key=lambda each: each.cost)

    def samples(self, solution: OptimizeResult, error_scale: float, n: int, rng: np.random.Generator) -> np.ndarray:
        """Draw samples of H and log κ (2, n) at the end."""
        jacobian = solution.jac.copy()
        jacobian[: self.gap.size] /= error_scale
        _, singular, rows = np.linalg.svd(jacobian, full_matrices=False)
        drawn = solution.x + (rng.standard_normal((n, singular.size)) / np.maximum(singular, 1e-12)) @ rows
        return np.array([[part[-1] for part in self.worn(p)] for p in drawn]).reshape(n, 2).T


def _log_evidence(solution: OptimizeResult, error_scale: float) -> float:
    """Return the logarithm of the evidence of a solution, up to a constant."""
    return float(-solution.cost / error_scale**2 - 0.5 * np.linalg.slogdet(solution.jac.T @ solution.jac)[1])
