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

from clearance_mj import Channel, ClearanceError, Dataset, LawError, Rig, RigError, load_law
from clearance_mj.beam import natural_frequencies
from clearance_mj.calibrate import read_frequencies
from clearance_mj.clearance.law_files import law_from_dict
from clearance_mj.io import formats, lvm
from clearance_mj.io.registry import FORMATS, Format
from clearance_mj.io.uff import read_geometry, scan_uff
from clearance_mj.sweep import load_plan
from clearance_mj.universal.dataset_58 import Header, function_block
from experiments.real import records as real

from . import absurd, command_lines, edges, loggers, samples, samples_uff
from .mutations import NUMBERS, as_json, damaged, packed, replanted, toml


@dataclass(frozen=True)
class Reader:
    """A kind of file."""

    name: str  #: in the table
    file: str  #: name of the file that is read
    make: Callable  #: random.Random -> bytes of an input
    read: Callable  #: path, random.Random -> None; raises what the reader raises
    inputs: int  #: how many a full run makes
    beside: Callable = dict  #: () -> names and bytes of files in the same folder
    memory: int = 500 * 2**20  #: bytes that reading may take beyond what the process has
    patience: float = 20.0  #: s of the processor's time for one input; they take milliseconds
    prepare: Callable = lambda inputs: None
    """takes inputs that come; compiles and imports what the processes of inputs, which are forked, shall have"""


def make_uff(rng, whole):
    if rng.random() < 0.75:
        return damaged(rng, rng.choice(whole), whole, text=rng.random() < 0.5)
    blocks = [_block(rng) for _ in range(rng.choice((1, 1, 2, 3)))]
    return b"".join(blocks if rng.random() < 0.7 else [damaged(rng, b, whole) for b in blocks])


def _block(rng):
    """A binary data set 58 of any kind, its length right more often than not."""
    if rng.random() < 0.15:
        return damaged(rng, rng.choice(samples_uff.uff()), samples_uff.uff(), text=True)
    kind, ordinate = rng.choice((1, 1, 4, 4, 6, 6, 2, 3, 9, 12, 5, 0, 7, 11, 26, 99, -1)), rng.choice((2, 4, 5, 6))
    size, even = rng.choice((1, 2, 3, 7)), rng.random() < 0.6
    header = Header(
        name=rng.choice(("a", "NONE", "", "    -1")), kind=kind, response=f"{rng.choice((0, 6, 7))}:+Z",
        reference=rng.choice(("0:S", "100:+Z", "200:-RX", "6:+Z")), ordinate=ordinate, size=size, even=even,
        first=rng.choice((0.0, 1.0, -5.0)), step=rng.choice(("1.00000e+00", "1.56250e-02", "1e-300", "0", "")),
        abscissa_type=rng.choice((0, 17, 17, 18, 18, 1, 19)), numerator=rng.choice((0, 1, 8, 11, 12, 13, 15)),
        denominator=rng.choice((0, 12, 13)), unit=rng.choice(("NONE", "g", "m/s^2", "g/N", "?", "g^2/Hz", "Pa", "²")),
        unit_below=rng.choice(("NONE", "N", "g")),
    )  # fmt: skip
    values = np.sort(np.array([rng.uniform(-9, 9) for _ in range(size * header.per_sample)]))
    if rng.random() < 0.1:
        values[rng.randrange(values.size)] = rng.choice((np.nan, np.inf, 1e308))
    if rng.random() < 0.1:
        values = values[:-1]
    with np.errstate(over="ignore"):
        if header.is_double and not even and values.size == size * header.per_sample and rng.random() < 0.5:
            rows = values.reshape(size, -1)  # with abscissas of single precision
            values = np.frombuffer(b"".join(row[:1].astype("<f4").tobytes() + row[1:].tobytes() for row in rows), "u1")
            return function_block(header, values)
        return function_block(header, values.astype("<f8" if header.is_double else "<f4"))


def read_any_uff(path, rng):
    """Raise the first refusal if no function could read the file."""
    refusals = []
    for function in (formats.read, scan_uff, read_geometry):
        try:
            shown_and_written(path.with_name("again.uff"), function(path))
        except ClearanceError as error:
            refusals.append(error)
    if len(refusals) == 3:
        raise refusals[0]


def shown_and_written(path, held):
    """What was read shows itself; what is written of it, unless that is refused, is read again."""
    repr(held)
    if isinstance(held, list) and not isinstance(held[0], Channel):
        return  # headers
    with contextlib.suppress(ClearanceError):
        formats.write(path, held)
        formats.read(path)


