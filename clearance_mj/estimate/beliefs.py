"""Recursive estimation: a belief about parameters, refined window by window of a record or a drive.

A belief is a mean and a covariance. A window of data refines it by Gauss-Newton on the window's residuals together with
the distance from the belief (moving horizon estimation with the belief as arrival cost; Rao, Rawlings and Mayne, IEEE
Transactions on Automatic Control 48, 2003). Everything is done in standard deviations of the belief along its principal
axes, so that no unit or correlation matters and a difference quotient reaches over a stated part of the uncertainty
(Arasaratnam and Haykin, IEEE Transactions on Automatic Control 54, 2009): a model with kinks, as every clearance is,
has no derivative worth the name. Between windows `Belief.through` carries states onwards and `Belief.drifted` widens
the belief as a random walk does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from ..core.errors import RecordError
from .covariance import correlated_observations
from .estimates import Estimates
from .parameter import Parameter

__all__ = ["Belief", "Refinement", "refine"]

Function = Callable[[np.ndarray], np.ndarray]
"""Function from points (n_points, n) to values (n_points, n_values), all points at once"""
REACH = 0.2  # standard deviations of the belief, over which differences are taken
MAX_STEPS = 8  # of Gauss and Newton
STEP_TOLERANCE = 0.05  # standard deviations of the result: a fit ends with a shorter step
HALVINGS = 6  # at most, of a step that makes the fit worse


@dataclass(frozen=True, eq=False)
class Belief:
    """A normal distribution of parameters and states, in what varies of them."""

    mean: np.ndarray
    """(n,)"""
    covariance: np.ndarray
    """(n, n)"""

    def __post_init__(self) -> None:
        mean, covariance = np.array(self.mean, dtype=float), np.array(self.covariance, dtype=float)
        if mean.ndim != 1 or covariance.shape != (mean.size, mean.size):
            raise RecordError(f"a belief has a mean (n,) and a covariance (n, n), got {mean.shape}, {covariance.shape}")
        if not (np.isfinite(mean).all() and np.isfinite(covariance).all() and (np.diag(covariance) >= 0).all()):
            raise RecordError("a belief's mean and covariance must be finite, its variances not negative")
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "covariance", (covariance + covariance.T) / 2)

    @classmethod
    def of(cls, parameters: Sequence[Parameter]) -> Belief:
        """Return the belief about parameters before any data: their starts and prior standard deviations.

        Parameters
        ----------
        parameters : sequence of Parameter
            In the order of the belief's entries.
        """
        return cls.independent([p.to_varied(p.start) for p in parameters], [p.known_std for p in parameters])

    @classmethod
    def independent(cls, mean: ArrayLike, std: ArrayLike) -> Belief:
        """Return a belief of independent entries with means (n,) and standard deviations (n,).

        Parameters
        ----------
        mean : array_like, shape (n,)
            Means of the entries.
        std : array_like, shape (n,)
            Standard deviations of the entries.
        """
        return cls(np.asarray(mean, dtype=float), np.diag(np.square(np.asarray(std, dtype=float))))

    @property
    def std(self) -> np.ndarray:
        """(n,) standard deviations."""
        return np.sqrt(np.diag(self.covariance))

    def part(self, which: slice | Sequence[int]) -> Belief:
        """Return the belief about some of the entries.

        Parameters
        ----------
        which : slice or sequence of int
            Entries that are kept.
        """
        return Belief(self.mean[which], self.covariance[which][:, which])

    def joined(self, other: Belief) -> Belief:
        """Return a belief about both, ``other`` after this one, independent of each other.

        Parameters
        ----------
        other : Belief
            The entries that follow those of this one.
        """
        covariance = scipy.linalg.block_diag(self.covariance, other.covariance)
        return Belief(np.concatenate((self.mean, other.mean)), covariance)

    def drifted(self, std: ArrayLike) -> Belief:
        """Return the belief after a step of a random walk with standard deviations (n,).

        Parameters
        ----------
        std : array_like, shape (n,)
            Standard deviations of the step.
        """
        return Belief(self.mean, self.covariance + np.diag(np.square(np.broadcast_to(std, self.mean.shape))))

    def through(self, function: Function) -> Belief:
        """Return the belief about a function's values, linearised over `REACH` standard deviations.

        Parameters
        ----------
        function : callable
            From points (n_points, n) to values (n_points, m).

        Returns
        -------
        Belief
            About the m values: mean at this mean, covariance to first order.
        """
        mean, slope = _differences(function, self.mean, _axes(self.covariance))
        return Belief(mean, slope @ slope.T)

    def estimates(self, parameters: Sequence[Parameter]) -> Estimates:
        """Return values, SI units, and covariance of the first entries, which are these parameters.

        Parameters
        ----------
        parameters : sequence of Parameter
            Those of the first entries.
        """
        part = self.part(slice(len(parameters)))
        entries = zip(parameters, part.mean)
        value = [p.from_varied(np.clip(v, p.to_varied(p.low), p.to_varied(p.high))) for p, v in entries]
        return Estimates.of(parameters, value, part.covariance)


@dataclass(frozen=True, eq=False)
class Refinement:
    """A belief that a window of data has refined."""

    belief: Belief
    """after the window"""
    residuals: np.ndarray
    """(n_residuals,) at its mean"""
    innovation: float
    """squared distance of the window's data from their prediction by the belief before, in standard deviations of noise
    and belief together: chi-squared with n_residuals degrees of freedom where the model holds"""
    steps: int
    """Gauss-Newton steps taken"""
    widening: float
    """factor on the standard deviations that the data alone give, for correlated residuals"""


def refine(belief: Belief, residuals: Function, block: int | None = None) -> Refinement:
    """Refine a belief by a window of data: the most probable point, and the covariance about it.

    Minimises |r(x)|² + (x - m)ᵀ P⁻¹ (x - m) by Gauss-Newton with step halving; the covariance is
    (P⁻¹ + JᵀJ/w²)⁻¹. w = 1 is for independent residuals of unit variance. If they are correlated or larger because the
    model misses something, the window holds less information than it seems to: w² = tr((JᵀJ)⁻¹ V)/n, V from the scores
    Jᵀr of blocks of residuals (`correlated_observations`), and the fit is repeated with residuals over w.

    Parameters
    ----------
    belief : Belief
        Mean m (n,) and covariance P (n, n) before.
    residuals : callable
        From points (n_points, n) to residuals (n_points, n_residuals) in standard deviations of the noise.
    block : int, optional
        Number of successive residuals that may be correlated; without it w = 1.

    Returns
    -------
    Refinement

    Raises
    ------
    RecordError
        Residuals at the belief's mean are not finite, or a block is longer than half of them.
    """
    axes = _axes(belief.covariance)
    start = np.zeros(axes.shape[1]), *_differences(residuals, belief.mean, axes)
    if not np.isfinite(start[1]).all():
        raise RecordError(
            "the residuals of a window are not finite where its belief begins: the data have gaps, or the model fails"
        )
    z, errors, slope, steps = _fit(belief.mean, axes, residuals, 1.0, *start)
    innovation = _innovation(errors - slope @ z, slope)
    widening = 1.0 if block is None else _widening(errors, slope, block)
    if widening > 1.0:
        z, errors, slope, further_steps = _fit(belief.mean, axes, residuals, widening, z, errors, slope)
        steps += further_steps
    information = np.eye(z.size) + slope.T @ slope / widening**2
    spread = axes @ np.linalg.inv(information) @ axes.T
    return Refinement(Belief(belief.mean + axes @ z, spread), errors, innovation, steps, widening)


def _axes(covariance: np.ndarray) -> np.ndarray:
    """Principal axes (n, n_axes) of a covariance, one standard deviation long; none where nothing varies."""
    scale = np.sqrt(np.diag(covariance))
    scale = np.where(scale > 0, scale, 1.0)
    value, vector = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = value > 1e-14 * max(value[-1], 1e-300)
    return np.asarray(scale[:, None] * vector[:, keep] * np.sqrt(value[keep]))


def _differences(function: Function, at: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (m,) at a point, and their central differences (m, n_axes) along axes, per standard deviation."""
    n = axes.shape[1]
    values = function(np.vstack((at, at + REACH * axes.T, at - REACH * axes.T)))
    return values[0], (values[1 : n + 1] - values[n + 1 :]).T / (2 * REACH)


