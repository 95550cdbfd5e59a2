"""The numbers of a text table, by pandas' reader; a cell that is no number is named with its line."""

from __future__ import annotations

import functools
import io
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import RecordError
from ..gaps import MISSING_WORDS
from .layout import BLANKS, Layout

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TableBody", "read_body"]

TAIL = 2**16  # bytes at the end of a file in which lines are looked for that are no numbers
_CODES = [sign + word for w in MISSING_WORDS for word in {w, w.upper(), w.title()} for sign in ("", "+", "-")]
_KINDS = {"n": "number", "d": "stamp", "t": "text"}


@dataclass(frozen=True, eq=False)
class TableBody:
    """The lines of numbers of a table."""

    frame: pd.DataFrame  #: a column for each of the table, of numbers or of text
    data: bytes  #: the file as UTF-8
    begin: int  #: its first byte of numbers
    end: int  #: the byte behind them
    layout: Layout

    @functools.cached_property
    def lines(self) -> list[tuple[int, bytes]]:
        """Number in the file, from 1, and text of each line of the table."""
        lines = self.data[self.begin : self.end].splitlines()
        filled = _row_test(self.layout)
        return [(i, line) for i, line in enumerate(lines, self.layout.first + 1) if filled(line)]

    def cells(self, row: int) -> list[str]:
        """Return the cells of a row as they are in the file."""
        return self.layout.style.split(self.lines[row][1].decode())

    def kind(self, column: int) -> str:
        """Return the kind of a column: "number", "stamp", "text", or "empty"."""
        if column >= self.frame.shape[1]:
            return "empty"
        values = self.frame[column].dropna()
        if values.empty:
            return "empty"
        if values.dtype.kind in "iuf":
            return "number"
        sample = values.iloc[np.linspace(0, len(values) - 1, 50).astype(int)].astype(str)
        kinds = [self.layout.style.kind(cell.strip()) for cell in sample]
        return _KINDS[max("ndt", key=kinds.count)]

    def numbers(self, column: int) -> np.ndarray:
        """Return (n,) numbers of a column, nan where there is none."""
        values = self.frame[column]
        if values.dtype.kind in "iuf":
            return values.to_numpy(float)
        write = self.layout.style.number
        cells = (cell if isinstance(cell, float) else number_of(write(str(cell).strip())) for cell in values)
        return np.fromiter(cells, float, len(values))

    def last_digit(self, column: int) -> float:
        """Return the place of the last digit that the last numbers of a column are written with."""
        style = self.layout.style
        last = self.data[max(self.begin, self.end - TAIL) : self.end].rstrip().rsplit(b"\n", 6)[-6:]
        rows = [style.split(line.decode(errors="replace")) for line in last]
        texts = [style.number(row[column]) for row in rows if column < len(row)]
        places = [Decimal(text).as_tuple().exponent for text in texts if np.isfinite(number_of(text))]
        return float(10.0 ** min([300, *map(int, places)]))


def number_of(text: str) -> float:
    """Return the number that a text is, nan of other text."""
    try:
        return float(text) if "_" not in text else np.nan
    except ValueError:
        return np.nan


def _row_test(layout: Layout) -> Callable[[bytes], bool]:
    """Return a function that is True of lines that are rows to pandas, which skips blanks and comments."""
    blanks = b" \r\n" if layout.style.separator == "\t" else b" \t\r\n"
    return lambda line: bool(line.strip(blanks)) and not line.startswith(b"#")


def read_body(data: bytes, begin: int, layout: Layout, notes: list[str]) -> TableBody:
    """Read the lines of numbers, which begin at a byte of a file; notes say what was left out at its end."""
    import pandas as pd

    end = _end_of_numbers(data, begin, layout, notes)
    plain = io.BytesIO(data if end == len(data) else data[:end])
    plain.seek(begin)
    # Comments are rare, and pandas would take what follows a mark within a line for one.
    if b"#" in data and b"\n#" in data[begin:end]:
        plain = io.BytesIO(b"\n".join(line for line in data[begin:end].splitlines() if _row_test(layout)(line)))
    style = layout.style
    is_exact = tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1)  # from then on every number is
    options: dict[str, Any] = {
        "sep": r"\s+" if style.separator == BLANKS else style.separator, "decimal": style.point, "header": None,
        "thousands": style.thousands or None, "float_precision": None if is_exact else "round_trip",
        "skipinitialspace": style.separator.encode() + b" " in data[begin : begin + TAIL],
    }  # fmt: skip
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pd.errors.DtypeWarning)  # numbers and text in one column
            position = plain.tell()
            frame: pd.DataFrame = pd.read_csv(plain, **options)
            body = TableBody(frame, data, begin, end, layout)
            if any(dtype.kind not in "iuf" and body.kind(i) == "number" for i, dtype in enumerate(body.frame.dtypes)):
                plain.seek(position)  # to look for codes takes a quarter more time, which most tables need not
                frame = pd.read_csv(plain, na_values=_CODES, **options)
                body = TableBody(frame, data, begin, end, layout)
            return body
    except pd.errors.ParserError as error:
        raise _refusal(str(error), data[begin:end], layout) from None


def _refusal(words: str, body: bytes, layout: Layout) -> RecordError:
    first = layout.first + 1
    for number, line in enumerate(body.splitlines(), first):
        if not _row_test(layout)(line):
            continue
        if line.count(b'"') % 2:
            return RecordError(f"line {number}: has a quotation mark that is not closed")
        width = len(layout.style.split(line.decode()))
        if number == first:
            usual = width
        if width > usual:
            return RecordError(f"line {number}: has {width} columns, the lines before it {usual}")
    return RecordError(f"line {first}: begins no table ({' '.join(words.split())[:100]})")


def _end_of_numbers(data: bytes, first: int, layout: Layout, notes: list[str]) -> int:
    """Return the byte where the last lines begin that are no numbers, or fewer than those before."""
    begin = max(first, len(data) - TAIL)
    begin = data.find(b"\n", begin) + 1 if begin > first else first
    lines = data[begin:].splitlines(keepends=True)
    count = len(lines)
    while count > 1 and not _is_row(lines[count - 1], layout):
        count -= 1
    if count <= 1 or not any(map(_row_test(layout), lines[count:])):
        return len(data)
    end = begin + sum(map(len, lines[:count]))
    number = layout.first + 1 + data.count(b"\n", first, end)
    notes.append(f"left out from line {number} on, which is cut off or no line of numbers")
    return end


def _is_row(line: bytes, layout: Layout) -> bool:
    cells = layout.style.split(line.decode(errors="replace")) if _row_test(layout)(line) else []
    return len(cells) >= layout.width and layout.style.kind(cells[0]) in "nde"
