"""Time records and FRFs in text tables: a line of the columns' names, then one line of numbers per instant or line.

Names of columns: `clearance_mj.io.columns`. Tables of data loggers are read as they are: separators of columns and
decimals, the first line of numbers, units and the sampling rate above them are detected (`clearance_mj.io.tables`),
and one `RecordNote` says what was guessed that the file does not say itself. A file without a header has columns named
"1", "2", ..., which are mapped.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from os import PathLike

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import read_text, replacing
from ..core.notes import note
from ..signals.frf import FRF
from .channels import Channel
from .columns import SKIP, ColumnHeader, Columns, Contents, frf_of_columns, quoted, resolve, timed_table
from .gaps import MAX_MISSING_FRACTION, gapless_channels, is_code
from .registry import Format, register
from .tables.headers import is_index, unique_names
from .tables.layout import BLANKS, COMMENTS, HEAD, Layout, Style, find_layout
from .tables.numbers import TableBody, number_of, read_body
from .tables.stamps import read_stamps
from .tables.times import time_of
from .time_axis import Rate, Rates

__all__ = ["read_columns", "read_csv", "read_table", "write_csv"]

MOST_CODES = 10_000  # cells without numbers that are looked at


def read_csv(path: str | PathLike[str], columns: Columns = None, fs: Rate = None, resample: Rate = None) -> Contents:
    """Read the time records or the FRFs (of a file with a column of frequency) of a text table.

    Separated by commas, semicolons, tabs or blanks, with decimal points or commas, in UTF-8, UTF-16 or Windows-1252; a
    file that ends in .gz may be compressed. ``columns`` gives channel and, if it is not SI, unit of a column by its
    header: ``{"Accel 1": "acc:1 [g]", "Temp": "skip"}``; others are named after their channel, or become raw channels
    under their own names. ``fs`` (Hz) is of a file without time, ``resample`` (Hz) has samples at uneven times
    interpolated. A `RecordNote` says what was guessed.
    """
    data, encoding = read_text(path)
    with naming(path):
        notes = [] if encoding == "UTF-8" else [encoding]
        contents = read_table(data, columns or {}, Rates(fs, resample, notes))
    note(path, notes)
    return contents


def read_columns(path: str | PathLike[str]) -> dict[str, np.ndarray]:
    """Read all columns (n,) of a text table under their headers, with units in brackets.

    Numbers are as in the file, nan where there is none; dates and clock times are s from the first one. Of a file
    without a header the columns are named "1", "2", ...
    """
    data, encoding = read_text(path)
    with naming(path):
        notes = [] if encoding == "UTF-8" else [encoding]
        body = _body(data, notes)
        cells, columns = unique_names(_names(body, True)[0], notes), dict[str, np.ndarray]()
        for index, cell in enumerate(cells):
            if body.kind(index) != "empty":
                stamps = read_stamps(body.frame[index]) if body.kind(index) == "stamp" else None
                columns[cell] = stamps[0] if stamps else body.numbers(index)
    note(path, notes)
    return columns


def write_csv(path: str | PathLike[str], obj: Contents) -> None:
    """Write time records of one rate, length and start, or FRFs, as CSV, every digit of every number."""
    with naming(f"{path}: cannot be written"):
        headers, numbers = timed_table(obj)
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(headers)
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        np.savetxt(file, numbers, "%.17g", ",", header=line.getvalue(), comments="")


def _body(data: bytes, notes: list[str]) -> TableBody:
    """Find and read the numbers of a text table."""
    if b"\r" in data and data.count(b"\r") > data.count(b"\r\n"):
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    head = data[:HEAD].splitlines(keepends=True)
    layout = find_layout(head)
    above = [line.decode().rstrip() for line in head[: layout.first]]
    notes += _describe_style(layout, above)
    return read_body(data, sum(map(len, head[: layout.first])), layout, notes)


def read_table(data: bytes, mapped: Mapping[str, str], rates: Rates) -> Contents:
    """Return the time records or FRFs of a table in UTF-8, as `read_csv` does."""
    notes = rates.notes
    body = _body(data, notes)
    cells, line = _names(body, bool(mapped))
    used = resolve(cells, mapped, line, notes)
    if any(c.reference for c in used):
        if rates.fs is not None:
            raise RecordError("holds FRFs, which have no sampling rate")
        return frf_of_columns(used, [_numbers(body, c, cells, needed=True)[0] for c in used])
    layout = body.layout
    above = [line.decode().rstrip() for line in body.data[: body.begin].splitlines()]
    axis, of_time = time_of(body, used, cells, rates, find_rate(above, layout.style))
    if not (columns := _channels(body, used, of_time, notes)):
        raise RecordError(f"line {line}: has no column of numbers beside time; its columns are {quoted(cells)}")
    return gapless_channels([c.samples(axis, *_numbers(body, c, cells)) for c in columns], notes)


def _describe_style(layout: Layout, above: Sequence[str]) -> list[str]:
    """Return in words how a table's style differs from the one that `write_csv` writes."""
    style, words = layout.style, []
    if style.point != ".":
        words.append("decimal commas")
    if style.thousands:
        words.append(f'thousands separated by "{style.thousands}"')
    if style.separator == BLANKS:
        words.append("columns separated by blanks")
    elif words:
        words.append(f"separator {'tab' if style.separator == chr(9) else repr(style.separator)}")
    if any(line and not line.startswith(COMMENTS) for line in above[: max(0, layout.header)]):
        words.append(f"header in line {layout.header + 1}")
    if layout.units >= 0:
        words.append(f"units in line {layout.units + 1}")
    return words


