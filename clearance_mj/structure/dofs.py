"""Tables of degrees of freedom: node, direction and, where it is known, the node's position."""

from __future__ import annotations

import csv
import difflib
import functools
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import read_lines
from .base import AXES, parse_dof

__all__ = ["Dofs", "dof_table", "read_dofs"]

EMPTY = "dofs is empty; needs a node and a direction for each row of the matrices"
_DIRECTION = re.compile(r"([+-]?)(?:(U|T|R|ROT|)([XYZ])|([1-6]))")


@dataclass(frozen=True, eq=False)
class Dofs:
    """Degrees of freedom of the rows of matrices."""

    names: tuple[str, ...]  #: of each row, such as "12:RX", without sign
    signs: np.ndarray  #: (n,) -1 where a coordinate counts against its direction
    places: np.ndarray | None = None
    """(n, 3) positions of the nodes, in the matrices' unit of length; None where they are not known"""

    @functools.cached_property
    def rows(self) -> dict[str, int]:
        """Row by name."""
        return {name: i for i, name in enumerate(self.names)}

    @property
    def axes(self) -> np.ndarray:
        """(n,) index of each row's direction in `AXES`."""
        return np.array([AXES.index(name.partition(":")[2]) for name in self.names])

    def find(self, point: float | str) -> tuple[int, float]:
        """Return the row of a point and its sign; a ValueError names the nearest nodes."""
        if (dof := parse_dof(point)) is None:
            raise ValueError(f'"{point}" is no degree of freedom, a text such as "{self.names[0]}" (node, direction)')
        node, axis, sign = dof
        if (row := self.rows.get(f"{node}:{axis}")) is None:
            raise ValueError(f'"{point}" is no degree of freedom of the structure; {self._describe_nearest(str(node))}')
        return row, sign * self.signs[row]

    def of_node(self, node: str) -> list[str]:
        """Return the names of a node's degrees of freedom."""
        return [name for axis in AXES if (name := f"{node}:{axis}") in self.rows]

    def _describe_nearest(self, node: str) -> str:
        if names := self.of_node(node):
            return f"node {node} has {', '.join(name.partition(':')[2] for name in names)}"
        nodes = list(dict.fromkeys(name.partition(":")[0] for name in self.names))
        if node.isdigit() and all(n.isdigit() for n in nodes):
            near = sorted(sorted(nodes, key=lambda n: abs(int(n) - int(node)))[:2], key=int)
        else:
            near = difflib.get_close_matches(node, nodes, 2, 0.0)
        return f"the nearest nodes are {' and '.join(near)}"


def dof_table(texts: Iterable[str], places: np.ndarray | None = None) -> Dofs:
    """Make a table from texts such as "12:X", "12:-RZ", "12:UX" or "12:4" (X Y Z RX RY RZ are 1 to 6)."""
    names, signs = [], []
    for row, text in enumerate(texts, 1):
        node, _, direction = str(text).strip().partition(":")
        match = _DIRECTION.fullmatch(direction.strip().upper())
        if not match or parse_dof(f"{node}:X") is None:
            raise ValueError(
                f"dofs row {row}: {text!r} is no degree of freedom; write a node and X, Y, Z, RX, RY or RZ, as in 12:RX"
            )
        sign, kind, letter, number = match.groups()
        names.append(f"{node}:{AXES[int(number) - 1] if number else ('R' if kind in ('R', 'ROT') else '') + letter}")
        signs.append(-1.0 if sign == "-" else 1.0)
    if not names:
        raise ValueError(EMPTY)
    if len(set(names)) < len(names):
        first = {name: row for row, name in reversed([*enumerate(names, 1)])}
        row, name = next((row, name) for row, name in enumerate(names, 1) if first[name] != row)
        raise ValueError(f"dofs row {row}: {name} stands in row {first[name]} already")
    if places is not None and (places.shape != (len(names), 3) or not np.isfinite(places).all()):
        raise ValueError(f"dofs: the coordinates must be {len(names)} x 3 finite numbers, one row for each")
    return Dofs(tuple(names), np.array(signs), places)


def read_dofs(name: str) -> Dofs:
    """Read a CSV table with the columns node, direction and, if known, x, y, z."""
    path = Path(name)
    try:
        lines = read_lines(path)
        table = csv.reader(lines, delimiter=max(",;\t", key="".join(lines[:1]).count))
        rows = [[cell.strip() for cell in row] for row in table if any(row)]
    except RecordError as error:  # names the file
        raise ValueError(str(error)) from None
    except csv.Error as error:
        raise ValueError(f"{path}: not a table of text (CSV): {error}") from None
    header = [cell.lower() for cell in rows[0]] if rows else []
    if "node" not in header or "direction" not in header:
        raise ValueError(f"{path}: the first line must name the columns node, direction and, if known, x, y, z")
    if len(rows) < 2:
        raise ValueError(f"{path}: {EMPTY}")
    for i, row in enumerate(rows[1:], 1):
        if len(row) != len(header):
            raise ValueError(f"{path}: row {i} has {len(row)} cells, the first line {len(header)}")
    columns = dict(zip(header, zip(*rows[1:])))
    with naming(f"{path}: x, y and z must be numbers", ValueError, ValueError, "{} ({})"):
        places = np.array([columns[axis] for axis in "xyz"], dtype=float).T if {"x", "y", "z"} <= set(header) else None
    with naming(path, ValueError):
        return dof_table(map(":".join, zip(columns.get("node", ()), columns.get("direction", ()))), places)
