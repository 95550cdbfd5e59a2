"""Names of clearances in records and results."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from ..structure.base import parse_place
from .clearance import Bushing
from .instruments import PROBE_NODE, Sensor, dof_label

__all__ = ["clearance_labels", "probe_labels"]


def probe_labels(bushings: Sequence[Bushing], sensors: Sequence[Sensor]) -> list[str]:
    """Return degrees of freedom of the clearances' displacements in records; see `Rig.probe_labels`."""
    taken = {s.node for s in sensors}
    free = (node for node in itertools.count(PROBE_NODE) if node not in taken)
    found: dict[str, None] = {}
    for bushing in bushings:
        node = _node_in(bushing, sensors)
        label = dof_label(next(free) if node is None else node, bushing.position)
        found[label if label not in found else dof_label(next(free), bushing.position)] = None
    both = ([f"{label.partition(':')[0]}:+{axis}" for axis in "YZ"] for label in found)
    return [row for b, label, two in zip(bushings, found, both) for row in (two if b.is_round else [label])]


def clearance_labels(bushings: Sequence[Bushing], sensors: Sequence[Sensor]) -> list[str]:
    """Return a unique name of each clearance in results; see `Rig.clearance_labels`."""
    found = [_named(j, bushing, sensors) for j, bushing in enumerate(bushings)]
    return [f"{name} bushings[{j}]" if found.count(name) > 1 else name for j, name in enumerate(found)]


def _named(j: int, bushing: Bushing, sensors: Sequence[Sensor]) -> str:
    if isinstance(bushing.position, str):
        return bushing.where
    node = _node_in(bushing, sensors)
    return f"bushings[{j}]" if node is None else dof_label(node, bushing.position)


def _node_in(bushing: Bushing, sensors: Sequence[Sensor]) -> int | None:
    """Node of the sensor nearest to the middle of a bushing around a shaft, None if it is not inside."""
    place = parse_place(bushing.position)
    if place is None or bushing.to is not None:
        return None
    probed = {s.node for s in sensors if s.quantity == "displacement"}  # these are other probes
    known = [s for s in sensors if s.quantity != "force" and s.node not in probed]
    inside = [(parse_place(s.position), s.node) for s in known if bushing.holds(s.position)]
    return min(((abs(at[1] - place[1]), node) for at, node in inside if at), default=(0.0, None))[1]
