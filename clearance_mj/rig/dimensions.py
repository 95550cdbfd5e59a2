"""Rules of a rig by its motion: of points that move along z alone, and of points that move in space."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator

from ..core.checks import naming
from ..core.errors import RigError
from ..core.quantities import GRAVITY
from ..core.validation import Number
from ..structure import Structure
from ..structure.attached import Attached
from ..structure.base import is_rotation, parse_direction, parse_dof, parse_place
from .bearings import Bearing
from .clearance import Bushing
from .instruments import Shaker
from .labels import ClearanceRows
from .loads import Load, Order
from .spinning import Spin, Unbalance

__all__ = [
    "Gravity", "check_motion", "directed_points", "fields_across", "motion_in_words", "named_points", "shaft_radius",
    "with_motion", "with_shapes",
]  # fmt: skip

ENDS = "position", "to"  # of a spring


def _vector(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError(
            f"{value:g} has no direction; give a vector (x, y, z) in m/s², such as "
            f"[0.0, 0.0, {-abs(value) or -GRAVITY:g}]"
        )
    return value


Gravity: TypeAlias = Annotated[tuple[Number, Number, Number], BeforeValidator(_vector)]
"""Acceleration of gravity, m/s² (x, y, z)"""


class InSpace(ClearanceRows, ABC):
    """Attributes of a `Rig` that the rules of its motion and its sensors need."""

    name: str
    gravity: tuple[float, float, float] | None
    spin: Spin | None
    unbalances: tuple[Unbalance, ...]
    bearings: tuple[Bearing, ...]
    loads: tuple[Load, ...]
    orders: tuple[Order, ...]

    @property
    @abstractmethod
    def moves_across(self) -> bool:
        """True if points move along y and z."""

    @property
    @abstractmethod
    def inputs(self) -> tuple[Shaker, ...]:
        """Excitation."""

    @property
    @abstractmethod
    def linear(self) -> Structure:
        """Structure."""

    @property
    @abstractmethod
    def attached(self) -> Attached:
        """Housings, springs and oscillators."""


def with_shapes(data: dict[str, Any]) -> dict[str, Any]:
    """Return plain data of a rig whose older files say ``motion`` of all clearances, with a shape for each instead.

    Parameters
    ----------
    data : dict
        Plain data as of a rig file.

    Raises
    ------
    RigError
        If the motion is unknown.
    """
    motion = data.get("motion", "planar")
    if motion not in ("planar", "spatial"):
        raise RigError(f'motion "{motion}" is unknown; leave it out, and give round bushings shape = "round"')
    fields, bushings = {name: value for name, value in data.items() if name != "motion"}, data.get("bushings")
    if motion == "spatial" and isinstance(bushings, list | tuple):
        fields["bushings"] = [{"shape": "round", **item} if isinstance(item, dict) else item for item in bushings]
    return fields


def with_motion(rig: InSpace, data: dict[str, Any]) -> dict[str, Any]:
    """Return plain data of a rig as older files have them, so that digests of these stay: in space with ``motion``.

    Parameters
    ----------
    rig : Rig
        The rig.
    data : dict
        Its plain data.
    """
    if not rig.moves_across or not all(b.is_round for b in rig.bushings):
        return data
    bushings = [{name: value for name, value in item.items() if name != "shape"} for item in data["bushings"]]
    return data | {"bushings": bushings, "motion": "spatial"}


def fields_across(rig: InSpace) -> list[str]:
    """Return the names of a rig's fields that need motion along y; none of a rig that moves along z alone.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    if rig.linear.is_torsional:
        return []
    fields = [name for name in ("spin", "unbalances", "bearings", "orders") if getattr(rig, name)]
    fields += ["gravity"] if rig.gravity and (rig.gravity[1] or (rig.linear.shafts and not rig.bushings)) else []
    if rig.linear.shafts:
        forces = [load.force for load in rig.loads]
        fields += [f"loads[{i}].force" for i, force in enumerate(forces) if isinstance(force, tuple) and force[1]]
        fields += [f"{n}.direction" for n, s in _inputs(rig) if s.kind == "force" and s.direction and s.direction[1]]
    fields += [f"sensors[{i}].direction" for i, sensor in enumerate(rig.sensors) if sensor.direction is not None]
    return fields + [name for name, axis in directed_points(rig).items() if axis in ("Y", "RZ")]


