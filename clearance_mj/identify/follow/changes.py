"""Changes of what windows of a record tell: a generalised likelihood ratio test between what came before and after.

A window's observation of parameters x is kept as a normal likelihood in information form, Λ and η = Λ y. For every
window at which a change may have begun, the mean of what followed is compared with what came before, each with its
covariance (Willsky and Jones, IEEE Transactions on Automatic Control 21, 1976; for unknown means before and after,
Siegmund and Venkatraman, Annals of Statistics 23, 1995). Changes below a size that matters are none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...estimate.beliefs import Belief

__all__ = ["Change", "Changes", "Observation", "fused", "observed"]

LONGEST = 200
"""windows back, at most, to where a change may have begun"""
USUAL = 10.0
"""windows as many as which the expectation counts that scatter is as large as covariances say"""
WILDEST = 9.0
"""squared distance over its expectation: no window counts as more scattered, or one change would hide the next"""


@dataclass(frozen=True)
class Observation:
    """What a window alone tells of parameters, as a likelihood."""

    precision: np.ndarray
    """(n, n) Λ"""
    weighted: np.ndarray
    """(n,) η = Λ y"""


@dataclass(frozen=True)
class Change:
    """The likeliest change that the windows show."""

    kind: int
    """number of its direction"""
    windows: int
    """since it began, the last one included"""
    size: float
    """along its direction"""
    std: float
    """standard deviation of the size"""
    before: np.ndarray
    """(n,) parameters before"""
    after: Belief
    """about the parameters, of what followed alone, whatever changed"""


def observed(before: Belief, after: Belief) -> Observation:
    """Return what took a belief from before to after."""
    old, new = np.linalg.inv(before.covariance), np.linalg.inv(after.covariance)
    value, vector = np.linalg.eigh(new - old)
    precision = vector * np.maximum(value, 0.0) @ vector.T
    return Observation(precision, precision @ before.mean + new @ (after.mean - before.mean))


def fused(belief: Belief, observation: Observation, scatter: float = 1.0) -> Belief:
    """Return a belief refined by a window; ``scatter``: factor on the variances of what the window tells."""
    old = np.linalg.inv(belief.covariance)
    covariance = np.linalg.inv(old + observation.precision / scatter)
    return Belief(covariance @ (old @ belief.mean + observation.weighted / scatter), covariance)


class Changes:
    """Watches the observations of one clearance.

    Parameters
    ----------
    start : Belief
        What is known before the first window.
    anew : ndarray
        (n,) standard deviations of what parameters may change to, wide.
    """

    def __init__(self, start: Belief, anew: np.ndarray) -> None:
        self.start, self.anew = start, np.diag(anew**-2.0)
        self.observations: list[Observation] = []
        self.scatter, self.count = 1.0, USUAL

    def add(self, belief: Belief, seen: Observation) -> float:
        """Keep a window's observation; return how much more windows scatter about beliefs than covariances say.

        The factor on variances, at least 1, is a mean over the windows so far.
        """
        n, gap = belief.mean.size, seen.weighted - seen.precision @ belief.mean
        spread = seen.precision + seen.precision @ belief.covariance @ seen.precision
        distance = float(gap @ np.linalg.pinv(spread, rcond=1e-9, hermitian=True) @ gap) / n
        self.count += 1.0
        self.scatter += (min(distance, WILDEST) - self.scatter) / self.count
        self.observations.append(seen)
        return max(1.0, self.scatter)

    def look(self, directions: np.ndarray, least: np.ndarray) -> tuple[Change, float] | None:
        """Find the likeliest change and by how many standard deviations it is larger than what does not matter.

        ``directions``: (n_kinds, n) of the changes that may happen, one at a time. ``least``: (n_kinds,) sizes that do
        not matter. None before the first window.
        """
        if not self.observations:
            return None
        count = len(self.observations)
        few = min(count, LONGEST)
        precision = np.array([o.precision for o in self.observations]) / max(1.0, self.scatter)
        weighted = np.array([o.weighted for o in self.observations]) / max(1.0, self.scatter)
        later = np.cumsum(precision[::-1], axis=0)[::-1][count - few :]
        later_weighted = np.cumsum(weighted[::-1], axis=0)[::-1][count - few :]
        first = np.linalg.inv(self.start.covariance)
        sooner = np.linalg.inv(first + precision.sum(axis=0) - later)
        mean = np.einsum("tij,tj->ti", sooner, first @ self.start.mean + weighted.sum(axis=0) - later_weighted)
        # What followed, u = Λ (y - m), has the covariance S = Λ + Λ P Λ, and after a change a d the mean a Λ d.
        left = later_weighted - np.einsum("tij,tj->ti", later, mean)
        inverse = np.linalg.pinv(later + later @ sooner @ later, rcond=1e-10, hermitian=True)
        told = inverse @ later @ directions.T
        information = np.maximum(np.einsum("qi,tij,tjq->tq", directions, later, told), 1e-300)
        size = np.einsum("ti,tiq->tq", left, told) / information
        best, kind = np.unravel_index(np.argmax(size**2 * information), size.shape)
        share = np.linalg.inv(later[best] + self.anew)  # where windows tell nothing it is what it was, within `anew`
        change = Change(
            int(kind), int(few - best), float(size[best, kind]), float(information[best, kind] ** -0.5), mean[best],
            Belief(mean[best] + share @ left[best], share),
        )  # fmt: skip
        return change, (abs(change.size) - float(least[kind])) / change.std
