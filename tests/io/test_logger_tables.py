"""Text tables as data loggers write them; the numbers are those that the files are written from."""

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.core.notes import RecordNote
from clearance_mj.io.channels import NOWHERE

G = 9.80665  # standard gravity: BIPM, The International System of Units
N = 40
FIRST, SECOND = 0.5 * np.arange(N), -0.25 * np.arange(N)
TIME = [f"{i / 2048:.8f}" for i in range(N)]
A, B = ([f"{value:.3f}" for value in column] for column in (FIRST, SECOND))


def lines(*columns, separator=",", head=()):
    return "\n".join([*head, *(separator.join(row) for row in zip(*columns))]) + "\n"


def commas(column):
    return [cell.replace(".", ",") for cell in column]


@pytest.fixture
def read(tmp_path):
    """Write a file, read it, and return the channels and what the note says without the file's name."""

    def read(text, encoding="utf-8", **options):
        path = tmp_path / "a.csv"
        path.write_bytes(text.encode(encoding))
        with pytest.warns(RecordNote) as said:
            channels = cm.read(path, **options)
        assert len(said) == 1, "one line for a file"
        return channels, str(said[0].message).removeprefix(f"{path}: ")

    return read


@pytest.fixture
def silent(tmp_path, recwarn):
    """Read a text of which nothing has to be guessed."""

    def silent(text, **options):
        (tmp_path / "a.csv").write_text(text)
        channels = cm.read(tmp_path / "a.csv", **options)
        assert not recwarn.list
        return channels

    return silent


def described(channels):
    return [(c.name, c.quantity, c.unit) for c in channels]


def test_raw_channels_have_their_names_and_the_quantity_of_their_unit(silent):
    head = ["Time (s),Accel_X (m/s^2),Accel 3 [g],F [kN],probe (µm),v / (mm/s),U [mV],Trigger"]
    channels = silent(lines(TIME, *6 * [A], B, head=head))
    assert described(channels) == [
        ("Accel_X", "acceleration", ""), ("Accel 3", "acceleration", ""), ("F", "force", ""),
        ("probe", "displacement", ""), ("v", "velocity", ""), ("U", "unknown", "mV"), ("Trigger", "unknown", ""),
    ]  # fmt: skip
    factors = [1, G, 1e3, 1e-6, 1e-3, 1]
    np.testing.assert_allclose([c.value for c in channels[:-1]], np.outer(factors, FIRST), rtol=1e-15)
    np.testing.assert_array_equal(channels[-1].value, SECOND)
    assert all((c.node, c.direction) == NOWHERE and not c.placed for c in channels)
    assert {(c.fs, c.start) for c in channels} == {(2048.0, 0.0)}


def test_a_header_of_many_blanks_is_no_work(read):
    """Of 100,000 characters; looking for a unit behind each of its blanks takes minutes."""
    (channel,), _ = read(lines(TIME, A, head=["Time,A" + " " * 100_000 + "B"]))
    assert channel.name == "A..."


TIME_NAMES = ("Time", "t", "t [s]", "Zeit", "X_Value", "Time (s)", "Timestamp", "relative time", "Elapsed Time",
              "time_s", "Temps (s)", "t/s", "Time, s", "TIME", "Date/Time", "Sample Time", "Seconds")  # fmt: skip


@pytest.mark.parametrize("name", TIME_NAMES)
def test_usual_names_of_time(silent, name):
    (channel,) = silent(lines(TIME, A, separator="\t", head=[f"{name}\tA"]))
    assert (channel.name, channel.fs) == ("A", 2048.0)


@pytest.mark.parametrize(("unit", "rate"), [("s", 2048.0), ("ms", 2048e3), ("µs", 2048e6), ("min", 2048 / 60)])
def test_units_of_time(silent, unit, rate):
    assert silent(lines(TIME, A, head=[f"Time [{unit}],A"]))[0].fs == pytest.approx(rate, rel=1e-7)