def _inputs(rig: InSpace) -> list[tuple[str, Shaker]]:
    """Return the shakers of a rig, with their paths in the rig file."""
    return [(f"shakers[{i - 1}]" if i else "shaker", shaker) for i, shaker in enumerate(rig.inputs)]


def named_points(rig: InSpace) -> dict[str, float | str]:
    """Return the points that a rig file names, by their paths in it.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    points = {
        f"{kind}[{i}].position": item.position
        for kind in ("masses", "bushings", "sensors", "oscillators", "unbalances", "bearings", "loads", "orders")
        for i, item in enumerate(getattr(rig, kind))
        if getattr(item, "quantity", "") != "force"
    }
    for kind, springs in (("springs", rig.attached.springs), ("structure.springs", getattr(rig.linear, "springs", ()))):
        points |= {f"{kind}[{i}].{end}": p for i, s in enumerate(springs) for end, p in zip(ENDS, s.joined)}
    points |= {f"bushings[{i}].to": b.to for i, b in enumerate(rig.bushings) if b.to is not None}
    rubbing = {f"bushings[{i}].friction.along": b.friction.along for i, b in enumerate(rig.bushings) if b.friction}
    points |= {name: point for name, point in rubbing.items() if point is not None}
    for name, shaker in _inputs(rig):
        paths = ["position", *(f"also[{i}].position" for i in range(len(shaker.forces) - 1))]
        points |= {f"{name}.{path}": point for path, (point, _) in zip(paths, shaker.forces)}
    return points


def directed_points(rig: InSpace) -> dict[str, str]:
    """Return the axes, such as RX, that points on shafts name, by their paths in the rig file.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    directions = {name: parse_direction(point) for name, point in named_points(rig).items() if rig.linear.shafts}
    return {name: direction[0] for name, direction in directions.items() if direction}


def check_motion(rig: InSpace) -> None:
    """Refuse slots with fields of round clearances, and fields that a rig that moves along y and z cannot have.

    There a slot stands along z at a position on a shaft, or along the axis of its point, such as "@0.4:Y" or "@0.4:RX".

    Parameters
    ----------
    rig : Rig
        The rig, its other rules checked.
    """
    for i, b in enumerate(rig.bushings):
        if b.round_only_fields and not b.is_round:
            name = f"bushings[{i}].{b.round_only_fields[0]}"
            raise ValueError(
                f'{name} needs shape = "round", and bushings[{i}] is a {b.default_shape}, along one coordinate'
            )
        if b.friction:
            _check_friction(rig, b, f"bushings[{i}].friction.along")
    if rig.gravity is not None and not any(rig.gravity):
        raise ValueError(f"gravity (0, 0, 0) has no direction; leave it out, or give such as [0.0, 0.0, {-GRAVITY}]")
    for kind in ("unbalances", "orders"):
        if getattr(rig, kind) and rig.spin is None:
            raise ValueError(f"{kind} act on a shaft that turns; give [spin] with its speed")
    for field in ("gravity", "unbalances", "bearings"):
        if rig.linear.is_torsional and getattr(rig, field):
            raise ValueError(f"{field}: nothing of gears moves across their axes; leave it out")
    if not rig.moves_across:
        if rig.attached.planes and "RX" in directed_points(rig).values():
            raise ValueError("planes: a shaft that twists has one twist, not one in each plane; leave planes or RX out")
        return
    if rig.attached.fixture or rig.attached.planes:
        raise ValueError("a rig that moves along y and z knows no fixture and no planes; leave them out")
    if rig.attached and not rig.linear.shafts:
        raise ValueError(
            "a rig that moves along y and z knows housings, springs and oscillators of shafts alone; put them into "
            "the matrices"
        )
    for i, bearing in enumerate(rig.bearings):
        dof = parse_dof(bearing.position)
        if dof and dof[1] not in "YZ":
            raise ValueError(f'bearings[{i}].position "{bearing.position}": a bearing acts along Y and Z; give one')
        for speed in (rig.spin.speed, rig.spin.until) if rig.spin else ():
            if speed is not None and bearing.spin and not bearing.spin[0] <= speed <= bearing.spin[-1]:
                ends = f"{bearing.spin[0]:g} to {bearing.spin[-1]:g} rad/s"
                raise ValueError(f"bearings[{i}].spin reaches from {ends}, and the shaft turns at {speed:g} rad/s")
    for i, b in enumerate(rig.bushings):
        dof = parse_dof(b.position)
        if b.is_round and dof and dof[1] not in "YZ":
            raise ValueError(f'bushings[{i}].position "{b.position}": a round clearance moves along Y and Z; give one')
        if b.to is not None and rig.spin and rig.linear.shafts:
            raise ValueError(f"bushings[{i}].to is on another shaft, and which of them turns is not told; leave it out")
        if b.is_round and (b.friction or b.film) and b.radius is None and parse_place(b.position) is None:
            raise ValueError(f"bushings[{i}].radius is missing: friction and film act at the shaft's radius")
    slots = tuple(f"bushings[{i}]." for i, b in enumerate(rig.bushings) if not b.is_round)
    for name, axis in directed_points(rig).items():
        if name.startswith(("bushings", "unbalances", "bearings", "orders")) and not name.startswith(slots):
            raise ValueError(f"{name} names {axis}, but it moves along y and z: give the position alone")
    if rig.spin:
        _check_spin(rig)


