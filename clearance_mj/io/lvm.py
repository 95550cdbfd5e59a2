"""LabVIEW measurement files (.lvm): text written by LabVIEW's "Write To Measurement File".

National Instruments, LabVIEW Measurement File (LVM) specification, 2023: a file header and, before each segment, a
segment header, both closed by ``***End_of_Header***``; then one line of column names and the numbers. ``X_Columns`` is
"One" (the abscissa once, before the channels), "Multi" (before each channel) or "No" (it is X0 + i Delta_X).
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from ..errors import RecordError
from ..files import TOO_DENSE, most_unpacked
from ._checks import even_rate
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

    x: np.ndarray
    """(n,) abscissa in the file's own unit: s for time, Hz for a spectrum"""
    value: np.ndarray
    """(n_channels, n) in the unit of each channel, as written"""
    names: tuple[str, ...]
    """of the channels"""
    units: tuple[str, ...]
    """ "" where the file gives none"""
    header: dict[str, str]
    """file header and segment header, the first channel's entry of each"""


def read_text(path: str | PathLike[str]) -> list[str]:
    """Read the lines of a text file, plain or compressed by gzip."""
    path = Path(path)
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            with gzip.open(path) as file:
                size, data = len(data), file.read(most_unpacked(len(data)) + 1)
            if len(data) > most_unpacked(size):
                raise RecordError(f"{path}: {TOO_DENSE}")
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise RecordError(f"{path}: damaged gzip file ({error})") from None
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror or error}") from None
    if b"\0" in data:
        raise RecordError(f"{path}: not a text file")
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return data.decode("latin-1").splitlines()


def read_lvm(path: str | PathLike[str]) -> list[LvmSegment]:
    """Read a LabVIEW measurement file, plain or compressed by gzip.

    Parameters
    ----------
    path : str or Path
        The file. Its numbers keep the units of the file (often g, lb or dB).

    Returns
    -------
    list of LvmSegment

    Raises
    ------
    RecordError
        Naming file and line, where it is not such a file or a line does not hold the announced numbers.
    """
    lines, path = read_text(path), Path(path)
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        raise RecordError(f'{path}, line 1: a LabVIEW measurement file begins with "LabVIEW Measurement"')
    header, at = _header(path, lines, 0)
    separator = SEPARATORS.get(header.get("Separator", ["Tab"])[0])
    if separator is None:
        raise RecordError(f"{path}: Separator must be {' or '.join(SEPARATORS)}, got {header['Separator'][0]!r}")
    point = header.get("Decimal_Separator", ["."])[0]
    segments = []
    while (at := _next_filled(lines, at)) < len(lines):
        part, at = _header(path, lines, at, separator)
        segment, at = _segment(path, lines, at, header | part, separator, point)
        segments.append(segment)
    if not segments:
        raise RecordError(f"{path}: no data after the file header")
    return segments


def read_lvm_channels(path: str | PathLike[str], columns: Mapping[str, str] | None = None) -> list[Channel]:
    """Read the time records of a LabVIEW measurement file of one segment.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping of str to str, optional
        Channel of a column by its title: ``{"Acceleration": "acc:1", "Comment": "skip"}``. Units are those that the
        file says of its channels, unless the map gives another.

    Returns
    -------
    list of Channel

    Raises
    ------
    RecordError
        As `read_lvm`; also if there are several segments, or a title or unit is unknown.
    """
    segments = read_lvm(path)
    try:
        if len(segments) > 1:
            raise RecordError(f"holds {len(segments)} segments, time records need one; read_lvm reads them all")
        (segment,) = segments
        titles = [f"{name} [{unit}]" if unit else name for name, unit in zip(segment.names, segment.units)]
        used = resolve(titles, columns or {})
        if any(column.reference or column.quantity in ("time", "frequency") for column in used):
            raise RecordError("its columns are channels over time: needs names such as acc:1, no FRFs and no time")
        fs, start = even_rate(segment.x, 1e-6)
        return [column.channel(segment.value[column.index], fs, start) for column in used]
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None


def _header(path: Path, lines: list[str], at: int, separator: str = "\t") -> tuple[Entries, int]:
    """Entries {name: [values]} up to the end mark, and the line after it."""
    entries: Entries = {}
    for number in range(at, len(lines)):
        if lines[number].startswith(END):
            return entries, number + 1
        name, *values = lines[number].split(separator)
        if name.strip():
            entries[name.strip()] = [v.strip() for v in values] or [""]
    raise RecordError(f"{path}, line {at + 1}: the header that begins here has no {END}")


def _next_filled(lines: list[str], at: int) -> int:
    return next((i for i in range(at, len(lines)) if lines[i].strip()), len(lines))


def _segment(
    path: Path, lines: list[str], at: int, header: Entries, separator: str, point: str
) -> tuple[LvmSegment, int]:
    channels = _whole(path, header, "Channels", at)[0]
    layout = header.get("X_Columns", ["One"])[0]
    if layout not in X_COLUMNS:
        raise RecordError(f"{path}, line {at}: X_Columns must be {', '.join(X_COLUMNS)}, got {layout!r}")
    if at >= len(lines):
        raise RecordError(f"{path}, line {at}: the file ends after a segment header")
    columns = 2 * channels if layout == "Multi" else channels + 1  # with "No" the column is there, empty
    titles = [title.strip() for title in lines[at].split(separator)]
    at += 1
    end = at
    while end < len(lines) and lines[end].strip() and not lines[end].startswith("Channels"):
        end += 1
    rows = np.array([_row(path, lines[i], i, columns, separator, point) for i in range(at, end)])
    if not len(rows):
        raise RecordError(f"{path}, line {at + 1}: the segment holds no numbers")
    is_value = np.arange(columns) % 2 == 1 if layout == "Multi" else np.arange(columns) > 0
    x = rows[:, 0]
    if layout == "No":
        x = _real(path, header, "X0", at) + _real(path, header, "Delta_X", at) * np.arange(len(rows))
    names = tuple(titles[i] if i < len(titles) else "" for i in np.flatnonzero(is_value))
    units = (header.get("Y_Unit_Label", []) + [""] * channels)[:channels]
    flat = {name: values[0] for name, values in header.items()}
    return LvmSegment(x, rows[:, is_value].T.copy(), names, tuple(units), flat), end


def _row(path: Path, line: str, number: int, columns: int, separator: str, point: str) -> list[float]:
    """Numbers of one line; a comment may follow them."""
    fields = line.split(separator)[:columns]
    if len(fields) < columns:
        raise RecordError(f"{path}, line {number + 1}: {len(fields)} of {columns} columns")
    try:
        return [float(f.replace(point, ".")) if f.strip() else np.nan for f in fields]
    except ValueError:
        raise RecordError(f"{path}, line {number + 1}: not numbers: {line.strip()[:60]!r}") from None


def _real(path: Path, header: Entries, name: str, at: int) -> float:
    try:
        return float(header[name][0])
    except (KeyError, ValueError):
        raise RecordError(
            f"{path}, line {at}: without a column of X the segment header needs {name}, a number"
        ) from None


def _whole(path: Path, header: Entries, name: str, at: int) -> list[int]:
    try:
        values = [int(v) for v in header[name] if v]
        if values and min(values) > 0:
            return values
    except (KeyError, ValueError):
        pass
    raise RecordError(f"{path}, line {at}: the segment header needs {name}, a whole number > 0")


register(
    Format(
        "LVM",
        (".lvm",),
        (Channel,),
        read_lvm_channels,
        options=("columns",),
        note="LabVIEW measurement files of one segment, with a map of columns; `.lvm.gz` is read",
    )
)