def test_maps_go_before(silent):
    text = lines(TIME, A, B, A, head=["Time (s),Accel 1 [g],F (N),State"])
    first, force = silent(text, columns={"Accel 1": "acc:3:-Z", "F (N)": "force [kN]", "State": "skip"})
    assert (first.label, first.quantity, force.label) == ("3:-Z", "acceleration", "200:+Z")
    np.testing.assert_allclose([first.value, force.value], [G * FIRST, 1e3 * SECOND], rtol=1e-15)
    assert silent(text, columns={"Time": "skip"}, fs=100.0)[0].fs == 100.0


def test_names_that_no_channel_can_have(read):
    channels, note = read(lines(TIME, A, B, A, A, head=[f"Time,A [g],A [g],,{'x' * 80}"]))
    names = ["A", "A (2)", "column 4", f"{'x' * 69}..."]
    assert [c.name for c in channels] == names
    assert note == "; ".join(f'column {i} is named "{name}"' for i, name in zip((3, 4, 5), names[1:]))
    channels, _ = read(lines(TIME, A, B, head=["Time,A [g],A [g]"]), columns={"A": "acc:1", "A (2)": "acc:2"})
    assert [c.label for c in channels] == ["1:+Z", "2:+Z"]


METADATA = ["Messung;Prüfstand 3", "Datum;23.10.2023", "Kanäle;2", ""]


@pytest.mark.parametrize("encoding, said", [
    ("utf-8", ""), ("utf-8-sig", ""), ("cp1252", "Windows-1252; "), ("utf-16", "UTF-16; "), ("utf-16-be", "UTF-16; "),
])  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_german_logger(read, encoding, said, end):
    text = lines(*map(commas, (TIME, A, B)), separator=";", head=[*METADATA, "Zeit;Kanal 1;Kanal 2", "s;m/s²;°C"])
    text = text.replace("\n", end)
    channels, note = read("\ufeff" * (encoding == "utf-16-be") + text, encoding)
    assert described(channels) == [("Kanal 1", "acceleration", ""), ("Kanal 2", "unknown", "°C")]
    np.testing.assert_array_equal([c.value for c in channels], [FIRST, SECOND])
    assert channels[0].fs == 2048.0
    assert note == f"{said}decimal commas; separator ';'; header in line 5; units in line 6"


def test_row_of_channel_numbers_between_names_and_numbers(silent, read):
    head = ["Time,Accel 1,Accel 2", "s,g,mm/s2", "0,1,2"]
    channels, note = read(lines(TIME, A, B, head=head))
    assert note == "units in line 2"
    np.testing.assert_allclose([c.value for c in channels], [G * FIRST, 1e-3 * SECOND], rtol=1e-15)
    channels, _ = read(lines(TIME, A, B, head=["Channel,1,2", *head[:2]]))
    assert [c.name for c in channels] == ["Accel 1", "Accel 2"]


def test_comments_before_and_names_in_a_comment(silent):
    text = lines(TIME, A, B, head=["# a logger's file", "#", "# Time,Accel 1 [g],Accel 2 [g]"])
    assert [c.name for c in silent(text)] == ["Accel 1", "Accel 2"]  # as numpy.savetxt writes them


def test_columns_between_blanks(read):
    channels, note = read(lines(TIME, A, B, separator="   ", head=["  Time  A1   A2"]))
    assert note == "columns separated by blanks"
    np.testing.assert_array_equal([c.value for c in channels], [FIRST, SECOND])