_FRF_HEADS = (
    b"frequency", b"frequency [kHz]", b"acc:6/base real", b"acc:6/base imag", b"acc:6/base coherence",
    b"acc:7/base magnitude", b"acc:7/base phase [deg]", b"acc:7/force magnitude [g/N]",
)  # fmt: skip
_HEADS = (
    b"time", b"time [ms]", b"base", b"base [g]", b"acc:6", b"acc:7 [mm/s2]", b"disp:6 [um]", b"force", b"Temp", b"",
    b"acc:6/base", b"acc:6:+RX", b"acc:99999999999", b"acc:6 [x]", b"1", *_FRF_HEADS,
)  # fmt: skip
_MAPS = (
    *10 * [None], {"1": "time", "2": "base [g]", "3": "acc:6"}, {"Temp": "skip"}, {"base": "acc:6 [g]"}, {"x": "y"},
)  # fmt: skip
_RATES = (*17 * [None], 64.0, 0.0, float("nan"))


def make_text(rng, whole):
    return damaged(rng, rng.choice(whole), whole, text=True)


def make_bytes(rng, whole):
    return damaged(rng, rng.choice(whole), whole)


def make_csv(rng, whole):
    kind = rng.random()
    if kind < 0.7:
        return packed(rng, make_text(rng, whole) if kind < 0.4 else loggers.table(rng))
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


def make_lvm(rng, whole):
    return packed(rng, make_text(rng, whole))


def read_table(path, rng):
    formats.read(path, rng.choice(_MAPS), rng.choice(_RATES))


def read_lvm(path, rng):
    lvm.read_lvm(path)
    with contextlib.suppress(ClearanceError):  # its columns have other names
        read_table(path, rng)


_VARIABLES = ("time", "fs", "data", "frf", "coherence", "columns", "base", "acc_6", "acc_7", "frequency", "force", "x")


def make_mat(rng, whole):
    if rng.random() < 0.6:
        return damaged(rng, rng.choice(whole), whole)
    held = {"fs": 64.0, "base": np.arange(6.0), "acc_6": np.arange(6.0)} if rng.random() < 0.7 else {}
    held |= {name: _array(rng) for name in rng.sample(_VARIABLES, rng.choice((1, 1, 2, 4)))}
    buffer = io.BytesIO()
    scipy.io.savemat(buffer, held, do_compression=rng.random() < 0.5, oned_as=rng.choice(("row", "column")))
    return buffer.getvalue() if rng.random() < 0.7 else damaged(rng, buffer.getvalue(), whole)


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


def make_hdf5(rng, whole):
    if rng.random() < 0.7:
        return damaged(rng, rng.choice(whole), whole)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.h5"
        path.write_bytes(rng.choice(whole))
        with h5netcdf.File(path, "a") as file:
            for _ in range(rng.choice((1, 1, 2))):
                _change_hdf5(rng, file)
        return path.read_bytes()


HDF5_WORDS = "frf", "channels", "response", "a"


def _change_hdf5(rng, file):
    """An attribute of another value or type, or a variable of other numbers or other dimensions."""
    where = rng.choice((file, *file.variables.values()))
    change = rng.random()
    names = list(where.attrs)
    if change < 0.6 and names:
        where.attrs[rng.choice(names)] = rng.choice((0, -1.0, np.nan, *HDF5_WORDS, np.zeros(3), "{}"))
    elif change < 0.7 and names:
        del where.attrs[rng.choice(names)]
    elif change < 0.85 and where is not file and where.dtype.kind == "f":
        where[...] = rng.choice((0.0, np.nan, np.inf, -1.0, 1e300))
    else:
        name, dims = f"more{rng.randrange(99)}", rng.sample(list(file.dimensions), rng.choice((0, 1)))
        if name not in file.variables:
            file.create_variable(name, dims, rng.choice(("f8", "i4", "S3")))


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


def read_structure(path, rng):
    """Through the rig file beside it, as users do; its frequencies are numbers, whatever was read."""
    rig = Rig.load(path.with_name("rig.toml"))
    with contextlib.suppress(RigError):
        assert np.isfinite(natural_frequencies(rig, 2)).all(), "frequencies of an accepted structure are not finite"


def make_arrays(load, save, rng, whole):
    """Damaged bytes, or whole files of damaged arrays."""
    if rng.random() < 0.5:
        return damaged(rng, rng.choice(whole), whole)
    held = {name: value for name, value in load(io.BytesIO(rng.choice(whole))).items() if not name.startswith("__")}
    return samples.written(lambda file: save(file, _changed(rng, held)))


def save_npz(file, held):
    np.savez(file, **{name: np.asarray(value) for name, value in held.items()})


make_npz = functools.partial(make_arrays, np.load, save_npz)
make_model_mat = functools.partial(make_arrays, scipy.io.loadmat, scipy.io.savemat)


def _changed(rng, held):
    """Arrays of a file with one or two left out, replaced, given another name or other numbers."""
    for _ in range(rng.choice((1, 1, 2))):
        name, change = rng.choice([*held]), rng.random()
        if change < 0.15:
            del held[name]
        elif change < 0.3:
            held[rng.choice(("C", "M", "K", "x", "mass_data", "coordinates"))] = held[name]
        elif change < 0.5:
            held[name] = _array(rng)
        elif isinstance(held[name], np.ndarray) and held[name].size and held[name].dtype.kind in "fiu":
            numbers = held[name].copy()
            numbers.flat[rng.randrange(numbers.size)] = rng.choice((0, 1, -1, 3, 100, 2**31 - 1))
            if numbers.dtype.kind == "f" and rng.random() < 0.5:
                numbers.flat[rng.randrange(numbers.size)] = rng.choice((np.nan, np.inf, 1e308, -1e9, 1e-320))
            held[name] = numbers if rng.random() < 0.8 else numbers[:-1]
    return held


