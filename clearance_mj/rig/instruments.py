"""Sensors and shaker: where a structure is measured and how it is driven."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from ..core.errors import RigError
from ..core.quantities import QUANTITIES, SensorQuantity
from ..core.validation import NotNegative, Number, Positive, Whole, checked, seldom
from ..structure import Point
from ..structure.base import AXES, POINT_SCHEMA, check_point, dof_vector, is_rotation, parse_direction

__all__ = [
    "BASE_NODE", "KEYPHASOR", "KEYPHASOR_NODE", "PROBE_NODE", "SHAKER_NODE", "AppliedForce", "Direction",
    "Kinds", "Sensor", "Shaker", "check_inputs", "dof_label", "input_kinds",
]  # fmt: skip

BASE_NODE = 100
"""Node of the base acceleration in records."""
SHAKER_NODE = 200
"""Node of the shaker's (or hammer's) force in records."""
PROBE_NODE = 301
"""First node in records of displacement probes that are at no sensor's."""
KEYPHASOR_NODE = 400
"""Node of the once-per-turn pulses in records of a shaft that turns."""
KEYPHASOR = f"{KEYPHASOR_NODE}:S"
"""Degree of freedom of these pulses, whose rising half height marks the shaft's angle 0."""


def dof_label(node: int, point: float | str) -> str:
    """Return the node in records and the direction of a point, such as "7:+Z"; shafts vibrate along Z."""
    axis, sign = parse_direction(point) or ("Z", 1)
    return f"{node}:{'-' if sign < 0 else '+'}{axis}"


Kinds: TypeAlias = str | tuple[str, ...]
"""Kind of the first input alone, "base" or "force", or of each of several"""
Direction: TypeAlias = tuple[Number, Number, Number]
"""Direction (x, y, z) of a sensor or an excitation, of any length"""


def _check_direction(direction: Direction | None) -> None:
    if direction is not None and not any(direction):
        raise ValueError("direction must not be zero")


def _unit(direction: Direction) -> np.ndarray:
    return np.array(direction) / np.linalg.norm(direction)


def _nearest_axis(node: int, direction: Direction | np.ndarray, about: str = "") -> str:
    """Return the node and the axis nearest to a direction, such as "7:+Z"."""
    axis = int(np.argmax(np.abs(direction)))
    return f"{node}:{'-' if direction[axis] < 0 else '+'}{about}{AXES[axis]}"


def _free_node(node: int) -> int:
    if node in (BASE_NODE, SHAKER_NODE):
        raise ValueError(f"must not be {BASE_NODE} (base) or {SHAKER_NODE} (shaker)")
    return node


def _place(value: Any) -> Any:
    return value if isinstance(value, str) and _CLEARANCE.fullmatch(value) else check_point(value)


_CLEARANCE = re.compile(r"(?:\S.* )?bushings\[[0-9]{1,4}\]")
Place: TypeAlias = Annotated[
    float | str,
    PlainValidator(_place),
    WithJsonSchema({"anyOf": [POINT_SCHEMA, {"type": "string", "pattern": f"^{_CLEARANCE.pattern}$"}]}),
]
"""A point, or of a force the name of a clearance, such as "bushings[0]" """
_NOT_TAKEN: dict[str, Any] = {"not": {"enum": [BASE_NODE, SHAKER_NODE]}}


@checked(RigError)
class Sensor:
    """A sensor on the structure, identified by its node number in files, and the quantity that it reads."""

    node: Annotated[Whole, Field(ge=1, le=999_999_999, json_schema_extra=_NOT_TAKEN), AfterValidator(_free_node)]
    """positive, unique in the rig; 100 (base) and 200 (shaker) are taken"""
    position: Place
    """m along the shaft, or a degree of freedom such as "12:+X"; of a force the name of a clearance, such as
    "bushings[0]", or where an elastic support of the shaft is"""
    mass: NotNegative = 0.0
    """kg, loads the structure like a point mass"""
    gain: Positive = seldom(default=1.0)
    """what it reads over its quantity"""
    delay: Number = seldom(default=0.0)
    """s, by which its channel is late"""
    direction: Direction | None = seldom(default=None)
    """(x, y, z) along which it measures in space, of any length; None: along z, or its degree of freedom. Of an angle
    the axis, None: y, about which a shaft bends along z; of a strain where the fibre is, seen from the shaft's axis"""
    quantity: SensorQuantity = seldom(default="acceleration")
    """what it reads: "acceleration" (m/s²), "velocity" (m/s, laser vibrometer), "displacement" (m, probe), "angle"
    (rad), "strain" (m/m, gauge along a shaft), "force" (N, of a bushing or an elastic support on the shaft)"""
    relative_to: Literal["ground", "base"] | None = seldom(default=None)
    """what a motion is read against; None: the base of displacements and angles, the ground of all others"""
    fibre: Positive | None = seldom(default=None)
    """m, distance of a strain gauge from the shaft's axis; None: half the shaft's depth there"""

    def __post_init__(self) -> None:
        _check_direction(self.direction)
        if self.fibre is not None and self.quantity != "strain":
            raise ValueError(f"fibre is where a strain gauge sits, and the sensor reads {self.quantity}; leave it out")
        if self.relative_to is not None and not QUANTITIES[self.quantity].motion:
            raise ValueError(f"relative_to has no effect on a sensor of {self.quantity}; leave it out")
        if self.quantity == "force" and self.mass:
            raise ValueError("mass has no effect: a force is read where the structure already is")
        if self.quantity != "force" and isinstance(self.position, str) and _CLEARANCE.fullmatch(self.position):
            raise ValueError(f'position "{self.position}" is a clearance, of which a sensor of quantity "force" reads')
        dof_axis = parse_direction(self.position)
        if dof_axis and self.turns and not is_rotation(self.position):
            raise ValueError(f'position "{self.position}" is no rotation, such as "12:+RX", whose angle it could read')
        if dof_axis and self.direction is not None and self.quantity != "force":
            raise ValueError(f'direction stands beside the degree of freedom "{self.position}", which has its own')

    @property
    def order(self) -> int:
        """Order of the time derivative that it reads."""
        return QUANTITIES[self.quantity].order

    @property
    def turns(self) -> bool:
        """True if it reads a rotation."""
        return QUANTITIES[self.quantity].motion == "angle"

    @property
    def moves_with_base(self) -> bool:
        """True if it reads nothing where all of the rig moves with its base."""
        against = self.relative_to or ("base" if self.order == 0 else "ground")
        return against == "base" or QUANTITIES[self.quantity].motion != "displacement"

    @property
    def unit_direction(self) -> np.ndarray:
        """(3,) unit vector along which it measures; zeros of a degree of freedom that is a rotation."""
        if self.direction is None and self.turns and not parse_direction(self.position):
            return np.array([0.0, 1.0, 0.0])
        return dof_vector(self.position) if self.direction is None else _unit(self.direction)

    @property
    def label(self) -> str:
        """Node and direction, the nearest of X, Y and Z, such as "7:+Z", or "7:+RY" of an angle."""
        if self.direction is None and parse_direction(self.position):
            return dof_label(self.node, self.position)
        return _nearest_axis(self.node, self.unit_direction, "R" if self.turns else "")


