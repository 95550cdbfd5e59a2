"""Universal files against the published format, against pyuff, and against damage.

The format: SDRC universal data sets 58, 151 and 164, https://www.ceas3.uc.edu/sdrluff/ (the text is also in
``pyuff.get_structure_58``). Files named "by hand" below are laid out from that text, not by our writer.
"""

import dataclasses
import re
import struct
import time
import tracemalloc

import numpy as np
import pytest
import pyuff
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clearance_mj.core.errors import RecordError
from clearance_mj.io.uff import DIRECTIONS, Channel, read_uff, scan_uff, write_uff
from clearance_mj.signals.frf import FRF, join_references

RNG = np.random.default_rng(20261120)


def channels(n=64, fs=2048.0):
    def noise():
        return RNG.standard_normal(n).astype(np.float32)

    return [
        Channel("base plate", 100, "+Z", "acceleration", noise(), fs),
        Channel("accelerometer 3", 3, "-Z", "acceleration", noise(), fs),
        Channel("probe 6", 6, "+Z", "displacement", 1e-4 * noise(), fs),
        Channel("Bürste 7", 7, "+RX", "velocity", noise(), fs),
        Channel("stinger", 200, "S", "force", noise(), fs),
    ]


def frf(frequency=None, coherence=True, n=3):
    frequency = np.arange(10, 440) * 0.5 if frequency is None else frequency
    shape = (n, len(frequency))
    value = RNG.standard_normal(shape) + 1j * RNG.standard_normal(shape)
    labels = ("1:+Z", "2:-X", "8:+RY")[:n]
    return FRF(frequency, value, RNG.random(shape) if coherence else None, labels, "100:+Z")


def assert_same_channels(a, b):
    assert len(a) == len(b)
    for one, other in zip(a, b):
        np.testing.assert_array_equal(one.value, other.value)
        for name in ("name", "node", "direction", "quantity", "fs", "start", "size"):
            assert getattr(one, name) == getattr(other, name)


def by_hand(rows, *, kind=1, ordinate=2, count=12, spacing=1, first="0.00000E+00", step="1.00000E-02",
            axis=17, numerator=12, denominator=0, dof=(3, 3, 0, 0), unit="NONE", binary=""):  # fmt: skip
    """One data set 58 in the columns of the published format; ``rows`` is its body (str or bytes)."""
    node, direction, reference, reference_direction = dof
    lines = [
        "    -1",
        f"    58{binary}",
        *(f"{t:<80}" for t in ("tip", "NONE", "NONE", "NONE", "NONE")),
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':10}{node:10d}{direction:4d}"
        f" {'NONE':10}{reference:10d}{reference_direction:4d}",
        f"{ordinate:10d}{count:10d}{spacing:10d}{first:>13}{step:>13}{'0.00000E+00':>13}",
        f"{axis:10d}    0    0    0 {'NONE':20} {'NONE':20}",
        f"{numerator:10d}    0    0    0 {'NONE':20} {unit:20}",
        f"{denominator:10d}    0    0    0 {'NONE':20} {'NONE':20}",
        f"{0:10d}    0    0    0 {'NONE':20} {'NONE':20}",
    ]
    head = "\n".join([*lines, ""]).encode()
    return head + (rows if binary else "".join(r + "\n" for r in rows).encode()) + b"    -1\n"


def units_by_hand(length, force):
    def d(value):
        return f"{value:25.17E}".replace("E", "D")

    return (f"    -1\n   164\n{9:10d}{'some':20}{1:10d}\n{d(length)}{d(force)}{d(1)}\n{d(0)}\n    -1\n").encode()


ROWS = ["".join(f"{v:13.5E}" for v in range(i, i + 6)) for i in (0, 6)]  # 0 to 11 as 6E13.5


@pytest.fixture
def write(tmp_path):
    def write(data):
        path = tmp_path / "file.uff"
        path.write_bytes(data)
        return path

    return write


# Reading what the format says


