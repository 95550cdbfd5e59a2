"""Write a response that comes block by block into one file, so that none of it needs to be in memory as a whole."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from os import PathLike
from pathlib import Path

import numpy as np

from ..errors import RecordError
from ..files import replacing
from ..signals.response import Response
from .results import _HDF5, _require_hdf5

__all__ = ["saving"]


def saving(path: str | PathLike[str], blocks: Iterable[Response]) -> Iterator[Response]:
    """Write blocks to an HDF5 file as they pass: ``estimate_frf_blocks(saving("run.h5", simulate_blocks(...)))``.

    The file, ".h5" or ".hdf5", is there once the last block was taken; `io.results.load` reads it.
    """
    if Path(path).suffix.lower() not in _HDF5:
        raise RecordError(f"{path}: blocks are appended to HDF5 only; give a name that ends in {' or '.join(_HDF5)}")
    _require_hdf5()
    import h5py

    blocks = iter(blocks)
    first = next(blocks, None)
    if first is None:
        raise RecordError(f"{path}: there is no block to write")
    with replacing(path) as temporary:
        written, done = first.to_xarray(), first.excitation.size
        written.to_netcdf(temporary, engine="h5netcdf", unlimited_dims=["time"])
        yield first
        with h5py.File(temporary, "a") as file:
            names = [str(name) for name, variable in written.variables.items() if "time" in variable.dims]
            for block in blocks:
                size = block.excitation.size
                for name in names:
                    value = (done + np.arange(size)) / block.fs if name == "time" else getattr(block, name)
                    file[name].resize(done + size, axis=value.ndim - 1)
                    file[name][..., done:] = value
                done += size
                yield block
