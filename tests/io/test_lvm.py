"""LabVIEW measurement files: the three layouts of the abscissa, and damage named by file and line."""

import gzip
import os
from pathlib import Path

import lvm_read
import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.core.notes import RecordNote
from clearance_mj.io.lvm import read_lvm, write_lvm

from .refusals import assert_refused

END = "***End_of_Header***\t\n"
HEAD = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t{point}\nX_Columns\t{layout}\n" + END + "\t\n"
HEAD_ONE = HEAD.format(point=".", layout="One")
SEGMENT = "Channels\t2\t\t\nSamples\t3\t3\t\nY_Unit_Label\tlb\tg\t\nX0\t0.5\t0.5\t\nDelta_X\t0.25\t0.25\t\n" + END
ONE = "X_Value\tForce\tAcc\tComment\n0.5\t1\t-4\n0.75\t2\t-5\tknocked\n1.0\t3\t-6e-1\n"
MULTI = "X_Value\tForce\tX_Value\tAcc\tComment\n0.5\t1\t0.5\t-4\n0.75\t2\t0.75\t-5\n1.0\t3\t1.0\t-6e-1\n"
NO = "X_Value\tForce\tAcc\tComment\n\t1\t-4\n\t2\t-5\n\t3\t-6e-1\n"
BODY = {"One": ONE, "Multi": MULTI, "No": NO}


def text(layout="One", point=".", segments=1):
    whole = HEAD.format(point=point, layout=layout) + "\n".join([SEGMENT + BODY[layout]] * segments)
    return whole.replace(".", point)