def test_text_time_function_by_hand(write):
    (tip,) = read_uff(write(by_hand(ROWS, first="-2.50000E-01")))
    np.testing.assert_array_equal(tip.value, np.arange(12.0))
    assert (tip.name, tip.label, tip.quantity, tip.fs, tip.start) == ("tip", "3:+Z", "acceleration", 100.0, -0.25)


def test_text_numbers_that_leave_no_blank_are_cut_by_column(write):
    row = "-1.00000D-100" * 6
    (tip,) = read_uff(write(by_hand([row], count=6)))
    np.testing.assert_array_equal(tip.value, np.full(6, -1e-100))


@pytest.mark.parametrize(
    ("ordinate", "spacing", "rows"),
    [
        (4, 1, ["".join(f"{v:20.12E}" for v in range(i, i + 4)) for i in (0, 4, 8)]),
        (2, 0, ["".join(f"{t / 100:13.5E}{t:13.5E}" for t in range(i, i + 3)) for i in (0, 3, 6, 9)]),
        (4, 0, ["".join(f"{t / 100:13.5E}{t:20.12E}" for t in range(i, i + 2)) for i in range(0, 12, 2)]),
    ],
    ids=["double even, 4E20.12", "single uneven, 6E13.5", "double uneven, 2(E13.5,E20.12)"],
)
def test_text_layouts_by_hand(write, ordinate, spacing, rows):
    (tip,) = read_uff(write(by_hand(rows, ordinate=ordinate, spacing=spacing)))
    np.testing.assert_array_equal(tip.value, np.arange(12.0))
    assert tip.fs == 100.0


@pytest.mark.parametrize(("order", "mark"), [(1, "<"), (2, ">")])
@pytest.mark.parametrize(("ordinate", "letter"), [(2, "f"), (4, "d")])
def test_binary_time_function_by_hand(write, order, mark, ordinate, letter):
    body = struct.pack(f"{mark}12{letter}", *range(12))
    declared = f"b{order:6d}{2:6d}{11:12d}{len(body):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    (tip,) = read_uff(write(by_hand(body, ordinate=ordinate, binary=declared)))
    np.testing.assert_array_equal(tip.value, np.arange(12.0))


def test_samples_that_look_like_a_delimiter(write):
    """A search for "    -1" would end the set inside these samples; sizes out of the header do not."""
    body = b"    -1\n " + struct.pack("<10f", *range(10))
    declared = f"b{1:6d}{2:6d}{11:12d}{len(body):12d}"
    (tip,) = read_uff(write(by_hand(body, binary=declared)))
    np.testing.assert_array_equal(tip.value[2:], np.arange(10.0))


def test_closing_delimiter_on_its_own_line(write):
    """Some acquisition systems end the samples with a line end (pyuff issue 61)."""
    data = by_hand(struct.pack("<12f", *range(12)), binary=f"b{1:6d}{2:6d}")
    (tip,) = read_uff(write(data.replace(b"    -1\n", b"    -1\r\n")[:-8] + b"\r\n    -1\r\n"))
    np.testing.assert_array_equal(tip.value, np.arange(12.0))


def test_other_data_sets_and_functions_are_passed_over(write):
    nodes = b"    -1\n    15\n         1         0         0        11  0.0  0.0  0.0\n    -1\n"
    spectrum = by_hand(ROWS, kind=2, axis=18)
    (tip,) = read_uff(write(nodes + spectrum + b"\n" + by_hand(ROWS)))
    assert tip.label == "3:+Z"


def test_units_of_the_file_are_brought_to_si(write):
    """Data set 164: divide by the factor to get SI. mm and mN: 1000 of each in one m, one N."""
    data = units_by_hand(1e3, 1e3) + by_hand(ROWS) + by_hand(ROWS, numerator=13, dof=(200, 3, 0, 0))
    acceleration, force = read_uff(write(data))
    np.testing.assert_allclose(acceleration.value, np.arange(12) / 1e3, rtol=1e-15)
    np.testing.assert_allclose(force.value, np.arange(12) / 1e3, rtol=1e-15)