def _names(body: TableBody, is_mapped: bool) -> tuple[list[str], int]:
    """Return the names of the columns and the number of their line."""
    layout = body.layout
    first = layout.first + 1
    width = next((i for i in range(body.frame.shape[1], 0, -1) if body.kind(i - 1) != "empty"), 1)
    if layout.header < 0:
        if not is_mapped:
            raise RecordError(
                f"line {first}: has numbers where the columns' names are expected; map the columns by their numbers: "
                f'"1=time", "2=acc:1 [g]"'
            )
        return [str(i) for i in range(1, width + 1)], first
    cells = list(layout.cells)
    if len(cells) < width:
        raise RecordError(f"line {first}: has {width} columns, the header {len(cells)}")
    return cells, layout.header + 1


def _channels(
    body: TableBody, used: Sequence[ColumnHeader], of_time: frozenset[int], notes: list[str]
) -> list[ColumnHeader]:
    """Return the columns that are channels; raw ones of no use are left out."""
    columns = [c for c in used if c.index not in of_time]
    reasons = [_why_unusable(body, c) if c.is_raw else "" for c in columns]
    notes += [f'left out "{c.name}", {reason}' for c, reason in zip(columns, reasons) if reason]
    return [c for c, reason in zip(columns, reasons) if not reason]


def _why_unusable(body: TableBody, column: ColumnHeader) -> str:
    """Return why a raw column cannot be a channel, or "" if it can."""
    kind = body.kind(column.index)
    if kind == "empty":
        return "which is empty"
    if kind != "number":
        return "which is text" if kind == "text" else "which is dates or clock times"
    values = body.numbers(column.index)
    missing = np.isnan(values)
    if missing.mean() >= MAX_MISSING_FRACTION:
        line = body.lines[int(np.argmax(missing))][0]
        return f"which lacks {missing.sum()} of {values.size} numbers, the first in line {line}"
    if is_index(column.name) and not missing.any() and (np.diff(values) == 1).all():
        return "which counts the samples"
    return ""


