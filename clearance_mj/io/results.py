"""Results and records as labelled arrays in NetCDF: FRFs, responses, modes and channels, with units.

The files are netCDF-3 (64-bit offset), which every NetCDF reader opens; those that end in .h5 or .hdf5 are netCDF-4,
which is HDF5, and need the package h5netcdf. Complex numbers, which netCDF-3 does not know, are pairs along a last
dimension ``part``.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import io
from collections.abc import Callable, Iterable, Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.checks import check_dof, naming
from ..core.deprecation import old_names
from ..core.errors import RecordError
from ..core.files import TOO_DENSE, most_unpacked, plain_file, replacing
from ..core.notes import note
from ..signals.ema import Modes
from ..signals.frf import FRF
from ..signals.labelled import KIND, UNITS, attribute, labels, require_kind, values
from ..signals.response import Response
from ..signals.spectra import Spectra
from ..structure.geometry import Geometry
from .channels import UNKNOWN, Channel, place_of, require_one_time
from .columns import Columns
from .containers import fields_of_hdf5, waveforms
from .registry import Format, register
from .time_axis import Rate, Rates
from .waveforms import channels_of_waveforms, whole

if TYPE_CHECKING:
    import xarray as xr
else:
    __getattr__ = old_names(__name__, {"saving": "clearance_mj.io.results.save_blocks"})

__all__ = ["load", "save", "save_blocks"]

Result = list[Channel] | FRF | Response | Spectra | Modes | Geometry
_HDF5 = (".h5", ".hdf5", ".nc4")
_TEXTS = ("name", "dof", "quantity", "units")  # of a channel
_HDF5_MAGIC = b"\x89HDF"


def with_parts(ds: xr.Dataset) -> xr.Dataset:
    """Return the complex variables as pairs along a last dimension ``part``, "real" and "imag"."""
    for name, array in ds.data_vars.items():
        if array.dtype.kind == "c":
            parts = np.stack((array.values.real, array.values.imag), axis=-1)
            ds = ds.assign({name: ((*array.dims, "part"), parts, array.attrs)}).assign_coords(part=["real", "imag"])
    return ds


def without_parts(ds: xr.Dataset) -> xr.Dataset:
    """Return the pairs that `with_parts` made as complex variables again."""
    if ds.sizes.get("part", 2) != 2:
        raise RecordError(f"needs two parts, real and imaginary, got {ds.sizes['part']}")
    for name, variable in ds.data_vars.items():
        if "part" in variable.dims:
            parts = variable.transpose(..., "part")
            value = np.ascontiguousarray(parts.values, dtype=float).view(complex)[..., 0]
            ds = ds.assign({name: (parts.dims[:-1], value, variable.attrs)})
    return ds


def _frf(ds: xr.Dataset) -> FRF:
    frf = FRF.from_xarray(ds)
    for label in (*frf.references, *frf.responses):
        check_dof(label)
    return frf


def channels_to_dataset(channels: Sequence[Channel]) -> xr.Dataset:
    """Return ``value`` (channel, time) of channels, with ``name``, ``dof``, ``quantity`` and ``units`` of each."""
    import xarray as xr

    require_one_time(channels)
    first = channels[0]
    texts = [(c.name, c.label, c.quantity, c.unit if c.quantity == UNKNOWN else UNITS[c.quantity]) for c in channels]
    coordinates: dict[str, Any] = {name: ("channel", [*text]) for name, text in zip(_TEXTS, zip(*texts))}
    coordinates["time"] = ("time", first.time, {"units": "s"})
    attributes = {KIND: "channels", "fs": float(first.fs), "start": float(first.start)}
    return xr.Dataset({"value": (("channel", "time"), [c.value for c in channels])}, coordinates, attributes)


def dataset_to_channels(ds: xr.Dataset) -> list[Channel]:
    """Return the channels of a dataset that `channels_to_dataset` made."""
    require_kind(ds, "channels")
    fs, start = float(attribute(ds, "fs")), float(attribute(ds, "start"))
    texts = (labels(ds, name) for name in _TEXTS)
    return [
        Channel(name, *place_of(dof), quantity, value, fs, start, unit if quantity == UNKNOWN else "")
        for name, dof, quantity, unit, value in zip(*texts, values(ds, "value", "channel", "time"))
    ]


_FROM_DATASET: dict[Any, Callable[[xr.Dataset], Result]] = {
    "frf": _frf, "response": Response.from_xarray, "spectra": Spectra.from_xarray, "modes": Modes.from_xarray,
    "geometry": Geometry.from_xarray, "channels": dataset_to_channels,
}  # fmt: skip


def save(path: str | PathLike[str], obj: Result) -> None:
    """Write FRFs, spectra, a response, modes, a geometry or time records as NetCDF, as HDF5 at .h5, .hdf5."""
    if not isinstance(obj, list | FRF | Response | Spectra | Modes | Geometry):
        raise RecordError(f"{path}: cannot write {type(obj).__name__}; needs an FRF, a Response or a list of channels")
    hdf5 = Path(path).suffix.lower() in _HDF5
    with naming(path):
        if hdf5:
            _require_hdf5()
        dataset = with_parts(channels_to_dataset(obj) if isinstance(obj, list) else obj.to_xarray())
    form: dict[str, Any] = {"engine": "h5netcdf"} if hdf5 else {"engine": "scipy", "format": "NETCDF3_64BIT"}
    with replacing(path) as temporary:
        # By way of memory: the HDF5 library ends the process where the disk is full.
        temporary.write_bytes(dataset.to_netcdf(**form))


def load(path: str | PathLike[str], columns: Columns = None, fs: Rate = None, resample: Rate = None) -> Result:
    """Read results that `save` wrote, or time records of other programs; the first bytes tell HDF5 from NetCDF.

    ``columns`` gives channels of other programs by their names, ``fs`` (Hz) is of those that do not say theirs.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordError(f"{path}: cannot be read; there is no such file")
    with naming(path), whole("NetCDF file of results"):
        try:
            dataset, notes = _dataset(path), list[str]()
        except OSError as error:
            raise RecordError(f"cannot be read ({error.strerror or error})") from None
        if isinstance(dataset, dict) and (waves := [*waveforms(dataset, notes)]):
            channels = channels_of_waveforms(waves, columns or {}, Rates(fs, resample, notes))
            note(path, notes)
            return channels
        kind = None if isinstance(dataset, dict) else dataset.attrs[KIND]
        if isinstance(dataset, dict) or kind not in _FROM_DATASET:
            raise RecordError(
                f"holds no results of clearance_mj; needs the attribute {KIND} = {' or '.join(_FROM_DATASET)}; and no "
                "time records of other programs"
            )
        if columns or fs:
            raise RecordError("is written by clearance_mj: it names its channels and says their rate itself")
        return _FROM_DATASET[kind](without_parts(dataset))