@pytest.mark.parametrize("label", ["NONE", "", "m/s^2", "m/s2", "(m/s²)", "[M/S**2]"])
def test_si_labels(write, label):
    assert len(read_uff(write(by_hand(ROWS, unit=label)))) == 1


def test_text_frf_by_hand(write):
    rows = [f"{1:20.12E}{2:20.12E}{3:20.12E}{-4:20.12E}"]
    data = by_hand(
        rows, kind=4, ordinate=6, count=2, axis=18, denominator=13, dof=(8, -3, 5, 3), first="1.0", step=".5"
    )
    result = read_uff(write(data))
    np.testing.assert_array_equal(result.functions, [[1 + 2j, 3 - 4j]])
    np.testing.assert_array_equal(result.frequency, [1.0, 1.5])
    assert (result.responses, result.reference) == (("8:-Z",), "5:+Z")
    assert (result.quantity, result.coherence) == ("acceleration/force", None)


# Round trips


def test_channels_come_back_bit_for_bit(tmp_path):
    path = tmp_path / "a.uff"
    sent = [*channels(), *(Channel("c", 1, direction, "force", np.ones(64), 2048.0) for direction in DIRECTIONS)]
    write_uff(path, sent)
    assert_same_channels(read_uff(path), sent)
    again = tmp_path / "b.uff"
    write_uff(again, read_uff(path))
    assert again.read_bytes() == path.read_bytes()


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.one_of(
        st.integers(1, 100_000).map(float),
        st.integers(1, 10_000_000).map(lambda i: i / 1000),
        st.sampled_from([44_100.0, 51_200.0, 102_400.0, 65_536.0, 204_800.0]),
    )
)
def test_rates_come_back_exactly(tmp_path, fs):
    write_uff(tmp_path / "a.uff", [Channel("c", 1, "+Z", "force", [1.0, 2.0], fs)])
    assert read_uff(tmp_path / "a.uff")[0].fs == fs


def test_rate_with_many_digits_is_rounded_to_eight(tmp_path):
    write_uff(tmp_path / "a.uff", [Channel("c", 1, "+Z", "force", [1.0, 2.0], 2048.123456789)])
    assert read_uff(tmp_path / "a.uff")[0].fs == pytest.approx(2048.123456789, rel=6e-8)


@pytest.mark.parametrize("coherence", [True, False])
@pytest.mark.parametrize(
    "frequency",
    [np.arange(10, 440) * 0.5, 3 + np.arange(400) * (2048 / 4200), np.geomspace(5, 220, 50), np.array([7.0])],
    ids=["even", "even, long digits", "uneven", "one line"],
)
def test_frf_comes_back_bit_for_bit(tmp_path, frequency, coherence):
    path, sent = tmp_path / "h.uff", frf(frequency, coherence)
    write_uff(path, sent)
    got = read_uff(path)
    for name in ("frequency", "value", "coherence"):
        np.testing.assert_array_equal(getattr(got, name), getattr(sent, name), strict=coherence)
    assert (got.responses, got.reference, got.quantity) == (sent.responses, sent.reference, sent.quantity)


def test_signed_zeros_of_an_frf(tmp_path):
    value = np.array([[complex(-0.0, 0.0), complex(0.0, -0.0)]])
    write_uff(tmp_path / "h.uff", FRF([1.0, 2.0], value))
    got = read_uff(tmp_path / "h.uff").value
    assert got.tobytes() == value.tobytes()


def test_same_object_same_bytes_whenever_and_wherever(tmp_path, monkeypatch):
    sent = channels()
    (tmp_path / "folder").mkdir()
    write_uff(tmp_path / "a.uff", sent)
    monkeypatch.setattr(time, "strftime", lambda *_: "another day")
    write_uff(tmp_path / "folder" / "b.uff", sent)
    data = (tmp_path / "a.uff").read_bytes()
    assert data == (tmp_path / "folder" / "b.uff").read_bytes()
    assert str(tmp_path).encode() not in data


