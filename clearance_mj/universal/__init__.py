"""Universal files: the scan of their data sets, and the content of single ones.

Every size that a file declares is compared with the bytes that it holds before anything is allocated.
"""

from __future__ import annotations

import re
from os import PathLike
from typing import NamedTuple

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import plain_file
from .dataset_58 import Function, read_function
from .dataset_164 import read_units
from .fields import SI, Block, FileUnits, closing_line, decoded

__all__ = ["Scan", "contents", "scan"]

_BLANKS = re.compile(rb"(?:\xef\xbb\xbf)?[\s\0\x1a]*")  # of some editors a mark before, of DOS one at the end
_OPEN = re.compile(rb"-1[ \t]*\r?\n")
_KIND = re.compile(rb" *(\d{1,6})([bB]?)")


def contents(path: str | PathLike[str]) -> bytes:
    """Return the bytes of a file.

    Parameters
    ----------
    path : str or Path
        The file.
    """
    try:
        return plain_file(path).read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from None


class Scan(NamedTuple):
    """Data sets of a universal file."""

    functions: list[Function]
    """of type 58"""
    blocks: list[Block]
    """all others"""
    notes: list[str]
    """assumptions, a sentence each"""


def scan(data: bytes, units: FileUnits | None = None) -> Scan:
    """Return the data sets of a file.

    Parameters
    ----------
    data : bytes
        Bytes of the file.
    units : Units, optional
        Units of the file, whatever its data set 164 says.
    """
    functions: list[Function] = []
    blocks: list[Block] = []
    notes: list[str] = []
    given_units, number, position = units, 0, 0
    units = units or SI
    while (blanks := _BLANKS.match(data, position)) and (begin := blanks.end()) < len(data):
        number += 1
        if not (opening := _OPEN.match(data, begin)):
            fault = "not a universal file" if number == 1 else f"stray bytes before data set {number}"
            raise RecordError(f"{fault}: needs a line '    -1' at byte {begin}")
        if not (kind := _KIND.match(data, opening.end())):
            raise RecordError(f"data set {number}: has no type, needs a number such as 58 after its '    -1'")
        with naming(f"data set {number}"):
            if kind[1] == b"58":
                function, position = read_function(data, opening.end(), bool(kind[2]), number, units)
                functions.append(function)
                continue
            end, position = closing_line(data, opening.end())
            lines = decoded(data[kind.end() : end]).splitlines()[1:]
            blocks.append(Block(int(kind[1]), number, tuple(lines), units))
            if kind[1] == b"164" and given_units is None:
                units = read_units(blocks[-1], notes)
    return Scan(functions, blocks, notes)