def read_law(path, rng):
    law = load_law(path)
    assert law_from_dict(law.to_dict()).to_dict() == law.to_dict(), "an accepted law is not the same after a round trip"
    with contextlib.suppress(LawError):  # of another number of bushings
        law.table(2)


def read_dataset(path, rng):
    for record in Dataset.load(path.parent).records:
        record.response()
        record.excitation()


def plainly(function):
    """A reader that takes nothing but the path."""
    return lambda path, rng: function(path)


MAKERS = {"UFF": (make_uff, 40_000), "CSV": (make_csv, 20_000), "LVM": (make_lvm, 20_000), "MATLAB": (make_mat, 15_000),
          "NetCDF": (make_bytes, 6_000), "HDF5": (make_hdf5, 3_000), "TDMS": (make_bytes, 6_000),
          "MDF": (make_bytes, 3_000)}  # fmt: skip
READERS = {"UFF": read_any_uff, "LVM": read_lvm}


def of_format(known: Format) -> Reader:
    """The reader of a registered format: whole files as it writes them and as others do, damaged."""
    make, inputs = MAKERS.get(known.name, (make_bytes, 5_000))
    read = READERS.get(known.name, read_table if "columns" in known.options else plainly(formats.read))
    whole = functools.cache(lambda: samples.whole(known))
    return Reader(known.name, f"a{known.suffixes[0]}", lambda rng: make(rng, whole()), read, inputs)


def readers() -> dict[str, Reader]:
    """Every reader by its name: the registered formats and the files that are read elsewhere."""
    records, beside_records = samples.dataset()
    rigs, laws = make_plain([samples.RIG.to_dict()], toml), make_plain([law.to_dict() for law in samples.LAWS], as_json)
    texts = {"frequencies (CSV)": ("modes.csv", samples.FREQUENCIES, read_frequencies),
             "DROPBEAR (text)": ("a.txt", samples.DROPBEAR, real.read_dropbear),
             "damper (JSON)": ("a.json", samples.DAMPER, real.read_damper)}  # fmt: skip
    structures = {"matrix (.mtx)": ("M.mtx", make_text, samples.matrix_market, 6_000),
                  "degrees of freedom (CSV)": ("dofs.csv", make_text, lambda: [samples.DOFS], 6_000),
                  "matrices (.npz)": ("model.npz", make_npz, samples.npz, 6_000),
                  "matrices (.mat)": ("model.mat", make_model_mat, samples.model_mat, 6_000),
                  "modes (UFF)": ("modes.uff", make_text, samples_uff.modes_uff, 6_000),
                  "modes (CSV)": ("modes.csv", make_text, lambda: samples.MODES_CSV, 6_000),
                  "MuJoCo model": ("model.xml", make_text, lambda: samples.MJCF, 6_000)}  # fmt: skip
    all_readers = [
        *(of_format(known) for known in dict.fromkeys(FORMATS.values()) if known.name not in ("TOML", "JSON")),
        Reader("rig (TOML)", "rig.toml", rigs, read_rig, 20_000),
        Reader("rig of a structure (TOML)", "rig.toml", make_plain(samples.structure_rigs(), toml), read_rig, 10_000),
        *(Reader(name, file, functools.partial(make, whole=whole()), read_structure, inputs,
                 functools.partial(samples.beside_structure, file))
          for name, (file, make, whole, inputs) in structures.items()),
        Reader("law (JSON)", "law.json", laws, read_law, 20_000),
        Reader("sweep plan (TOML)", "plan.toml", make_plain(samples.PLANS, toml), plainly(load_plan), 6_000,
               samples.beside_plan),
        Reader("dataset (TOML)", "dataset.toml", make_plain([records], toml), read_dataset, 6_000,
               lambda: beside_records),
        *(Reader(name, file, functools.partial(make_text, whole=whole), plainly(read), 5_000)
          for name, (file, whole, read) in texts.items()),
        Reader("absurd rig and law", "case.json", absurd.make, absurd.run, 5_000, dict, 2**30, 10.0, absurd.prepare),
        Reader("command line", "line.json", command_lines.make, command_lines.run, 20_000, dict, 2**30, 10.0,
               command_lines.prepare),
        Reader("rig at an edge", "edge.json", edges.make, edges.run, 2_000, dict, 2**30, 60.0, edges.prepare),
    ]  # fmt: skip
    return {reader.name: reader for reader in all_readers}


def generator(reader: Reader, seed: int, index: int) -> random.Random:
    """The random numbers of an input: those that make it, then those that read it."""
    return random.Random(f"{reader.name} {seed} {index}")
