"""Geometry of a test: nodes (data sets 15, 2411, 781), lines (82), elements (2412), systems (18, 2420).

15: FORMAT(4I10,1P3E13.5) node, systems of definition and displacement, colour, position. 2411, 781: 4I10
of the same, then 1P3D25.16. 82: FORMAT(3I10) number, nodes, colour; 80A1 name; 8I10 nodes, 0 lifts the pen. 2412: 6I10
number, kind, properties, material, colour, nodes; 3I10 orientation of beams; 8I10 nodes. 18: 5I10 number, kind,
reference system, colour, method; name; 6E13.5, 3E13.5: origin, a point on +x, one in the plane xz. 2420: part; its
name; 3I10 number, kind, colour; name; 1P3D25.16 unit vectors along x, y, z and the origin.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ...core.checks import naming
from ...core.errors import RecordError
from ...rig import BASE_NODE, SHAKER_NODE, Rig
from ...rig.sensing import sensor_points
from ...structure.base import parse_place
from ...structure.geometry import CoordinateSystem, Element, Geometry
from ...universal.fields import Block, fields, read_integer, read_real, text_set

__all__ = ["GEOMETRY_SETS", "geometry_sets", "read_geometry_blocks", "rig_geometry"]

GEOMETRY_SETS = (15, 18, 82, 781, 2411, 2412, 2420)
"""Data sets that make up a geometry"""
_BEAMS = (11, 21, 22, 23, 24)  # kinds of elements with a record of their orientation
_KINDS = ("cartesian", "cylindrical", "spherical")
Node = tuple[int, int, int, list[float]]  # number, systems of definition and displacement, position in m


def rig_geometry(rig: Rig) -> Geometry:
    """Return the nodes of a rig's records, and one line through those of each shaft, from the clamp of a cantilever."""
    points = {s.node: point for s, point in zip(rig.sensors, sensor_points(rig))}
    probed = (rig.bushings[j].position for j in rig.bushing_of_row)
    points |= {int(label.split(":")[0]): at for label, at in zip(rig.probe_labels, probed)} | points
    if rig.shaker.position is not None and rig.shaker.kind == "force":
        points[SHAKER_NODE] = rig.shaker.position
    nodes: dict[int, list[float]] = {BASE_NODE: [0.0, 0.0, 0.0]}
    nodes |= {node: rig.linear.coordinates(point).tolist() for node, point in points.items()}
    shafts: dict[str, dict[int, float]] = {"": {BASE_NODE: 0.0}} if rig.beam else {}
    for node, point in points.items():
        if place := parse_place(point):
            shafts.setdefault(place[0], {})[node] = place[1]
    lines = tuple(tuple(sorted(shaft, key=lambda node: shaft[node])) for shaft in shafts.values())
    return Geometry(tuple(nodes), np.array([*nodes.values()]), lines)


def read_geometry_blocks(blocks: Sequence[Block], notes: list[str]) -> Geometry | None:
    """Return the geometry of a file's nodes, lines, elements and systems; None if it has none."""
    blocks = [block for block in blocks if block.kind in GEOMETRY_SETS]
    nodes: dict[int, Node] = {}
    lines: list[tuple[int, ...]] = []
    elements: list[Element] = []
    systems: list[CoordinateSystem] = []
    for block in blocks:
        with naming(f"data set {block.number}"):
            if block.kind in (18, 2420):
                systems += _local_systems(block, notes) if block.kind == 18 else _part_systems(block)
            elif block.kind == 82:
                lines.append(_line(block))
            elif block.kind == 2412:
                elements += _elements(block)
            else:
                for node in _nodes(block):
                    if nodes.setdefault(node[0], node)[3] != node[3]:
                        notes.append(f"data set {block.number}: node {node[0]} comes twice; its first place is taken")
    if not blocks:
        return None
    by_number = {system.number: system for system in systems}
    position = [_global(node, by_number, notes) for node in nodes.values()]
    local = tuple(node[2] for node in nodes.values())
    return Geometry(tuple(nodes), np.array(position), tuple(lines), tuple(elements), tuple(systems), local)


