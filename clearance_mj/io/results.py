"""Results and records as labelled arrays in NetCDF: FRFs, responses and channels with units and where they come from.

The files are netCDF-3 (64-bit offset), which every NetCDF reader opens; those that end in .h5 or .hdf5 are netCDF-4,
which is HDF5, and need the package h5netcdf. Complex numbers, which netCDF-3 does not know, are pairs along a last
dimension ``part``.
"""

from __future__ import annotations

import importlib.util
import io
import json
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..errors import RecordError
from ..files import TOO_DENSE, most_unpacked, replacing
from ..signals.frf import FRF
from ..signals.response import Response
from ._checks import check_dof, naming
from .channels import Channel, require_one_time
from .columns import listed
from .registry import Format, register

__all__ = ["load", "save"]

_KIND = "clearance_mj"
"""Attribute that says what a file holds."""
_HDF5 = (".h5", ".hdf5")
_HDF5_MAGIC = b"\x89HDF"
_UNITS = {"displacement": "m", "velocity": "m s-1", "acceleration": "m s-2", "force": "N"}
"""As UDUNITS writes them: attributes of netCDF-3 are ASCII."""
_EXCITATION_UNITS = {"base": _UNITS["acceleration"], "force": _UNITS["force"]}
_HISTORIES = {
    "acceleration": ("response", "m s-2"),
    "displacement": ("bushing", "m"),
    "contact_force": ("bushing", "N"),
    "grease_force": ("bushing", "N"),
}


def frf_to_dataset(frf: FRF) -> xr.Dataset:
    """``value`` (response, reference, frequency, part) with part "real", "imag", and ``coherence`` without part.

    Responses and references are labelled "3:+Z"; nan stands for pairs of them that were not measured.
    """
    dims = ("response", "reference", "frequency")
    above, _, below = frf.quantity.partition("/")
    parts = np.stack((frf.value.real, frf.value.imag), axis=-1)
    units = "1" if above == below else f"({_UNITS.get(above, above)})/({_UNITS.get(below, below)})"
    variables: dict[str, Any] = {"value": ((*dims, "part"), parts, {"units": units, "long_name": frf.quantity})}
    if frf.coherence is not None:
        variables["coherence"] = (dims, frf.coherence, {"units": "1"})
    coordinates = {
        "response": list(frf.responses),
        "reference": list(frf.references),
        "frequency": ("frequency", frf.frequency, {"units": "Hz"}),
        "part": ["real", "imag"],
    }
    return xr.Dataset(variables, coordinates, {_KIND: "frf", "quantity": frf.quantity})


def dataset_to_frf(ds: xr.Dataset) -> FRF:
    _require_kind(ds, "frf")
    dims = ("response", "reference", "frequency")
    value = _values(ds, "value", (*dims, "part"))
    references, responses = _labels(ds, "reference"), _labels(ds, "response")
    if value.shape[3] != 2 or not references or len(set(references)) < len(references):
        raise RecordError(f"needs different references and two parts, got {listed(references)} and {value.shape[3]}")
    for label in (*references, *responses):
        check_dof(label)
    value = value.view(complex)[..., 0]
    coherence = _values(ds, "coherence", dims) if "coherence" in ds else None
    frequency, quantity = _values(ds, "frequency", ("frequency",)), str(_attribute(ds, "quantity"))
    return FRF(frequency, value, coherence, responses, references, quantity)


def response_to_dataset(resp: Response) -> xr.Dataset:
    """``excitation`` (time,), ``acceleration`` (response, time); of (bushing, time) what the response has."""
    if resp.kind not in _EXCITATION_UNITS:
        raise RecordError(f'kind "{resp.kind}" is unknown; use {" or ".join(_EXCITATION_UNITS)}')
    attributes: dict[str, Any] = {"units": _EXCITATION_UNITS[resp.kind], "dof": resp.reference}
    variables: dict[str, Any] = {"excitation": ("time", resp.excitation, attributes)}
    for name, (dimension, unit) in _HISTORIES.items():
        if (value := getattr(resp, name)) is not None:
            variables[name] = ((dimension, "time"), value, {"units": unit})
    coordinates: dict[str, Any] = {"time": ("time", resp.time, {"units": "s"})}
    if resp.responses:
        coordinates["response"] = list(resp.responses)
    attributes = {
        _KIND: "response",
        "fs": float(resp.fs),
        "kind": resp.kind,
        "provenance": _json(resp.provenance),
    }
    if resp.band is not None:
        attributes["band"] = np.array(resp.band, dtype=float)
    return xr.Dataset(variables, coordinates, attributes)


