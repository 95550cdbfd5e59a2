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
    frf_by_hand,
    units_by_hand,
)

# Reading what the format says


def binary(data, **layout):
    """A binary data set, whose header declares the length of its samples."""
    order, length = layout.pop("order", 1), f"{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return by_hand(data, binary=f"b{order:6d}{2:6d}{length}", **layout)


def in_rows(form, per_row, time=""):
    """0 to 11 in text; with an abscissa before each number if it has a format."""
    words = [(f"{i / 100:{time}}" if time else "") + f"{i:{form}}" for i in range(12)]
    return ["".join(words[i : i + per_row]) for i in range(0, 12, per_row)]


WHOLE = struct.pack("<12f", *range(12))
LAYOUTS = {
    "single even, 6E13.5": by_hand(ROWS),
    "double even, 4E20.12": by_hand(in_rows("20.12E", 4), ordinate=4),
    "single uneven, 6E13.5": by_hand(in_rows("13.5E", 3, "13.5E"), spacing=0),
    "double uneven, 2(E13.5,E20.12)": by_hand(in_rows("20.12E", 2, "13.5E"), ordinate=4, spacing=0),
    "other columns, E14.6": by_hand(in_rows("14.6E", 6)),
    "four in a line": by_hand(in_rows("13.5E", 4)),
    "marks of editors and of DOS": b"\xef\xbb\xbf" + by_hand(ROWS) + b"\x1a",
    "delimiters without blanks": by_hand(ROWS).replace(b"    -1", b"-1"),
    "binary": binary(WHOLE),
    "binary, double": binary(struct.pack("<12d", *range(12)), ordinate=4),
    "big-endian": binary(struct.pack(">12f", *range(12)), order=2),
    "big-endian, double": binary(struct.pack(">12d", *range(12)), ordinate=4, order=2),
    # Some acquisition systems end the samples with a line end (pyuff issue 61).
    "closing delimiter on its own line": by_hand(WHOLE, binary=f"b{1:6d}{2:6d}").replace(b"    -1\n", b"    -1\r\n")[
        :-8
    ]
    + b"\r\n    -1\r\n",
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_time_functions_by_hand(write, layout):
    (tip,) = read_uff(write(LAYOUTS[layout]))
    np.testing.assert_array_equal(tip.value, np.arange(12.0))
    assert (tip.name, tip.label, tip.quantity, tip.fs, tip.start) == ("tip", "3:+Z", "acceleration", 100.0, 0.0)
    assert read_uff(write(by_hand(ROWS, first="-2.50000E-01")))[0].start == -0.25


@pytest.mark.parametrize("data, expected", [
    (by_hand(["-1.00000D-100" * 6], count=6), np.full(6, -1e-100)),  # no blanks: cut by column
    # A search for "    -1" would end the set inside these samples; sizes out of the header do not.
    (binary(b"    -1\n " + WHOLE[:40]), [*np.frombuffer(b"    -1\n ", "<f4"), *range(10)]),
    (by_hand([*ROWS, f"{12:13.5E}" + 5 * f"{0:13.5E}"], count=13), np.arange(13.0)),  # filled with zeros
    (by_hand(["".join(f"{-v:12.5E}" for v in range(i, i + 6)) for i in (1, 7)]), -np.arange(1.0, 13.0)),  # 12 columns
])  # fmt: skip
def test_numbers_without_blanks_between_and_lines_that_are_filled(write, data, expected):
    np.testing.assert_array_equal(read_uff(write(data))[0].value, expected)


def test_other_data_sets_are_passed_over(write):
    nodes = b"    -1\n    15\n         1         0         0        11  0.0  0.0  0.0\n    -1\n"
    others = b"    -1\n  1858\n         0\n    -1\n    -1\n   250\n         0\n    -1\n"
    (tip,) = read_uff(write(others + b"\n" + by_hand(ROWS)))
    assert tip.label == "3:+Z"
    path = write(others + nodes + by_hand(ROWS, kind=2, axis=18) + by_hand(ROWS))
    (tip,) = read_uff(path)
    contents = read(path)
    assert [*contents.parts] == ["channels", "spectra", "geometry"] and contents.channels[0].label == "3:+Z"


def test_units_of_the_file_are_brought_to_si(write):
    """Data set 164: divide by the factor to get SI. mm and mN: 1000 of each in one m, one N."""
    data = units_by_hand(1e3, 1e3) + by_hand(ROWS) + by_hand(ROWS, numerator=13, dof=(200, 3, 0, 0))
    acceleration, force = read_uff(write(data))
    np.testing.assert_allclose(acceleration.value, np.arange(12) / 1e3, rtol=1e-15)
    np.testing.assert_allclose(force.value, np.arange(12) / 1e3, rtol=1e-15)


def test_text_frf_by_hand(write):
    rows = [f"{1:20.12E}{2:20.12E}{3:20.12E}{-4:20.12E}"]
    frf = by_hand(rows, kind=4, ordinate=6, count=2, axis=18, denominator=13, dof=(8, -3, 5, 3), first="1.0", step=".5")
    result = read_uff(write(frf))
    np.testing.assert_array_equal(result.functions, [[1 + 2j, 3 - 4j]])
    np.testing.assert_array_equal(result.frequency, [1.0, 1.5])
    assert (result.responses, result.reference) == (("8:-Z",), "5:+Z")
    assert (result.quantity, result.coherence) == ("acceleration/force", None)


# Round trips


def test_channels_come_back_bit_for_bit(tmp_path):
    sent = [*channels(), *(Channel(f"c{way}", 1, way, "force", np.ones(64), 2048.0) for way in DIRECTIONS)]
    write_uff(tmp_path / "a.uff", sent)
    got = read_uff(tmp_path / "a.uff")
    assert_same_channels(got, sent)
    write_uff(tmp_path / "b.uff", got)
    assert (tmp_path / "b.uff").read_bytes() == (tmp_path / "a.uff").read_bytes()


def rate_through_a_file(folder, fs):
    write_uff(folder / "a.uff", [Channel("c", 1, "+Z", "force", [1.0, 2.0], fs)])
    return read_uff(folder / "a.uff")[0].fs


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.one_of(
        st.integers(1, 100_000).map(float),
        st.integers(1, 10_000_000).map(lambda i: i / 1000),
        st.sampled_from([44_100.0, 51_200.0, 102_400.0, 65_536.0, 204_800.0]),
    )
)
def test_rates_come_back_exactly_and_many_digits_rounded_to_eight(tmp_path, fs):
    assert rate_through_a_file(tmp_path, fs) == fs
    assert rate_through_a_file(tmp_path, 2048.123456789) == pytest.approx(2048.123456789, rel=6e-8)


