"""Global sensitivities: which varied number the spread of a result comes from, by Sobol indices, and points for them.

First order: the fraction of the variance that fixing this number alone would remove on average. Total: the fraction
that is left if all others are fixed, interactions included. Both come from the cases of a "saltelli" design through
`scipy.stats.sobol_indices` (Saltelli et al., Computer Physics Communications 181, 2010); the intervals are percentiles
of a bootstrap over the samples.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats
from numpy.typing import ArrayLike
from scipy.stats import qmc

from ..core.errors import ClearanceError
from .intervals import CONFIDENCE

__all__ = ["Sensitivity", "require_power_of_two", "saltelli_points", "sobol_indices", "unit_points"]

RESAMPLES = 200


def unit_points(method: str, n: int, d: int, seed: int) -> np.ndarray:
    """Return points (n, d) of a unit cube; the first ones of "sobol" stay the same if more are drawn.

    Parameters
    ----------
    method : str
        "latin-hypercube" or "sobol", which is scrambled.
    n, d : int
        Number of points and of dimensions.
    seed : int
        Of the random numbers.
    """
    sampler = {"latin-hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}[method]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of numbers that are no power of two
        return sampler(d, rng=np.random.default_rng(seed)).random(n)


def saltelli_points(groups: Sequence[Sequence[int]], n: int, seed: int) -> np.ndarray:
    """Return the points (n × (n_groups + 2), d) of a unit cube from which Sobol indices follow.

    Two Sobol' samples A and B, then A with the dimensions of one group after the other from B.

    Parameters
    ----------
    groups : sequence of sequence of int
        Dimensions that have their indices together; each of the d is in one group.
    n : int
        Number of points of a sample, a power of two.
    seed : int
        Of the random numbers.
    """
    d = sum(map(len, groups))
    a, b = np.split(unit_points("sobol", n, 2 * d, seed), 2, axis=1)
    return np.concatenate((a, b, *[np.where(np.isin(np.arange(d), group), b, a) for group in groups]))


def require_power_of_two(what: str, n: int) -> None:
    """Refuse a number of Sobol' points that is no power of two, and say which ones are.

    Parameters
    ----------
    what : str
        Name of the number.
    n : int
        Its value, > 0.
    """
    if n & (n - 1):
        below = 2 ** math.floor(math.log2(n))
        raise ClearanceError(f"{what} = {n} is no power of 2, which Sobol' points need; take {below} or {2 * below}")


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Sobol indices of several results to the varied parameters."""

    quantity: tuple[str, ...]  #: names of the results, with their units
    parameter: tuple[str, ...]  #: paths of the varied parameters
    first: np.ndarray  #: (n_quantities, n_parameters) first-order indices
    total: np.ndarray  #: (n_quantities, n_parameters) total-order indices
    first_interval: np.ndarray  #: (2, n_quantities, n_parameters) limits of their 95 % intervals
    total_interval: np.ndarray  #: (2, n_quantities, n_parameters)

    def rows(self) -> list[dict[str, Any]]:
        """Return a row of plain data for each result and parameter."""
        order = {"first_order": (self.first, self.first_interval), "total_order": (self.total, self.total_interval)}
        columns = {f"{name}{end}": v for name, (values, (low, high)) in order.items()
                   for end, v in (("", values), ("_low", low), ("_high", high))}  # fmt: skip
        return [
            {"quantity": quantity, "parameter": parameter} | {key: float(v[i, j]) for key, v in columns.items()}
            for i, quantity in enumerate(self.quantity)
            for j, parameter in enumerate(self.parameter)
        ]


def sobol_indices(values: ArrayLike, n_parameters: int, seed: int = 0) -> tuple[np.ndarray, ...]:
    """Return Sobol indices of results (n_cases, n_quantities) of a "saltelli" design, in the order of its cases.

    First and total order (n_quantities, n_parameters), and the limits (2, n_quantities, n_parameters) of the 95 %
    intervals of each.
    """
    blocks = np.reshape(values, (n_parameters + 2, -1, np.shape(values)[1])).transpose(0, 2, 1)
    n, rng = blocks.shape[-1], np.random.default_rng(seed)
    drawn = (_indices(blocks[..., rng.integers(n, size=n)]) for _ in range(RESAMPLES))
    tails = 50 * (1 - CONFIDENCE) * np.array([1, -1]) + [0, 100]
    first, total = np.percentile(list(drawn), tails, axis=0).swapaxes(0, 1)
    return *_indices(blocks), first, total


def _indices(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first and total order (n_quantities, n_parameters) of blocks (A, B, AB...) of (n_quantities, n)."""
    pairs = np.repeat(blocks, 2, axis=1)  # scipy fails at one result of one parameter
    result = scipy.stats.sobol_indices(func={"f_A": pairs[0], "f_B": pairs[1], "f_AB": pairs[2:]}, n=pairs.shape[-1])
    shape = pairs.shape[1], len(blocks) - 2
    return result.first_order.reshape(shape)[::2], result.total_order.reshape(shape)[::2]
