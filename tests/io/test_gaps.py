"""Codes of overloads and of missing numbers are no values; of every format, the samples beside them at their times.

SCPI-1999, 7.2.1.4 and 7.2.1.5: 9.9E37 is infinity, 9.91E37 not a number;
LAS 2.0 of the Canadian Well Logging Society: -999.25.
"""

import re

import numpy as np
import pytest
import scipy.io
from asammdf import Signal
from nptdms import ChannelObject

import clearance_mj as cm
from clearance_mj.core.notes import RecordNote
from clearance_mj.io.uff import FileWarning

from .logger_files import mdf, tdms
from .uff_by_hand import by_hand

FS, N = 100.0, 200
TIME = np.arange(N) / FS
CLEAN = np.round(5 * np.sin(TIME), 4)
GAP, LONGEST = slice(30, 34), slice(34, N)


def table(code, separator=","):
    cells = np.array([[f"{t:.3f}", f"{a:.4f}", f"{-a:.4f}"] for t, a in zip(TIME, CLEAN)], dtype=object)
    cells[GAP, 1] = code
    return "\n".join(map(separator.join, [["time [s]", "A", "B"], *cells])) + "\n"


def assert_longest(path, words=r'"A" lacks 4 of 200 numbers .*, the first at 0\.3 s; .* from 0\.34 s to 1\.99 s'):
    """What is read of a file is what follows the gap, and a note says so."""
    with pytest.warns(RecordNote, match=words):
        channels = cm.read(path)
    assert [(c.name, c.fs) for c in channels] == [("A", FS), ("B", FS)]
    for channel, sign in zip(channels, (1, -1)):
        np.testing.assert_array_equal(channel.value, sign * CLEAN[LONGEST])
        np.testing.assert_allclose(channel.time, TIME[LONGEST], rtol=1e-12)


TEXTS = ["OVL", "OVLD", "ovl", "OverLoad", "-OVL", "+OL", "OL", "Over Range", "N/A", "#N/A", "---", "--", "nan", "NaN",
         "inf", "-inf", "", "#DIV/0!", "#VALUE!", "#NUM!", "#REF!", "NULL", "None", "***", "1.#IND", "err"]  # fmt: skip
NUMBERS = ["9.9E+37", "-9.9E+37", "9.91E+37", "1e30", "3.4028235e+38", "3.4E38", "-9999", "-9999.0", "-999.25", "9999",
           "99999"]  # fmt: skip


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("code", TEXTS)
def test_texts_in_a_table(tmp_path, code, separator):
    (tmp_path / "a.csv").write_text(table(code, separator))
    words = rf'"A" lacks 4 of 200 numbers \({"an empty cell" if not code else ".*"} in line 32\), the first at 0\.3 s; '
    assert_longest(tmp_path / "a.csv", words + r"all is read from 0\.34 s to 1\.99 s, 166 of 200 samples")


@pytest.mark.parametrize("code", NUMBERS)
def test_numbers_in_a_table(tmp_path, code):
    (tmp_path / "a.csv").write_text(table(code))
    number = re.escape(f"{float(code):g}")
    assert_longest(tmp_path / "a.csv", rf'"A" lacks 4 of 200 numbers \({number}\), the first at 0\.3 s')


def test_decimal_commas(tmp_path):
    (tmp_path / "a.csv").write_text(table("9.9E+37", ";").replace(".", ","))
    assert_longest(tmp_path / "a.csv", r"9\.9e\+37")


def test_first_and_last_samples_of_all_channels(tmp_path):
    """A logger that is not ready yet, and one that is switched off."""
    rows = table("").splitlines()
    rows[1:4] = [f"{t:.3f},---,---" for t in TIME[:3]]
    rows[-2:] = [f"{t:.3f},OVL,OVL" for t in TIME[-2:]]
    rows[31:35] = [f"{t:.3f},1,1" for t in TIME[30:34]]
    (tmp_path / "a.csv").write_text("\n".join(rows) + "\n")
    with pytest.warns(RecordNote, match=r'"A" lacks 5 of 200 .*"B" lacks 5 of 200 .* from 0\.03 s to 1\.97 s'):
        one, _ = cm.read(tmp_path / "a.csv")
    np.testing.assert_allclose(one.time, TIME[3:-2], rtol=1e-12)
    np.testing.assert_array_equal(one.value[40:], CLEAN[43:-2])


def test_a_line_of_dashes_under_the_names_is_no_code(tmp_path):
    rows = table("1").splitlines()
    (tmp_path / "a.csv").write_text("\n".join([rows[0], "-----,-----,-----", *rows[1:]]) + "\n")
    one, _ = cm.read(tmp_path / "a.csv")
    assert (one.size, one.start) == (N, 0.0)


