"""LabVIEW measurement files (.lvm): text written by LabVIEW's "Write To Measurement File".

National Instruments, LabVIEW Measurement File (LVM) specification, 2023: a file header and, before each segment, a
segment header, both closed by ``***End_of_Header***``; then one line of column names and the numbers. ``X_Columns`` is
"One" (the abscissa once, before the channels), "Multi" (before each channel) or "No" (it is X0 + i Delta_X).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..core.checks import even_rate, naming
from ..core.errors import RecordError
from ..core.files import read_lines
from .channels import Channel
from .columns import resolve
from .registry import Format, register

__all__ = ["LvmSegment", "read_lvm", "read_lvm_channels"]

END = "***End_of_Header***"
SEPARATORS = {"Tab": "\t", "Comma": ","}
X_COLUMNS = ("One", "Multi", "No")
Entries = dict[str, list[str]]


@dataclass(frozen=True, eq=False)
class LvmSegment:
    """One segment of a file: channels over one abscissa."""

    x: np.ndarray  #: (n,) abscissa in the file's own unit: s for time, Hz for a spectrum
    value: np.ndarray  #: (n_channels, n) in the unit of each channel, as written
    names: tuple[str, ...]  #: of the channels
    units: tuple[str, ...]  #: "" where the file gives none
    header: dict[str, str]  #: file header and segment header, the first channel's entry of each


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


def read_lvm_channels(path: str | PathLike[str], columns: Mapping[str, str] | None = None) -> list[Channel]:
    """Read the time records of a LabVIEW measurement file of one segment.

    ``columns`` gives the channel of a column by its title: ``{"Acceleration": "acc:1", "Comment": "skip"}``; units are
    those that the file says, unless the map gives another.
    """
    segments = read_lvm(path)
    with naming(path):
        if len(segments) > 1:
            raise RecordError(f"holds {len(segments)} segments, time records need one; read_lvm reads them all")
        (segment,) = segments
        titles = [f"{name} [{unit}]" if unit else name for name, unit in zip(segment.names, segment.units)]
        used = resolve(titles, columns or {})
        if any(column.reference or column.quantity in ("time", "frequency") for column in used):
            raise RecordError("its columns are channels over time: needs names such as acc:1, no FRFs and no time")
        fs, start = even_rate(segment.x, 1e-6)
        return [column.channel(segment.value[column.index], fs, start) for column in used]


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
        channels = self.number(header, "Channels")
        if not channels.is_integer() or channels < 1:
            raise self.error(f"the segment header needs Channels, a whole number > 0, got {channels:g}")
        layout = header.get("X_Columns", ["One"])[0]
        if layout not in X_COLUMNS:
            raise self.error(f"X_Columns must be {', '.join(X_COLUMNS)}, got {layout!r}")
        if self.at >= len(self.lines):
            raise self.error("the file ends after a segment header")
        n = int(channels)
        columns = 2 * n if layout == "Multi" else n + 1  # with "No" the column is there, empty
        titles = [title.strip() for title in self.lines[self.at].split(self.separator)]
        rows = self.rows(columns)
        is_value = np.arange(columns) % 2 == 1 if layout == "Multi" else np.arange(columns) > 0
        x = rows[:, 0]
        if layout == "No":
            x = self.number(header, "X0") + self.number(header, "Delta_X") * np.arange(len(rows))
        names = tuple(titles[i] if i < len(titles) else "" for i in np.flatnonzero(is_value))
        units = tuple((header.get("Y_Unit_Label", []) + [""] * n)[:n])
        return LvmSegment(x, rows[:, is_value].T.copy(), names, units, {name: v[0] for name, v in header.items()})

    def rows(self, columns: int) -> np.ndarray:
        """Return (n, columns) numbers of the lines after the titles; a comment may follow them."""
        rows = []
        self.at += 1
        while self.at < len(self.lines) and (line := self.lines[self.at]).strip() and not line.startswith("Channels"):
            fields = line.split(self.separator)[:columns]
            if len(fields) < columns:
                raise self.error(f"{len(fields)} of {columns} columns")
            try:
                rows.append([float(f.replace(self.point, ".")) if f.strip() else np.nan for f in fields])
            except ValueError:
                raise self.error(f"not numbers: {line.strip()[:60]!r}") from None
            self.at += 1
        if not rows:
            raise self.error("the segment holds no numbers")
        return np.array(rows)

    def number(self, header: Entries, name: str) -> float:
        try:
            return float(header[name][0])
        except (KeyError, ValueError):
            raise self.error(f"the segment header needs {name}, a number") from None


register(Format(
    "LVM", (".lvm",), (Channel,), read_lvm_channels, options=("columns",),
    note="LabVIEW measurement files of one segment, with a map of columns; `.lvm.gz` is read",
))  # fmt: skip