@pytest.mark.parametrize("cell, value, commas, thousands", [
    ("1.234,5", 1234.5, True, "."), ("1,234.5", 1234.5, False, ","), ("1 234,5", 1234.5, True, " "),
    ("1'234.5", 1234.5, False, "'"), ("12,345,678", 12345678.0, False, ","), ("1,234", 1.234, True, ""),
    ("1,5e3", 1500.0, True, ""),
])  # fmt: skip
def test_decimals_and_thousands(read, cell, value, commas, thousands):
    (channel,), note = read(lines(map(str, range(N)), N * [cell], separator=";", head=["Time [s];A"]))
    said = ["decimal commas"] * commas + [f'thousands separated by "{thousands}"'] * bool(thousands)
    assert (channel.value == value).all() and note == "; ".join([*said, "separator ';'"])


def test_quoted_names_and_numbers_that_hold_the_separator(read):
    quoted = [[f'"{cell}"' for cell in commas(column)] for column in (TIME, A)]
    (channel,), note = read(lines(*quoted, head=['"Time","Accel, plate [g]"']))
    assert channel.name == "Accel, plate"
    np.testing.assert_allclose(channel.value, G * FIRST, rtol=1e-15)
    assert note == "decimal commas; separator ','"


RATES = {
    "Sample rate: 2048 Hz": 2048.0, "Sampling frequency [Hz];2048": 2048.0, "Sample Rate (kHz),2.048": 2048.0,
    "Rate (S/s),2048": 2048.0, "Fs = 2.048 kHz": 2048.0, "# Abtastrate: 2048 Hz": 2048.0, "Scan rate;2048;Hz": 2048.0,
    "dt=0.00048828125": 2048.0, "Sample interval: 0.48828125 ms": 2048.0, "Delta_X\t4.8828125E-4": 2048.0,
    '"Sampling interval (us)","488.28125"': 2048.0, "Abtastintervall: 0,5 ms": 2000.0,
}  # fmt: skip


@pytest.mark.parametrize("entry", RATES)
def test_sampling_rate_above_the_table(read, entry):
    separator = ";" if "," in entry else ","
    columns = map(commas, (A, B)) if separator == ";" else (A, B)
    channels, note = read(lines(*columns, separator=separator, head=["Title: run 3", entry, "", f"A [g]{separator}B"]))
    assert [c.fs for c in channels] == 2 * [RATES[entry]]
    assert note.endswith(f"{RATES[entry]:g} Hz, from line 2")


def test_sampling_rate_beside_a_column_of_time(read):
    """The column is taken, unless its digits are too few to tell a rate that it does not contradict."""
    (channel,), note = read(lines(TIME, A, head=["Sample rate: 1024 Hz", "Time,A"]))
    assert channel.fs == 2048.0
    assert note == 'header in line 2; 2048 Hz by "Time", not the 1024 Hz of line 1'
    (channel,), note = read(lines([f"{i / 2048:.3f}" for i in range(N)], A, head=["Sample rate: 2048 Hz", "Time,A"]))
    assert channel.fs == 2048.0
    assert note == "header in line 2; 2048 Hz, from line 1: the times have too few digits"