def _check_friction(rig: InSpace, bushing: Bushing, name: str) -> None:
    assert bushing.friction
    along, slides = bushing.friction.along, bushing.sliding_point
    if slides is None:
        if along is not None:
            raise ValueError(f"{name} is of a slot or stop; in a round clearance the shaft slides around its wall")
        return
    axis = (parse_direction(bushing.position) or "Z")[0]
    if slides == bushing.position or (along is None and (axis != "Z" or not rig.moves_across)):
        raise ValueError(
            f'{name} "{slides}": nothing slides along the wall that "{bushing.position}" meets; give a point of '
            'another coordinate, such as "12:Y" or "@0.4:Y"'
        )
    if is_rotation(slides) != is_rotation(bushing.position):
        raise ValueError(f'{name} "{slides}": one of it and position "{bushing.position}" is an angle; give two alike')
    with naming(name, ValueError, ValueError, "{} {}"):
        rig.linear.check(slides)


def _check_spin(rig: InSpace) -> None:
    if len(rig.linear.shafts) != 1:
        raise ValueError("spin needs a beam or one shaft: of other structures it is not known what turns")
    with naming("spin", ValueError, ValueError):
        rig.linear.shafts[0].check_turning()


def motion_in_words(rig: InSpace) -> str:
    """Return gravity, spin and unbalance of a rig in space in words, for overviews."""
    words = ["along y and z"]
    if rig.gravity:
        words.append(f"gravity {tuple(rig.gravity)} m/s²")
    if spin := rig.spin:
        speeds = [speed for speed in (spin.speed, spin.until) if speed is not None]
        words.append("turns at " + " to ".join(f"{speed * 30 / math.pi:.4g}" for speed in speeds) + " rev/min")
        words += ["coasts"] if spin.inertia else []
    if rig.unbalances:
        words.append(f"unbalance {sum(unbalance.moment for unbalance in rig.unbalances):.4g} kg m")
    return ", ".join(words)


def shaft_radius(rig: InSpace, bushing: int) -> float:
    """Return the shaft's radius where it touches a bushing, m; 0 where the structure does not tell it.

    Parameters
    ----------
    rig : Rig
        The rig.
    bushing : int
        Its number.

    Raises
    ------
    RigError
        If nothing is known of the shaft there, though friction or a film acts.
    """
    b = rig.bushings[bushing]
    if b.radius is not None:
        return b.radius
    if parse_place(b.position) is None:
        return 0.0
    shaft, x = rig.linear.place(b.position)
    return float(rig.linear.shafts[shaft].half_depth(x))