def test_channels_that_have_many_gaps_are_left_out(tmp_path):
    """A tenth or more; also of a channel with a name of ours."""
    rows = [f"{t:.3f},{'OVL' if i % 5 == 0 else a},{a}" for i, (t, a) in enumerate(zip(TIME, CLEAN))]
    (tmp_path / "a.csv").write_text("\n".join(["time,acc:1,acc:2", *rows]) + "\n")
    with pytest.warns(RecordNote, match=r'"acc:1" lacks 40 of 200 numbers \(OVL in line 2\) and is left out'):
        (one,) = cm.read(tmp_path / "a.csv")
    assert (one.label, one.size) == ("2:+Z", N)
    (tmp_path / "a.csv").write_text("\n".join(["time,acc:1", *(row.rpartition(",")[0] for row in rows)]) + "\n")
    with pytest.raises(cm.RecordError, match=r"has no channel of numbers: .*and is left out"):
        cm.read(tmp_path / "a.csv")


@pytest.mark.parametrize("value", [
    np.arange(-9999.0, -9799.0), np.linspace(-9999.0, 9999.0, N), np.round(np.linspace(-999.25, 1.0, N), 2),
    1e29 * np.sin(TIME), np.where(np.arange(N) < 3, -9998.0, 0.0),
])  # fmt: skip
def test_numbers_that_are_none_of_them(tmp_path, recwarn, value):
    """A code lies apart from all other numbers, or beyond all that is measured."""
    scipy.io.savemat(tmp_path / "a.mat", {"fs": FS, "A": value})
    (channel,) = cm.read(tmp_path / "a.mat")
    np.testing.assert_array_equal(channel.value, value)
    assert not recwarn.list


def holding(code):
    return np.where((TIME >= TIME[30]) & (TIME < TIME[34]), code, CLEAN)


def write_lvm(path, code):
    head = ["LabVIEW Measurement\t", "Separator\tTab", "X_Columns\tOne", "***End_of_Header***\t", "Channels\t2",
            "***End_of_Header***\t", "X_Value\tA\tB"]  # fmt: skip
    rows = table(repr(code) if isinstance(code, float) else code, "\t").splitlines()[1:]
    path.write_text("\n".join([*head, *rows]) + "\n")


def write_tdms(path, code):
    wave = {"wf_increment": 1 / FS}
    tdms(path.parent, ChannelObject("g", "A", holding(code), wave), ChannelObject("g", "B", -CLEAN, wave))


def write_mdf(path, code):
    mdf(path.parent, [Signal(holding(code), TIME, name="A"), Signal(-CLEAN, TIME, name="B")])


def write_mat(path, code):
    scipy.io.savemat(path, {"fs": FS, "A": holding(code), "B": -CLEAN})


WRITERS = {"lvm": write_lvm, "tdms": write_tdms, "mf4": write_mdf, "mat": write_mat}


@pytest.mark.parametrize("code", [np.nan, np.inf, 9.9e37, 3.4028234663852886e38, -9999.0, -999.25])
@pytest.mark.parametrize("suffix", WRITERS)
def test_numbers_in_other_formats(tmp_path, suffix, code):
    WRITERS[suffix](tmp_path / f"a.{suffix}", code)
    assert_longest(tmp_path / f"a.{suffix}")


@pytest.mark.parametrize("code", ["OVL", "NaN", "#N/A"])
def test_texts_in_lvm(tmp_path, code):
    write_lvm(tmp_path / "a.lvm", code)
    assert_longest(tmp_path / "a.lvm")


@pytest.mark.parametrize("code", [9.9e37, -9999.0])
def test_numbers_in_universal_files(tmp_path, code):
    """In mm: a code is looked for in the numbers of the file."""
    value = [0.0, 1.0, code, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0]
    body = ["".join(f"{x:13.5E}" for x in value[i : i + 6]) for i in (0, 6)]
    (tmp_path / "a.uff").write_bytes(by_hand(body, numerator=8, unit="mm"))
    with pytest.warns(FileWarning, match=r'"tip" lacks 1 of 12 numbers .*, the first at 0\.02 s'):
        (tip,) = cm.read(tmp_path / "a.uff")
    np.testing.assert_allclose(tip.value, 1e-3 * np.arange(3.0, 12.0), rtol=1e-15)
    np.testing.assert_allclose(tip.time, 0.01 * np.arange(3, 12), rtol=1e-12)