def test_header_columns_are_those_of_the_format(tmp_path):
    write_uff(tmp_path / "a.uff", channels())
    lines = (tmp_path / "a.uff").read_bytes().split(b"\n")
    start = next(i for i, line in enumerate(lines) if line.startswith(b"    58b"))
    # 58b: I6, A1, I6 byte order (1: little endian), I6 format (2: IEEE), I12 lines, I12 bytes
    assert lines[start][7:43].split() == [b"1", b"2", b"11", b"256"]
    # Record 6: 2(I5,I10),2(1X,10A1,I10,I4); record 7: 3I10,3E13.5; records 8, 9: I10 first
    assert [lines[start + 6][a:b].strip() for a, b in ((0, 5), (41, 51), (51, 55))] == [b"1", b"100", b"3"]
    assert [lines[start + 7][a:b].strip() for a, b in ((0, 10), (10, 20), (20, 30))] == [b"2", b"64", b"1"]
    assert lines[start + 7][43:56] == b"  4.88281e-04"
    assert (lines[start + 8][:10].strip(), lines[start + 9][:10].strip()) == (b"17", b"12")


# pyuff as the independent reader and writer


def test_pyuff_reads_our_channels(tmp_path):
    sent = channels()
    write_uff(tmp_path / "a.uff", sent)
    header, units, *functions = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    assert (header["type"], header["date_file_written"]) == (151, "01-Jan-00")
    assert (units["type"], units["units_code"], units["length"], units["force"]) == (164, 1, 1.0, 1.0)
    specs = {"acceleration": 12, "displacement": 8, "velocity": 11, "force": 13}
    assert len(functions) == len(sent)
    for f, c in zip(functions, sent):
        np.testing.assert_array_equal(f["data"], c.value)
        np.testing.assert_allclose(f["x"], np.arange(64) / 2048, rtol=2e-6)
        assert (f["id1"], f["rsp_node"], f["rsp_dir"]) == (c.name, c.node, DIRECTIONS[c.direction])
        assert (f["func_type"], f["ord_data_type"], f["abscissa_spacing"]) == (1, 2, 1)
        assert (f["abscissa_spec_data_type"], f["ordinate_spec_data_type"]) == (17, specs[c.quantity])
        assert f["n_bytes"] == 256


@pytest.mark.parametrize("frequency", [np.arange(10, 440) * 0.5, np.geomspace(5, 220, 50)])
def test_pyuff_reads_our_frf(tmp_path, frequency):
    sent = frf(frequency)
    write_uff(tmp_path / "h.uff", sent)
    with pytest.raises(RecordError, match="holds FRFs, needs time functions"):
        scan_uff(tmp_path / "h.uff")
    functions = pyuff.UFF(str(tmp_path / "h.uff")).read_sets()[2:]
    assert [f["func_type"] for f in functions] == [4, 4, 4, 6, 6, 6]
    for f, value in zip(functions, np.concatenate((sent.functions, sent.coherence[:, 0]))):
        np.testing.assert_array_equal(f["data"], value)
        np.testing.assert_array_equal(f["x"], frequency)
    assert [(f["rsp_node"], f["rsp_dir"], f["ref_node"], f["ref_dir"]) for f in functions[:3]] == [
        (1, 3, 100, 3),
        (2, -1, 100, 3),
        (8, 5, 100, 3),
    ]
    assert {(f["ordinate_spec_data_type"], f["orddenom_spec_data_type"]) for f in functions[:3]} == {(12, 12)}


def test_pyuff_reads_our_frfs_to_several_references(tmp_path):
    sent = join_references([dataclasses.replace(frf(), references=(f"{node}:+Z",)) for node in (100, 5)])
    write_uff(tmp_path / "h.uff", sent)
    functions = [f for f in pyuff.UFF(str(tmp_path / "h.uff")).read_sets()[2:] if f["func_type"] == 4]
    assert [(f["rsp_node"], f["ref_node"], f["ref_dir"]) for f in functions] == [
        (response, reference, 3) for reference in (100, 5) for response in (1, 2, 8)
    ]
    np.testing.assert_array_equal([f["data"] for f in functions], sent.functions)


