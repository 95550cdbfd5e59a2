"""What reads each kind of file, and how its inputs are made."""

import contextlib
import functools
import io
import random
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5netcdf
import numpy as np
import scipy.io

from clearance_mj.calibrate.files import read_frequencies
from clearance_mj.clearance.law import law_from_dict, load_law
from clearance_mj.errors import ClearanceError, LawError
from clearance_mj.io import formats, lvm, results
from clearance_mj.io.dataset import Dataset
from clearance_mj.io.uff import Geometry, read_geometry, read_uff, scan_uff
from clearance_mj.io.uff._dataset_58 import Header, function_block
from clearance_mj.rig import Rig
from clearance_mj.sweep import load_plan
from clearance_mj.sweep.store import Table
from experiments.real import records as real

from . import samples
from .mutations import NUMBERS, as_json, damaged, packed, replanted, toml


@dataclass(frozen=True)
class Reader:
    """A kind of file."""

    name: str
    """in the table"""
    file: str
    """name of the file that is read"""
    make: Callable
    """random.Random -> bytes of an input"""
    read: Callable
    """path, random.Random -> None; raises what the reader raises"""
    inputs: int
    """how many a full run makes"""
    beside: Callable = dict
    """() -> names and bytes of files in the same folder"""


def every(path, rng, *functions):
    """Call all, and raise the first refusal if none of them could read the file."""
    refusals = []
    for function in functions:
        try:
            function(path)
        except ClearanceError as error:
            refusals.append(error)
    if len(refusals) == len(functions):
        raise refusals[0]


# Universal files.


@functools.cache
def _uff():
    return samples.uff()


def make_uff(rng):
    if rng.random() < 0.75:
        return damaged(rng, rng.choice(_uff()), _uff(), text=rng.random() < 0.5)
    blocks = [_block(rng) for _ in range(rng.choice((1, 1, 2, 3)))]
    return b"".join(blocks if rng.random() < 0.7 else [damaged(rng, b, _uff()) for b in blocks])


def _block(rng):
    """A binary data set 58 of any kind, its length right more often than not."""
    kind, ordinate = rng.choice((1, 1, 4, 4, 6, 0, 99)), rng.choice((2, 4, 5, 6))
    size, even = rng.choice((1, 2, 3, 7)), rng.random() < 0.6
    header = Header(
        name=rng.choice(("a", "NONE", "", "    -1")), kind=kind, response=f"{rng.choice((0, 6, 7))}:+Z",
        reference=rng.choice(("0:S", "100:+Z", "200:-RX")), ordinate=ordinate, size=size, even=even,
        first=rng.choice((0.0, 1.0, -5.0)), step=rng.choice(("1.00000e+00", "1.56250e-02", "1e-300", "0", "")),
        abscissa_type=rng.choice((0, 17, 18, 1)), numerator=rng.choice((0, 8, 11, 12, 13)),
        denominator=rng.choice((0, 12, 13)), unit=rng.choice(("NONE", "g", "m/s^2", "g/N", "?")),
        unit_below=rng.choice(("NONE", "N", "g")),
    )  # fmt: skip
    values = np.sort(np.array([rng.uniform(-9, 9) for _ in range(size * header.per_sample)]))
    if rng.random() < 0.1:
        values[rng.randrange(values.size)] = rng.choice((np.nan, np.inf, 1e308))
    if rng.random() < 0.1:
        values = values[:-1]
    with np.errstate(over="ignore"):
        return function_block(header, values.astype("<f8" if header.is_double else "<f4"))


def read_any_uff(path, rng):
    every(path, rng, read_uff, scan_uff, _geometry)


def _geometry(path):
    assert isinstance(read_geometry(path), Geometry)


# Tables.


@functools.cache
def _csv():
    return samples.csv()


_FRF_HEADS = (
    b"frequency", b"frequency [kHz]", b"acc:6/base real", b"acc:6/base imag", b"acc:6/base coherence",
    b"acc:7/base magnitude", b"acc:7/base phase [deg]", b"acc:7/force magnitude [g/N]",
)  # fmt: skip
_HEADS = (
    b"time", b"time [ms]", b"base", b"base [g]", b"acc:6", b"acc:7 [mm/s2]", b"disp:6 [um]", b"force", b"Temp", b"",
    b"acc:6/base", b"acc:6:+RX", b"acc:99999999999", b"acc:6 [x]", b"1", *_FRF_HEADS,
)  # fmt: skip
_MAPS = (
    *10 * [None],
    {"1": "time", "2": "base [g]", "3": "acc:6"},
    {"Temp": "skip"},
    {"base": "acc:6 [g]"},
    {"x": "y"},
)
_RATES = (*17 * [None], 64.0, 0.0, float("nan"))


