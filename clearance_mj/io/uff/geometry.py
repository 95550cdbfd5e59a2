"""Where the nodes of a test are: nodes (data set 15) and the trace lines between them (82).

15: FORMAT(4I10,1P3E13.5) node, coordinate systems, colour, position. 82: FORMAT(3I10) number, nodes, colour; 80A1 name;
8I10 nodes, 0 lifts the pen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...core.checks import naming
from ...core.errors import RecordError
from ...rig import BASE_NODE, SHAKER_NODE, Rig
from ...structure.base import parse_place
from ...universal.fields import Block, fields, read_integer, read_real, text_set


@dataclass(frozen=True)
class Geometry:
    """Nodes and the lines between them."""

    nodes: dict[int, tuple[float, ...]]
    """position (x, y, z) in m by node"""
    lines: tuple[tuple[int, ...], ...] = ()
    """nodes along each trace line; 0 between parts that are not joined"""


def rig_geometry(rig: Rig) -> Geometry:
    """Return the nodes of a rig's records, and one line through those of each shaft, from the clamp of a cantilever."""
    points = {s.node: s.position for s in rig.sensors}
    points |= {int(label.split(":")[0]): b.position for label, b in zip(rig.probe_labels, rig.bushings)} | points
    if rig.shaker.position is not None and rig.shaker.kind == "force":
        points[SHAKER_NODE] = rig.shaker.position
    nodes: dict[int, tuple[float, ...]] = {BASE_NODE: (0.0, 0.0, 0.0)}
    nodes |= {node: tuple(rig.linear.coordinates(point).tolist()) for node, point in points.items()}
    shafts: dict[str, dict[int, float]] = {"": {BASE_NODE: 0.0}} if rig.beam else {}
    for node, point in points.items():
        if place := parse_place(point):
            shafts.setdefault(place[0], {})[node] = place[1]
    return Geometry(nodes, tuple(tuple(sorted(shaft, key=lambda node: shaft[node])) for shaft in shafts.values()))


def read_geometry_blocks(blocks: Sequence[Block]) -> Geometry:
    """Put nodes and lines of a file together."""
    nodes: dict[int, tuple[float, ...]] = {}
    lines: list[tuple[int, ...]] = []
    for block in blocks:
        with naming(f"data set {block.number}"):
            if block.kind == 15:
                nodes |= _read_nodes(block)
            else:
                lines.append(_read_line(block))
    if not nodes:
        raise RecordError("holds no nodes (data set 15)")
    return Geometry(nodes, tuple(lines))


def _read_nodes(block: Block) -> dict[int, tuple[float, ...]]:
    nodes: dict[int, tuple[float, ...]] = {}
    for line in filter(str.strip, block.lines):
        node = read_integer(line[:10], "node")
        if node < 1:
            raise RecordError(f"node {node} must be > 0")
        if node in nodes:
            raise RecordError(f"node {node} comes twice")
        position = [read_real(text, f"position of node {node}") for text in fields(line[40:], 13, 3)]
        nodes[node] = tuple(x / block.units.length for x in position)
    return nodes


def _read_line(block: Block) -> tuple[int, ...]:
    count = read_integer(block.record(0)[10:20], "number of nodes of a trace line")
    words = [word for line in block.lines[2:] for word in fields(line, 10)]
    if count != len(words):
        raise RecordError(f"trace line declares {count} nodes, but {len(words)} follow")
    return tuple(read_integer(word, "node of a trace line") for word in words)


def geometry_sets(geometry: Geometry) -> list[str]:
    """Data sets of a geometry as text."""
    positions = {node: "".join(f"{x:13.5E}" for x in place) for node, place in geometry.nodes.items()}
    sets = [text_set(15, (f"{node:10d}{0:10d}{0:10d}{0:10d}{text}" for node, text in positions.items()))]
    for number, nodes in enumerate(geometry.lines, 1):
        rows = ["".join(f"{node:10d}" for node in nodes[i : i + 8]) for i in range(0, len(nodes), 8)]
        sets.append(text_set(82, (f"{number:10d}{len(nodes):10d}{1:10d}", f"{'shaft':<80}", *rows)))
    return sets
