"""Data set 15: nodes. Record 1: FORMAT(4I10,1P3E13.5), node, coordinate systems, colour, position."""

from __future__ import annotations

import numpy as np

from ...errors import RecordError
from ._blocks import Block, fields
from ._fields import read_integer, read_real


def read_nodes(block: Block) -> dict[int, tuple[float, ...]]:
    """Position of each node in m."""
    nodes = {}
    for line in block.lines:
        if not line.strip():
            continue
        node = read_integer(line[:10], "node")
        if node < 1:
            raise RecordError(f"node {node} must be > 0")
        if node in nodes:
            raise RecordError(f"node {node} comes twice")
        place = [read_real(text, f"position of node {node}") for text in fields(line[40:], 13, 3)]
        nodes[node] = tuple(x / block.factors[0] for x in place)
    return nodes


def node_set(nodes: dict[int, tuple[float, ...]]) -> dict:
    """The data set as pyuff writes it."""
    zero = np.zeros(len(nodes), dtype=int)
    x, y, z = np.array(list(nodes.values()), dtype=float).T
    shared = {"def_cs": zero, "disp_cs": zero, "color": zero}
    return {"type": 15, "node_nums": list(nodes), "x": x, "y": y, "z": z, **shared}
