"""LabVIEW measurement files (.lvm): text written by LabVIEW's "Write To Measurement File".

National Instruments, LabVIEW Measurement File (LVM) specification, 2023: a file header and, before each segment, a
segment header, both closed by ``***End_of_Header***``; then one line of column names and the numbers. ``X_Columns`` is
"One" (the abscissa once, before the channels), "Multi" (before each channel) or "No" (it is X0 + i Delta_X).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..core.checks import even_rate, naming
from ..core.errors import RecordError
from ..core.files import read_lines, replacing
from ..core.notes import note
from .channels import Channel, require_one_time
from .columns import raw_header
from .gaps import is_code
from .registry import Format, register
from .waveforms import GAPS, Waveform, named_channels

__all__ = ["LvmSegment", "read_lvm", "read_lvm_channels", "write_lvm"]

END = "***End_of_Header***"
SEPARATORS = {"Tab": "\t", "Comma": ","}
X_COLUMNS = ("One", "Multi", "No")
Entries = dict[str, list[str]]
_CLOCK = re.compile(r"(\d+):(\d+):(\d+(?:[.,]\d+)?)")


@dataclass(frozen=True, eq=False)
class LvmSegment:
    """One segment of a file: channels over one abscissa."""

    x: np.ndarray  #: (n,) abscissa in the file's own unit: s for time, Hz for a spectrum; of the first channel
    value: np.ndarray  #: (n_channels, n) in the unit of each channel, as written; nan where a cell is empty
    names: tuple[str, ...]  #: of the channels
    units: tuple[str, ...]  #: "" where the file gives none
    header: dict[str, str]  #: file header and segment header, the first channel's entry of each
    abscissae: np.ndarray | None = None  #: (n_channels, n) of a file that has one for each channel


def read_lvm(path: str | PathLike[str]) -> list[LvmSegment]:
    """Read a LabVIEW measurement file, plain or compressed by gzip; numbers keep their units (often g, lb, dB)."""
    lines = _Lines(read_lines(path))
    try:
        return _segments(lines)
    except RecordError as error:
        raise RecordError(f"{path}, {error}") from None


def _segments(lines: _Lines) -> list[LvmSegment]:
    if not lines.lines or not lines.lines[0].startswith("LabVIEW Measurement"):
        raise lines.error('a LabVIEW measurement file begins with "LabVIEW Measurement"')
    header = lines.header()
    separator = header.get("Separator", ["Tab"])[0]
    if separator not in SEPARATORS:
        raise lines.error(f"Separator must be {' or '.join(SEPARATORS)}, got {separator!r}")
    lines.separator, lines.point = SEPARATORS[separator], header.get("Decimal_Separator", ["."])[0]
    segments = []
    while lines.has_more():
        segments.append(lines.segment(header | lines.header()))
    if not segments:
        raise lines.error("no data after the file header")
    return segments


def read_lvm_channels(
    path: str | PathLike[str], columns: Mapping[str, str] | None = None, fs: float | None = None
) -> list[Channel]:
    """Read the time records of a LabVIEW measurement file, each channel under its own name with the unit of its header.

    Segments that go on where the one before ends are one record; channels of others are told apart by ", segment 2" in
    their names. ``columns`` gives the channel of a column by its title: ``{"Acceleration": "acc:1", "Comment":
    "skip"}``; units are those that the file says, unless the map gives another. ``fs`` (Hz) takes the place of times
    that are uneven.
    """
    segments = read_lvm(path)
    notes: list[str] = []
    with naming(path):
        joined = _joined(segments)
        if len(segments) > 1:
            made = "one record" if len(joined) == 1 else f"{len(joined)} records, which do not go on from each other"
            notes.append(f"{len(segments)} segments are {made}")
        waves = []
        for number, segment in enumerate(joined, 1):
            if segment.header.get("X_Dimension", "Time") not in ("Time", ""):
                raise RecordError(f"is over {segment.header['X_Dimension']}, not over time; read_lvm reads it")
            suffix = f", segment {number}" if number > 1 else ""
            waves += [wave for i in range(len(segment.names)) if (wave := _wave(segment, i, suffix, fs, notes))]
        found = named_channels(waves, columns or {}, notes)
    note(path, notes)
    return found


def _wave(segment: LvmSegment, i: int, suffix: str, fs: float | None, notes: list[str]) -> Waveform | None:
    """Return a channel of a segment, at the instants at which it has numbers; None of one that has none."""
    name, value = segment.names[i] + suffix, segment.value[i]
    x = segment.x if segment.abscissae is None else segment.abscissae[i]
    has = np.isfinite(value)
    if not has.any():
        notes.append(f'left out "{name}", which is empty')
        return None
    if has.mean() > 1 - GAPS and np.isfinite(x).any():  # gaps; with more it is a channel that is sampled more slowly
        known = np.flatnonzero(np.isfinite(x))
        x, has = np.interp(np.arange(x.size), known, x[known]), np.ones_like(has)
    rate, start = fs or 0.0, 0.0
    if fs is None:
        with naming(f'"{name}"'):
            try:
                rate, start = even_rate(x[has], 1e-6)
            except RecordError as error:
                raise RecordError(f"{error}, or the sampling rate in place of them (--fs)") from None
    return Waveform(name, segment.units[i], value[has], rate, start)


def _joined(segments: Sequence[LvmSegment]) -> list[LvmSegment]:
    """Put segments together that go on from each other."""
    found = [segments[0]]
    for new in segments[1:]:
        last = found[-1]
        offset = _offset(last, new)
        if offset is None:
            found.append(new)
            continue
        abscissae = None
        if last.abscissae is not None and new.abscissae is not None:
            abscissae = np.concatenate((last.abscissae, new.abscissae + offset), axis=1)
        x, value = np.concatenate((last.x, new.x + offset)), np.concatenate((last.value, new.value), axis=1)
        found[-1] = LvmSegment(x, value, last.names, last.units, last.header, abscissae)
    return found


def _offset(last: LvmSegment, new: LvmSegment) -> float | None:
    """Return what to add to a segment's abscissa so that it goes on from another; None if it does not.

    Its abscissa goes on itself, or begins anew and the clock times of the two say how much later.
    """
    if last.names != new.names or last.units != new.units or last.x.size < 2:
        return None
    step = (last.x[-1] - last.x[0]) / (last.x.size - 1)
    offsets = [0.0]
    if (begin := _clock(last)) is not None and (then := _clock(new)) is not None:
        offsets.append(then - begin)
    for offset in offsets:
        if abs(new.x[0] + offset - last.x[-1] - step) < 0.01 * step:
            return last.x[-1] + step - new.x[0] if offset else 0.0
    return None


def _clock(segment: LvmSegment) -> float | None:
    """Seconds of the day at which a segment begins."""
    found = _CLOCK.match(segment.header.get("Time", ""))
    return float(found[1]) * 3600 + float(found[2]) * 60 + float(found[3].replace(",", ".")) if found else None


def write_lvm(path: str | PathLike[str], channels: Sequence[Channel]) -> None:
    """Write time records of one rate, length and start as LabVIEW does, in one segment with one column of time."""
    with naming(f"{path}: cannot be written"):
        require_one_time(channels)
        headers = [raw_header(channel) for channel in channels]
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


class _Lines:
    """The lines of a file and where reading has come to; errors name the line."""

    def __init__(self, lines: list[str]) -> None:
        self.lines, self.at, self.separator, self.point = lines, 0, "\t", "."

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
        channels = self.number(header, "Channels")
        if not channels.is_integer() or not 1 <= channels <= len(titles):
            raise self.error(
                f"the segment header needs Channels, a whole number from 1 to the titles, got {channels:g}"
            )
        n = int(channels)
        columns = 2 * n if layout == "Multi" else n + 1  # with "No" the column is there, empty
        rows = self.rows(columns)
        is_value = np.arange(columns) % 2 == 1 if layout == "Multi" else np.arange(columns) > 0
        x = rows[:, 0]
        if layout == "No":
            x = self.number(header, "X0", 0.0) + self.number(header, "Delta_X") * np.arange(len(rows))
        names = tuple(titles[i] if i < len(titles) else "" for i in np.flatnonzero(is_value))
        labels = [*header.get("Y_Unit_Label", []), *(2 * n) * [""]]
        if layout == "Multi" and not any(labels[1 : 2 * n : 2]):  # one for each abscissa, too
            labels = labels[::2]
        units = tuple(labels[:n])
        abscissae = rows[:, ~is_value].T.copy() if layout == "Multi" else None
        said = {name: v[0] for name, v in header.items()}
        return LvmSegment(x, rows[:, is_value].T.copy(), names, units, said, abscissae)

    def rows(self, columns: int) -> np.ndarray:
        """Return (n, columns) numbers of the lines after the titles; a comment may follow them."""
        rows = []
        self.at += 1
        while self.at < len(self.lines) and (line := self.lines[self.at]).strip() and not line.startswith(_NEXT):
            fields = line.split(self.separator)[:columns]
            if len(fields) < columns:
                raise self.error(f"{len(fields)} of {columns} columns")
            try:
                rows.append([np.nan if is_code(f) else float(f.replace(self.point, ".")) for f in fields])
            except ValueError:
                raise self.error(f"not numbers: {line.strip()[:60]!r}") from None
            self.at += 1
        if not rows:
            raise self.error("the segment holds no numbers")
        return np.array(rows)

    def number(self, header: Entries, name: str, default: float | None = None) -> float:
        """Return an entry of the header of a segment, in its decimals; one that is not there is the default."""
        if default is not None and name not in header:
            return default
        try:
            return float(header[name][0].replace(self.point, "."))
        except (KeyError, ValueError):
            raise self.error(f"the segment header needs {name}, a number") from None


_NEXT = ("Channels", "Notes")  # entries that a segment header begins with

register(Format(
    "LVM", (".lvm",), (Channel,), read_lvm_channels, write_lvm, options=("columns", "fs"),
    note="LabVIEW measurement files, channels under their own names; `.lvm.gz` is read",
))  # fmt: skip