def make_csv(rng):
    if rng.random() < 0.6:
        return packed(rng, damaged(rng, rng.choice(_csv()), _csv(), text=True))
    heads = rng.sample(_HEADS, rng.choice((1, 2, 2, 3, 3, 4, 5)))
    if rng.random() < 0.7:  # of one kind, as a file has them
        heads = [rng.choice(_HEADS[:2]), *rng.sample(_HEADS[2:7], rng.choice((1, 2, 3, 4)))]
        if rng.random() < 0.3:
            heads = [rng.choice(_FRF_HEADS[:2]), *rng.sample(_FRF_HEADS[2:], rng.choice((2, 2, 3, 4)))]
    separator, step = rng.choice((b",", b",", b";", b"\t")), rng.choice((0.5, 1e-3, 1 / 2048))
    rows = [[f"{i * step:.9g}".encode(), *(f"{rng.uniform(-2, 2):.6g}".encode() for _ in heads[1:])] for i in range(5)]
    if rng.random() < 0.4:
        rng.choice(rows)[rng.randrange(len(heads))] = rng.choice(NUMBERS)
    return packed(rng, b"\n".join(separator.join(row) for row in (heads, *rows)))


def read_table(path, rng):
    formats.read(path, rng.choice(_MAPS), rng.choice(_RATES))


@functools.cache
def _lvm():
    return samples.lvm()


def make_lvm(rng):
    return packed(rng, damaged(rng, rng.choice(_lvm()), _lvm(), text=True))


@functools.cache
def _mat():
    return samples.mat()


_VARIABLES = ("time", "fs", "data", "frf", "coherence", "columns", "base", "acc_6", "acc_7", "frequency", "force", "x")


def make_mat(rng):
    if rng.random() < 0.6:
        return damaged(rng, rng.choice(_mat()), _mat())
    held = {"fs": 64.0, "base": np.arange(6.0), "acc_6": np.arange(6.0)} if rng.random() < 0.7 else {}
    held |= {name: _array(rng) for name in rng.sample(_VARIABLES, rng.choice((1, 1, 2, 4)))}
    buffer = io.BytesIO()
    scipy.io.savemat(buffer, held, do_compression=rng.random() < 0.5, oned_as=rng.choice(("row", "column")))
    return buffer.getvalue() if rng.random() < 0.7 else damaged(rng, buffer.getvalue(), _mat())


def _array(rng):
    n = rng.choice((0, 1, 2, 6, 6, 6))
    made = rng.choice((
        lambda: np.arange(n) / 64, lambda: np.arange(n, dtype=rng.choice(("i1", "u2", "i8", "f4", ">f8"))),
        lambda: np.ones((n, rng.choice((1, 2, 3)))), lambda: 1j * np.arange(n), lambda: np.full(n, np.nan),
        lambda: rng.choice((64.0, 0.0, -1.0, np.nan, 1j)), lambda: "text", lambda: {"x": 1},
        lambda: np.zeros((2, 2, 2)),
        lambda: np.array(["base", "acc:6", "acc:6/base"][:n], dtype=object), lambda: np.array([[], ["a", 1.0]], object),
        lambda: np.arange(n) > 1, lambda: np.array(["base"], dtype=object), lambda: np.zeros((0, 3)),
    ))  # fmt: skip
    return made()


# Results.


@functools.cache
def _netcdf(suffix):
    return samples.netcdf(suffix)


def make_netcdf(rng):
    return damaged(rng, rng.choice(_netcdf(".nc")), _netcdf(".nc"))


