"""A small share of the fuzzing, the same in every run; the tool itself, on readers that misbehave; what was found."""

import faulthandler
import gzip
import json
import os
import signal
import time

import h5py
import numpy as np
import pytest
import scipy.io

from clearance_mj import ClearanceError, RecordError, load_law
from clearance_mj.core import tasks
from clearance_mj.core.files import most_unpacked
from clearance_mj.io.csv_tables import read_csv
from clearance_mj.io.lvm import read_lvm
from clearance_mj.io.mat import read_mat
from clearance_mj.live import server
from clearance_mj.sweep import Design, Vary, load_plan

from ..processes import content
from ..refusals import assert_refused
from . import command_lines, run, samples
from .__main__ import table
from .mutations import toml
from .readers import Reader, generator, readers
from .run import fuzz

# Inputs of those that take longer, in the quick tests and in the slow ones.
FEW = {"NetCDF": 3, "HDF5": 3, "command line": 5, "rig at an edge": 5, "absurd rig and law": 15}
MORE = {"NetCDF": 30, "HDF5": 30, "command line": 40, "rig at an edge": 30, "absurd rig and law": 150}
FIRST = {"command line": 2}  # Before it, command lines identify a bench, which alone takes ten seconds.


def shared(name, count, tmp_path, first=0):
    outcome = fuzz([readers()[name]], 2, tmp_path, first=first, count=count, progress=False)[name]
    assert outcome.findings == [] and outcome.inputs == count == outcome.read + outcome.refused
    return outcome


@pytest.mark.parametrize("name", [*readers()])
def test_a_few_inputs(name, tmp_path):
    shared(name, FEW.get(name, 60), tmp_path, FIRST.get(name, 0))


def test_command_lines_leave_nothing_patched():
    """Processes that ran as threads of this one took it with them where a later test kills one."""
    before = tasks._on_processes, server.serve
    command_lines.prepare([b'["new"]'])
    assert (tasks._on_processes, server.serve) == before


@pytest.mark.slow
@pytest.mark.parametrize("name", [*readers()])
def test_a_share_of_the_inputs(name, tmp_path):
    outcome = shared(name, MORE.get(name, 80), tmp_path)
    # Damage that stops every file at the door would find nothing.
    assert 0 < outcome.read < outcome.inputs and len(outcome.messages) >= 3


@pytest.mark.parametrize("name", [*readers()])
def test_an_input_is_made_again_by_its_index(name):
    reader = readers()[name]
    one, other = (reader.make(generator(reader, 1, 7)) for _ in range(2))
    assert one == other or name == "HDF5"  # it stores the time of a change


# The tool.


def misbehaving(path, rng):
    match int(path.read_text()):
        case 3:
            raise KeyError("escaped")
        case 5:
            faulthandler.disable()  # pytest's
            os.kill(os.getpid(), signal.SIGSEGV)
        case 7:
            time.sleep(60)
        case 9:
            np.ones(2**27)
        case 11:
            raise RecordError("it is wrong")
        case 13:
            raise RecordError(f"{path}: Unable to allocate 9 GiB")
        case i if i % 2:
            raise RecordError(f"{path}: {i} is odd")


def test_what_no_reader_may_do_is_found_and_kept(tmp_path, monkeypatch):
    """Every other input is read all the same, also those after a crash or a hang in the same batch."""
    monkeypatch.setattr(run, "generator", lambda reader, seed, index: index)  # in place of random numbers
    reader = Reader("odd ones", "a.txt", lambda index: b"%d" % index, misbehaving, 20, patience=0.3)
    outcome = fuzz([reader], 1, tmp_path, workers=1, progress=False)["odd ones"]
    assert {index: what for index, what, *_ in outcome.findings} == {
        3: "escaped", 5: "crashed", 7: "hung", 9: "memory", 11: "unclear", 13: "memory",
    }  # fmt: skip
    assert (outcome.inputs, outcome.read) == (20, 10)
    assert "KeyError: 'escaped'" in next(detail for index, _, detail, _ in outcome.findings if index == 3)
    assert "by SIGSEGV" in next(detail for index, _, detail, _ in outcome.findings if index == 5)
    assert content(tmp_path) == {f"odd_ones-1-{i}.txt": b"%d" % i for i in (3, 5, 7, 9, 11, 13)}
    json.dumps(outcome.summary())


def test_table_of_the_page():
    row = {"read": 1, "refused": 2000, "memory_growth_mb": 4}
    summary = {name: run.Outcome(inputs=n).summary() | row for name, n in (("A", 2001), ("B", 1))}
    *_, sums, _, total = table(summary).strip().splitlines()
    assert sums == "| sum | 2,002 | 2 | 4,000 | 0 |"
    assert total == "0 inputs are distinct; the memory of a process grew by at most 4 MB."


# What it has found.


def packed_csv(path):
    path.write_bytes(gzip.compress(b"time,base\n" + b"1,1\n" * 2**24))


def packed_mat(path):
    scipy.io.savemat(path, {"fs": 64.0, "base": np.zeros(2**23)}, do_compression=True)


def declared_hdf5(path):
    with h5py.File(path, "w") as file:
        file.attrs["clearance_mj"] = "channels"
        file.create_dataset("value", (4, 10**11), "f8")


