"""Data sets of text: their delimiters, the contents of fields, and names of numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..core.checks import DIRECTIONS, NOWHERE, UNKNOWN
from ..core.errors import RecordError
from ..core.quantities import QUANTITIES
from ..core.units import quantity_of as quantity_of_unit

DELIMITER = f"{-1:6d}\n"
_CLOSING_LINE = re.compile(rb"^ {0,6}-1[ \t]*(?:\r?\n|\Z)", re.MULTILINE)  # some editors strip blanks
_INTEGER = re.compile(r"[+-]?[0-9]{1,10}")
_REAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(E[+-]?[0-9]{1,3})?")


@dataclass(frozen=True)
class FileUnits:
    """Units of a file (data set 164): those of length and of force in one SI unit."""

    length: float = 1.0
    force: float = 1.0

    def factor(self, quantity: str) -> float:
        """Return the SI units of a quantity in one unit of the file."""
        of_length, of_force = QUANTITIES[quantity].exponents
        return 1 / (self.length**of_length * self.force**of_force)


SI = FileUnits()


@dataclass(frozen=True)
class Block:
    """A data set that is not 58: its records."""

    kind: int
    number: int  #: of the data set in the file, from 1
    lines: tuple[str, ...]  #: the records after the data set's type
    units: FileUnits

    def record(self, index: int) -> str:
        """Return a record; refuses a data set that has fewer."""
        if index >= len(self.lines):
            raise RecordError(f"is cut short; needs {index + 1} records, has {len(self.lines)}")
        return self.lines[index]


def decoded(data: bytes) -> str:
    """Return text in UTF-8 or, as older programs write it, Latin-1."""
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def closing_line(data: bytes, begin: int) -> tuple[int, int]:
    """Return where the text of a data set ends and where the next data set begins."""
    if not (closing := _CLOSING_LINE.search(data, begin)):
        raise RecordError("has no closing line '    -1'; the file is cut short")
    return closing.start(), closing.end()


def text_set(kind: int, lines: Iterable[str]) -> str:
    """Return a data set of text, with its delimiters."""
    return DELIMITER + f"{kind:6d}{'':74}\n" + "".join(f"{line}\n" for line in lines) + DELIMITER


def fields(line: str, width: int, count: int | None = None) -> list[str]:
    """Cut a record into fields of one width; without a count, as many as it fills."""
    line = line.rstrip()
    count = -(-len(line) // width) if count is None else count
    return [line[i * width : (i + 1) * width] for i in range(count)]


def read_integer(text: str, what: str) -> int:
    """Read a whole number; a blank field is zero."""
    text = text.strip()
    if text and not _INTEGER.fullmatch(text):
        raise RecordError(f"{what} is {text!r}, needs a whole number")
    return int(text or 0)  # Fortran reads a blank field as zero


def read_real(text: str, what: str) -> float:
    """Read a finite number; a blank field is zero."""
    text = with_exponents(text.strip().upper().replace("D", "E").encode()).decode()
    if text and not _REAL.fullmatch(text):
        raise RecordError(f"{what} is {text!r}, needs a number")
    value = float(text or 0)
    if not np.isfinite(value):
        raise RecordError(f"{what} is {text!r}, needs a finite number")
    return value


def with_exponents(text: bytes, behind: bytes = rb"(?=[-+\s]|$)") -> bytes:
    """Return numbers with the E that Fortran leaves out before exponents of three digits: 2.00000-101 is 2.00000E-101.

    ``behind``: expression of what follows such an exponent.
    """
    return re.sub(rb"(\.[0-9]*)([+-][0-9]{3})" + behind, rb"\1E\2", text)


def read_dof(node: str, direction: str, what: str) -> str:
    """Read a node and the code of a direction as "3:+Z"; some programs write node -1 where there is none."""
    number = read_integer(node, f"{what} node")
    if number == -1:
        return NOWHERE
    if not 0 <= number < 10**9:
        raise RecordError(f"{what} node {number} must be a whole number of at most 9 digits")
    code = read_integer(direction, f"{what} direction")
    if not (names := [name for name, known in DIRECTIONS.items() if code == known]):
        raise RecordError(f"{what} direction {code} is unknown; needs -6 to 6")
    return f"{number}:{names[0]}"


def quantity_of(code: int, label: str = "") -> str:
    """Return the quantity of a specific data type, "unknown" of those that no calculation uses.

    Where several have the type, such as displacements and angles, the unit's label says which, alone or over another.
    """
    names = [name for name, known in QUANTITIES.items() if code in known.codes]
    match = quantity_of_unit(label, names) or quantity_of_unit(label.rpartition("/")[0], names)
    return match[0] if match else next(iter(names), UNKNOWN)


DATA_SETS = {
    15: "nodes", 18: "coordinate systems", 55: "data at nodes", 56: "data on elements", 57: "data at element nodes",
    58: "functions", 82: "trace lines", 151: "header", 164: "units", 250: "matrices", 780: "elements", 781: "nodes",
    1858: "qualifiers of functions", 2400: "model header", 2411: "nodes", 2412: "elements", 2414: "analysis data",
    2420: "coordinate systems", 2429: "groups", 2435: "groups", 2452: "groups", 2467: "groups", 2477: "groups",
}  # fmt: skip
"""Names of data sets by their numbers"""


def named_sets(kinds: Iterable[int]) -> str:
    """Return numbers of data sets with their names, each once, such as "151 (header), 164 (units)"."""
    return ", ".join(f"{kind} ({DATA_SETS[kind]})" if kind in DATA_SETS else str(kind) for kind in sorted(set(kinds)))