def write(folder, content, name="a.lvm"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("layout", list(BODY))
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_layouts(tmp_path, layout, end):
    [segment] = read_lvm(write(tmp_path, text(layout).replace("\n", end)))
    np.testing.assert_array_equal(segment.x, [0.5, 0.75, 1.0])
    np.testing.assert_array_equal(segment.value, [[1, 2, 3], [-4, -5, -0.6]])
    assert (segment.names, segment.units) == (("Force", "Acc"), ("lb", "g"))
    assert segment.header["X_Columns"] == layout


def test_decimal_comma_gzip_and_two_segments(tmp_path):
    segments = read_lvm(write(tmp_path, gzip.compress(text(point=",", segments=2).encode()), "a.lvm.gz"))
    assert [s.value[1, 2] for s in segments] == [-0.6, -0.6]
    assert_refused(r"nothing.lvm: No such file", read_lvm, tmp_path / "nothing.lvm")


@pytest.mark.parametrize("content, message", [
    ("time,force\n1,2\n", "line 1: a LabVIEW"), ("", "line 1"), (HEAD_ONE, "no data"),
    (text().replace("0.75\t2\t-5\tknocked", "0.75\t2"), "line 15: 2 of 3 columns"),
    (text().replace("0.75\t2\t-5\tknocked", "0.75\ttwo\t-5"), "line 15: not numbers"),
    (text().replace("Channels\t2", "Channels\tmany"), "Channels"),
    (text().replace("X_Columns\tOne", "X_Columns\tSome"), "X_Columns"),
    (text().replace("Separator\tTab", "Separator\tBlank"), "Separator"), (text().split("X_Value")[0], "ends after"),
    (text().split("0.5\t1")[0], "no numbers"), (text()[:100], "no \\*\\*\\*End_of_Header"),
    (text("One", ",").replace("Tab", "Comma").replace("\t", ","), "commas separate both columns and decimals"),
    (gzip.compress(text().encode(), mtime=0)[:80], "damaged gzip"), (b"LabVIEW Measurement\0\1", "not a text file"),
])  # fmt: skip
def test_damage(tmp_path, content, message):
    assert_refused(f"bad.lvm.*{message}", read_lvm, write(tmp_path, content, "bad.lvm"))


def test_time_records(tmp_path):
    """The unit that the map gives the force goes before its own, lb; that of the acceleration, g, is the file's."""
    columns, path = {"Force": "force:5 [kN]", "Acc": "acc:3:-Z"}, write(tmp_path, text())
    force, acceleration = cm.read(path, columns)
    assert [(c.label, c.quantity, c.fs, c.start) for c in (force, acceleration)] == [
        ("5:+Z", "force", 4.0, 0.5), ("3:-Z", "acceleration", 4.0, 0.5)
    ]  # fmt: skip
    np.testing.assert_allclose(force.value, [1e3, 2e3, 3e3])
    np.testing.assert_allclose(acceleration.value, 9.80665 * np.array([-4, -5, -0.6]))
    arguments = [part for header, name in columns.items() for part in ("--column", f"{header}={name}")]
    assert main(["convert", str(path), str(tmp_path / "a.csv"), *arguments]) == 0
    np.testing.assert_allclose(cm.read(tmp_path / "a.csv")[1].value, acceleration.value)
    np.testing.assert_allclose(cm.read(path)[0].value, 4.4482216152605 * np.array([1, 2, 3]))
    unknown = 'a.lvm: .*variable "Force \\[lb\\]": unit "st" of force is unknown'
    assert_refused(unknown, cm.read, path, {"Force": "force:5 [st]"})
    over_frequency = {"Force": "frequency [Hz]", "Acc": "acc:3/force [g/N]"}
    assert_refused("a.lvm: .*channels over time", cm.read, path, over_frequency)


# Channels under their own names. Each file is laid out as one of those that LabVIEW wrote and lvm_read is tested with.


def laid_out(head, entries, titles, rows):
    """A file of one segment: entries {name: [values]} and rows of cells, tabs between them."""
    top = ["LabVIEW Measurement\t", "Separator\tTab", *head, END.strip() + "\t", "\t"]
    segment = ["\t".join([name, *values]) for name, values in entries.items()]
    return "\n".join([*top, *segment, END.strip() + "\t\t", titles, *("\t".join(row) for row in rows)]) + "\n"


NUMBERS = [("0.914018", "1.204792"), ("0.537321", "1.208403"), ("-8.954490E-1", "1.212205"), ("0.57446", "1.222088")]
TWO = {"Channels": ["2", "", ""], "Samples": ["4", "4", ""]}
UNITS = {"Y_Unit_Label": ["Newtons", "m/s^2", ""]}
STEP = {"X_Dimension": ["Time", "Time", ""], "X0": ["0.0E+0"] * 2 + [""], "Delta_X": ["3.906250E-5"] * 2 + [""]}
NO_X0 = {name: values for name, values in STEP.items() if name != "X0"}
EVERY = [f"{i * 0.00025:.6f}" for i in range(4)]
MULTI_UNITS = {"Y_Unit_Label": ["g", "", "g", ""], "Delta_X": ["0.000250", "", "0.000250", ""]}
SEVERAL = {"Channels": ["3"], "Delta_X": ["0.001", "0.001", "0.002"]}
AS_LABVIEW = {
    "no column of time": laid_out(["Decimal_Separator\t.", "X_Columns\tNo"], TWO | UNITS | STEP,
        "X_Value\tExcitation (Trigger)\tResponse (Trigger)\tComment", [("", *row) for row in NUMBERS]),
    "no X0": laid_out(["X_Columns\tNo"], TWO | UNITS | NO_X0,
        "X_Value\tExcitation (Trigger)\tResponse (Trigger)\tComment", [("", *row) for row in NUMBERS]),
    "several columns of time": laid_out(["X_Columns\tMulti"], TWO | MULTI_UNITS, "X_Value\tax\tX_Value\tay\tComment",
        [(t, a, t, b) for t, (a, b) in zip(EVERY, NUMBERS)]),
    "comments": laid_out(["X_Columns\tOne"], TWO | UNITS, "X_Value\tPress (N)\tb\tComment",
        [(t, *row, *(["knocked"] if i % 2 else [])) for i, (t, row) in enumerate(zip(EVERY, NUMBERS))]),
    "empty and slow columns": laid_out(["X_Columns\tOne"], SEVERAL, "X_Value\tDev0/Ai0\tUntitled\tslow\tComment",
        [(f"{i * 0.001:.6f}", NUMBERS[i][0], "", NUMBERS[i][1] if i % 2 == 0 else "") for i in range(4)]),
}  # fmt: skip
AS_LABVIEW["decimal commas"] = AS_LABVIEW["no column of time"].replace(".", ",")
AS_LABVIEW["an empty line at the end"] = AS_LABVIEW["no column of time"] + "\n"
FIRST, SECOND = np.array(NUMBERS, float).T


def by_lvm_read(path):
    return lvm_read.read(str(path), read_from_pickle=False, dump_file=False)[0]


@pytest.mark.parametrize("name", AS_LABVIEW)
def test_numbers_are_those_of_lvm_read(tmp_path, name):
    """To the last bit; lvm_read keeps the column of time and that of comments (nan) among the numbers."""
    path = write(tmp_path, AS_LABVIEW[name])
    [ours] = read_lvm(path)
    table, several = by_lvm_read(path)["data"], name == "several columns of time"
    columns = range(1, table.shape[1], 2) if several else range(len(ours.names))
    first = 0 if "X_Columns\tNo" in AS_LABVIEW[name] or several else 1
    np.testing.assert_array_equal(ours.value, [table[:, i + first] for i in columns])


def test_names_units_and_rates(tmp_path):
    for name in ("no column of time", "no X0", "decimal commas", "an empty line at the end"):
        force, response = cm.read(write(tmp_path, AS_LABVIEW[name]))
        assert (force.name, force.quantity, force.fs) == ("Excitation (Trigger)", "force", 25600.0)
        assert (response.name, response.quantity, response.start) == ("Response (Trigger)", "acceleration", 0.0)
        np.testing.assert_array_equal([force.value, response.value], [FIRST, SECOND])
    ax, ay = cm.read(write(tmp_path, AS_LABVIEW["several columns of time"]))
    assert (ax.name, ay.name, ax.quantity, ax.fs, ay.fs) == ("ax", "ay", "acceleration", 4000.0, 4000.0)
    np.testing.assert_allclose([ax.value, ay.value], 9.80665 * np.array([FIRST, SECOND]), rtol=1e-15)
    press, b = cm.read(write(tmp_path, AS_LABVIEW["comments"]))
    assert (press.name, press.quantity, b.quantity, b.fs) == ("Press (N)", "force", "acceleration", 4000.0)


def test_empty_columns_are_left_out_and_slow_ones_have_their_own_rate(tmp_path):
    path = write(tmp_path, AS_LABVIEW["empty and slow columns"])
    with pytest.warns(RecordNote) as said:
        fast, slow = cm.read(path)
    assert [(c.name, c.fs, c.size) for c in (fast, slow)] == [("Dev0/Ai0", 1000.0, 4), ("slow", 500.0, 2)]
    np.testing.assert_array_equal(slow.value, SECOND[::2])
    assert str(said[0].message) == (
        f'{path}: left out "Untitled", which is empty; channels of several rates or lengths: 1 at 500 Hz, 1 at 1000 Hz'
    )


SECONDS = "Channels\t1\t\nTime\t{clock}\t\nX0\t0\t\nDelta_X\t0.25\t\n" + END + "X_Value\tA\tComment\n"


def restarted(clock, times):
    first = SECONDS.format(clock="23:59:59.0") + "0.0\t1\n0.25\t2\n0.5\t3\n"
    return (
        HEAD_ONE + first + "\n" + SECONDS.format(clock=clock) + "".join(f"{t}\t{i}\n" for i, t in enumerate(times, 4))
    )


@pytest.mark.parametrize(("clock", "times"), [("10:00:00", (0.75, 1.0)), ("23:59:59.75", (0.0, 0.25))])
def test_segments_that_go_on_are_one_record(tmp_path, clock, times):
    """By their abscissa, or by the clock time at which one begins that starts anew."""
    with pytest.warns(RecordNote, match="2 segments are one record"):
        [channel] = cm.read(write(tmp_path, restarted(clock, times)))
    np.testing.assert_array_equal(channel.value, [1, 2, 3, 4, 5])
    assert (channel.fs, channel.start) == (4.0, 0.0)


def test_other_segments_are_channels_of_their_own(tmp_path):
    path = write(tmp_path, restarted("10:00:00", (0.0, 0.25)))
    with pytest.warns(RecordNote, match="2 segments are 2 records, which do not go on from each other; channels of "):
        first, second = cm.read(path)
    assert (first.name, first.size, second.name, second.size) == ("A", 3, "A, segment 2", 2)
    with pytest.warns(RecordNote):
        [only] = cm.read(path, {"A": "acc:1", "A, segment 2": "skip"})
    assert only.label == "1:+Z"


def test_uneven_times_need_a_rate(tmp_path):
    path = write(tmp_path, text().replace("0.75", "0.6"))
    assert_refused(r'"Force": its times are uneven at sample 1 .* the sampling rate .*\(--fs\)', cm.read, path)
    assert [c.fs for c in cm.read(path, fs=4.0)] == [4.0, 4.0]


def test_a_missing_number(tmp_path):
    """One of twelve: no slower channel, and read from behind it, at its own times."""
    rows = "".join(f"{i / 4}\t{'' if i == 5 else i}\n" for i in range(12))
    path = write(tmp_path, HEAD_ONE + SECONDS.format(clock="10:00:00") + rows)
    words = r'"A" lacks 1 of 12 numbers .*, the first at 1\.25 s; .* from 1\.5 s to 2\.75 s'
    with pytest.warns(RecordNote, match=words):
        (channel,) = cm.read(path)
    np.testing.assert_array_equal(channel.value, channel.time * 4)


def test_lvm_read_reads_ours(tmp_path, rng):
    channels = [cm.Channel(n, 0, "S", q, rng.standard_normal(50), 2048.0, 0.5, u)
                for n, q, u in (("Accel 3", "acceleration", ""), ("U", "unknown", "mV"))]  # fmt: skip
    write_lvm(tmp_path / "a.lvm", channels)
    theirs = by_lvm_read(tmp_path / "a.lvm")
    np.testing.assert_array_equal(theirs["data"].T[:3], [channels[0].time, *(c.value for c in channels)])
    assert theirs["Channel names"][:3] == ["X_Value", "Accel 3", "U"]
    assert (theirs["Y_Unit_Label"][:2], theirs["Delta_X"][0]) == (["m/s2", "mV"], 1 / 2048)


@pytest.mark.skipif("CLEARANCE_FOREIGN_FILES" not in os.environ, reason="CLEARANCE_FOREIGN_FILES names no folder")
def test_files_of_labview():
    """Those that lvm_read is tested with; one is sampled by an operator, at uneven times."""
    paths = sorted(Path(os.environ["CLEARANCE_FOREIGN_FILES"]).glob("**/*.lvm"))
    assert paths
    for path in paths:
        [ours] = read_lvm(path)
        columns = by_lvm_read(path)["data"].T
        assert all(any(np.array_equal(value, column, equal_nan=True) for column in columns) for value in ours.value)
        assert "with_comments" in path.name or cm.read(path)


# Separators of LabVIEW's header, files that are cut off, spectra, and channels that begin at other times.

SEPARATED = {
    "commas": lambda text: text.replace("Separator\tTab", "Separator\tComma").replace("\t", ","),
    "semicolons": lambda text: text.replace("Separator\tTab", "Separator\tSemicolon").replace("\t", ";"),
    "semicolons, decimal commas": lambda text: (
        text.replace(".", ",").replace("Separator\tTab", "Separator\tSemicolon").replace("\t", ";")
    ),
    "commas in the table only": lambda text: END.join(
        part.replace("\t", ",") if i else part.replace("Separator\tTab", "Separator\tComma")
        for i, part in enumerate(text.split(END))
    ),
}


@pytest.mark.parametrize("separated", SEPARATED)
@pytest.mark.parametrize("layout", list(BODY))
def test_separators_of_the_header(tmp_path, separated, layout):
    """The same numbers as between tabs: "Separator" is followed by what it says."""
    [segment] = read_lvm(write(tmp_path, SEPARATED[separated](text(layout))))
    [expected] = read_lvm(write(tmp_path, text(layout), "tab.lvm"))
    np.testing.assert_array_equal(segment.x, expected.x)
    np.testing.assert_array_equal(segment.value, expected.value)
    assert (segment.names, segment.units) == (expected.names, expected.units)


LONG = SECONDS.format(clock="10:00:00").replace("X0", "Samples\t8\t\nX0")
ROWS = "".join(f"{i / 4:.6f}\t{1.1 * i:.6f}\n" for i in range(8))


@pytest.mark.parametrize("end, kept, words", [
    (None, 8, ""),
    (-1, 8, ""),
    (-3, 7, "left out line 21, which is cut off; ends after 7 of 8 samples (line 21): is it cut off?"),
    (-9, 7, "left out line 21, which is cut off; ends after 7 of 8 samples (line 21): is it cut off?"),
    (-18, 7, "ends after 7 of 8 samples (line 20): is it cut off?"),
    (-20, 6, "left out line 20, which is cut off; ends after 6 of 8 samples (line 20): is it cut off?"),
])  # fmt: skip
def test_a_file_that_is_cut_off(tmp_path, recwarn, end, kept, words):
    """Within a number, before it, at the end of a line: what is whole is read, and how much is said."""
    path = write(tmp_path, (HEAD_ONE + LONG + ROWS)[:end])
    [channel] = cm.read(path)
    np.testing.assert_allclose(channel.value, 1.1 * np.arange(kept), rtol=1e-12)
    assert [str(one.message) for one in recwarn.list] == ([f"{path}: {words}"] if words else [])


@pytest.mark.parametrize("title, dimension, part", [
    ("A (FFT - (RMS))", "Time", "is a spectrum by its name"),
    ("A (Power Spectrum)", "Time", "is a spectrum by its name"),
    ("Level (dB)", "Time", "is in dB by its name, not in g"),
    ("Acc", "Frequency", "is over Frequency, not over time; read_lvm reads it"),
])  # fmt: skip
def test_spectra_are_no_records(tmp_path, title, dimension, part):
    """Even where the header says "Time"; other channels of the file are read."""
    changed = text().replace("\tAcc\t", f"\t{title}\t").replace("Samples", f"X_Dimension\tTime\t{dimension}\nSamples")
    path = write(tmp_path, changed)
    with pytest.raises(cm.RecordError) as caught:
        cm.read(path)
    assert f'"{title}": {part}' in str(caught.value)
    assert [c.name for c in cm.read(path, {title: "skip"})] == ["Force"]


def test_starts_and_steps_of_each_channel(tmp_path):
    """By X0 and Delta_X of each, and by the clock times at which the channels began, over midnight too."""
    other = text("No").replace("X0\t0.5\t0.5", "X0\t0.5\t1.5").replace("Delta_X\t0.25\t0.25", "Delta_X\t0.25\t0.5")
    with pytest.warns(RecordNote):
        force, acceleration = cm.read(write(tmp_path, other))
    assert [(c.start, c.fs) for c in (force, acceleration)] == [(0.5, 4.0), (1.5, 2.0)]
    clocks = text("No").replace("X0\t", "Time\t23:59:59.9\t00:00:00.1\t\nX0\t")
    with pytest.warns(RecordNote, match=r'"Acc" begins 0\.2 s after the first channel'):
        force, acceleration = cm.read(write(tmp_path, clocks))
    assert [c.start for c in (force, acceleration)] == [0.5, pytest.approx(0.7)]


def test_a_column_with_a_hole_or_nothing_is_skipped(tmp_path, recwarn):
    rows = "".join(f"{i / 4}\t{i}\t{'' if i == 5 else i}\t\n" for i in range(12))
    head = SECONDS.format(clock="10:00:00").replace("Channels\t1", "Channels\t3").replace("\tA\t", "\tA\tB\tC\t")
    path = write(tmp_path, HEAD_ONE + head + rows)
    with pytest.warns(RecordNote, match='"B" lacks 1 of 12 numbers'):
        assert [channel.size for channel in cm.read(path, {"C": "skip"})] == [6, 6]
    recwarn.clear()
    [channel] = cm.read(path, {"B": "skip", "C": "skip"})
    np.testing.assert_array_equal(channel.value, np.arange(12))
    assert not recwarn.list