def by_pyuff(path, **changes):
    x = np.arange(64) / 2048
    dset = {
        "type": 58, "binary": 0, "func_type": 1, "rsp_node": 3, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 0, "x": x, "data": RNG.standard_normal(64),
    }  # fmt: skip
    dset |= changes
    pyuff.UFF(str(path)).write_sets([dset], mode="add")
    return dset["data"]


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("spacing", [0, 1])
def test_we_read_pyuffs_time_functions(tmp_path, binary, spacing):
    """pyuff marks evenly sampled functions as uneven unless told otherwise (OpenModal issue 14)."""
    data = by_pyuff(tmp_path / "a.uff", binary=binary, abscissa_spacing=spacing)
    (got,) = read_uff(tmp_path / "a.uff")
    np.testing.assert_allclose(got.value, data, rtol=0 if binary else 1e-11)
    assert got.fs == pytest.approx(2048.0, rel=0 if binary and not spacing else 1e-5)


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("spacing", [0, 1])
def test_we_read_pyuffs_frfs(tmp_path, binary, spacing):
    """pyuff declares half the bytes of a complex binary set; the number of samples is right."""
    value = RNG.standard_normal(64) + 1j * RNG.standard_normal(64)
    f = 5 + 0.5 * np.arange(64)
    by_pyuff(tmp_path / "a.uff", binary=binary, abscissa_spacing=spacing, func_type=4, x=f, data=value, ref_node=1,
             ref_dir=3, abscissa_spec_data_type=18, orddenom_spec_data_type=13)  # fmt: skip
    got = read_uff(tmp_path / "a.uff")
    np.testing.assert_allclose(got.functions, [value], rtol=0 if binary else 1e-10)
    np.testing.assert_array_equal(got.frequency, f)
    assert (got.reference, got.quantity) == ("1:+Z", "acceleration/force")


def test_we_read_pyuffs_frfs_to_several_references(tmp_path):
    """A hammer that roves over four points, two accelerometers: written point by point."""
    f, sent = 5 + 0.5 * np.arange(64), {}
    for reference in (4, 3, 9, 1):
        for response in (2, 7):
            value = RNG.standard_normal(64) + 1j * RNG.standard_normal(64)
            by_pyuff(tmp_path / "a.uff", binary=1, func_type=4, x=f, data=value, rsp_node=response, ref_node=reference,
                     ref_dir=-2, abscissa_spec_data_type=18, orddenom_spec_data_type=13)  # fmt: skip
            sent[f"{response}:+Z", f"{reference}:-Y"] = value
    got = read_uff(tmp_path / "a.uff")
    assert got.references == ("4:-Y", "3:-Y", "9:-Y", "1:-Y")
    for (response, reference), value in sent.items():
        np.testing.assert_array_equal(got.value[got.responses.index(response), got.references.index(reference)], value)


# Refusals


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    path = tmp_path_factory.mktemp("good") / "a.uff"
    write_uff(path, channels())
    return path.read_bytes()


def refused(path, *parts):
    for function in (read_uff, scan_uff):
        with pytest.raises(RecordError) as caught:
            function(path)
        message = str(caught.value)
        assert message.startswith(f"{path}: ") and "\n" not in message
        assert all(part in message for part in parts), message


