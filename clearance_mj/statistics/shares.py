"""Intervals of proportions of a population, and quantiles over its members."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .intervals import two_sided_quantile

__all__ = ["quantiles", "share_interval"]


def share_interval(share: ArrayLike, n: ArrayLike, confidence: float = 0.95) -> np.ndarray:
    """Return the limits (2, ...) within which proportions of a population lie of which n members were drawn.

    Wilson's interval (Journal of the American Statistical Association 22, 1927), for independent draws; Sobol' points
    scatter less, so it holds more often than it says.

    Parameters
    ----------
    share : array_like
        Of the members that were drawn.
    n : array_like
        Their number, or the number of independent ones with as much information.
    confidence : float
        Probability that the population's proportion lies between the limits.
    """
    p, n, z = np.asarray(share, dtype=float), np.asarray(n, dtype=float), two_sided_quantile(confidence)
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    return np.stack((np.where(p == 0, 0.0, middle - half), np.where(p == 1, 1.0, middle + half)))


def quantiles(members: ArrayLike, shares: ArrayLike, axis: int = -1) -> np.ndarray:
    """Return values (n_shares, ...) below which these fractions of a population lie; infinite members are the largest.

    Parameters
    ----------
    members : array_like
        Values of the members that were drawn; each quantile is that of one of them.
    shares : array_like
        From 0 to 1.
    axis : int
        Of the members.
    """
    values, at = np.asarray(members, dtype=float), np.asarray(shares, dtype=float)
    return np.asarray(np.quantile(values, at, axis=axis, method="nearest"))
