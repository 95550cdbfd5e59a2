"""Codes of overloads and of missing numbers are no values; of every format, the samples beside them at their times.

SCPI-1999, 7.2.1.4 and 7.2.1.5: 9.9E37 is infinity, 9.91E37 not a number;
LAS 2.0 of the Canadian Well Logging Society: -999.25.
"""

import numpy as np
import pytest
import scipy.io
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter

import clearance_mj as cm
from clearance_mj.core.notes import RecordNote
from clearance_mj.io.uff import FileWarning

from .uff_by_hand import by_hand

FS, N = 100.0, 200
TIME = np.arange(N) / FS
CLEAN = np.round(5 * np.sin(TIME), 4)
GAP = slice(30, 34)
LONGEST = slice(34, N)


def table(code, time=TIME, separator=",", more=""):
    rows = [
        separator.join([f"{t:.3f}", code if GAP.start <= i < GAP.stop else f"{a:.4f}", f"{b:.4f}"])
        for i, (t, a, b) in enumerate(zip(time, CLEAN, -CLEAN))
    ]
    return "\n".join([separator.join(["time [s]", "A", "B"]), *rows]) + more + "\n"


def assert_longest(channels):
    assert [(c.name, c.fs) for c in channels] == [("A", FS), ("B", FS)]
    for channel, sign in zip(channels, (1, -1)):
        np.testing.assert_array_equal(channel.value, sign * CLEAN[LONGEST])
        np.testing.assert_allclose(channel.time, TIME[LONGEST], rtol=1e-12)


TEXTS = ["OVL", "OVLD", "ovl", "OverLoad", "-OVL", "+OL", "OL", "Over Range", "N/A", "#N/A", "---", "--", "nan", "NaN",
         "inf", "-inf", "", "#DIV/0!", "#VALUE!", "#NUM!", "#REF!", "NULL", "None", "***", "1.#IND", "err"]  # fmt: skip
NUMBERS = [
    "9.9E+37", "-9.9E+37", "9.91E+37", "1e30", "3.4028235e+38", "3.4E38", "-9999", "-9999.0", "-999.25", "9999",
    "99999",
]  # fmt: skip


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("code", TEXTS)
def test_texts_in_a_table(tmp_path, code, separator):
    path = tmp_path / "a.csv"
    path.write_text(table(code, separator=separator))
    words = rf'"A" lacks 4 of 200 numbers \({"an empty cell" if not code else ".*"} in line 32\), the first at 0\.3 s; '
    with pytest.warns(RecordNote, match=words + r"all is read from 0\.34 s to 1\.99 s, 166 of 200 samples"):
        assert_longest(cm.read(path))


@pytest.mark.parametrize("code", NUMBERS)
def test_numbers_in_a_table(tmp_path, code):
    path = tmp_path / "a.csv"
    path.write_text(table(code))
    with pytest.warns(
        RecordNote, match=rf'"A" lacks 4 of 200 numbers \({float(code):g}\), the first at 0\.3 s'.replace("+", r"\+")
    ):
        assert_longest(cm.read(path))


def test_decimal_commas(tmp_path):
    (tmp_path / "a.csv").write_text(table("9.9E+37", separator=";").replace(".", ","))
    with pytest.warns(RecordNote, match=r"9\.9e\+37"):
        assert_longest(cm.read(tmp_path / "a.csv"))


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
    value = CLEAN.copy()
    value[GAP] = code
    return value


def lvm(path, code):
    head = ["LabVIEW Measurement\t", "Separator\tTab", "X_Columns\tOne", "***End_of_Header***\t", "Channels\t2",
            "***End_of_Header***\t", "X_Value\tA\tB"]  # fmt: skip
    rows = table(repr(code) if isinstance(code, float) else code, separator="\t").splitlines()[1:]
    path.write_text("\n".join([*head, *rows]) + "\n")


def tdms(path, code):
    wave = {"wf_increment": 1 / FS}
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("g", "A", holding(code), wave), ChannelObject("g", "B", -CLEAN, wave)])


def mdf(path, code):
    with MDF(version="4.10") as file:
        file.append([Signal(holding(code), TIME, name="A"), Signal(-CLEAN, TIME, name="B")], common_timebase=True)
        file.save(path)


def mat(path, code):
    scipy.io.savemat(path, {"fs": FS, "A": holding(code), "B": -CLEAN})


@pytest.mark.parametrize("code", [np.nan, np.inf, 9.9e37, 3.4028234663852886e38, -9999.0, -999.25])
@pytest.mark.parametrize("write", [lvm, tdms, mdf, mat])
def test_numbers_in_other_formats(tmp_path, write, code):
    path = tmp_path / f"a.{'mf4' if write is mdf else write.__name__}"
    write(path, code)
    with pytest.warns(
        RecordNote, match=r'"A" lacks 4 of 200 numbers .*, the first at 0\.3 s; .* from 0\.34 s to 1\.99 s'
    ):
        assert_longest(cm.read(path))


@pytest.mark.parametrize("code", ["OVL", "NaN", "#N/A"])
def test_texts_in_lvm(tmp_path, code):
    lvm(tmp_path / "a.lvm", code)
    with pytest.warns(RecordNote, match='"A" lacks 4 of 200 numbers'):
        assert_longest(cm.read(tmp_path / "a.lvm"))


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