def _nodes(block: Block) -> Iterator[Node]:
    lines = [line for line in block.lines if line.strip()]
    seen: set[int] = set()
    step = 1 if block.kind == 15 else 2
    for i in range(0, len(lines), step):
        head, body = (lines[i][:40], lines[i][40:]) if step == 1 else (lines[i], "".join(lines[i + 1 : i + 2]))
        number, definition, displacement = _integers(head, "node", 3)
        if number < 1:
            raise RecordError(f"node {number} must be > 0")
        if number in seen:
            raise RecordError(f"node {number} comes twice")
        seen.add(number)
        position = _reals(body, 13 if step == 1 else 25, 3, f"position of node {number}")
        # Positions are in the system of definition in data set 15 alone.
        yield number, definition if step == 1 else 0, displacement, [x / block.units.length for x in position]


def _global(node: Node, systems: dict[int, CoordinateSystem], notes: list[str]) -> list[float]:
    """Return the position in global coordinates."""
    number, definition, _, place = node
    if (system := systems.get(definition)) is None:
        return place
    if system.kind != "cartesian":
        notes.append(f"node {number} is defined in a {system.kind} system; its angles are taken for degrees")
        degree = np.radians(1.0)
        r, theta, phi = place[0], place[1] * degree, place[2] * degree
        if system.kind == "cylindrical":
            place = [r * np.cos(theta), r * np.sin(theta), place[2]]
        else:
            place = [r * np.sin(theta) * np.cos(phi), r * np.sin(theta) * np.sin(phi), r * np.cos(theta)]
    return (np.array(system.origin) + np.array(place) @ np.array(system.axes)).tolist()


def _line(block: Block) -> tuple[int, ...]:
    count = _integers(block.record(0), "number of nodes of a trace line", 2)[1]
    words = [word for line in block.lines[2:] for word in _words(line)]
    nodes = tuple(read_integer(word, "node of a trace line") for word in words)
    if count > len(nodes) or any(nodes[count:]):  # some programs fill the last record with zeros
        raise RecordError(f"trace line declares {count} nodes, but {len(words)} follow")
    return nodes[:count]


def _elements(block: Block) -> Iterator[Element]:
    lines = [line for line in block.lines if line.strip()]
    i = 0
    while i < len(lines):
        number, kind, _, _, _, count = _integers(lines[i], "element", 6)
        if count < 1:
            raise RecordError(f"element {number} has {count} nodes; needs 1 or more")
        i += 1
        # A rod is a beam to some writers and has no orientation with others: two nodes are not three numbers.
        if kind in _BEAMS and i < len(lines) and not (count == 2 and len(_words(lines[i])) == 2):
            i += 1
        nodes: list[int] = []
        while len(nodes) < count and i < len(lines):
            nodes += [read_integer(word, f"node of element {number}") for word in _words(lines[i])]
            i += 1
        if len(nodes) != count:
            raise RecordError(f"element {number} declares {count} nodes, but {len(nodes)} follow")
        yield Element(number, tuple(nodes), kind)


def _local_systems(block: Block, notes: list[str]) -> Iterator[CoordinateSystem]:
    for i in range(0, len([line for line in block.lines if line.strip()]), 4):
        number, kind, reference = _integers(block.record(i), "coordinate system", 3)
        values = _reals(block.record(i + 2), 13, 6, f"coordinate system {number}")
        values += _reals(block.record(i + 3), 13, 3, f"coordinate system {number}")
        origin, on_x, in_xz = np.reshape(values, (3, 3)) / block.units.length
        if reference:
            notes.append(f"coordinate system {number} is defined in system {reference}, which is taken for the global")
        x = on_x - origin
        y = np.cross(in_xz - origin, x)
        if not np.any(x) or not np.any(y):
            raise RecordError(f"coordinate system {number}: its three points must not lie on one line")
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        yield _system(number, kind, origin, [x, y, np.cross(x, y)], block.record(i + 1))


