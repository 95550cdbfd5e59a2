"""LabVIEW measurement files (.lvm): text written by LabVIEW's "Write To Measurement File".

National Instruments, LabVIEW Measurement File (LVM) specification, 2023: a file header and, before each segment, a
segment header, both closed by ``***End_of_Header***``; then one line of column names and the numbers. ``X_Columns`` is
"One" (the abscissa once, before the channels), "Multi" (before each channel) or "No" (it is X0 + i Delta_X).
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import read_text, replacing
from ..core.notes import note
from .channels import Channel, require_one_time
from .columns import Columns, written_header
from .gaps import is_code
from .registry import Format, register
from .time_axis import Rate, Rates
from .waveforms import Waveform, channels_of_waveforms, not_over_time

__all__ = ["LvmSegment", "read_lvm", "read_lvm_channels", "write_lvm"]

END = "***End_of_Header***"
SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
X_COLUMNS = ("One", "Multi", "No")
Entries = dict[str, list[str]]
DAY = 86400.0  # s
FIRST = 100  # lines of a file among which its header says its separator
_SEPARATOR = re.compile(r"Separator([\t,;])")
_CLOCK = re.compile(r"(\d+):(\d+):(\d+(?:[.,]\d+)?)")


@dataclass(frozen=True, eq=False)
class LvmSegment:
    """One segment of a file: channels over one abscissa."""

    x: np.ndarray  #: (n,) abscissa in the file's own unit: s for time, Hz for a spectrum; of the first channel
    value: np.ndarray  #: (n_channels, n) in the unit of each channel, as written; nan where a cell is empty
    names: tuple[str, ...]  #: of the channels
    units: tuple[str, ...]  #: "" where the file gives none
    header: dict[str, str]  #: file header and segment header, the first channel's entry of each
    abscissae: np.ndarray | None = None  #: (n_channels, n) of a file that has one for each channel, or starts or steps
    dimensions: tuple[str, ...] = ()  #: quantity of each abscissa, "Time" or other words


def read_lvm(path: str | PathLike[str]) -> list[LvmSegment]:
    """Read a LabVIEW measurement file, plain or compressed by gzip; numbers keep their units (often g, lb, dB)."""
    segments, notes = _read(path)
    note(path, notes)
    return segments


def _read(path: str | PathLike[str]) -> tuple[list[LvmSegment], list[str]]:
    data = read_text(path)[0].decode()
    lines = _LineReader(data.splitlines(), not data.endswith(("\n", "\r")))
    with naming(path, form="{}, {}"):
        return _segments(lines), lines.notes


def _segments(lines: _LineReader) -> list[LvmSegment]:
    if not lines.lines or not lines.lines[0].startswith("LabVIEW Measurement"):
        raise lines.error('a LabVIEW measurement file begins with "LabVIEW Measurement"')
    lines.separator = next((match[1] for line in lines.lines[:FIRST] if (match := _SEPARATOR.match(line))), "\t")
    header = lines.header()
    separator = header.get("Separator", ["Tab"])[0]
    if separator.lower() not in SEPARATORS:
        raise lines.error(f"Separator must be {', '.join(map(str.title, SEPARATORS))}, got {separator!r}")
    if lines.separator == "\t":
        lines.separator = SEPARATORS[separator.lower()]
    lines.point = header.get("Decimal_Separator", ["."])[0] or ","  # a comma between commas is two cells without text
    if lines.point == lines.separator:
        raise lines.error("commas separate both columns and decimals; write the file with another separator")
    segments = []
    while lines.has_more():
        segments.append(lines.segment(header | lines.header()))
    if not segments:
        raise lines.error("no data after the file header")
    return segments


def read_lvm_channels(
    path: str | PathLike[str], columns: Columns = None, fs: Rate = None, resample: Rate = None
) -> list[Channel]:
    """Read the time records of a LabVIEW measurement file, each channel under its name with the unit of its header.

    Segments that go on where the one before ends are one record; channels of others differ by ", segment 2" in
    their names. ``columns`` gives the channel of a column by its title: ``{"Acceleration": "acc:1", "Comment":
    "skip"}``; units are those that the file says, unless the map gives another. ``fs`` (Hz) takes the place of times
    that are uneven, ``resample`` (Hz) has samples between them interpolated.
    """
    segments, notes = _read(path)
    with naming(path):
        joined = _join_segments(segments)
        if len(segments) > 1:
            result = "one record" if len(joined) == 1 else f"{len(joined)} records, which do not go on from each other"
            notes.append(f"{len(segments)} segments are {result}")
        waves = []
        for number, segment in enumerate(joined, 1):
            suffix = f", segment {number}" if number > 1 else ""
            waves += [_wave(segment, i, suffix) for i in range(len(segment.names))]
        channels = channels_of_waveforms(waves, columns or {}, Rates(fs, resample, notes))
    note(path, notes)
    return channels


def _wave(segment: LvmSegment, i: int, suffix: str) -> Waveform:
    """Return a channel of a segment."""
    name, value, unit = segment.names[i], segment.value[i], segment.units[i]
    x = segment.x if segment.abscissae is None else segment.abscissae[i]
    dimension = segment.dimensions[i] if segment.dimensions else "Time"
    fault = f"is over {dimension}, not over time" if dimension != "Time" else not_over_time(name, unit)
    useless = "" if np.isfinite(value).any() else "which is empty"
    fault = fault and f"{fault}; read_lvm reads it"
    return Waveform(name + suffix, unit, value, time=x, digits=1e-6, useless=useless, fault=fault)


def _join_segments(segments: Sequence[LvmSegment]) -> list[LvmSegment]:
    """Return segments, those joined that go on from each other."""
    joined = [segments[0]]
    for new in segments[1:]:
        last = joined[-1]
        if (offset := _offset(last, new)) is None:
            joined.append(new)
            continue
        abscissae = None
        if last.abscissae is not None and new.abscissae is not None:
            abscissae = np.concatenate((last.abscissae, new.abscissae + offset), axis=1)
        x, value = np.concatenate((last.x, new.x + offset)), np.concatenate((last.value, new.value), axis=1)
        joined[-1] = dataclasses.replace(last, x=x, value=value, abscissae=abscissae)
    return joined


def _offset(last: LvmSegment, new: LvmSegment) -> float | None:
    """Return the offset of a segment's abscissa with which it goes on from another; None if it does not.

    Its abscissa goes on itself, or begins anew and the clock times of the two say how much later.
    """
    if last.names != new.names or last.units != new.units or last.x.size < 2:
        return None
    step = (last.x[-1] - last.x[0]) / (last.x.size - 1)
    offsets = [0.0]
    last_begin, new_begin = (_seconds(segment.header.get("Time", "")) for segment in (last, new))
    if last_begin is not None and new_begin is not None:
        offsets.append(new_begin - last_begin)
    for offset in offsets:
        if abs(new.x[0] + offset - last.x[-1] - step) < 0.01 * step:
            return last.x[-1] + step - new.x[0] if offset else 0.0
    return None


def _seconds(clock: str) -> float | None:
    """Return the seconds of the day of a clock time; None of other text."""
    match = _CLOCK.match(clock)
    return float(match[1]) * 3600 + float(match[2]) * 60 + float(match[3].replace(",", ".")) if match else None


def write_lvm(path: str | PathLike[str], channels: Sequence[Channel]) -> None:
    """Write time records of one rate, length and start as LabVIEW does, in one segment with one column of time."""
    with naming(f"{path}: cannot be written"):
        require_one_time(channels)
        headers = [written_header(channel) for channel in channels]
        if wrong := next((name for name, _ in headers if "\t" in name), None):
            raise RecordError(f'channel "{wrong}" holds a tab')
    first, n = channels[0], len(channels)

    def row(name: str, cells: Sequence[object]) -> str:
        return "\t".join([name, *map(str, cells)]) + "\t\n"

    file_header = {"Writer_Version": 2, "Reader_Version": 2, "Separator": "Tab", "Decimal_Separator": ".",
                   "Multi_Headings": "No", "X_Columns": "One", "Time_Pref": "Relative"}  # fmt: skip
    entries: dict[str, Sequence[object]] = {
        "Samples": n * [first.size], "Y_Unit_Label": [unit for _, unit in headers], "X_Dimension": n * ["Time"],
        "X0": n * [f"{first.start:.17g}"], "Delta_X": n * [f"{1 / first.fs:.17g}"],
    }  # fmt: skip
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write("LabVIEW Measurement\t\n" + "".join(row(name, [value]) for name, value in file_header.items()))
        file.write(f"{END}\t\n\t\n" + row("Channels", [n, *(n - 1) * [""]]))
        file.write("".join(row(name, cells) for name, cells in entries.items()) + row(END, n * [""]))
        file.write("\t".join(["X_Value", *(name for name, _ in headers), "Comment"]) + "\n")
        np.savetxt(file, np.column_stack((first.time, *(c.value for c in channels))), "%.17g", "\t")


class _LineReader:
    """Lines of a file and the current position; errors name the line."""

    def __init__(self, lines: list[str], is_cut: bool) -> None:
        self.lines, self.at, self.separator, self.point = lines, 0, "\t", "."
        self.is_cut = is_cut  # True if the last line has no end
        self.last = next((i for i in reversed(range(len(lines))) if lines[i].strip()), 0)
        self.notes: list[str] = []

    def error(self, reason: str, line: int | None = None) -> RecordError:
        return RecordError(f"line {(self.at if line is None else line) + 1}: {reason}")

    def has_more(self) -> bool:
        while self.at < len(self.lines) and not self.lines[self.at].strip():
            self.at += 1
        return self.at < len(self.lines)

    def header(self) -> Entries:
        """Return the entries {name: [values]} up to the end mark."""
        entries: Entries = {}
        for number in range(self.at, len(self.lines)):
            if self.lines[number].startswith(END):
                self.at = number + 1
                return entries
            name, *values = self.lines[number].split(self.separator)
            if name.strip():
                entries[name.strip()] = [v.strip() for v in values] or [""]
        raise self.error(f"the header that begins here has no {END}")

    def segment(self, header: Entries) -> LvmSegment:
        layout = header.get("X_Columns", ["One"])[0]
        if layout not in X_COLUMNS:
            raise self.error(f"X_Columns must be {', '.join(X_COLUMNS)}, got {layout!r}")
        if self.at >= len(self.lines):
            raise self.error("the file ends after a segment header")
        titles = [title.strip() for title in self.lines[self.at].split(self.separator)]
        count = self.number(header.get("Channels", [""])[0], "Channels")
        if not count.is_integer() or not 1 <= count <= len(titles):
            raise self.error(f"the segment header needs Channels, a whole number from 1 to the titles, got {count:g}")
        n = int(count)
        entries = {name: _of_channels(cells, n, layout == "Multi") for name, cells in header.items()}
        columns = 2 * n if layout == "Multi" else n + 1  # with "No" the column is there, empty
        samples = max((int(cell) for cell in entries.get("Samples", ()) if cell.isdecimal()), default=0)
        rows = self.rows(columns, samples)
        is_value = np.arange(columns) % 2 == 1 if layout == "Multi" else np.arange(columns) > 0
        names = tuple(titles[i] if i < len(titles) else "" for i in np.flatnonzero(is_value))
        x, abscissae = rows[:, 0], rows[:, ~is_value].T.copy() if layout == "Multi" else None
        if layout == "No":
            starts = [self.number(cell or "0", "X0") for cell in entries.get("X0", n * [""])]
            common = header.get("Delta_X", [""])[0]
            steps = [self.number(cell or common, "Delta_X") for cell in entries.get("Delta_X", n * [""])]
            abscissae = np.array(starts)[:, None] + np.array(steps)[:, None] * np.arange(len(rows))
        if abscissae is not None:
            abscissae += self.delays(entries.get("Time", n * [""]), names)[:, None]
            x, abscissae = abscissae[0], None if (abscissae == abscissae[0]).all() else abscissae
        first = {name: v[0] for name, v in header.items()}
        units = tuple(entries.get("Y_Unit_Label", n * [""]))
        dimensions = tuple(cell or first.get("X_Dimension") or "Time" for cell in entries.get("X_Dimension", n * [""]))
        return LvmSegment(x, rows[:, is_value].T.copy(), names, units, first, abscissae, dimensions)

    def delays(self, clocks: Sequence[str], names: Sequence[str]) -> np.ndarray:
        """Return (n_channels,) s by which channels begin after the first of them, by their clock times."""
        seconds = [_seconds(clock) for clock in clocks]
        valid = [second for second in seconds if second is not None]
        delay = np.array([0.0 if s is None else (s - valid[0] + DAY / 2) % DAY - DAY / 2 for s in seconds])
        delay = np.round(delay - delay.min(), 9)
        late = ((second, name) for second, name in zip(delay, names) if second)
        self.notes += [f'"{name}" begins {second:.9g} s after the first channel (Time)' for second, name in late]
        return delay

    def numbers(self, fields: Sequence[str]) -> list[float]:
        """Return the numbers of a line, nan where it has a code or nothing; none of a line of other words."""
        try:
            return [float(f.replace(self.point, ".")) for f in fields]  # nearly always, and fast
        except ValueError:
            pass
        try:
            return [np.nan if is_code(f) else float(f.replace(self.point, ".")) for f in fields]
        except ValueError:
            return []

    def rows(self, columns: int, samples: int) -> np.ndarray:
        """Return (n, columns) numbers of the lines after the titles; a comment may follow them.

        A last line of the file that is cut off is left out, and a note says so, as it does of fewer than ``samples``.
        """
        rows: list[list[float]] = []
        self.at += 1
        decimals = 0
        while self.at < len(self.lines) and (line := self.lines[self.at]).strip() and not line.startswith(_NEXT):
            fields = line.split(self.separator)[:columns]
            numbers = self.numbers(fields)
            previous, decimals = decimals, len(fields[-1].partition(self.point)[2])
            is_cut = self.is_cut and (decimals < previous or len(rows) + 1 < samples)
            if rows and self.at == self.last and (len(numbers) < columns or is_cut):
                self.notes.append(f"left out line {self.at + 1}, which is cut off")
            elif not numbers:
                raise self.error(f"not numbers: {line.strip()[:60]!r}")
            elif len(fields) < columns:
                raise self.error(f"{len(fields)} of {columns} columns")
            else:
                rows.append(numbers)
            self.at += 1
        if not rows:
            raise self.error("the segment holds no numbers")
        if len(rows) < samples:
            self.notes.append(f"ends after {len(rows)} of {samples} samples (line {self.at}): is it cut off?")
        return np.array(rows)

    def number(self, cell: str, name: str) -> float:
        """Return a number of the header of a segment, in its decimals."""
        try:
            return float(cell.replace(self.point, "."))
        except ValueError:
            raise self.error(f"the segment header needs {name}, a number") from None


def _of_channels(cells: Sequence[str], n: int, is_multi: bool) -> list[str]:
    """Return an entry of each of ``n`` channels; where each has its abscissa, there may be one of that, too."""
    cells = [*cells, *(2 * n) * [""]]
    return cells[: 2 * n : 2] if is_multi and not any(cells[1 : 2 * n : 2]) else cells[:n]


_NEXT = ("Channels", "Notes")  # entries that a segment header begins with

register(Format(
    "LVM", (".lvm",), (Channel,), read_lvm_channels, write_lvm, options=("columns", "fs", "resample"),
    note="LabVIEW measurement files, channels under their own names; `.lvm.gz` is read",
))  # fmt: skip
