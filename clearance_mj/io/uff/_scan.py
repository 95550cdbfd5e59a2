"""The data sets of a file, from delimiter to delimiter."""

from __future__ import annotations

import re

from ...errors import RecordError
from ._dataset_58 import COHERENCE, FREQUENCY_RESPONSE, TIME_FUNCTION, Function, read_function
from ._dataset_164 import read_units
from ._fields import SI, Block, closing_line

_OPEN = re.compile(rb"-1[ \t]*\r?\n")
_KIND = re.compile(rb" *(\d{1,6})([bB]?)")


def measured(found: list[Function]) -> list[Function]:
    """The functions to read: all of time, or FRFs and coherences."""
    kinds = {f.kind for f in found}
    if TIME_FUNCTION in kinds and FREQUENCY_RESPONSE in kinds:
        raise RecordError("holds both time functions and FRFs; put them into two files")
    if not kinds & {TIME_FUNCTION, FREQUENCY_RESPONSE}:
        raise RecordError(
            "holds no time function (type 1) and no FRF (type 4) in data sets 58, "
            f"only function types {sorted(kinds) or 'none'}"
        )
    wanted = (TIME_FUNCTION,) if TIME_FUNCTION in kinds else (FREQUENCY_RESPONSE, COHERENCE)
    return [f for f in found if f.kind in wanted]


def scan(data: bytes) -> tuple[list[Function], list[Block]]:
    """Walk over the data sets of a file: the functions, and the others."""
    functions: list[Function] = []
    blocks: list[Block] = []
    units, number, position = SI, 0, 0
    while (begin := _after_blanks(data, position)) < len(data):
        number += 1
        opening = _OPEN.match(data, begin)
        if not opening:
            what = "not a universal file" if number == 1 else f"stray bytes before data set {number}"
            raise RecordError(f"{what}: needs a line '    -1' at byte {begin}")
        kind = _KIND.match(data, opening.end())
        if not kind:
            raise RecordError(f"data set {number}: has no type, needs a number such as 58 after its '    -1'")
        try:
            if kind[1] == b"58":
                function, position = read_function(data, opening.end(), bool(kind[2]), number, units)
                functions.append(function)
                continue
            end, position = closing_line(data, opening.end())
            lines = data[kind.end() : end].decode("utf-8", "replace").splitlines()[1:]
            blocks.append(Block(int(kind[1]), number, tuple(lines), units))
            if kind[1] == b"164":
                units = read_units(blocks[-1])
        except RecordError as error:
            raise RecordError(f"data set {number}: {error}") from None
    return functions, blocks


def _after_blanks(data: bytes, position: int) -> int:
    while data[position : position + 1].isspace():
        position += 1
    return position
