"""Universal files against the published format, against pyuff, and against damage.

The format: SDRC universal data sets 58, 151 and 164, https://www.ceas3.uc.edu/sdrluff/ (the text is also in
``pyuff.get_structure_58``). Files named "by hand" below are laid out from that text, not by our writer.
"""

import struct
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clearance_mj import FRF, Channel, read, read_uff, write_uff
from clearance_mj.io.uff import DIRECTIONS

from .uff_by_hand import (
    ROWS,
    assert_same_channels,
    by_hand,
    channels,
    coherence_by_hand,
    frf,
    frf_by_hand,
    units_by_hand,
)

# Reading what the format says


def test_text_time_function_by_hand(write):
    (tip,) = read_uff(write(by_hand(ROWS, first="-2.50000E-01")))
    np.testing.assert_array_equal(tip.value, np.arange(12.0))
    assert (tip.name, tip.label, tip.quantity, tip.fs, tip.start) == ("tip", "3:+Z", "acceleration", 100.0, -0.25)


def test_text_numbers_that_leave_no_blank_are_cut_by_column(write):
    (tip,) = read_uff(write(by_hand(["-1.00000D-100" * 6], count=6)))
    np.testing.assert_array_equal(tip.value, np.full(6, -1e-100))


@pytest.mark.parametrize("ordinate, spacing, rows", [
    (4, 1, ["".join(f"{v:20.12E}" for v in range(i, i + 4)) for i in (0, 4, 8)]),
    (2, 0, ["".join(f"{t / 100:13.5E}{t:13.5E}" for t in range(i, i + 3)) for i in (0, 3, 6, 9)]),
    (4, 0, ["".join(f"{t / 100:13.5E}{t:20.12E}" for t in range(i, i + 2)) for i in range(0, 12, 2)]),
], ids=["double even, 4E20.12", "single uneven, 6E13.5", "double uneven, 2(E13.5,E20.12)"])  # fmt: skip
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
    (tip,) = read_uff(write(by_hand(body, binary=f"b{1:6d}{2:6d}{11:12d}{len(body):12d}")))
    np.testing.assert_array_equal(tip.value[2:], np.arange(10.0))


def test_closing_delimiter_on_its_own_line(write):
    """Some acquisition systems end the samples with a line end (pyuff issue 61)."""
    data = by_hand(struct.pack("<12f", *range(12)), binary=f"b{1:6d}{2:6d}")
    (tip,) = read_uff(write(data.replace(b"    -1\n", b"    -1\r\n")[:-8] + b"\r\n    -1\r\n"))
    np.testing.assert_array_equal(tip.value, np.arange(12.0))


def test_other_data_sets_are_passed_over(write):
    nodes = b"    -1\n    15\n         1         0         0        11  0.0  0.0  0.0\n    -1\n"
    others = b"    -1\n  1858\n         0\n    -1\n    -1\n   250\n         0\n    -1\n"
    (tip,) = read_uff(write(others + b"\n" + by_hand(ROWS)))
    assert tip.label == "3:+Z"
    path = write(others + nodes + by_hand(ROWS, kind=2, axis=18) + by_hand(ROWS))
    (tip,) = read_uff(path)
    found = read(path)
    assert [*found.parts] == ["channels", "spectra", "geometry"] and found.channels[0].label == "3:+Z"


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
    sent = [
        *channels(),
        *(Channel(f"c{direction}", 1, direction, "force", np.ones(64), 2048.0) for direction in DIRECTIONS),
    ]
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
@pytest.mark.parametrize("frequency", [
    np.arange(10, 440) * 0.5, 3 + np.arange(400) * (2048 / 4200), np.geomspace(5, 220, 50), np.array([7.0]),
], ids=["even", "even, long digits", "uneven", "one line"])  # fmt: skip
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
    assert read_uff(tmp_path / "h.uff").value.tobytes() == value.tobytes()


def test_same_object_same_bytes_whenever_and_wherever(tmp_path, monkeypatch):
    sent = channels()
    (tmp_path / "folder").mkdir()
    write_uff(tmp_path / "a.uff", sent)
    monkeypatch.setattr(time, "strftime", lambda *_: "another day")
    write_uff(tmp_path / "folder" / "b.uff", sent)
    data = (tmp_path / "a.uff").read_bytes()
    assert data == (tmp_path / "folder" / "b.uff").read_bytes() and str(tmp_path).encode() not in data


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


def test_several_references_by_hand(write):
    """Every function has its place, in whatever order they stand."""
    data = frf_by_hand() + frf_by_hand(dof=(8, 3, 6, -1)) + coherence_by_hand(7, 5)
    got = read_uff(write(data + frf_by_hand(dof=(7, 3, 5, 3)) + coherence_by_hand(8, 5)))
    assert (got.responses, got.references, got.quantity) == (("8:+Z", "7:+Z"), ("5:+Z", "6:-X"), "acceleration/force")
    assert got.labels == ("8:+Z/5:+Z", "7:+Z/5:+Z", "8:+Z/6:-X")
    np.testing.assert_array_equal(got.coherence[:, 0], [[0.5, 1.0], [0.5, 1.0]])
    assert np.isnan(got.coherence[:, 1]).all()


def test_reference_of_a_coherence(write):
    """Beside FRFs to one reference it need not be told; beside several it stands alone if it is none of theirs."""
    one = frf_by_hand() + coherence_by_hand(8, 0)
    assert read_uff(write(one)).coherence.shape == (1, 1, 2)
    found = read(write(one + frf_by_hand(dof=(8, 3, 6, 3))))
    assert found.frf.coherence is None and found.frf.references == ("5:+Z", "6:+Z")
    assert (found.spectra[0].kind, found.spectra[0].labels) == ("coherence", ("8:+Z",))


def test_coherence_of_some_responses_only(write):
    coherence = by_hand([f"{1:20.12E}{1:20.12E}"], kind=6, ordinate=4, count=2, axis=18, dof=(8, 3, 5, 3))
    got = read_uff(write(frf_by_hand() + frf_by_hand(dof=(7, 3, 5, 3)) + coherence))
    assert got.responses == ("8:+Z", "7:+Z")
    np.testing.assert_array_equal(got.coherence[:, 0], [[1.0, 1.0], [np.nan, np.nan]])