@pytest.mark.parametrize(
    ("data", "parts"),
    [
        (b"", ["no time function", "none"]),
        (b"\x00\xff" * 4000, ["not a universal file", "'    -1'"]),
        (b"name,node\n1,2\n", ["not a universal file"]),
        (by_hand(ROWS)[:-7], ["data set 1", "no closing line '    -1'"]),
        (by_hand(ROWS) + b"tail", ["stray bytes before data set 2"]),
        (by_hand(ROWS, count=18), ["data set 1", "declares 18 samples, which is 3 lines, but 2"]),
        (by_hand(ROWS, count=0), ["declares 0 samples; needs at least 1"]),
        (by_hand(ROWS, count=-4), ["declares -4 samples"]),
        (by_hand(ROWS, step="0.00000E+00"), ["data set 1", "abscissa increment 0 must be > 0"]),
        (by_hand(ROWS, step="-1.0000E-02"), ["abscissa increment -0.01 must be > 0"]),
        (by_hand(ROWS, step="nan"), ["abscissa increment is 'NAN', needs a number"]),
        (by_hand(ROWS, step="1.00000E-320"), ["data set 1", "abscissa increment 9.99989e-321 is too small"]),
        (by_hand(ROWS, first="1E999"), ["abscissa minimum is '1E999', needs a finite number"]),
        (by_hand(ROWS, ordinate=3), ["ordinate data type 3 is unknown; needs 2, 4, 5 or 6"]),
        (by_hand(ROWS, ordinate=5, count=6), ["must be real"]),
        (by_hand(ROWS, spacing=2), ["abscissa spacing 2"]),
        (by_hand(ROWS, axis=18), ["abscissa type 18", "must be 17"]),
        (by_hand(ROWS, numerator=2), ["ordinate type 2 cannot be used", "12 (acceleration)"]),
        (by_hand(ROWS, dof=(3, 7, 0, 0)), ["response direction 7"]),
        (by_hand(ROWS, dof=(-3, 3, 0, 0)), ["response node -3"]),
        (by_hand(ROWS, unit="ft/s2"), ['unit "ft/s2" of acceleration is unknown; use m/s2, mm/s2, g']),
        (by_hand(ROWS, unit="N"), ['unit "N" of acceleration is unknown']),
        (units_by_hand(1e3, 1.0) + by_hand(ROWS, unit="g"), ["data set 2", 'unit "g" contradicts']),
        (units_by_hand(1e3, 1.0) + by_hand(ROWS, unit="m/s^2"), ["data set 2", "contradicts"]),
        (units_by_hand(0, 1.0) + by_hand(ROWS), ["data set 1", "factors of length and force must be > 0"]),
        (b"    -1\n   164\n1\n    -1\n" + by_hand(ROWS), ["data set 1", "units need two factors"]),
        (by_hand(ROWS, kind=2), ["no time function", "only function types [2]"]),
        (by_hand(b"\0" * 48, binary=f"b{3:6d}{2:6d}"), ["byte ordering 3"]),
        (by_hand(b"\0" * 48, binary=f"b{1:6d}{1:6d}"), ["floating-point format 1", "2 (IEEE 754)"]),
        (by_hand(b"\0" * 40, binary=f"b{1:6d}{2:6d}"), ["12 samples, which is 48 bytes, but 40 bytes"]),
        (by_hand(b"\0" * 52, binary=f"b{1:6d}{2:6d}"), ["12 samples, which is 48 bytes, but 52 bytes"]),
        (b"    -1\n    58b     1\n", ["data set 1", "header is cut short"]),
        (b"    -1\nnonsense\n    -1\n", ["data set 1", "has no type"]),
        (by_hand(ROWS) + by_hand(ROWS, kind=4, ordinate=5, count=6), ["both time functions and FRFs"]),
    ],
)  # fmt: skip
def test_refused_in_one_line_that_names_file_and_data_set(write, data, parts):
    refused(write(data), *parts)


@pytest.mark.parametrize("spacing", [0, 1])
def test_non_finite_sample_is_refused_with_its_place(write, spacing):
    rows = ["".join(f"{v:>13}" for v in ("0.0", "1.0", "0.1", "NaN", "0.2", "3.0"))]
    path = write(by_hand(rows, spacing=spacing, count=6 if spacing else 3))
    with pytest.raises(RecordError, match=r"data set 1: sample \d is not a finite number"):
        read_uff(path)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_non_finite_binary_sample(write, good, bad):
    position = good.find(b"    -1\n    -1\n    58b", good.find(b"    58b"))  # the end of the first function
    data = good[: position - 4] + np.float32(bad).tobytes() + good[position:]
    with pytest.raises(RecordError, match="data set 3: sample 63 is not a finite number"):
        read_uff(write(data))


