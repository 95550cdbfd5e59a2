"""What a rig may have where points move along z alone, and what where they move in space."""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol, TypeAlias

from pydantic import BeforeValidator

from ..core.errors import ClearanceError
from ..core.validation import Number
from ..structure import Structure
from ..structure.attached import Attached
from ..structure.base import parse_direction, parse_dof, parse_place
from .clearance import Bushing
from .instruments import Sensor, Shaker
from .spinning import Spin, Unbalance

__all__ = [
    "Gravity", "check_motion", "directed_points", "motion_in_words", "named_points", "planar", "shaft_radius",
]  # fmt: skip

ENDS = "position", "to"  # of a spring
EARTH = 9.80665  # m/s²


def _vector(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError(
            f"{value:g} has no direction; give a vector (x, y, z) in m/s², such as "
            f"[0.0, 0.0, {-abs(value) or -EARTH:g}]"
        )
    return value


Gravity: TypeAlias = Annotated[tuple[Number, Number, Number], BeforeValidator(_vector)]
"""Acceleration of gravity, m/s² (x, y, z)"""


class InSpace(Protocol):
    """What is asked of a `Rig` here."""

    @property
    def name(self) -> str:
        """Name."""

    @property
    def motion(self) -> str:
        """Planar or spatial."""

    @property
    def gravity(self) -> tuple[float, float, float] | None:
        """Gravity."""

    @property
    def spin(self) -> Spin | None:
        """Turning."""

    @property
    def unbalances(self) -> tuple[Unbalance, ...]:
        """Unbalances."""

    @property
    def bushings(self) -> tuple[Bushing, ...]:
        """Clearances."""

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """Sensors."""

    @property
    def shaker(self) -> Shaker:
        """Excitation."""

    @property
    def linear(self) -> Structure:
        """Structure."""

    @property
    def attached(self) -> Attached:
        """What it has beside it."""


def named_points(rig: InSpace) -> dict[str, float | str]:
    """Return the points that a rig file names, by their paths in it.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    points = {
        f"{kind}[{i}].position": item.position
        for kind in ("masses", "bushings", "sensors", "oscillators", "unbalances")
        for i, item in enumerate(getattr(rig, kind))
    }
    for kind, springs in (("springs", rig.attached.springs), ("structure.springs", getattr(rig.linear, "springs", ()))):
        points |= {f"{kind}[{i}].{end}": p for i, s in enumerate(springs) for end, p in zip(ENDS, s.joined)}
    points |= {f"bushings[{i}].to": b.to for i, b in enumerate(rig.bushings) if b.to is not None}
    if rig.shaker.position is not None:
        points["shaker.position"] = rig.shaker.position
    return points | {f"shaker.also[{i}].position": force.position for i, force in enumerate(rig.shaker.also or ())}


def directed_points(rig: InSpace) -> dict[str, str]:
    """Return the axes, such as RX, that points on shafts name, by their paths in the rig file.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    named = {name: parse_direction(point) for name, point in named_points(rig).items() if rig.linear.shafts}
    return {name: direction[0] for name, direction in named.items() if direction}


def check_motion(rig: InSpace) -> None:
    """Refuse what a planar rig has of space, and what a spatial one cannot have.

    Parameters
    ----------
    rig : Rig
        The rig, its other rules checked.
    """
    if rig.motion == "planar":
        _check_planar(rig)
        return
    if rig.gravity is not None and not any(rig.gravity):
        raise ValueError(f"gravity (0, 0, 0) has no direction; leave it out, or give such as [0.0, 0.0, {-EARTH}]")
    if rig.unbalances and rig.spin is None:
        raise ValueError("unbalances act on a shaft that turns; give [spin] with its speed")
    if rig.attached.fixture or rig.attached.planes:
        raise ValueError('motion "spatial" knows no fixture and no planes; leave them out, or give motion = "planar"')
    if rig.attached and not rig.linear.shafts:
        raise ValueError(
            'motion "spatial" knows housings, springs and oscillators of shafts alone; put them into the matrices, or '
            'give motion = "planar"'
        )
    for i, b in enumerate(rig.bushings):
        if b.stops != "both":
            raise ValueError(f'bushings[{i}].stops "{b.stops}" is one wall; a round clearance has its wall all around')
        dof = parse_dof(b.position)
        if dof and dof[1] not in "YZ":
            raise ValueError(f'bushings[{i}].position "{b.position}": a round clearance moves along Y and Z; give one')
        if b.to is not None and rig.spin and rig.linear.shafts:
            raise ValueError(f"bushings[{i}].to is on another shaft, and which of them turns is not told; leave it out")
        if (b.friction or b.film) and b.radius is None and parse_place(b.position) is None:
            raise ValueError(f"bushings[{i}].radius is missing: friction and film act at the shaft's radius")
    for name, axis in directed_points(rig).items():
        if name.startswith(("bushings", "unbalances")):
            raise ValueError(f"{name} names {axis}, and in space it moves along y and z: give the position alone")
    if rig.spin:
        _check_spin(rig)


def _check_planar(rig: InSpace) -> None:
    of_rig = [name for name in ("gravity", "spin", "unbalances") if getattr(rig, name)]
    names = of_rig + [f"bushings[{i}].{name}" for i, b in enumerate(rig.bushings) for name in b.in_space_only]
    names += [f"sensors[{i}].direction" for i, sensor in enumerate(rig.sensors) if sensor.direction is not None]
    names += [name for name, axis in directed_points(rig).items() if axis in ("Y", "RZ")]
    if names:
        raise ValueError(f'{names[0]} needs motion = "spatial": a planar rig moves along z alone and does not turn')
    if rig.attached.planes and "RX" in directed_points(rig).values():
        raise ValueError("planes: a shaft that twists has one twist, not one in each plane; leave planes or RX out")


def _check_spin(rig: InSpace) -> None:
    if len(rig.linear.shafts) != 1:
        raise ValueError("spin needs a beam or one shaft: of other structures it is not known what turns")
    try:
        rig.linear.shafts[0].check_turning()
    except ValueError as error:
        raise ValueError(f"spin: {error}") from None


def motion_in_words(rig: InSpace) -> str:
    """Return how a spatial rig is loaded and turns, for overviews."""
    words = ["along y and z"]
    if rig.gravity:
        words.append(f"gravity {tuple(rig.gravity)} m/s²")
    if spin := rig.spin:
        speeds = [speed for speed in (spin.speed, spin.until) if speed is not None]
        words.append("turns at " + " to ".join(f"{speed * 30 / math.pi:.4g}" for speed in speeds) + " rev/min")
        words += ["coasts"] if spin.inertia else []
    if rig.unbalances:
        words.append(f"unbalance {sum(each.moment for each in rig.unbalances):.4g} kg m")
    return ", ".join(words)


def planar(rig: InSpace, what: str) -> None:
    """Refuse a rig in space where a calculation knows the plane alone.

    Parameters
    ----------
    rig : Rig
        The rig.
    what : str
        The calculation, the first words of the message.

    Raises
    ------
    ClearanceError
        If the rig is spatial.
    """
    if rig.motion == "spatial":
        raise ClearanceError(
            f'{what} knows planar rigs, and rig {rig.name!r} has motion = "spatial"; give one with motion = "planar"'
        )


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
    which, x = rig.linear.place(b.position)
    return float(rig.linear.shafts[which].half_depth(x))