def make_hdf5(rng):
    if rng.random() < 0.7:
        return damaged(rng, rng.choice(_netcdf(".h5")), _netcdf(".h5"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.h5"
        path.write_bytes(rng.choice(_netcdf(".h5")))
        with h5netcdf.File(path, "a") as file:
            for _ in range(rng.choice((1, 1, 2))):
                _change_hdf5(rng, file)
        return path.read_bytes()


def _change_hdf5(rng, file):
    """An attribute of another value or type, or a variable of other numbers or other dimensions."""
    where = rng.choice((file, *file.variables.values()))
    change = rng.random()
    names = list(where.attrs)
    if change < 0.6 and names:
        where.attrs[rng.choice(names)] = rng.choice(
            (0, -1.0, np.nan, "frf", "channels", "response", "a", np.zeros(3), "{}")
        )
    elif change < 0.7 and names:
        del where.attrs[rng.choice(names)]
    elif change < 0.85 and where is not file and where.dtype.kind == "f":
        where[...] = rng.choice((0.0, np.nan, np.inf, -1.0, 1e300))
    else:
        name, dims = f"more{rng.randrange(99)}", rng.sample(list(file.dimensions), rng.choice((0, 1)))
        if name not in file.variables:
            file.create_variable(name, dims, rng.choice(("f8", "i4", "S3")))


@functools.cache
def _table():
    return samples.table()


def make_table(rng):
    return damaged(rng, _table()[0], _table())


def read_cases(path, rng):
    Table(path, samples.TABLE, 3).finished()


# Plain data.


def make_plain(data, write):
    """Maker of files of nested plain data: most have entries replaced, some bytes."""
    texts = [write(item) for item in data]

    def make(rng):
        if rng.random() < 0.7:
            return write(replanted(rng, rng.choice(data)))
        if rng.random() < 0.05:
            return b"x = " * (write is toml) + rng.choice((b"[", b'{"a":')) * rng.choice((50, 5000))
        return damaged(rng, rng.choice(texts), texts, text=True)

    return make


def read_rig(path, rng):
    rig = Rig.load(path)
    assert Rig.from_dict(rig.to_dict()) == rig, "an accepted rig is not the same after a round trip"


def read_law(path, rng):
    law = load_law(path)
    assert law_from_dict(law.to_dict()).to_dict() == law.to_dict(), "an accepted law is not the same after a round trip"
    with contextlib.suppress(LawError):  # of another number of bushings
        law.table(2)


def read_dataset(path, rng):
    for record in Dataset.load(path.parent).records:
        record.response()
        record.excitation()


def _samples(make):
    found = make()
    return lambda rng: damaged(rng, rng.choice(found), found, text=True)


def plainly(function):
    """A reader that takes nothing but the path."""
    return lambda path, rng: function(path)


@functools.cache
def readers() -> dict[str, Reader]:
    """Every reader by its name."""
    records, beside_records = samples.dataset()
    rigs, laws = [samples.RIG.to_dict()], [law.to_dict() for law in samples.LAWS]
    load, frequencies = plainly(results.load), _samples(samples.frequencies)
    dropbear, damper = plainly(real.read_dropbear), plainly(real.read_damper)
    found = (
        Reader("UFF", "a.uff", make_uff, read_any_uff, 40_000),
        Reader("CSV", "a.csv", make_csv, read_table, 20_000),
        Reader("LVM", "a.lvm", make_lvm, plainly(lvm.read_lvm), 20_000),
        Reader("MATLAB", "a.mat", make_mat, read_table, 15_000),
        Reader("NetCDF", "a.nc", make_netcdf, load, 6_000),
        Reader("HDF5", "a.h5", make_hdf5, load, 3_000),
        Reader("rig (TOML)", "rig.toml", make_plain(rigs, toml), read_rig, 20_000),
        Reader("law (JSON)", "law.json", make_plain(laws, as_json), read_law, 20_000),
        Reader("sweep plan (TOML)", "plan.toml", make_plain(samples.PLANS, toml), plainly(load_plan), 6_000,
               samples.beside_plan),
        Reader("dataset (TOML)", "dataset.toml", make_plain([records], toml), read_dataset, 6_000,
               lambda: beside_records),
        Reader("table of a sweep", "cases.npy", make_table, read_cases, 5_000),
        Reader("frequencies (CSV)", "modes.csv", frequencies, plainly(read_frequencies), 5_000),
        Reader("DROPBEAR (text)", "a.txt", _samples(samples.dropbear), dropbear, 5_000),
        Reader("damper (JSON)", "a.json", _samples(samples.damper), damper, 5_000),
    )  # fmt: skip
    return {reader.name: reader for reader in found}


def generator(reader: Reader, seed: int, index: int) -> random.Random:
    """The random numbers of an input: those that make it, then those that read it."""
    return random.Random(f"{reader.name} {seed} {index}")