def save_blocks(path: str | PathLike[str], blocks: Iterable[Response]) -> Iterator[Response]:
    """Write blocks to an HDF5 file as they pass: ``estimate_frf_blocks(save_blocks("run.h5", simulate_blocks(...)))``.

    The file, ".h5" or ".hdf5", is there once the last block was taken; `io.results.load` reads it.
    """
    if Path(path).suffix.lower() not in _HDF5:
        raise RecordError(f"{path}: blocks are appended to HDF5 only; give a name that ends in {' or '.join(_HDF5)}")
    _require_hdf5()
    import h5py

    blocks = iter(blocks)
    if (first := next(blocks, None)) is None:
        raise RecordError(f"{path}: there is no block to write")
    with replacing(path) as temporary:
        written, done = first.to_xarray(), first.excitation.shape[-1]
        written.to_netcdf(temporary, engine="h5netcdf", unlimited_dims=["time"])
        yield first
        with h5py.File(temporary, "a") as file:
            names = [str(name) for name, variable in written.variables.items() if "time" in variable.dims]
            for block in blocks:
                size = block.excitation.shape[-1]
                for name in names:
                    value = (done + np.arange(size)) / block.fs if name == "time" else getattr(block, name)
                    file[name].resize(done + size, axis=value.ndim - 1)
                    file[name][..., done:] = value
                done += size
                yield block


def _dataset(path: Path) -> xr.Dataset | dict[str, Any]:
    """Return the dataset that `save` wrote, or the nested fields of another program's file."""
    import xarray as xr

    data = plain_file(path).read_bytes()
    if not data.startswith(_HDF5_MAGIC):
        # In memory, where as much can be read as there is: a damaged header may declare any size.
        dataset = xr.load_dataset(io.BytesIO(data), engine="scipy", decode_times=False)
        parts = {str(name): v for name, v in dataset.variables.items()}
        fields = {name: v.values for name, v in parts.items()} | {f"{name}Header": v.attrs for name, v in parts.items()}
        return dataset if KIND in dataset.attrs else dataset.attrs | fields
    _require_hdf5()
    import h5py

    sizes: list[int] = []
    with h5py.File(path) as file:
        file.visititems(lambda _, item: sizes.append(item.nbytes) if isinstance(item, h5py.Dataset) else None)
        if sum(sizes) > most_unpacked(len(data)):  # HDF5 fills up numbers that are declared but not there
            raise RecordError(TOO_DENSE)
        if KIND not in file.attrs:
            return fields_of_hdf5(file)
    return xr.load_dataset(path, engine="h5netcdf", decode_times=False, phony_dims="sort")


def _require_hdf5() -> None:
    if importlib.util.find_spec("h5netcdf") is None:
        raise RecordError('HDF5 needs the package h5netcdf: pip install "clearance-mj[hdf5]"; .nc needs nothing more')


NETCDF = register(Format(
    "NetCDF", (".nc",), (Channel, Response, FRF, Spectra, Modes, Geometry), load, save,
    options=("columns", "fs", "resample"),
    note="NetCDF 3; `simulate` writes its response here, with contact and grease forces",
))  # fmt: skip
register(dataclasses.replace(
    NETCDF, name="HDF5", suffixes=_HDF5,
    note='the same as NetCDF 4, and time records of other programs, such as Rattlesnake; '
    'needs h5netcdf: `pip install "clearance-mj[hdf5]"`',
))  # fmt: skip
