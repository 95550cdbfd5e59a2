"""Where the nodes of a test are: data sets 15 and 82."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import RecordError
from ...rig import BASE_NODE, SHAKER_NODE, Rig
from ._blocks import Block
from ._dataset_15 import node_set, read_nodes
from ._dataset_82 import line_set, read_line

__all__ = ["Geometry", "rig_geometry"]


@dataclass(frozen=True)
class Geometry:
    """Nodes and the lines between them."""

    nodes: dict[int, tuple[float, float, float]]
    """position in m by node"""
    lines: tuple[tuple[int, ...], ...] = ()
    """nodes along each trace line; 0 between parts that are not joined"""


def rig_geometry(rig: Rig) -> Geometry:
    """Nodes of a rig's records along the shaft, and one line from the clamp through them.

    Parameters
    ----------
    rig : Rig
        The rig; its shaft lies along X and vibrates along Z.
    """
    along = {BASE_NODE: 0.0} | {s.node: s.position for s in rig.sensors}
    if rig.shaker.kind == "force":
        along[SHAKER_NODE] = rig.shaker.position
    nodes = {node: (x, 0.0, 0.0) for node, x in along.items()}
    return Geometry(nodes, (tuple(sorted(along, key=along.get)),))


def read_geometry_blocks(blocks: Sequence[Block]) -> Geometry:
    nodes, lines = {}, []
    for block in blocks:
        try:
            if block.kind == 15:
                nodes |= read_nodes(block)
            else:
                lines.append(read_line(block))
        except RecordError as error:
            raise RecordError(f"data set {block.number}: {error}") from None
    if not nodes:
        raise RecordError("holds no nodes (data set 15)")
    return Geometry(nodes, tuple(lines))


def geometry_sets(geometry: Geometry) -> list[dict]:
    lines = [line_set(i, nodes, "shaft") for i, nodes in enumerate(geometry.lines, 1)]
    return [node_set(geometry.nodes), *lines]