STAMPS = {
    "ISO": ([f"2023-10-23 23:59:{58 + i // 4}.{25 * (i % 4):02d}" for i in range(8)], "2023-10-23 23:59:58.00"),
    "ISO with T and zone": ([f"2023-10-23T10:00:00.{250 * i:03d}Z" for i in range(4)], "2023-10-23T10:00:00.000Z"),
    "LabVIEW": ([f"2023/10/23 10:00:00.{250 * i:03d}" for i in range(4)], "2023/10/23 10:00:00.000"),
    "European": ([f"23.10.2023 10:00:00,{250 * i:03d}" for i in range(4)],
                 "23.10.2023 10:00:00,000 (dates are day.month.year)"),
    "over the end of a month": (["31/03/2023 23:59:59.75", "01/04/2023 00:00:00.00", "01/04/2023 00:00:00.25"],
                                "31/03/2023 23:59:59.75 (dates are day/month/year)"),
    "days only tell": (["03/04/2023 23:59:59.75", "04/04/2023 00:00:00.00", "04/04/2023 00:00:00.25"],
                       "03/04/2023 23:59:59.75 (dates are day/month/year, which it does not say)"),
    "US": ([f"10/23/2023 {h}:59:59.{p} PM" for h, p in ((3, "00"), (3, "25"), (3, "50"))],
           "10/23/2023 3:59:59.00 PM (dates are month/day/year)"),
    "US at noon": (["10/23/2023 11:59:59.75 AM", "10/23/2023 12:00:00.00 PM", "10/23/2023 12:00:00.25 PM"],
                   "10/23/2023 11:59:59.75 AM (dates are month/day/year)"),
    "neither": ([f"03/04/2023 10:00:00.{p}" for p in ("00", "25", "50")],
                "03/04/2023 10:00:00.00 (dates are month/day/year, which it does not say)"),
    "name of the month": ([f"23-Oct-2023 10:00:00.{p}" for p in ("00", "25", "50")],
                          "23-Oct-2023 10:00:00.00 (dates are day-month-year)"),
    "clock": ([f"10:00:00.{p}" for p in ("00", "25", "50")], "10:00:00.00"),
    "clock over midnight": (["23:59:59.75", "00:00:00.00", "00:00:00.25"], "23:59:59.75, past midnight"),
    "minutes": (["59:59.75", "60:00.00", "60:00.25"], "59:59.75"),
}  # fmt: skip


@pytest.mark.parametrize("name", STAMPS)
def test_time_stamps(read, name):
    stamps, said = STAMPS[name]
    (channel,), note = read(lines(stamps, A, separator=";", head=["Timestamp;A [g]"]))
    assert (channel.fs, channel.start, channel.size) == (4.0, 0.0, len(stamps))
    assert note == f"time begins at {said}"


def test_date_beside_a_clock_time(read):
    channels, note = read(lines(N * ["10/23/2023"], [f"10:00:{i:02}.5" for i in range(N)], A, head=["Date,Time,A [g]"]))
    assert (described(channels), channels[0].fs) == ([("A", "acceleration", "")], 1.0)
    assert note == 'time begins at 10:00:00.5; left out "Date", which is dates or clock times'


def test_what_is_no_channel_is_left_out_and_said(read):
    slow = ["20.1" if i % 10 == 0 else "" for i in range(N)]
    text = lines(map(str, range(N)), TIME, A, N * ["OK"], slow, N * [""], N * [""], head=["No.,Time,A,State,Temp,Gap,"])
    channels, note = read(text)
    assert described(channels) == [("A", "unknown", "")]
    assert note == (
        'left out "No.", which counts the samples; left out "State", which is text; left out "Temp", which lacks 36 '
        'of 40 numbers, the first in line 3; left out "Gap", which is empty'
    )


def test_trailing_separators_are_no_columns(silent):
    assert described(silent(lines(TIME, A, N * [""], N * [""], head=["Time,A"]))) == [("A", "unknown", "")]


@pytest.mark.parametrize("end", ["0.8,3", "\nEnd of data", "Mean,1.5"])
def test_what_follows_the_numbers_is_left_out_and_said(read, end):
    (channel, _), note = read(lines(TIME, A, B, head=["Time,A,B"]) + end)
    np.testing.assert_array_equal(channel.value, FIRST)
    assert note == f"left out from line {N + 2} on, which is cut off or no line of numbers"


def test_first_column_that_rises_evenly(read):
    (channel,), note = read(lines(TIME, A, head=["X [ms],A"]))
    assert (channel.fs, note) == (2048e3, '"X" is taken for time in ms')