def _fit(
    mean: np.ndarray, axes: np.ndarray, residuals: Function, width: float, z: np.ndarray, errors: np.ndarray,
    slope: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:  # fmt: skip
    """Return the most probable point along the axes, its residuals and their slopes, and the number of steps."""
    steps = 0
    for steps in range(1, MAX_STEPS + 1):
        slope = np.where(np.isfinite(slope).all(axis=0), slope, 0.0)
        information = np.eye(z.size) + slope.T @ slope / width**2
        step = -np.linalg.solve(information, z + slope.T @ errors / width**2)
        cost = errors @ errors / width**2 + z @ z
        for halving in range(HALVINGS + 1):
            point = z + step / 2**halving
            new_errors = residuals((mean + axes @ point)[None])[0]
            if new_errors @ new_errors / width**2 + point @ point <= cost:
                break
        else:
            return z, errors, slope, steps
        z, errors = point, new_errors
        if step @ information @ step < STEP_TOLERANCE**2 * z.size:
            break
        errors, slope = _differences(residuals, mean + axes @ z, axes)
    return z, errors, slope, steps


def _innovation(expected: np.ndarray, slope: np.ndarray) -> float:
    """Return the squared length of residuals in standard deviations of I + J Jᵀ, by the matrix inversion lemma."""
    score = slope.T @ expected
    return float(expected @ expected - score @ np.linalg.solve(np.eye(score.size) + slope.T @ slope, score))


def _widening(residuals: np.ndarray, slope: np.ndarray, block: int) -> float:
    """Return the factor on standard deviations over those of independent residuals of unit variance."""
    if not 1 <= block <= residuals.size // 2:
        raise RecordError(f"blocks of {block} residuals: at least two of them must lie in a window of {residuals.size}")
    scores = np.add.reduceat(slope * residuals[:, None], np.arange(0, residuals.size, block))
    information = slope.T @ slope
    # Of directions with less information than the belief has, the window says nothing.
    informed = int(np.count_nonzero(np.linalg.eigvalsh(information) > 1.0))
    # Slopes that the fit has used up leave smaller residuals.
    freedom = max(residuals.size - informed, 1) / residuals.size
    return float(np.sqrt(max(correlated_observations(scores, information, least=1.0) / freedom, 1.0)))
