"""The data sets of a file that hold functions."""

from __future__ import annotations

from ...errors import RecordError
from ._blocks import Block
from ._dataset_58 import COHERENCE, FREQUENCY_RESPONSE, TIME_FUNCTION, Function, read_function
from ._dataset_164 import unit_factors
from ._delimiters import BLANK, KIND, OPEN, closing_line

KEPT = (b"15", b"55", b"82")
"""Nodes, modes and trace lines."""


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
    """Walk over the data sets of a file, from delimiter to delimiter: the functions, and those of `KEPT` kinds."""
    found, blocks, factors, number = [], [], (1.0, 1.0), 0
    position = BLANK.match(data).end()
    while position < len(data):
        number += 1
        opening = OPEN.match(data, position)
        if not opening:
            what = "not a universal file" if number == 1 else f"stray bytes before data set {number}"
            raise RecordError(f"{what}: needs a line '    -1' at byte {position}")
        kind = KIND.match(data, opening.end())
        if not kind:
            raise RecordError(f"data set {number}: has no type, needs a number such as 58 after its '    -1'")
        try:
            if kind[1] == b"58":
                function, position = read_function(data, opening.end(), bool(kind[2]), number, factors)
                found.append(function)
            else:
                end, position = closing_line(data, opening.end())
            if kind[1] == b"164":
                factors = unit_factors(data[opening.end() : end])
            if kind[1] in KEPT:
                lines = data[kind.end() : end].decode("utf-8", "replace").splitlines()[1:]
                blocks.append(Block(int(kind[1]), number, tuple(lines), factors))
        except RecordError as error:
            raise RecordError(f"data set {number}: {error}") from None
        position = BLANK.match(data, position).end()
    return found, blocks
