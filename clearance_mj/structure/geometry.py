"""Geometry of a test or a model: nodes, lines and elements, drawn alone or displaced by a mode shape."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.checks import DIRECTIONS, NOWHERE, naming
from ..core.errors import RecordError
from ..core.overview import HasOverview, Overview, few, span
from ..signals import labelled
from ..signals.arrays import ArrayData, read_only
from ..signals.ema import Modes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["CoordinateSystem", "Element", "Geometry"]

SOLIDS = {
    111: (4, "01 12 20 03 13 23"),
    112: (6, "01 12 20 34 45 53 03 14 25"),
    115: (8, "01 12 23 30 45 56 67 74 04 15 26 37"),
}
"""Number of nodes and edges of solid elements, by their kind; others are drawn as polygons"""


@dataclass(frozen=True)
class CoordinateSystem:
    """A local coordinate system."""

    number: int
    origin: tuple[float, float, float]
    """m"""
    axes: tuple[tuple[float, float, float], ...]
    """unit vectors along its x, y and z, in global coordinates"""
    name: str = ""
    kind: str = "cartesian"
    """ "cartesian", "cylindrical" or "spherical" """


@dataclass(frozen=True)
class Element:
    """An element of a mesh."""

    number: int
    nodes: tuple[int, ...]
    kind: int = 0
    """descriptor of finite elements in universal files, such as 94 for a thin shell with four nodes"""

    @property
    def edges(self) -> tuple[tuple[int, int], ...]:
        """Pairs of nodes along its edges."""
        count, pairs = SOLIDS.get(self.kind, (0, ""))
        if len(self.nodes) == count:
            return tuple((self.nodes[int(pair[0])], self.nodes[int(pair[1])]) for pair in pairs.split())
        closing = self.nodes[:1] if len(self.nodes) > 2 else ()
        return tuple(zip(self.nodes, (*self.nodes[1:], *closing)))


@dataclass(frozen=True, eq=False, repr=False)
class Geometry(HasOverview, ArrayData):
    """Nodes, the lines and elements between them, and local coordinate systems.

    Raises
    ------
    RecordError
        If a node comes twice or has not three coordinates.
    """

    numbers: tuple[int, ...]
    """of the nodes"""
    position: np.ndarray
    """(n_nodes, 3) m, in global coordinates"""
    lines: tuple[tuple[int, ...], ...] = ()
    """nodes along each trace line; 0 between parts that are not joined"""
    elements: tuple[Element, ...] = ()
    """of a mesh, by nodes that may lack a position"""
    systems: tuple[CoordinateSystem, ...] = ()
    """local coordinate systems"""
    displacement_systems: tuple[int, ...] = ()
    """number of each node's displacement system, where that is one of ``systems``; global if left out"""

    def __post_init__(self) -> None:
        position = read_only(np.reshape(np.asarray(self.position, dtype=float), (-1, 3)))
        numbers = tuple(self.numbers)
        local = tuple(self.displacement_systems) or (0,) * len(numbers)
        if len(numbers) != len(position) or len(local) != len(numbers):
            raise RecordError(f"{len(numbers)} nodes with {len(position)} positions and {len(local)} systems")
        if len(set(numbers)) < len(numbers):
            raise RecordError(f"node {next(n for n in numbers if numbers.count(n) > 1)} comes twice")
        self._set(numbers=numbers, position=position, displacement_systems=local)

    @property
    def nodes(self) -> dict[int, tuple[float, ...]]:
        """Position (x, y, z) in m by node."""
        return {number: tuple(place) for number, place in zip(self.numbers, self.position.tolist())}

    @property
    def edges(self) -> tuple[tuple[int, int], ...]:
        """Pairs of nodes that lines and elements join, each once, without nodes that have no position."""
        pairs = [pair for line in self.lines for pair in zip(line, line[1:])]
        pairs += [pair for element in self.elements for pair in element.edges]
        known = set(self.numbers)
        unique = dict.fromkeys((min(pair), max(pair)) for pair in pairs if set(pair) <= known and pair[0] != pair[1])
        return tuple(unique)

    def missing(self, dofs: Iterable[str]) -> tuple[str, ...]:
        """Return the degrees of freedom whose node has no position here.

        Parameters
        ----------
        dofs : iterable of str
            Such as the responses of an FRF, "3:+Z".
        """
        known = set(self.numbers)
        return tuple(dof for dof in dofs if dof == NOWHERE or int(dof.split(":")[0]) not in known)

    def displacement(self, modes: Modes, mode: int) -> np.ndarray:
        """Return the displacement of the nodes in a mode, in global coordinates; 0 for nodes without a response.

        Parameters
        ----------
        modes : Modes
            Modes whose responses are translations at the nodes.
        mode : int
            Number of the mode, from 1.

        Returns
        -------
        ndarray, shape (n_nodes, 3)
            Complex displacements.

        Raises
        ------
        RecordError
            If there is no such mode, or none of its responses is at a node of this geometry.
        """
        if not 1 <= mode <= modes.frequency.size:
            raise RecordError(f"mode {mode} is not there; there are {modes.frequency.size} modes")
        rows = {number: row for row, number in enumerate(self.numbers)}
        axes = {system.number: np.array(system.axes) for system in self.systems if system.kind == "cartesian"}
        displacement, any_translation = np.zeros((len(self.numbers), 3), dtype=complex), False
        for dof, value in zip(modes.responses, modes.shape[:, mode - 1]):
            node, direction = dof.split("/")[0].split(":")
            row, code = rows.get(int(node)), DIRECTIONS.get(direction, 0)
            if row is None or not 1 <= abs(code) <= 3:
                continue
            local = axes.get(self.displacement_systems[row], np.eye(3))
            displacement[row] += np.sign(code) * value * local[abs(code) - 1]
            any_translation = True
        if not any_translation:
            raise RecordError(
                f"no response of the modes is a translation at a node of the geometry; the modes have "
                f"{few(modes.responses)}, the geometry nodes {few(self.numbers)}"
            )
        return displacement

    def plot(self, modes: Modes | None = None, mode: int = 1, scale: float | None = None) -> Figure:
        """Draw nodes, lines and elements in space, and a mode shape of them if one is given.

        Parameters
        ----------
        modes : Modes, optional
            Modes at the nodes.
        mode : int
            Number of the one that is drawn, from 1.
        scale : float, optional
            Factor of the shape; None: its largest motion is a tenth of the geometry's extent.
        """
        from .geometry_figure import geometry_figure

        if modes is None:
            return geometry_figure(self.numbers, self.position, self.edges)
        displacement = self.displacement(modes, mode)
        rotation = np.exp(-0.5j * np.angle(np.sum(displacement**2)))  # the phase at which the shape is largest
        shape = (displacement * rotation).real
        extent = float(np.ptp(self.position, axis=0).max()) or 1.0
        factor = 0.1 * extent / np.abs(shape).max() if scale is None else scale
        words = f"mode {mode}: {modes.frequency[mode - 1]:.4g} Hz, damping {100 * modes.damping[mode - 1]:.3g} %"
        if lacking := self.missing(dof.split("/")[0] for dof in modes.responses):
            words += f"; without a place: {few(lacking, 4)}"
        return geometry_figure(self.numbers, self.position, self.edges, self.position + factor * shape, words)

    def _overview(self) -> Overview:
        kinds = sorted({element.kind for element in self.elements})
        facts = {
            "nodes": few(self.numbers),
            **{axis: span(column, "m") for axis, column in zip("xyz", self.position.T) if len(self.position)},
            "lines": str(len(self.lines) or ""),
            "elements": f"{len(self.elements)} of kinds {few(kinds)}" if self.elements else "",
            "coordinate systems": few([f"{s.number}{f' {s.name}' if s.name else ''}" for s in self.systems]),
        }
        return Overview(f"Geometry of {len(self.numbers)} nodes", facts)

    def to_xarray(self) -> xr.Dataset:
        """Return ``position`` (node, axis) in m; lines, elements and coordinate systems are attributes, plain data."""
        variables = {
            "position": (("node", "axis"), self.position, "m"),
            "displacement_system": ("node", np.array(self.displacement_systems, dtype=float), "1"),
        }
        systems = [[s.number, s.origin, s.axes, s.name, s.kind] for s in self.systems]
        plain: dict[str, Any] = {
            "lines": self.lines, "elements": [[e.number, e.nodes, e.kind] for e in self.elements], "systems": systems
        }  # fmt: skip
        attributes = {name: labelled.plain_json(value, name) for name, value in plain.items()}
        coordinates = {"node": [str(number) for number in self.numbers], "axis": list("xyz")}
        return labelled.dataset("geometry", variables, coordinates, attributes)

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Geometry:
        """Return the geometry of a dataset that `to_xarray` made; RecordError for others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "geometry")
        position = labelled.values(ds, "position", "node", "axis")
        local = labelled.values(ds, "displacement_system", "node")
        wrong = TypeError, ValueError, OverflowError
        with naming("its lines, elements or systems are no geometry", wrong, RecordError):
            numbers = tuple(int(label) for label in labelled.labels(ds, "node")) if position.size else ()
            lines = tuple(tuple(map(int, line)) for line in labelled.from_json(ds, "lines"))
            elements = tuple(Element(n, tuple(nodes), kind) for n, nodes, kind in labelled.from_json(ds, "elements"))
            systems = tuple(
                CoordinateSystem(number, tuple(origin), tuple(map(tuple, axes)), name, kind)
                for number, origin, axes, name, kind in labelled.from_json(ds, "systems")
            )
            return cls(numbers, position, lines, elements, systems, tuple(int(number) for number in local))