def test_uneven_time_is_refused(write):
    t = np.arange(12) / 100
    t[7] += 0.004
    rows = ["".join(f"{t[i]:13.5E}{i:13.5E}" for i in range(j, j + 3)) for j in (0, 3, 6, 9)]
    refused(write(by_hand(rows, spacing=0)), "data set 1", "uneven at sample 7", "one time step")


@pytest.mark.parametrize("end", [5, 90, 700, 1300, 1700, 2000, -1, -7, -8, -100])
def test_every_cut_is_refused_but_the_last_line_end(write, good, end):
    path = write(good[:end])
    if end == -1:
        assert_same_channels(read_uff(path), read_uff(write(good)))
    else:
        refused(path)


@pytest.mark.parametrize("count", [2**31 - 1, 10**9, 9_999_999_999])
def test_declared_size_allocates_nothing(write, count):
    for data in (by_hand(ROWS, count=count), by_hand(b"\0" * 48, count=count, binary=f"b{1:6d}{2:6d}")):
        path = write(data)
        tracemalloc.start()
        began = time.perf_counter()
        refused(path, f"declares {count} samples")
        assert tracemalloc.get_traced_memory()[1] < 1e6
        assert time.perf_counter() - began < 1
        tracemalloc.stop()


def test_missing_file_and_folder(tmp_path):
    refused(tmp_path / "absent.uff", "cannot be read (No such file or directory)")
    refused(tmp_path, "cannot be read")


def frf_by_hand(**changes):
    rows = [f"{1:20.12E}{2:20.12E}{3:20.12E}{-4:20.12E}"]
    values = {"kind": 4, "ordinate": 6, "count": 2, "axis": 18, "denominator": 13, "dof": (8, 3, 5, 3)}
    return by_hand(rows, **(values | changes))


@pytest.mark.parametrize(
    ("other", "part"),
    [
        ({}, "response 8:+Z comes twice"),
        ({"dof": (7, 3, 5, 3), "step": "2.00000E-02"}, "data set 2: its frequencies differ"),
        ({"dof": (7, 3, 5, 3), "numerator": 8}, "is displacement/force, data set 1 is acceleration/force"),
        ({"dof": (7, 3, 5, 3), "denominator": 0}, "data set 2: denominator type 0 cannot be used"),
        ({"dof": (7, 3, 5, 3), "axis": 17}, "abscissa type 17 of an FRF must be 18"),
        ({"dof": (7, 3, 5, 3), "ordinate": 4, "count": 4}, "an FRF must be complex"),
        ({"dof": (7, 3, 5, 3), "unit": "g/lbf"}, 'unit "g/lbf" of acceleration/force is unknown; use m/s2/N'),
        ({"dof": (7, 3, 5, 3), "kind": 6, "ordinate": 4, "count": 4}, "its frequencies differ"),
    ],
)
def test_frfs_that_do_not_fit_each_other(write, other, part):
    path = write(frf_by_hand() + frf_by_hand(**other))
    with pytest.raises(RecordError, match=re.escape(part)):
        read_uff(path)


def coherence_by_hand(response, reference):
    rows = [f"{0.5:20.12E}{1:20.12E}"]
    return by_hand(rows, kind=6, ordinate=4, count=2, axis=18, dof=(response, 3, reference, 3))


def test_several_references_by_hand(write):
    """Every function has its place, in whatever order they stand."""
    data = frf_by_hand() + frf_by_hand(dof=(8, 3, 6, -1)) + coherence_by_hand(7, 5)
    got = read_uff(write(data + frf_by_hand(dof=(7, 3, 5, 3)) + coherence_by_hand(8, 5)))
    assert (got.responses, got.references, got.quantity) == (("8:+Z", "7:+Z"), ("5:+Z", "6:-X"), "acceleration/force")
    assert got.labels == ("8:+Z/5:+Z", "7:+Z/5:+Z", "8:+Z/6:-X")
    np.testing.assert_array_equal(got.coherence[:, 0], [[0.5, 1.0], [0.5, 1.0]])
    assert np.isnan(got.coherence[:, 1]).all()