@checked(RigError)
class AppliedForce:
    """A point at which the shaker's force acts too, with a factor."""

    position: Point
    """m along the shaft, or a degree of freedom such as "12:+Z" """
    factor: Number = 1.0
    """of the excitation, N/N"""


_FORCE_NEEDS_POSITION = {
    "if": {"properties": {"kind": {"const": "force"}}, "required": ["kind"]},
    "then": {"required": ["position"]},
}


@checked(RigError, schema=_FORCE_NEEDS_POSITION)
class Shaker:
    """Excitation of the rig: at the base that carries supports and bushings, or by a force."""

    kind: Literal["base", "force"] = "base"
    """ "base" or "force" """
    position: Point | None = None
    """m along the shaft, or a degree of freedom such as "12:+Z"; for a force"""
    direction: Direction | None = None
    """(x, y, z) along which the base moves, and a force on a shaft in space acts, of any length; None: along z, in
    which shafts vibrate"""
    also: tuple[AppliedForce, ...] | None = None
    """further points at which the force acts at the same time"""
    delay: Number = seldom(default=0.0)
    """s, by which the excitation's channel is late"""
    node: Annotated[Whole, Field(ge=1, le=999_999_999)] | None = seldom(default=None)
    """of its channel in records; None: 100 of the base, 200 of a force"""

    def __post_init__(self) -> None:
        if self.kind == "force" and self.position is None:
            raise ValueError('position is missing; a shaker of kind "force" pushes at one point')
        _check_direction(self.direction)
        if self.also and self.position is None:
            raise ValueError("position is missing; also adds points to it")

    @property
    def forces(self) -> tuple[tuple[float | str, float], ...]:
        """Points at which the force acts, and its factor at each."""
        also = ((force.position, force.factor) for force in self.also or ())
        return () if self.position is None else ((self.position, 1.0), *also)

    def pushed(self) -> tuple[list[float | str], np.ndarray]:
        """Return the points at which the force acts, and its factor (n,) at each.

        Raises
        ------
        RigError
            If the rig file does not give their positions.
        """
        if not self.forces:
            raise RigError("a force drives the rig, and its file does not say where: give [shaker] its position")
        points, factors = zip(*self.forces)
        return list(points), np.array(factors)

    @property
    def unit_direction(self) -> np.ndarray:
        """(3,) unit vector along which the base moves."""
        return _unit(self.direction or (0.0, 0.0, 1.0))

    def label(self, kind: str) -> str:
        """Return node and direction of an excitation, such as "100:+Z".

        Parameters
        ----------
        kind : str
            Kind of the excitation, "base" or "force".
        """
        if kind == "base":
            return _nearest_axis(self.node or BASE_NODE, self.unit_direction)
        if self.direction is not None and parse_direction(self.position or 0.0) is None:
            return _nearest_axis(self.node or SHAKER_NODE, self.unit_direction)
        return dof_label(self.node or SHAKER_NODE, 0.0 if self.position is None else self.position)


def input_kinds(kinds: Kinds) -> tuple[str, ...]:
    """Return the kind of each input."""
    return (kinds,) if isinstance(kinds, str) else kinds


def check_inputs(inputs: Sequence[Shaker], nodes: Sequence[int]) -> None:
    """Refuse inputs that records could not distinguish from each other, or from sensors at nodes."""
    taken: set[str] = set()
    for i, shaker in enumerate(inputs):
        where = f"shakers[{i - 1}]" if i else "shaker"
        label = shaker.label(shaker.kind)
        if label.replace("-", "+") in taken:
            raise ValueError(f"{where} is at {label} as another input; give it a node of its own")
        if shaker.node in nodes:
            raise ValueError(f"{where}.node {shaker.node} is a sensor's; give another one")
        if shaker.delay != inputs[0].delay:
            raise ValueError(f"{where}.delay {shaker.delay:g} s: all inputs are as late as the first one")
        taken.add(label.replace("-", "+"))
