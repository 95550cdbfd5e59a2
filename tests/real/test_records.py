"""Readers of the published records, on small files of the same form."""

import gzip
import json

import numpy as np
import pytest
import scipy.io

from clearance_mj.core.errors import RecordError
from experiments.real.records import read_damper, read_dropbear, read_hammer, read_stepped_sines, real_folder

from ..refusals import assert_refused

NAMES = "Low G Accel\tSG_300_a\tAccel\tPinLoc\tTime"
DROPBEAR = (
    f"C:\\test0.txt\nProgrammer - None\nStriker Velocity - 0\nSampling Frequency - 5000\nMon\n{NAMES}\nVoltage\n0.0\n\n"
    "1.5E+0\t0\t9\t1.25\t0.0\n-2.5\t0\t9\t1.50\t2.0E-4\n3.5\t0\t9\t1.75\t4.0E-4\n"
)
ROWS = [[0.0, 1.0, 2.0, 0, 0, 0], [0.5, -1.0, -2.0, 0, 0, 0], [1.0, 0.0, 1.0, 0, 0, 0]]


def write(path, content):
    """A file of text or bytes, or MATLAB's of the hammer's hit with changes."""
    if isinstance(content, dict):
        scipy.io.savemat(path, {"HIdata": HIT | content})
    else:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("pack", [str.encode, lambda text: gzip.compress(text.encode(), mtime=0)])
def test_dropbear(tmp_path, pack):
    record = read_dropbear(write(tmp_path / "a.txt", pack(DROPBEAR)))
    known = [1.5, -2.5, 3.5], [1.25, 1.5, 1.75], [0, 2e-4, 4e-4]
    np.testing.assert_array_equal((record.acceleration, record.position, record.time), known)
    assert record.fs == pytest.approx(5000)


def test_damper(tmp_path):
    record = read_damper(write(tmp_path / "a.json.gz", gzip.compress(json.dumps({"data": ROWS}).encode())))
    np.testing.assert_allclose(record.displacement, [0.0254, -0.0254, 0.0])
    np.testing.assert_allclose(record.force, [8896.443, -8896.443, 4448.222], rtol=1e-6)
    assert record.fs == 2.0


HIT = {"time": [0.0, 0.5, 1.0], "acc1": [1.0, 2.0, 3.0], "acc2": [0.0, 0.1, 0.2], "acc3": [4.0, 5.0, 6.0]}
STEPPED = (
    "control,index,frequency_Hz,force_N,amplitude_m_s2,phase_rad\n"
    "ForceControl,0,79.5,0.2,3.5,-0.1\nForceControl,0,80,0.25,8,-1.5\nResponseControl,1,80,0.1,20,-1.6\n"
)


def test_hammer(tmp_path):
    record = read_hammer(write(tmp_path / "a.mat", {}))
    np.testing.assert_array_equal(record.acceleration, [HIT["acc1"], HIT["acc2"], HIT["acc3"]])
    assert record.fs == 2.0


def test_stepped_sines(tmp_path):
    first, second = read_stepped_sines(write(tmp_path / "a.csv", STEPPED))
    assert (first.control, first.index, second.control, second.index) == ("ForceControl", 0, "ResponseControl", 1)
    np.testing.assert_array_equal((first.frequency, first.force, first.amplitude), [[79.5, 80], [0.2, 0.25], [3.5, 8]])
    np.testing.assert_array_equal(second.phase, [-1.6])


@pytest.mark.parametrize(("read", "name", "content", "message"), [
    (read_dropbear, "bad.txt", DROPBEAR.replace("PinLoc", "Roller"), "line 6: no column PinLoc"),
    (read_dropbear, "bad.txt", DROPBEAR.replace("-2.5\t", "-2.5V\t"), "line 11: 5 numbers expected"),
    (read_dropbear, "bad.txt", DROPBEAR.replace("-2.5\t0\t", "-2.5\t"), "line 11: 5 numbers expected"),
    (read_dropbear, "bad.txt", DROPBEAR.replace("-2.5\t", "nan\t"), "line 11: acceleration is not finite"),
    (read_dropbear, "bad.txt", DROPBEAR.replace("4.0E-4", "2.0E-4"), "line 12: the time does not rise"),
    (read_dropbear, "bad.txt", DROPBEAR[:60], "9 header lines"),
    (read_damper, "bad.json", '{"data":\n[[0, 1,', "line 2: not JSON"),
    (read_damper, "bad.json", "[1, 2]", "needs"),
    (read_damper, "bad.json", '{"data": [[0, 1, 2]]}', "two rows"),
    (read_damper, "bad.json", json.dumps({"data": [*ROWS, [2.0, "x", 1.0]]}), "row 4: needs numbers"),
    (read_damper, "bad.json", json.dumps({"data": [*ROWS, [0.5, 1.0, 1.0]]}), "row 4: the time does not rise"),
    (read_damper, "bad.json", json.dumps({"data": [*ROWS, [2.0, 1.0, float("nan")]]}), "row 4: force is not finite"),
    (read_hammer, "bad.mat", {"acc2": [[]]}, "it has no acc2"),
    (read_hammer, "bad.mat", {"acc3": [1.0, 2.0]}, r"have \[3, 3, 3, 2\] samples"),
    (read_hammer, "bad.mat", {"time": [0.0, 0.5, 0.5]}, "sample 3: the time does not rise"),
    (read_hammer, "bad.mat", {"acc1": [1.0, np.nan, 2.0]}, "sample 2: acc1 is not finite"),
    (read_stepped_sines, "bad.csv", "", "line 1: no column control"),
    (read_stepped_sines, "bad.csv", STEPPED.replace("force_N", "F"), "line 1: no column force_N"),
    (read_stepped_sines, "bad.csv", STEPPED.replace(",0.25,", ",x,"), "line 3: a control and 5 numbers"),
    (read_stepped_sines, "bad.csv", STEPPED.replace(",20,-1.6", ""), "line 4: a control and 5 numbers"),
    (read_stepped_sines, "bad.csv", STEPPED.replace(",0.25,", ",-0.25,"),
     "line 3: frequency, force and amplitude must be > 0"),
    (read_hammer, "bad.mat", "text, but long enough to be a header of a MATLAB file" * 8, "not a whole MATLAB file"),
])  # fmt: skip
def test_damaged(tmp_path, read, name, content, message):
    assert_refused(RecordError, f"{name}.*{message}", lambda: read(write(tmp_path / name, content)))


def test_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CLEARANCE_REAL_DATA", str(tmp_path))
    assert real_folder() == tmp_path
    monkeypatch.setenv("CLEARANCE_REAL_DATA", str(tmp_path / "none"))
    assert real_folder() is None