def _part_systems(block: Block) -> Iterator[CoordinateSystem]:
    for start in range(2, len([line for line in block.lines if line.strip()]), 6):
        number, kind = _integers(block.record(start), "coordinate system", 2)
        rows = [_reals(block.record(start + i), 25, 3, f"coordinate system {number}") for i in range(2, 6)]
        yield _system(number, kind, np.array(rows[3]) / block.units.length, rows[:3], block.record(start + 1))


def _system(number: int, kind: int, origin: np.ndarray, axes: Iterable[Iterable[float]], name: str) -> CoordinateSystem:
    if kind not in range(len(_KINDS)):
        raise RecordError(f"coordinate system {number} is of kind {kind}; needs 0, 1 or 2")
    x, y, z = (float(value) for value in origin)
    unit = tuple((float(a), float(b), float(c)) for a, b, c in axes)
    return CoordinateSystem(number, (x, y, z), unit, " ".join(name.split()), _KINDS[kind])


def _words(line: str) -> list[str]:
    """Return the whole numbers of a record as text, split at blanks or, where they fill their columns, cut."""
    words = line.split()
    return words if all(len(word) <= 10 for word in words) else fields(line, 10)


def _integers(line: str, name: str, count: int) -> list[int]:
    values = [read_integer(word, name) for word in _words(line)[:count]]
    return values + [0] * (count - len(values))


def _reals(line: str, width: int, count: int, name: str) -> list[float]:
    words = line.split()
    return [read_real(word, name) for word in (words if len(words) == count else fields(line, width, count))]


def geometry_sets(geometry: Geometry) -> list[str]:
    """Return the data sets of a geometry as text: nodes in six digits (data set 15), or in full if these do not do."""
    positions = {node: "".join(f"{x:13.5E}" for x in place) for node, place in geometry.nodes.items()}
    exact = all([*map(float, fields(positions[node], 13))] == [*place] for node, place in geometry.nodes.items())
    local = dict(zip(geometry.numbers, geometry.displacement_systems))
    heads = {node: f"{node:10d}{0:10d}{local[node]:10d}{1:10d}" for node in positions}
    sets = []
    if geometry.systems:
        rows = [row for system in geometry.systems for row in _system_rows(system)]
        sets.append(text_set(2420, (f"{1:10d}", "NONE", *rows)))
    if exact:
        sets.append(text_set(15, (heads[node] + text for node, text in positions.items())))
    else:
        rows = [row for node, place in geometry.nodes.items() for row in (heads[node], _full(place))]
        sets.append(text_set(2411, rows))
    for number, nodes in enumerate(geometry.lines, 1):
        rows = _rows_of_eight(nodes)
        sets.append(text_set(82, (f"{number:10d}{len(nodes):10d}{1:10d}", f"{f'line {number}':<80}", *rows)))
    if geometry.elements:
        sets.append(text_set(2412, (row for element in geometry.elements for row in _element_rows(element))))
    return sets


def _element_rows(element: Element) -> list[str]:
    head = f"{element.number:10d}{element.kind:10d}{1:10d}{1:10d}{7:10d}{len(element.nodes):10d}"
    return [head, *([f"{0:10d}{1:10d}{1:10d}"] if element.kind in _BEAMS else []), *_rows_of_eight(element.nodes)]


def _system_rows(system: CoordinateSystem) -> list[str]:
    head = f"{system.number:10d}{_KINDS.index(system.kind):10d}{0:10d}"
    return [head, f"{system.name or 'NONE':<40}", *(_full(row) for row in (*system.axes, system.origin))]


def _full(values: Iterable[float]) -> str:
    return "".join(f"{value:25.16e}" for value in values).replace("e", "D")


def _rows_of_eight(nodes: Sequence[int]) -> list[str]:
    return ["".join(f"{node:10d}" for node in nodes[i : i + 8]) for i in range(0, len(nodes), 8)]
