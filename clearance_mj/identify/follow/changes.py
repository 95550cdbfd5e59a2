"""Changes of parameters between windows of a record: a generalised likelihood ratio test of before against after.

A window's observation of parameters x is kept as a normal likelihood in information form, Λ and η = Λ y. For every
window at which a change may have begun, the mean of the windows after it is compared with that before, each with its
covariance (Willsky and Jones, IEEE Transactions on Automatic Control 21, 1976; for unknown means before and after,
Siegmund and Venkatraman, Annals of Statistics 23, 1995). Changes below a size that matters are none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...estimate.beliefs import Belief, Function, Refinement, refine

__all__ = ["Change", "Changes", "WindowLikelihood", "fused", "observed", "refined"]

LONGEST_CHANGE = 200  # windows back, at most, to where a change may have begun
EXPECTED_WINDOWS = 10.0  # as many windows the prior counts that scatter is as large as covariances say
MAX_SCATTER = 9.0  # squared distance over its expectation: one window counts no more, or a change would hide the next


class WindowLikelihood(NamedTuple):
    """The likelihood of parameters given one window alone."""

    precision: np.ndarray
    """(n, n) Λ"""
    weighted: np.ndarray
    """(n,) η = Λ y"""


@dataclass(frozen=True)
class Change:
    """The likeliest change that the windows show."""

    kind: int  #: number of its direction
    windows: int  #: since it began, the last one included
    size: float  #: along its direction
    std: float  #: standard deviation of the size
    before: np.ndarray  #: (n,) parameters before
    after: Belief  #: about the parameters, from the windows after the change alone


def observed(before: Belief, after: Belief) -> WindowLikelihood:
    """Return the observation that took a belief from before to after."""
    old, new = np.linalg.inv(before.covariance), np.linalg.inv(after.covariance)
    value, vector = np.linalg.eigh(new - old)
    precision = vector * np.maximum(value, 0.0) @ vector.T
    return WindowLikelihood(precision, precision @ before.mean + new @ (after.mean - before.mean))


def fused(belief: Belief, observation: WindowLikelihood, scatter: float = 1.0) -> Belief:
    """Return a belief refined by a window's observation, whose variances ``scatter`` multiplies."""
    old = np.linalg.inv(belief.covariance)
    covariance = np.linalg.inv(old + observation.precision / scatter)
    return Belief(covariance @ (old @ belief.mean + observation.weighted / scatter), covariance)


def refined(
    belief: Belief, residuals: Function, block: int, window_std: ArrayLike, change_std: ArrayLike, most: float
) -> tuple[Refinement, WindowLikelihood]:
    """Refine a belief by a window, and return the refinement and the observation in the window alone.

    Parameters
    ----------
    belief : Belief
        Before the window.
    residuals : callable
        As `estimate.refine` takes them.
    block : int
        Successive residuals that may be correlated.
    window_std : array_like, shape (n,)
        Standard deviations that a window's estimate may be off the last one.
    change_std : array_like, shape (n,)
        The same after a change.
    most : float
        Of ``window_std``: one that ends farther off is refined again from the wider belief.
    """
    prior = belief.drifted(window_std)
    refinement = refine(prior, residuals, block)
    if np.any(np.abs(refinement.belief.mean - prior.mean) > most * np.asarray(window_std)):
        prior = belief.drifted(change_std)
        refinement = refine(prior, residuals, block)
    return refinement, observed(prior, refinement.belief)


class Changes:
    """Observations of one clearance, tested for changes.

    Parameters
    ----------
    start : Belief
        Belief before the first window.
    after_std : ndarray
        Wide prior standard deviations (n,) of the parameters after a change.
    """

    def __init__(self, start: Belief, after_std: np.ndarray) -> None:
        self.start, self.after_precision = start, np.diag(after_std**-2.0)
        self.observations: list[WindowLikelihood] = []
        self.scatter, self.count = 1.0, EXPECTED_WINDOWS

    def add(self, belief: Belief, observation: WindowLikelihood) -> float:
        """Keep a window's observation; return the scatter of windows about beliefs over that of the covariances.

        Parameters
        ----------
        belief : Belief
            Before the window.
        observation : Observation
            Observation in the window.

        Returns
        -------
        float
            Factor on variances, at least 1: a mean over the windows so far.
        """
        n, distance = belief.mean.size, observation.weighted - observation.precision @ belief.mean
        spread = observation.precision + observation.precision @ belief.covariance @ observation.precision
        squared = float(distance @ np.linalg.pinv(spread, rcond=1e-9, hermitian=True) @ distance) / n
        self.count += 1.0
        self.scatter += (min(squared, MAX_SCATTER) - self.scatter) / self.count
        self.observations.append(observation)
        return max(1.0, self.scatter)

    def likeliest(self, directions: np.ndarray, thresholds: np.ndarray) -> tuple[Change, float] | None:
        """Return the likeliest change and by how many standard deviations it exceeds its threshold.

        Parameters
        ----------
        directions : ndarray
            Directions (n_kinds, n) of the changes that may happen, one at a time.
        thresholds : ndarray
            Sizes (n_kinds,) up to which changes do not matter.

        Returns
        -------
        tuple of Change and float, or None
            None before the first window.
        """
        if not self.observations:
            return None
        places = min(len(self.observations), LONGEST_CHANGE)
        precision, weighted = (np.array(part) / max(1.0, self.scatter) for part in zip(*self.observations))
        later, later_weighted = (np.cumsum(part[::-1], axis=0)[::-1][-places:] for part in (precision, weighted))
        first = np.linalg.inv(self.start.covariance)
        sooner = np.linalg.inv(first + precision.sum(axis=0) - later)
        mean = np.einsum("tij,tj->ti", sooner, first @ self.start.mean + weighted.sum(axis=0) - later_weighted)
        # What followed, u = Λ (y - m), has the covariance S = Λ + Λ P Λ, and after a change a d the mean a Λ d.
        innovation = later_weighted - np.einsum("tij,tj->ti", later, mean)
        inverse = np.linalg.pinv(later + later @ sooner @ later, rcond=1e-10, hermitian=True)
        filters = inverse @ later @ directions.T
        information = np.maximum(np.einsum("qi,tij,tjq->tq", directions, later, filters), 1e-300)
        size = np.einsum("ti,tiq->tq", innovation, filters) / information
        best, kind = np.unravel_index(np.argmax(size**2 * information), size.shape)
        # A parameter on which the windows since then have no information keeps its value, within `after_std`.
        covariance = np.linalg.inv(later[best] + self.after_precision)
        change = Change(
            int(kind), int(places - best), float(size[best, kind]), float(information[best, kind] ** -0.5), mean[best],
            Belief(mean[best] + covariance @ innovation[best], covariance),
        )  # fmt: skip
        return change, (abs(change.size) - float(thresholds[kind])) / change.std
