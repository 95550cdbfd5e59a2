"""Data set 82: trace lines. Records: FORMAT(3I10) number, nodes, colour; 80A1 name; 8I10 nodes, 0 lifts the pen."""

from __future__ import annotations

import numpy as np

from ...errors import RecordError
from ._blocks import Block, fields
from ._fields import read_integer


def read_line(block: Block) -> tuple[int, ...]:
    """Nodes that a line joins; 0 between two parts that are not joined."""
    count = read_integer(block.record(0)[10:20], "number of nodes of a trace line")
    words = [word for line in block.lines[2:] for word in fields(line, 10)]
    if count != len(words):
        raise RecordError(f"trace line declares {count} nodes, but {len(words)} follow")
    return tuple(read_integer(word, "node of a trace line") for word in words)


def line_set(number: int, nodes: tuple[int, ...], name: str) -> dict:
    """The data set as pyuff writes it; pyuff counts a node that follows itself once, so there must be none."""
    return {"type": 82, "trace_num": number, "color": 1, "id": name, "nodes": np.array(nodes)}