@pytest.mark.parametrize("name, make", [
    ("CSV", packed_csv), ("LVM", packed_csv), ("MATLAB", packed_mat), ("HDF5", declared_hdf5),
], ids=["csv.gz", "lvm.gz", "mat", "h5"])  # fmt: skip
def test_a_small_file_that_unpacks_to_a_large_one(tmp_path, name, make):
    """64 MB and more out of 1 to 130 kB: refused in less than the 500 MB that the process may take."""
    make(tmp_path / "whole")
    data = (tmp_path / "whole").read_bytes()
    reader = Reader(name, readers()[name].file, lambda rng: data, readers()[name].read, 1)
    outcome = fuzz([reader], 1, tmp_path / "found", progress=False)[name]
    assert outcome.findings == []
    assert any("times its size, which no record does" in message for message in outcome.messages)


def test_numbers_that_were_measured_unpack(tmp_path):
    """White noise with six digits, compressed as well as gzip can."""
    noise = np.random.default_rng(0).standard_normal((50_000, 2))
    text = "time,base,acc:1\n" + "".join(f"{i / 64},{a:.6g},{b:.6g}\n" for i, (a, b) in enumerate(noise))
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text.encode(), 9))
    assert len(text) < most_unpacked((tmp_path / "a.csv.gz").stat().st_size) / 10
    assert len(read_csv(tmp_path / "a.csv.gz")) == 2


def plan(table, **changes):
    return toml(samples.PLAN | {table: samples.PLAN[table] | changes})


def mat(**held):
    return samples.written(lambda file: scipy.io.savemat(file, held | {"base": np.arange(4.0)}))


def mat_of_too_many_cells():
    """scipy would make room for 2 GB of them."""
    data, size = mat(fs=64.0, x=np.array(["a", "b"], dtype=object)), np.array([1, 2], dtype="<i4").tobytes()
    assert data.count(size) == 1
    return data.replace(size, np.array([1, 2**28], dtype="<i4").tobytes())


def contact_law(**changed):
    return json.dumps({"kind": "contact", "contact": [{"stiffness": 1} | changed]}).encode()


@pytest.mark.parametrize("read, content, part", [
    (read_csv, b"time,base\n0e400,1\n0e400,2\n0e999,3\n", 'column 1 "time": goes from 0 s to 0 s'),
    (read_lvm, samples.lvm()[2].replace(b"X0\t0.5", b"X0\t0.5-1"), "the segment header needs X0, a number"),
    *((read_mat, mat(fs=stored), 'variable "fs" must be one number') for stored in ("fast", 1j, [])),
    (read_mat, mat_of_too_many_cells(), "an array declares 268435456 elements, which do not follow"),
    (load_law, b"[" * 100_000, "not a law file"),
    (load_law, b'{"kind": "constant", "k": 1' + b"0" * 400 + b', "c": 0}', "k must be numbers"),
    (load_law, contact_law(model=["a"]), r"contact[0].model ['a'] is unknown"),
    (load_law, contact_law(model="kelvin-voigt", adhesion=[1]), "contact[0].adhesion must be true or false, got [1]"),
    (load_law, contact_law(model="hunt-crossley", stiffness=[1], restitution=0.5),
     "contact[0].stiffness must be a plain number in SI units, got [1]"),
    (load_plan, b'rig = "rig.toml"\nengine = { name = { a = 1 } }\n', "engine \"{'a': 1}\" is unknown"),
    (load_plan, plan("excitation", duration=10**400), "excitation: a whole number is too large to use"),
    (load_plan, plan("excitation", band=[5, 10**400]), "excitation: a whole number is too large to use"),
    (load_plan, plan("excitation", duration=1e9), "excitation: duration times fs is more than 10000000 samples"),
    (load_plan, plan("outputs", resolution=1e-320), "shorter than one segment of"),
])  # fmt: skip
def test_refused_in_one_line(tmp_path, read, content, part):
    path = tmp_path / "file"
    path.write_bytes(content)
    samples.RIG.save(tmp_path / "rig.toml")
    message = assert_refused(ClearanceError, None, read, path)
    assert part in message and str(path) in message and message.isprintable()


def test_messages_are_one_printable_line():
    assert str(RecordError("a\nb\tc\x85ä")) == r"a\nb\tc\x85ä"
    assert len(str(RecordError("x" * 10**6))) < 600


def test_a_plan_of_millions_of_cases_is_looked_at_in_time(tmp_path):
    """Only a part of the cases is tried beforehand; points that would not fit into memory are refused."""
    samples.RIG.save(tmp_path / "rig.toml")
    vary = '[[vary]]\npath = "rig.bushings.gap"\nlow = 1e-4\nhigh = 2e-4\ncount = {}\n'
    (tmp_path / "plan.toml").write_text('rig = "rig.toml"\n' + vary.format(10**6))
    assert load_plan(tmp_path / "plan.toml").points.shape == (10**6, 1)
    many = [Vary(f"a{i}", low=0.0, high=1.0) for i in range(100)]
    for method in ("latin-hypercube", "sobol", "saltelli"):
        assert_refused(ClearanceError, "cases of 100 parameters are too many", Design(method, 2**20).points, many)