def dataset_to_response(ds: xr.Dataset) -> Response:
    _require_kind(ds, "response")
    histories: dict[str, Any] = {
        name: _values(ds, name, (dimension, "time")) if name in ds else None
        for name, (dimension, _) in _HISTORIES.items()
    }
    if histories["acceleration"] is None:
        raise RecordError('holds no "acceleration"')
    band = ds.attrs.get("band")
    try:
        provenance = json.loads(_attribute(ds, "provenance"))
    except ValueError as error:
        raise RecordError(f"its provenance is not JSON: {error}") from None
    return Response(
        fs=float(_attribute(ds, "fs")),
        excitation=_values(ds, "excitation", ("time",)),
        kind=str(_attribute(ds, "kind")),
        band=None if band is None else (float(band[0]), float(band[1])),
        responses=_labels(ds, "response") if "response" in ds.coords else (),
        reference=str(ds["excitation"].attrs.get("dof", "100:+Z")),
        provenance=provenance,
        **histories,
    )


def channels_to_dataset(channels: Sequence[Channel]) -> xr.Dataset:
    """``value`` (channel, time), each channel in its own ``units``, with its ``name``, ``dof`` and ``quantity``."""
    require_one_time(channels)
    first = channels[0]
    texts = {
        "name": [c.name for c in channels],
        "dof": [c.label for c in channels],
        "quantity": [c.quantity for c in channels],
        "units": [_UNITS[c.quantity] for c in channels],
    }
    coordinates: dict[str, Any] = {name: ("channel", text) for name, text in texts.items()}
    coordinates["time"] = ("time", first.time, {"units": "s"})
    attributes = {_KIND: "channels", "fs": float(first.fs), "start": float(first.start)}
    return xr.Dataset({"value": (("channel", "time"), [c.value for c in channels])}, coordinates, attributes)


def dataset_to_channels(ds: xr.Dataset) -> list[Channel]:
    _require_kind(ds, "channels")
    fs, start = float(_attribute(ds, "fs")), float(_attribute(ds, "start"))
    rows = zip(_labels(ds, "name"), _labels(ds, "dof"), _labels(ds, "quantity"), _values(ds, "value", _CHANNEL_DIMS))
    channels = []
    for name, dof, quantity, value in rows:
        node, _, direction = dof.partition(":")
        channels.append(Channel(name, int(node), direction, quantity, value, fs, start))
    return channels


_CHANNEL_DIMS = ("channel", "time")
_TO_DATASET: dict[type, Callable[..., xr.Dataset]] = {
    FRF: frf_to_dataset,
    Response: response_to_dataset,
    list: channels_to_dataset,
}
_FROM_DATASET: dict[Any, Callable[[xr.Dataset], FRF | Response | list[Channel]]] = {
    "frf": dataset_to_frf,
    "response": dataset_to_response,
    "channels": dataset_to_channels,
}


def save(path: str | PathLike[str], obj: FRF | Response | list[Channel]) -> None:
    """Write FRFs, a response or time records as NetCDF; an existing file is replaced once the new one is whole.

    Parameters
    ----------
    path : str or Path
        The file, usually ".nc"; ".h5" and ".hdf5" are HDF5.
    obj : FRF, Response or list of Channel
        What to write.

    Raises
    ------
    RecordError
        If ``obj`` is none of these, its provenance is not plain data, or HDF5 needs a package that is not there.
    """
    convert = _TO_DATASET.get(type(obj))
    if convert is None:
        raise RecordError(f"{path}: cannot write {type(obj).__name__}; needs an FRF, a Response or a list of channels")
    hdf5 = Path(path).suffix.lower() in _HDF5
    with naming(path):
        if hdf5:
            _require_hdf5()
        dataset = convert(obj)
    form: dict[str, Any] = {"engine": "h5netcdf"} if hdf5 else {"engine": "scipy", "format": "NETCDF3_64BIT"}
    with replacing(path) as temporary:
        # By way of memory: the HDF5 library ends the process where the disk is full.
        temporary.write_bytes(dataset.to_netcdf(**form))