def test_reference_of_a_coherence(write):
    """Beside FRFs to one reference it need not be told; beside several it must be one of theirs."""
    one = frf_by_hand() + coherence_by_hand(8, 0)
    assert read_uff(write(one)).coherence.shape == (1, 1, 2)
    with pytest.raises(RecordError, match=r"data set 2: coherence to 0:\+Z, the FRFs are to 5:\+Z, 6:\+Z"):
        read_uff(write(one + frf_by_hand(dof=(8, 3, 6, 3))))


def test_coherence_of_some_responses_only(write):
    coherence = by_hand([f"{1:20.12E}{1:20.12E}"], kind=6, ordinate=4, count=2, axis=18, dof=(8, 3, 5, 3))
    data = frf_by_hand() + frf_by_hand(dof=(7, 3, 5, 3)) + coherence
    with pytest.raises(RecordError, match=r"coherences and FRFs .* same responses: \['7:\+Z'\]"):
        read_uff(write(data))


@pytest.mark.parametrize("obj", [None, 3, "text", np.zeros(4), [np.zeros(4)], [], object()])
def test_objects_that_are_no_test_data(tmp_path, obj):
    with pytest.raises(RecordError, match=r"cannot be written: (needs a sequence of Channel|there is no channel)"):
        write_uff(tmp_path / "a.uff", obj)
    assert not list(tmp_path.iterdir())


def test_samples_beyond_single_precision(tmp_path):
    with pytest.raises(RecordError, match='channel "c" exceeds single precision'):
        write_uff(tmp_path / "a.uff", [Channel("c", 1, "+Z", "force", [1.0, -1e39], 10.0)])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"name": ""}, "1 to 72 printable"),
        ({"name": "a\nb"}, "printable"),
        ({"name": " a"}, "printable"),
        ({"name": "a" * 73}, "1 to 72"),
        ({"node": -1}, "node -1 must be"),
        ({"node": 10**9}, "node 1000000000 must be a whole number of at most 9 digits"),
        ({"direction": "up"}, 'direction "up" is unknown; use .*\\+Z'),
        ({"quantity": "strain"}, 'quantity "strain" is unknown; use displacement'),
        ({"value": [[1.0]]}, r"one row of samples, got shape \(1, 1\)"),
        ({"value": []}, "one row of samples"),
        ({"value": [0.0, np.nan]}, "sample 1 is not a finite number"),
        ({"fs": 0.0}, "fs must be > 0 Hz"),
        ({"fs": np.inf}, "fs must be > 0 Hz"),
        ({"start": np.nan}, "start finite"),
    ],
)
def test_impossible_channels(changes, part):
    with pytest.raises(RecordError, match=part):
        dataclasses.replace(channels()[0], **changes)


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"quantity": "acceleration"}, 'quantity "acceleration" is unknown'),
        ({"quantity": "strain/force"}, 'quantity "strain/force" is unknown'),
        ({"references": ("tip",)}, 'degree of freedom "tip" must be a node and a direction'),
        ({"responses": ("1:+Z", "2", "3:+Z")}, 'degree of freedom "2"'),
        ({"value": np.full((3, 430), np.nan + 0j)}, r"FRF 1:\+Z: sample 0 is not a finite number"),
        ({"coherence": np.full((3, 430), np.nan)}, r"coherence 1:\+Z: sample 0 is not"),
    ],
)
def test_frfs_that_the_format_cannot_hold(tmp_path, changes, part):
    with pytest.raises(RecordError, match=part):
        write_uff(tmp_path / "h.uff", dataclasses.replace(frf(), **changes))
    assert not list(tmp_path.iterdir())