def test_signed_zeros_of_an_frf(tmp_path):
    value = np.array([[complex(-0.0, 0.0), complex(0.0, -0.0)]])
    write_uff(tmp_path / "h.uff", FRF([1.0, 2.0], value))
    assert read_uff(tmp_path / "h.uff").value.tobytes() == value.tobytes()


def test_same_object_same_bytes_whenever_and_wherever(tmp_path, monkeypatch):
    sent, other = channels(), tmp_path / "folder"
    other.mkdir()
    write_uff(tmp_path / "a.uff", sent)
    monkeypatch.setattr(time, "strftime", lambda *_: "another day")
    write_uff(other / "b.uff", sent)
    data = (tmp_path / "a.uff").read_bytes()
    assert data == (other / "b.uff").read_bytes() and str(tmp_path).encode() not in data


def test_header_columns_are_those_of_the_format(tmp_path):
    write_uff(tmp_path / "a.uff", channels())
    lines = (tmp_path / "a.uff").read_bytes().split(b"\n")
    start = next(i for i, line in enumerate(lines) if line.startswith(b"    58b"))
    # 58b: I6, A1, I6 byte order (1: little endian), I6 format (2: IEEE), I12 lines, I12 bytes
    assert lines[start][7:43].split() == [b"1", b"2", b"11", b"256"]
    # Record 6: 2(I5,I10),2(1X,10A1,I10,I4); record 7: 3I10,3E13.5; records 8, 9: I10 first
    columns = {6: {(0, 5): b"1", (41, 51): b"100", (51, 55): b"3"}, 8: {(0, 10): b"17"}, 9: {(0, 10): b"12"}}
    columns[7] = {(0, 10): b"2", (10, 20): b"64", (20, 30): b"1", (43, 56): b"4.88281e-04"}
    for record, fields in columns.items():
        assert {at: lines[start + record][slice(*at)].strip() for at in fields} == fields


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
    contents = read(write(one + frf_by_hand(dof=(8, 3, 6, 3))))
    assert contents.frf.coherence is None and contents.frf.references == ("5:+Z", "6:+Z")
    assert (contents.spectra[0].kind, contents.spectra[0].labels) == ("coherence", ("8:+Z",))


def test_coherence_of_some_responses_only(write):
    coherence = by_hand([f"{1:20.12E}{1:20.12E}"], kind=6, ordinate=4, count=2, axis=18, dof=(8, 3, 5, 3))
    got = read_uff(write(frf_by_hand() + frf_by_hand(dof=(7, 3, 5, 3)) + coherence))
    assert got.responses == ("8:+Z", "7:+Z")
    np.testing.assert_array_equal(got.coherence[:, 0], [[1.0, 1.0], [np.nan, np.nan]])