def _numbers(
    body: TableBody, column: ColumnHeader, cells: Sequence[str], needed: bool = False
) -> tuple[np.ndarray, str]:
    """Return (n,) numbers of a column, nan where there is a code, and the first code; ``needed``: there is none."""
    index, name = column.index, cells[column.index]
    if index >= body.frame.shape[1]:
        line, width = body.lines[0][0], len(body.cells(0))
        raise RecordError(f"line {line}: has {width} columns, the header {len(cells)}")
    values = body.numbers(index)
    faulty = np.flatnonzero(~np.isfinite(values))
    rows = [(at, body.cells(at)) for at in faulty[:MOST_CODES]]
    wrong = [(at, row) for at, row in rows if needed or index >= len(row) or not is_code(row[index])]
    if not wrong:
        return values, f"{rows[0][1][index] or 'an empty cell'} in line {body.lines[faulty[0]][0]}" if rows else ""
    line, row = body.lines[wrong[0][0]][0], wrong[0][1]
    if index >= len(row):
        raise RecordError(f"line {line}: has {len(row)} columns, the header {len(cells)}")
    cell = f'"{row[index]}"' if row[index] else "an empty cell"
    more = f" (so have {len(wrong) - 1} more lines)" if len(wrong) > 1 else ""
    raise RecordError(
        f'line {line}, column {index + 1} "{name}": {cell} is not a number{more}; mend it, end the file before it, or '
        f'leave the column out ("{name}={SKIP}")'
    )


register(Format(
    "CSV", (".csv", ".tsv", ".txt", ".asc"), (Channel, FRF), read_csv, write_csv,
    options=("columns", "fs", "resample"),
    note="a header or a map of columns, also as data loggers write it; `.csv.gz` is read",
))  # fmt: skip


# The sampling rate in the lines above a table.

_RATE = (
    r"(?:(?:data|acquisition|scan|sampl\w*|channel|daq)?[ _-]*(?:rate|freq(?:uency|\.)?)|f_?s|samples? per second"
    r"|abtast(?:rate|frequenz)|fr[ée]quence d['’ ][ée]chantillonnage)"
)
_STEP = (
    r"(?:d_?t|delta[ _]?[tx]|(?:sampl\w*|scan|time|data)[ _-]*(?:interval|period|step|increment|time|spacing)"
    r"|abtast(?:intervall|zeit|periode)|wf_increment)"
)
_RATES = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "s/s": 1.0, "ks/s": 1e3, "ms/s": 1e6, "sa/s": 1.0, "samples/s": 1.0,
          "sps": 1.0, "ksps": 1e3, "1/s": 1.0, "samples/sec": 1.0, "samples/second": 1.0}  # fmt: skip
_STEPS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9}
_NAMED_UNIT = r"\s*[\[(]\s*([^\[\]()]{1,16}?)\s*[\])]"
_VALUE = r'([+-]?[\d.,]*\d(?:[eE][+-]?\d+)?)"?[\s;,"]*([^\d\s;,"][^\s;,"]*)?["\s;,]*'
_ENTRY = rf'"?(?:{_NAMED_UNIT})?"?\s*[:=;,\t ]\s*["\t;, ]*{_VALUE}'
_LINES = tuple(
    (re.compile(rf'[\s#%/!"]*{key}{_ENTRY}', re.IGNORECASE), units, is_step)
    for key, units, is_step in ((_RATE, _RATES, False), (_STEP, _STEPS, True))
)


def find_rate(lines: Sequence[str], style: Style) -> tuple[float, int] | None:
    """Return samples per second and the number of the line, from 1, that says so; None if no line does."""
    for number, line in enumerate(lines, 1):
        for pattern, units, is_step in _LINES:
            if not (match := pattern.fullmatch(line[:200])):
                continue
            bracketed, text, trailing = match.groups()
            unit = (trailing or bracketed or "").strip("[]()").lower()
            factor = units.get(unit, 1.0 if not unit else None)
            text = text.replace(",", ".") if "." not in text and style.point == "," else text.replace(",", "")
            value = number_of(text) * (factor or 0.0)
            if 0 < value < 1e12:
                return (1 / value if is_step else value), number
    return None