def load(path: str | PathLike[str]) -> FRF | Response | list[Channel]:
    """Read what `save` wrote.

    Parameters
    ----------
    path : str or Path
        The file; whether it is HDF5 is seen from its first bytes.

    Returns
    -------
    FRF, Response or list of Channel

    Raises
    ------
    RecordError
        If the file is missing, damaged or holds something else, or HDF5 needs a package that is not there.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordError(f"{path}: cannot be read; there is no such file")
    try:
        dataset = _dataset(path)
        kind = dataset.attrs.get(_KIND)
        if kind not in _FROM_DATASET:
            raise RecordError(
                f"holds no results of clearance_mj; needs the attribute {_KIND} = {' or '.join(_FROM_DATASET)}"
            )
        return _FROM_DATASET[kind](dataset)
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None
    except Exception as error:  # xarray and its engines raise whatever a damaged header leads to
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RecordError(f"{path}: not a whole NetCDF file of results: {reason}") from None


def _dataset(path: Path) -> xr.Dataset:
    data = path.read_bytes()
    if not data.startswith(_HDF5_MAGIC):
        # In memory, where as much can be read as there is: a damaged header may declare any size.
        return xr.load_dataset(io.BytesIO(data), engine="scipy", decode_times=False)
    _require_hdf5()
    _require_stored(path, most_unpacked(len(data)))
    return xr.load_dataset(path, engine="h5netcdf", decode_times=False, phony_dims="sort")


def _require_stored(path: Path, most: int) -> None:
    """Refuse numbers that are declared but not there; HDF5 would fill them up when it reads them."""
    import h5py

    sizes: list[int] = []
    with h5py.File(path) as file:
        file.visititems(lambda _, item: sizes.append(item.nbytes) if isinstance(item, h5py.Dataset) else None)
    if sum(sizes) > most:
        raise RecordError(TOO_DENSE)


def _require_hdf5() -> None:
    if importlib.util.find_spec("h5netcdf") is None:
        raise RecordError('HDF5 needs the package h5netcdf: pip install "clearance-mj[hdf5]"; .nc needs nothing more')


def _require_kind(ds: xr.Dataset, kind: str) -> None:
    if ds.attrs.get(_KIND) != kind:
        raise RecordError(f'holds "{ds.attrs.get(_KIND)}", needs "{kind}" in the attribute {_KIND}')


def _attribute(ds: xr.Dataset, name: str) -> Any:
    if name not in ds.attrs:
        raise RecordError(f'the attribute "{name}" is missing')
    return ds.attrs[name]


def _values(ds: xr.Dataset, name: str, dims: tuple[str, ...]) -> np.ndarray:
    """Return a variable as native doubles, C-contiguous; netCDF-3 is big endian, old files have time first."""
    if name not in ds or set(ds[name].dims) != set(dims):
        raise RecordError(f'needs "{name}" over ({", ".join(dims)})')
    return np.ascontiguousarray(ds[name].transpose(*dims).values, dtype=float)


def _labels(ds: xr.Dataset, name: str) -> tuple[str, ...]:
    if name not in ds.coords:
        raise RecordError(f'needs labels along "{name}"')
    return tuple(str(label) for label in ds[name].values)


def _json(provenance: Any) -> str:
    try:
        return json.dumps(provenance)
    except (TypeError, ValueError) as error:
        raise RecordError(f"provenance is not plain data: {error}") from None


register(Format(
    "NetCDF", (".nc",), (Channel, Response, FRF), load, save,
    note="NetCDF 3; `simulate` writes its response here, with contact and grease forces",
))  # fmt: skip
register(Format(
    "HDF5", _HDF5, (Channel, Response, FRF), load, save,
    note='the same as NetCDF 4; needs h5netcdf: `pip install "clearance-mj[hdf5]"`',
))  # fmt: skip
