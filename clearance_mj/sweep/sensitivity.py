"""Sobol indices of a sweep's results."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..core.errors import ClearanceError
from ..statistics.sobol import Sensitivity, sobol_indices

__all__ = ["quantities", "sensitivity"]


def quantities(results: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the scalar results (n_cases,) of the cases, by names that end with the unit.

    They are natural frequencies, frequency and height of the FRF's peaks, and mean RMSE over the sensors.
    """
    columns = {f"natural frequency {i} (Hz)": x for i, x in enumerate(results["natural_frequency"].values.T, 1)}
    if "peak_frequency" in results:
        columns |= {f"frequency of peak {i} (Hz)": x for i, x in enumerate(results["peak_frequency"].values.T, 1)}
        with np.errstate(divide="ignore"):
            decibels = 20 * np.log10(results["peak_magnitude"].values.T)
        columns |= {f"height of peak {i} (dB)": column for i, column in enumerate(decibels, 1)}
    if "rmse" in results:
        columns["RMSE (dB)"] = results["rmse"].values.mean(axis=1)
    return columns


def sensitivity(results: xr.Dataset, samples: int) -> Sensitivity:
    """Return Sobol indices of the varying results of a sweep whose "saltelli" design has so many samples.

    Raises a ClearanceError if the cases are of another design, or some have no results.
    """
    n_parameters = results.sizes["varied"]
    if results.sizes["case"] != samples * (n_parameters + 2):
        raise ClearanceError('Sobol indices need the cases of a design with method "saltelli"')
    if failed := [(int(case), error) for case, error in zip(results["case"], results["error"].values) if error]:
        raise ClearanceError(
            f"Sobol indices need all cases; {len(failed)} have no results, first case {failed[0][0]}: {failed[0][1]}"
        )
    varying = {name: values for name, values in quantities(results).items() if np.ptp(values) > 0}
    indices = sobol_indices(np.stack(list(varying.values()), axis=1), n_parameters)
    return Sensitivity(tuple(varying), tuple(map(str, results["varied"].values)), *indices)
