"""Rows and names of clearances in records and results."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence

import numpy as np

from ..structure.base import parse_dof, parse_place
from .clearance import Bushing
from .instruments import PROBE_NODE, Sensor, dof_label

__all__ = ["ClearanceRows"]


class ClearanceRows:
    """Rows and names of the clearances of a `Rig` in records and results."""

    bushings: tuple[Bushing, ...]
    sensors: tuple[Sensor, ...]

    @functools.cached_property
    def clearance_rows(self) -> list[slice]:
        """Rows of each clearance in displacements and forces, `n_rows` in all; y before z of a round one."""
        ends = itertools.accumulate((b.n_coordinates for b in self.bushings), initial=0)
        return [slice(*pair) for pair in itertools.pairwise(ends)]

    @property
    def row_offsets(self) -> np.ndarray:
        """(n_rows,) m, of the unloaded shaft from the middles of round clearances; 0 of slots and stops."""
        offsets = [(b.offset_y, b.offset) if b.is_round else (0.0,) for b in self.bushings]
        return np.array([offset for pair in offsets for offset in pair])

    @functools.cached_property
    def row_axes(self) -> list[tuple[str, int]]:
        """Axis of each row, such as "Z", or "RX" of a twist, and 1 or -1 of its direction along it."""
        return [dof[1:] for label in self.probe_labels if (dof := parse_dof(label))]

    @property
    def row_walls(self) -> np.ndarray:
        """(n_rows, 2) m, displacements from the unloaded shaft at which each row is at its walls; infinite for none."""
        walls = [[(-b.gap - offset, b.gap - offset) for offset in (b.offset_y, b.offset)] if b.is_round else [b.walls]
                 for b in self.bushings]  # fmt: skip
        return np.array([pair for rows in walls for pair in rows]).reshape(-1, 2)

    @property
    def n_rows(self) -> int:
        """Number of rows of all clearances."""
        return len(self.bushing_of_row)

    @functools.cached_property
    def bushing_of_row(self) -> np.ndarray:
        """(n_rows,) number of the bushing that each row belongs to, from 0."""
        return np.array([j for j, b in enumerate(self.bushings) for _ in range(b.n_coordinates)], dtype=int)

    @functools.cached_property
    def end_rows(self) -> np.ndarray:
        """(n_rows, 2) indices of both ends of each row among all ends, which are bushing by bushing."""
        pairs = [(rows.start + i, rows.stop + i) for rows in self.clearance_rows for i in range(rows.start, rows.stop)]
        return np.array(pairs, dtype=int).reshape(-1, 2)

    @property
    def probe_labels(self) -> list[str]:
        """Degrees of freedom of the clearances' relative displacements in records, such as "6:+Z".

        A round clearance has two, along y and z. Its node is that of the sensor in a bushing around a shaft; others, at
        named degrees of freedom, between two points or without a sensor, have those from 301 on that no sensor has.
        """
        taken = {s.node for s in self.sensors}
        free = (node for node in itertools.count(PROBE_NODE) if node not in taken)
        probes: list[str] = []
        for bushing in self.bushings:
            node = _node_in(bushing, self.sensors)
            labels = _dofs_of_rows(bushing, next(free) if node is None else node)
            probes += labels if {*probes}.isdisjoint(labels) else _dofs_of_rows(bushing, next(free))
        return probes

    @property
    def clearance_labels(self) -> list[str]:
        """Unique name of each clearance in results: its place in the rig file, such as "36:Y" or "rod@0.5".

        A bushing that is placed by a number has the name of the sensor in it, such as "6:+Z", or else its place in the
        rig file, such as "bushings[0]", which is also added where several clearances are at one place.
        """
        names = [_clearance_label(j, bushing, self.sensors) for j, bushing in enumerate(self.bushings)]
        return [f"{name} bushings[{j}]" if names.count(name) > 1 else name for j, name in enumerate(names)]


def _dofs_of_rows(bushing: Bushing, node: int) -> list[str]:
    """Return the degrees of freedom of a clearance at a node."""
    return [f"{node}:+Y", f"{node}:+Z"] if bushing.is_round else [dof_label(node, bushing.position)]


def _clearance_label(j: int, bushing: Bushing, sensors: Sequence[Sensor]) -> str:
    if isinstance(bushing.position, str):
        return bushing.where
    node = _node_in(bushing, sensors)
    return f"bushings[{j}]" if node is None else dof_label(node, bushing.position)


def _node_in(bushing: Bushing, sensors: Sequence[Sensor]) -> int | None:
    """Return the node of the sensor nearest to the middle of a bushing around a shaft, None if it is not inside."""
    place = parse_place(bushing.position)
    if place is None or bushing.to is not None:
        return None
    probed = {s.node for s in sensors if s.quantity == "displacement"}  # these are other probes
    candidates = [s for s in sensors if s.quantity != "force" and s.node not in probed]
    inside = [(parse_place(s.position), s.node) for s in candidates if bushing.holds(s.position)]
    return min(((abs(at[1] - place[1]), node) for at, node in inside if at), default=(0.0, None))[1]