REFUSED = {
    "a slip": (lines(TIME, A, B, head=["time,base,acc3"]),
               'line 1, column 3 "acc3": not the name of a channel (did you mean "acc:3"?)'),
    "a slip in the kind": (lines(TIME, A, B, head=["Time,acx:1,B"]),
                           'column 2 "acx:1": not the name of a channel (did you mean "acc:1"?)'),
    "a unit that is none": (lines(TIME, A, B, head=["time,acc:3 [gg],B"]), 'unit "gg" of acceleration is unknown; use'),
    "a line of tabs": (lines([*TIME[:5], "", *TIME[6:]], [*A[:5], "", *A[6:]], separator="\t", head=["Time\tA"]),
                       'line 7, column 1 "Time": an empty cell is not a number or a time'),
    "a line that ends otherwise": (
        lines(TIME, A, head=["Time,A"]).replace(f"{A[4]}\n", f"{A[4]}\r").replace(A[7], "3..5"),
        'line 9, column 2 "A": "3..5" is not a number'),
    "two times": (lines(TIME, A, A, B, head=["Time 1,A,Time 2,B"]),
                  'needs just one, and then no sampling rate beside it ("Time 2=skip" leaves it out)'),
    "no time": (lines(A, B, head=["A,B"]),
                'has no column "time", only "A", "B"; map one to it, or give the sampling rate (--fs)'),
    "spectra": (lines(TIME, A, head=["Frequency [Hz],H 1"]),
                '"Frequency" is of FRFs, "H 1" is the name of none; map it: "H 1=acc:1/base real"'),
    "stamps of seconds": (lines(N * ["10:00:00"], A, head=["Time,A"]),
                          'or the sampling rate in place of it ("Time=skip" and --fs)'),
    "unit of time": (lines(TIME, A, head=["Time [weeks],A"]),
                     'unit "weeks" of time is unknown; map it: "Time=time [s]"'),
    "a lost line": (lines(TIME[:9] + TIME[10:], A[:-1], head=["Time,A"]), 'line 11, column 1 "Time": goes from'),
    "text": ("hello\nworld\n", "holds no records; needs a line with the names"),
    "an open quotation mark": (lines(TIME, [*A[:5], '"1', *A[6:]], B, head=["Time,A,B"]),
                               "line 7: has a quotation mark that is not closed"),
    "a line that is too long": (lines(TIME, [*A[:5], "1,2", *A[6:]], B, head=["Time,A,B"]),
                                "line 7: has 4 columns, the lines before it 3"),
    "a date that is none": (lines([f"31/31/2023 10:00:0{i}" for i in range(9)], A, head=["Time,A"]),
                            '"31/31/2023" is no date'),
    "no column of numbers": (lines(TIME, N * ["OK"], head=["Time,A"]), "has no column of numbers beside time"),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::clearance_mj.core.notes.RecordNote")
@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_the_way_out(tmp_path, name):
    text, part = REFUSED[name]
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(cm.RecordError) as caught:
        cm.read(tmp_path / "a.csv")
    assert str(caught.value).startswith(f"{tmp_path / 'a.csv'}: ") and part in str(caught.value)


def test_the_command_line_says_what_was_guessed(tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text(lines(commas(TIME), commas(A), separator=";", head=["Zeit;A [g]"]))
    assert main(["convert", str(path), str(tmp_path / "a.nc")]) == 0
    assert f"clearance-mj: note: {path}: decimal commas; separator ';'\n" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore::clearance_mj.core.notes.RecordNote")
@pytest.mark.parametrize("point, separator", [".,", ",;"])
def test_one_of_a_hundred_thousand_numbers_is_exact(tmp_path, rng, point, separator):
    """To the last bit, with 17 digits and in decimal commas, where pandas' own default was once not."""
    values = rng.standard_normal(100_000) * 10 ** rng.uniform(-9, 9, 100_000)
    rows = [["Time", "A"], *([f"{i / 2048:.8f}", f"{value:.17g}"] for i, value in enumerate(values))]
    (tmp_path / "a.csv").write_text("\n".join(map(separator.join, rows)).replace(".", point))
    (channel,) = cm.read(tmp_path / "a.csv")
    np.testing.assert_array_equal(channel.value, values)
