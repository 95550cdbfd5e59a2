"""Layout of a text table: its first line of numbers, its separators, and the line above that names its columns.

Loggers write titles and ``key: value`` lines, blank lines, names, channel numbers and units above their numbers. The
numbers are the longest block of lines with the same cells; the lines above it are read from the bottom.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from ...core.errors import RecordError
from ..gaps import is_code
from .headers import is_unit
from .stamps import STAMP

__all__ = ["BLANKS", "COMMENTS", "HEAD", "Layout", "Style", "find_layout", "strip_empty_end"]

HEAD = 2**22  # bytes at the beginning of a file in which its table begins
LINES = 20_000  # lines of it, of which the first are looked at first
FIRST_LINES = 400
COMMENTS = ("#", "%", "//", "!")
BLANKS = " "  # columns are separated by any number of blanks
SEPARATORS = ("\t", ";", ",", "|", BLANKS)
DECIMALS = ((".", ""), (",", ""), (".", ","), (",", "."), (",", " "), (",", "\xa0"), (".", "'"), (",", "'"))
"""Decimal and thousands separators, the first of which all numbers fit is taken"""
_NUMBER = {
    (point, group): re.compile(
        (rf"[+-]?\d{{1,3}}(?:{re.escape(group)}\d{{3}})+(?:{re.escape(point)}\d*)?|" if group else "")
        + rf"[+-]?(?:\d+(?:{re.escape(point)}\d*)?|{re.escape(point)}\d+)(?:[eE][+-]?\d+)?"
    )
    for point, group in DECIMALS
}
_DIGITS = re.compile(r"\d")
_LIKE_NUMBER = re.compile(r"[+-]?[\d.,][\d., '\xa0]*(?:[eE][+-]?\d+)?")
_UNITS = ("unit", "units", "einheit", "einheiten", "[unit]", "y_unit_label")
_NUMBERS = ("channel", "channels", "ch", "no", "no.", "nr", "nr.", "number", "index", "kanal", "#", "")


@dataclass(frozen=True)
class Style:
    """Separators of columns, decimals and thousands of a table."""

    separator: str
    point: str = "."
    thousands: str = ""

    def split(self, line: str) -> list[str]:
        """Return the cells of a line, without quotation marks and blanks around them."""
        if self.separator == BLANKS:
            return line.split()
        if '"' not in line:
            return [cell.strip() for cell in line.split(self.separator)]
        return [cell.strip().strip('"').strip() for cell in next(csv.reader([line], delimiter=self.separator), [])]

    def number(self, cell: str) -> str:
        """Return a number as Python writes it."""
        return cell.replace(self.thousands, "").replace(self.point, ".") if self.kind(cell) == "n" else cell

    def kind(self, cell: str) -> str:
        """Return "n" for a number, "d" for a date or a clock time, "e" for an empty cell, "t" for text."""
        if not cell:
            return "e"
        if _NUMBER[self.point, self.thousands].fullmatch(cell) or is_code(cell):
            return "n"
        return "d" if len(cell) < 50 and STAMP.fullmatch(cell) else "t"


@dataclass(frozen=True)
class Layout:
    """Place of a table in its file; lines count from 0."""

    style: Style
    first: int  #: line of the first numbers
    width: int  #: cells of a line of numbers
    header: int = -1  #: line with the columns' names; -1: there is none
    units: int = -1  #: line with the columns' units; -1: there is none
    cells: tuple[str, ...] = ()  #: names of the columns, with units in brackets


def strip_empty_end(cells: Sequence[str]) -> list[str]:
    """Return cells without those at their end that are empty."""
    return list(cells[: max((i for i, cell in enumerate(cells, 1) if cell), default=0)])


def find_layout(head: Sequence[bytes]) -> Layout:
    """Find the table among the first lines of a file, which are UTF-8; a RecordError says that there is none."""
    for count in (FIRST_LINES, LINES):
        lines = [line.decode(errors="replace").rstrip("\r\n") for line in head[:count]]
        candidates = [candidate for separator in SEPARATORS if (candidate := _try_separator(lines, separator))]
        if candidates:
            _, ends, layout = max(candidates, key=lambda candidate: candidate[0])
            if ends or len(head) <= count:
                return layout
    raise RecordError("holds no records; needs a line with the names of the columns, then two or more of numbers")


def _try_separator(lines: Sequence[str], separator: str) -> tuple[int, bool, Layout] | None:
    """Return the score of a separator, True if its table goes on to the last line, and the table's layout."""
    filled = [i for i, line in enumerate(lines) if line.strip() and not line.startswith(COMMENTS)]
    if separator != BLANKS and not any(separator in lines[i] for i in filled) and separator != ",":
        return None
    rows = _split(lines, filled, separator)
    style = _style(rows, separator)
    # A row of dashes is a line below the names, although dashes may stand for a number.
    kinds = [tuple(style.kind(cell) if any(map(_DIGITS.search, row)) else "t" for cell in row) for row in rows]
    begin, end = _longest_block(kinds)
    if begin == end:
        return None
    width = 1 + max(i for row in kinds[begin:end] for i, kind in enumerate(row) if kind != "e")
    # A line with a number missing, or that is no number, belongs to the table that goes on behind it.
    model = kinds[begin]
    while begin and (_is_data(kinds[begin - 1], model) or _is_damaged(kinds[:begin], model)):
        begin -= 1
    while end < len(kinds) and _is_data(kinds[end], model):
        end += 1
    if end - begin < 2:
        return None
    while _is_numbering(rows[begin], rows[begin + 1]) and end - begin > 2:
        begin += 1
    layout = _find_header(lines, filled, rows, begin, width, style)
    numbers = sum(kind in "nd" for kind in kinds[end - 1])
    has_names = len(layout.cells) == width
    return (2 * has_names + 1) * min(end - begin, 20) * numbers, end == len(rows), layout


