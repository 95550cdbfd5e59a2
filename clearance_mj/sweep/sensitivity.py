"""Global sensitivities: which varied parameter the spread of a result comes from, by Sobol indices.

First order: the share of the variance that fixing this parameter alone would take away on average. Total: the share
that is left if every other one is fixed, interactions included. Both come from the cases of a "saltelli" design through
`scipy.stats.sobol_indices` (Saltelli et al., Computer Physics Communications 181, 2010); the intervals are percentiles
of a bootstrap over the samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.stats
import xarray as xr
from numpy.typing import ArrayLike

from ..core.errors import ClearanceError

__all__ = ["Sensitivity", "quantities", "sensitivity", "sobol_indices"]

CONFIDENCE = 0.95
RESAMPLES = 200


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Sobol indices of several results to the varied parameters."""

    quantity: tuple[str, ...]  #: names of the results, with their units
    parameter: tuple[str, ...]  #: paths of the varied parameters
    first: np.ndarray  #: (n_quantities, n_parameters) first-order indices
    total: np.ndarray  #: (n_quantities, n_parameters) total-order indices
    first_interval: np.ndarray  #: (2, n_quantities, n_parameters) limits of their 95 % intervals
    total_interval: np.ndarray  #: (2, n_quantities, n_parameters)

    def rows(self) -> list[dict]:
        """Return a row of plain data for each result and parameter."""
        order = {"first_order": (self.first, self.first_interval), "total_order": (self.total, self.total_interval)}
        columns = {f"{name}{end}": v for name, (of, (low, high)) in order.items()
                   for end, v in (("", of), ("_low", low), ("_high", high))}  # fmt: skip
        return [
            {"quantity": quantity, "parameter": parameter} | {key: float(v[i, j]) for key, v in columns.items()}
            for i, quantity in enumerate(self.quantity)
            for j, parameter in enumerate(self.parameter)
        ]


def sobol_indices(values: ArrayLike, n_parameters: int, seed: int = 0) -> tuple[np.ndarray, ...]:
    """Sobol indices of results (n_cases, n_quantities) of a "saltelli" design, in the order of its cases.

    Returns first and total order (n_quantities, n_parameters), and the limits (2, n_quantities, n_parameters) of the
    95 % intervals of each.
    """
    blocks = np.reshape(values, (n_parameters + 2, -1, np.shape(values)[1])).transpose(0, 2, 1)
    n, rng = blocks.shape[-1], np.random.default_rng(seed)
    drawn = (_indices(blocks[..., rng.integers(n, size=n)]) for _ in range(RESAMPLES))
    tails = 50 * (1 - CONFIDENCE) * np.array([1, -1]) + [0, 100]
    first, total = np.percentile(list(drawn), tails, axis=0).swapaxes(0, 1)
    return *_indices(blocks), first, total


def _indices(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and total order (n_quantities, n_parameters) of blocks (A, B, AB...) of (n_quantities, n)."""
    twice = np.repeat(blocks, 2, axis=1)  # scipy fails at one result of one parameter
    found = scipy.stats.sobol_indices(func={"f_A": twice[0], "f_B": twice[1], "f_AB": twice[2:]}, n=twice.shape[-1])
    shape = twice.shape[1], len(blocks) - 2
    return found.first_order.reshape(shape)[::2], found.total_order.reshape(shape)[::2]


def quantities(results: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the results (n_cases,) that are one number for each case, by names that end with the unit.

    They are natural frequencies, frequency and height of the FRF's peaks, and mean RMSE over the sensors.
    """
    frequencies = results["natural_frequency"].values.T
    found = {f"natural frequency {i} (Hz)": column for i, column in enumerate(frequencies, 1)}
    if "peak_frequency" in results:
        found |= {f"frequency of peak {i} (Hz)": x for i, x in enumerate(results["peak_frequency"].values.T, 1)}
        with np.errstate(divide="ignore"):
            decibels = 20 * np.log10(results["peak_magnitude"].values.T)
        found |= {f"height of peak {i} (dB)": column for i, column in enumerate(decibels, 1)}
    if "rmse" in results:
        found["RMSE (dB)"] = results["rmse"].values.mean(axis=1)
    return found


def sensitivity(results: xr.Dataset, samples: int) -> Sensitivity:
    """Sobol indices of the results that vary, of a sweep whose "saltelli" design has so many samples.

    A ClearanceError says if the cases are of another design, or some have no results.
    """
    n_parameters = results.sizes["varied"]
    if results.sizes["case"] != samples * (n_parameters + 2):
        raise ClearanceError('Sobol indices need the cases of a design with method "saltelli"')
    if failed := [(int(case), error) for case, error in zip(results["case"], results["error"].values) if error]:
        raise ClearanceError(
            f"Sobol indices need all cases; {len(failed)} have no results, first case {failed[0][0]}: {failed[0][1]}"
        )
    found = {name: values for name, values in quantities(results).items() if np.ptp(values) > 0}
    indices = sobol_indices(np.stack(list(found.values()), axis=1), n_parameters)
    return Sensitivity(tuple(found), tuple(map(str, results["varied"].values)), *indices)
