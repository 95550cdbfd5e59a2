"""Labelled datasets (xarray) of the data types: dimensions, units, and the checks of each ``from_xarray``."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["KIND", "UNITS", "attribute", "dataset", "from_json", "labels", "plain_json", "require_kind", "values"]

KIND = "clearance_mj"  # attribute that names the data type of a dataset
# as UDUNITS writes them: attributes of netCDF-3 are ASCII
UNITS = {"frequency": "Hz", "time": "s"} | {name: known.cf_unit for name, known in QUANTITIES.items()}


def dataset(
    holds: str, variables: dict[str, Any], coordinates: dict[str, Any], attributes: dict[str, Any] | None = None
) -> xr.Dataset:
    """Return a dataset with its data type, such as "frf", as an attribute.

    Variables are (dimensions, numbers, units) by name, left out where the numbers are None; coordinates are labels or
    numbers by dimension, left out where empty.
    """
    import xarray as xr

    data_vars = {
        name: (dims, value, {"units": units}) for name, (dims, value, units) in variables.items() if value is not None
    }
    axes = {
        name: (name, value, {"units": UNITS[name]}) if name in UNITS else (name, list(value))
        for name, value in coordinates.items()
        if len(value)
    }
    return xr.Dataset(data_vars, axes, {KIND: holds, **(attributes or {})})


def driving_attributes(item: Any, plain: str) -> dict[str, Any]:
    """Return rate, kinds and band of an excitation or a response as attributes, and one of its fields as JSON."""
    attributes = {"fs": float(item.fs), "kind": " ".join(item.kinds), plain: plain_json(getattr(item, plain), plain)}
    return attributes if item.band is None else attributes | {"band": np.array(item.band, dtype=float)}


def require_kind(ds: xr.Dataset, kind: str) -> None:
    """Refuse a dataset that holds something else."""
    if ds.attrs.get(KIND) != kind:
        raise RecordError(f'holds "{ds.attrs.get(KIND)}", needs "{kind}" in the attribute {KIND}')


def attribute(ds: xr.Dataset, name: str) -> Any:
    """Return an attribute; a RecordError says that it is missing."""
    if name not in ds.attrs:
        raise RecordError(f'the attribute "{name}" is missing')
    return ds.attrs[name]


def values(ds: xr.Dataset, name: str, *dims: str, dtype: type = float) -> np.ndarray:
    """Return a variable as native numbers, C-contiguous, its axes in the named order; older files have time first."""
    if name not in ds or set(ds[name].dims) != set(dims):
        raise RecordError(f'needs "{name}" over ({", ".join(dims)})')
    return np.ascontiguousarray(ds[name].transpose(*dims).values, dtype=dtype)


def labels(ds: xr.Dataset, name: str) -> tuple[str, ...]:
    """Return the labels along a dimension."""
    if name not in ds.coords:
        raise RecordError(f'needs labels along "{name}"')
    return tuple(str(label) for label in ds[name].values)


def plain_json(data: dict[str, Any], name: str) -> str:
    """Return plain data as JSON; a RecordError says that it is none."""
    with naming(f"{name} is not plain data", (TypeError, ValueError), RecordError):
        return json.dumps(data)


def from_json(ds: xr.Dataset, name: str) -> Any:
    """Return the plain data of an attribute that holds them as JSON."""
    with naming(f"its {name} is not JSON", ValueError, RecordError):
        return json.loads(attribute(ds, name))