def _split(lines: Sequence[str], filled: Sequence[int], separator: str) -> list[list[str]]:
    style, rows = Style(separator), []
    for i in filled:
        try:
            rows.append(style.split(lines[i]))
        except csv.Error:
            rows.append([lines[i]])
    return rows


def _style(rows: Sequence[Sequence[str]], separator: str) -> Style:
    """Return the decimal and thousands separators that all numbers of the lower half of the rows fit."""
    cells = {cell for row in rows[len(rows) // 2 :] for cell in row if _LIKE_NUMBER.fullmatch(cell)}
    fitting = (marks for marks in DECIMALS if all(_NUMBER[marks].fullmatch(cell) for cell in cells))
    return Style(separator, *next(fitting, DECIMALS[0]))


def _longest_block(kinds: Sequence[tuple[str, ...]]) -> tuple[int, int]:
    """Return begin and end of the longest block of rows of one width with numbers in the same columns.

    Lines ``key;value`` are one, too: one whose first column holds numbers or times goes before.
    """
    best, best_score, begin = (0, 0), (False, 0), 0
    for i in range(1, len(kinds) + 1):
        if i < len(kinds) and _same_kinds(kinds[i], kinds[i - 1]):
            continue
        numbers = sum(kind in "nd" for kind in kinds[i - 1])
        score = (kinds[i - 1][0] in "nd" and i - begin > 1, (i - begin) * numbers)
        if numbers and score >= best_score:
            best, best_score = (begin, i), score
        begin = i
    return best


def _same_kinds(row: tuple[str, ...], other: tuple[str, ...]) -> bool:
    return len(row) == len(other) and all(a == b or "e" in (a, b) for a, b in zip(row, other))


def _is_data(row: tuple[str, ...], below: tuple[str, ...]) -> bool:
    """Return True if a row holds numbers where the table has them, with at most half of them missing."""
    numbers = [i for i, kind in enumerate(below) if kind in "nd"]
    count = sum(i < len(row) and row[i] in "nd" for i in numbers)
    return 2 * count >= len(numbers) > 0 and row[0] in ("e" if below[0] == "e" else "nd")


def _is_damaged(above: Sequence[tuple[str, ...]], model: tuple[str, ...]) -> bool:
    """Return True if the last of the rows begins with a number or a time and has a row of numbers above it."""
    return len(above) > 1 and above[-1][0] in "nd" and model[0] in "nd" and _is_data(above[-2], model)


def _is_numbering(row: Sequence[str], below: Sequence[str]) -> bool:
    """Return True if a row counts the columns, as one of channel numbers does and one of numbers does not."""
    counted = [cell for cell in row if cell]
    if not all(cell.isdecimal() and len(cell) < 6 for cell in counted) or len(counted) < max(2, len(row) - 1):
        return False
    numbers = [int(cell) for cell in counted]
    return numbers == list(range(numbers[0], numbers[0] + len(numbers))) and not all(c.isdecimal() for c in below if c)


def _find_header(
    lines: Sequence[str], filled: Sequence[int], rows: list[list[str]], begin: int, width: int, style: Style
) -> Layout:
    """Return the layout with the lines of names and of units above the numbers."""
    header, units = -1, -1
    for i in range(begin - 1, max(-1, begin - 7), -1):
        row = strip_empty_end(rows[i])
        if len(row) != width and header < 0 and i < begin - 1 and units < 0 and not _is_row_of_numbers(rows[i + 1]):
            break
        if _is_row_of_units(row, header >= 0 or i == 0):
            units = i if units < 0 else units
        elif _is_row_of_numbers(row):
            continue
        elif header < 0:
            header = i
        elif len(row) != width:
            break
    cells = strip_empty_end(rows[header]) if header >= 0 else _names_in_comment(lines, filled[begin], width, style)
    return Layout(
        style, filled[begin], width, filled[header] if header >= 0 else filled[begin] - 1 if cells else -1,
        filled[units] if units >= 0 else -1, _with_units(cells, rows[units] if units >= 0 else []),
    )  # fmt: skip


def _names_in_comment(lines: Sequence[str], first: int, width: int, style: Style) -> list[str]:
    """Return the columns' names in a comment right above the numbers, as numpy.savetxt writes them."""
    line = lines[first - 1] if first else ""
    if (mark := next((mark for mark in COMMENTS if line.startswith(mark)), None)) is None:
        return []
    cells = style.split(line[len(mark) :].strip())
    return cells if len(cells) == width and all(style.kind(cell) == "t" for cell in cells) else []


def _is_row_of_units(row: Sequence[str], labelled_only: bool) -> bool:
    """Return True if a row holds units; above the names only if it is labelled so."""
    if row and row[0].lower().rstrip(":") in _UNITS:
        return True
    labels = [cell for cell in row if cell]
    return not labelled_only and bool(labels) and all(is_unit(cell.strip("[]() ")) for cell in labels)


def _is_row_of_numbers(row: Sequence[str]) -> bool:
    if not any(map(str.isalnum, "".join(row))):
        return True  # a line of dashes
    counted = [cell for cell in row[1:] if cell]
    is_counted = bool(counted) and all(cell.isdecimal() for cell in counted)
    return is_counted and (row[0].lower() in _NUMBERS or row[0].isdecimal())


def _with_units(cells: Sequence[str], units: Sequence[str]) -> tuple[str, ...]:
    """Return the names with their units of the row of units in square brackets."""
    plain = [unit.strip("[]() ") for unit in units] + [""] * len(cells)
    if plain and plain[0].lower().rstrip(":") in _UNITS:
        plain[0] = ""
    return tuple(f"{cell} [{unit}]" if unit else cell for cell, unit in zip(cells, plain))
