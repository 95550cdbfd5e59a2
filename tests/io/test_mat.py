"""MATLAB files: what MATLAB users save comes back in SI units; every fault is named with the variable.

The files are written by scipy as MATLAB's save(..., '-v6') lays them out.
"""

import numpy as np
import pytest
import scipy.io

from clearance_mj import Channel, RecordError
from clearance_mj.io.mat import read_mat, read_variables, write_mat

from .refusals import assert_refused

FS, N = 2048.0, 300
TIME = 1.5 + np.arange(N) / FS


@pytest.fixture
def save(tmp_path):
    def save(**variables):
        scipy.io.savemat(tmp_path / "a.mat", variables)
        return tmp_path / "a.mat"

    return save


def test_vectors_named_after_channels(save, rng):
    base, tip = rng.standard_normal((2, N))
    got = read_mat(save(time=TIME, base=base, acc_8=tip[:, None], note="bench 3"))
    assert [(c.label, c.quantity, c.fs, c.start) for c in got] == [
        ("100:+Z", "acceleration", FS, 1.5),
        ("8:+Z", "acceleration", FS, 1.5),
    ]
    np.testing.assert_array_equal([c.value for c in got], [base, tip])


@pytest.mark.parametrize("turned", [False, True])
def test_columns_of_a_matrix_by_a_map(save, rng, turned):
    data = rng.standard_normal((N, 3))
    path = save(X=data.T if turned else data, fs=FS, T=rng.standard_normal(N))
    got = read_mat(path, {"X:1": "force [kN]", "X:2": "skip", "X:3": "acc:3:-Z [g]", "T": "skip"})
    assert [(c.label, c.quantity, c.fs) for c in got] == [("200:+Z", "force", FS), ("3:-Z", "acceleration", FS)]
    np.testing.assert_allclose([c.value for c in got], [1e3 * data[:, 0], 9.80665 * data[:, 2]], rtol=1e-15)


def test_variables_of_other_names_are_raw_channels(save, rng):
    data = rng.standard_normal((N, 2))
    got = read_mat(save(t=TIME, X=data, Force=TIME))
    assert [(c.name, c.quantity, c.placed) for c in got] == [(n, "unknown", False) for n in ("X:1", "X:2", "Force")]
    np.testing.assert_array_equal([got[0].value, got[1].value], data.T)
    first, second = read_mat(save(time=TIME, data=data, columns=np.array(["Accel 1 [g]", "U [V]"], dtype=object)))
    assert (first.name, first.quantity, second.name, second.unit) == ("Accel 1", "acceleration", "U", "V")
    np.testing.assert_array_equal(first.value, 9.80665 * data[:, 0])


def test_rate_of_the_caller(save):
    assert read_mat(save(base=TIME), fs=512.0)[0].fs == 512.0


def test_complex_frfs_by_a_map(save, rng):
    h = rng.standard_normal((50, 2)) + 1j * rng.standard_normal((50, 2))
    got = read_mat(
        save(f=1.0 + np.arange(50), H=h), {"f": "frequency", "H:1": "acc:1/force [g/N]", "H:2": "acc:2:-Z/force"}
    )
    assert (got.responses, got.reference, got.quantity) == (("1:+Z", "2:-Z"), "200:+Z", "acceleration/force")
    np.testing.assert_allclose(got.functions, h.T * [[9.80665], [1]], rtol=1e-15)


def test_matlab_users_find_plain_names_in_our_file(tmp_path, rng):
    write_mat(tmp_path / "r.mat", [Channel("a", 3, "+Z", "acceleration", rng.standard_normal(N), FS)])
    held = scipy.io.loadmat(tmp_path / "r.mat", squeeze_me=True)
    assert (held["fs"], str(held["columns"]), held["data"].shape) == (FS, "acc:3 [m/s2]", (N,))
    np.testing.assert_allclose(held["time"], np.arange(N) / FS)


@pytest.mark.parametrize("variables, part", [
    ({"base": TIME}, 'no variable "time" or "fs"'),
    ({"time": TIME, "base": TIME, "acc3": TIME}, 'variable "acc3": not the name .*did you mean "acc:3"'),
    ({"time": TIME, "base": TIME[:-1]}, '"base" has 299 numbers, "time" has 300'),
    ({"time": TIME, "base": TIME * 1j}, 'variable "base" is complex'),
    ({"time": TIME**2, "base": TIME}, "times are uneven"),
    ({"time": TIME}, "has no channel beside time"),
    ({"s": {"x": TIME}}, '"x": does not say its sampling interval or rate; give the sampling rate'),
    ({"s": {"x": "none"}}, "holds no numeric vectors"),
    ({"fs": FS, "data": TIME, "columns": np.array(["base", "acc:1"], dtype=object)}, '"columns" names 2 columns'),
])  # fmt: skip
def test_variables_that_cannot_be_used(save, variables, part):
    path = save(**variables)
    with pytest.raises(RecordError, match=part) as caught:
        read_mat(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def test_version_7_3_is_refused_with_a_way_out(tmp_path):
    """The first 128 bytes of a version 7.3 file: text, then version 2.0 and the byte order."""
    (tmp_path / "a.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM\x89HDF\r\n\x1a\n" + bytes(512))
    assert_refused(r"version 7\.3, which is not read; save it in MATLAB with .*-v7", read_mat, tmp_path / "a.mat")


def test_an_element_of_an_unknown_type(tmp_path):
    """It ends the process in scipy 1.17, which takes the type as an index."""
    scipy.io.savemat(tmp_path / "a.mat", {"time": TIME, "base": TIME}, do_compression=False)
    data = (tmp_path / "a.mat").read_bytes()
    numbers = data.index(b"\x09\x00\x00\x00" + (8 * N).to_bytes(4, "little"))
    (tmp_path / "a.mat").write_bytes(data[:numbers] + b"\x81" + data[numbers + 1 :])
    assert_refused("element of the unknown type 129", read_mat, tmp_path / "a.mat")


def test_files_that_are_none(tmp_path, save):
    whole = save(time=TIME, base=TIME).read_bytes()
    for content in (b"", b"\x00\xff" * 400, whole[:200], whole[:-100]):
        (tmp_path / "b.mat").write_bytes(content)
        with pytest.raises(RecordError, match="not a whole MATLAB file") as caught:
            read_mat(tmp_path / "b.mat")
        assert "\n" not in str(caught.value)
    assert_refused("No such file", read_mat, tmp_path / "absent.mat")


def test_structure_of_variables(tmp_path):
    """As scipy writes it; within one, and many of them, which are a list."""
    inner = {"x": TIME, "name": "a", "deep": {"y": 2.0}}
    scipy.io.savemat(tmp_path / "a.mat", {"one": inner, "many": np.array([(1.0,), (2.0,)], dtype=[("z", object)])})
    held = read_variables(tmp_path / "a.mat")
    assert [float(item["z"].item()) for item in held["many"]] == [1.0, 2.0] and list(held["one"]) == [
        "x", "name", "deep",
    ]  # fmt: skip
    np.testing.assert_array_equal(held["one"]["x"], TIME[None])
    assert held["one"]["name"] == "a" and held["one"]["deep"]["y"] == 2.0
