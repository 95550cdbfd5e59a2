"""The rig: a linear structure, point masses on it, bushings or other clearances, sensors and shaker.

Plain frozen data in SI units, read from and written to TOML. Every impossible value is refused by
`RigError` with a message that names the field.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import AfterValidator, Field

from .errors import RigError
from .files import replacing
from .structure import AnyStructure, Beam, Point, Structure
from .structure.base import AXES, moved, parse_dof, parse_place
from .structure.files import content, is_embedded
from .validation import (
    NotNegative,
    Number,
    Positive,
    Share,
    Text,
    Whole,
    checked,
    from_plain,
    json_schema,
    read_plain,
    to_plain,
)

__all__ = ["AppliedForce", "Beam", "Bushing", "Contact", "Grease", "PointMass", "Rig", "Sensor", "Shaker", "rig_schema"]

BASE_NODE = 100
"""Node of the base acceleration in records."""
SHAKER_NODE = 200
"""Node of the shaker's (or hammer's) force in records."""
PROBE_NODE = 301
"""First node in records of displacement probes that are at no sensor's."""


def _label(node: int, point: float | str) -> str:
    """Node in records and the direction of a point, such as "7:+Z"; shafts vibrate along Z."""
    dof = parse_dof(point)
    return f"{node}:{'-' if dof[2] < 0 else '+'}{dof[1]}" if dof else f"{node}:+Z"


@checked(RigError)
class PointMass:
    """A mass fixed to the structure at one point; at a degree of freedom it acts in that direction alone."""

    position: Point
    """m along the shaft, or a degree of freedom such as "12:+Z" """
    mass: Positive
    """kg"""
    name: Text = ""
    """for people"""


@checked(RigError)
class Grease:
    """Grease in a bushing: Bouc-Wen hysteresis (Eq. 9) and a squeeze film (physics of the thinning film).

    The force on the shaft is φ = λ k x + (1-λ) k z + c ẋ / max(1-|x|/h, ε)², with
    ż = A ẋ - β|ẋ||z|ⁿ⁻¹z - γ ẋ|z|ⁿ. The default λ = 1 without film height is a linear spring and damper.
    """

    stiffness: NotNegative
    """k, N/m"""
    damping: NotNegative = 0.0
    """c, N s/m, of the centred shaft"""
    elastic_ratio: Share = 1.0
    """λ, share of the stiffness that does not slide"""
    amplitude: Positive = 1.0
    """A"""
    beta: NotNegative = 0.0
    """β, 1/mⁿ (the article's ζ)"""
    gamma: Number = 0.0
    """γ, 1/mⁿ"""
    exponent: Annotated[Number, Field(ge=1)] = 2.0
    """n"""
    film_height: Positive | None = None
    """h, m: film thickness at which the squeeze film would close; None: damping does not grow"""
    film_limit: Annotated[Positive, Field(le=1)] = 0.2
    """ε, smallest relative film thickness (the asperities' share of h)"""

    def __post_init__(self) -> None:
        if abs(self.gamma) > self.beta:
            raise ValueError(
                f"gamma {self.gamma:g} makes the Bouc-Wen element create energy "
                f"(needs -beta <= gamma <= beta, beta = {self.beta:g})"
            )
        if self.elastic_ratio < 1 and self.beta + self.gamma <= 0:
            raise ValueError("beta + gamma must be > 0 when elastic_ratio < 1, or the loop never yields")

    @property
    def yield_displacement(self) -> float:
        """z_ult = (A/(β+γ))^(1/n) in m; infinite for a linear grease."""
        total = self.beta + self.gamma
        return (self.amplitude / total) ** (1 / self.exponent) if total > 0 else math.inf


@checked(RigError)
class Contact:
    """Datasheet contact of shaft and bushing, linearised at one gap of penetration."""

    stiffness: Positive
    """k, N/m"""
    damping: NotNegative = 0.0
    """c, N s/m"""


@checked(RigError)
class Bushing:
    """A clearance: a bushing around a shaft, or a degree of freedom that meets a stop, or another one, beyond a gap.

    A bushing touches at its two ends once the shaft has moved by the radial gap.
    """

    position: Point
    """m along the shaft to the bushing's middle, or a degree of freedom such as "12:+Z" """
    gap: Positive
    """radial clearance d, m"""
    length: NotNegative
    """m along the shaft, 0 for a degree of freedom; contact happens at both ends, each with half of k and c"""
    grease: Grease
    """what fills the gap"""
    contact: Contact
    """what happens beyond it"""
    to: Point | None = None
    """the point, of another shaft or part, relative to which ``position`` moves; None: the base"""
    offset: Number = 0.0
    """m from the bushing's middle to where the shaft stands at rest, within the gap; the film is thinner there"""
    stops: Literal["both", "upper", "lower"] = "both"
    """where there is a wall: on both sides, or on that of positive or negative displacement alone"""

    def __post_init__(self) -> None:
        if abs(self.offset) >= self.gap:
            raise ValueError(
                f"offset {self.offset:g} m lies beyond the gap {self.gap:g} m: at rest the shaft touches neither wall"
            )

    @property
    def walls(self) -> tuple[float, float]:
        """Displacements from rest at which the shaft meets the lower and the upper wall, m; infinite without a wall."""
        lower, upper = -self.gap - self.offset, self.gap - self.offset
        return -math.inf if self.stops == "upper" else lower, math.inf if self.stops == "lower" else upper

    @property
    def ends(self) -> tuple[float | str, float | str]:
        """The two points of contact."""
        return self.ends_of(self.position)

    def ends_of(self, point: float | str) -> tuple[float | str, float | str]:
        """Return the two points half the bushing's length before and behind another one.

        Parameters
        ----------
        point : Point
            ``position`` or ``to``.
        """
        return moved(point, -self.length / 2), moved(point, self.length / 2)

    def holds(self, point: float | str) -> bool:
        """Return whether a point of the structure lies in the bushing, on the side of ``position``.

        Parameters
        ----------
        point : Point
            Such as a sensor's position.
        """
        dof, own = parse_dof(point), parse_dof(self.position)
        if dof or own:
            return dof is not None and own is not None and dof[:2] == own[:2]
        (shaft, x), (bushing, middle) = parse_place(point) or ("", 0.0), parse_place(self.position) or ("", 0.0)
        return shaft == bushing and middle - self.length / 2 <= x <= middle + self.length / 2

    @property
    def where(self) -> str:
        """Where it is, for messages and tables."""
        at = [f"x = {p:g} m" if isinstance(p, float) else p for p in self.joined]
        return " to ".join(at)

    @property
    def joined(self) -> tuple[float | str, ...]:
        """The points whose relative motion the clearance limits: ``position`` and, unless it is the base, ``to``."""
        return (self.position,) if self.to is None else (self.position, self.to)


def _free_node(node: int) -> int:
    if node in (BASE_NODE, SHAKER_NODE):
        raise ValueError(f"must not be {BASE_NODE} (base) or {SHAKER_NODE} (shaker)")
    return node


_NOT_TAKEN: dict[str, Any] = {"not": {"enum": [BASE_NODE, SHAKER_NODE]}}


@checked(RigError)
class Sensor:
    """An accelerometer on the structure, identified by its node number in files."""

    node: Annotated[Whole, Field(ge=1, le=999_999_999, json_schema_extra=_NOT_TAKEN), AfterValidator(_free_node)]
    """positive, unique in the rig; 100 (base) and 200 (shaker) are taken"""
    position: Point
    """m along the shaft, or a degree of freedom such as "12:+X" """
    mass: NotNegative = 0.0
    """kg, loads the structure like a point mass"""
    gain: Positive = 1.0
    """what it reads over the acceleration"""

    @property
    def label(self) -> str:
        """Node and direction, such as "7:+Z"."""
        return _label(self.node, self.position)


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
    """How the rig is excited: at the base that carries supports and bushings, or by a force."""

    kind: Literal["base", "force"] = "base"
    """ "base" or "force" """
    position: Point | None = None
    """m along the shaft, or a degree of freedom such as "12:+Z"; for a force"""
    direction: tuple[Number, Number, Number] | None = None
    """(x, y, z) along which the base moves, of any length; None: along z, in which shafts vibrate"""
    also: tuple[AppliedForce, ...] | None = None
    """further points at which the force acts at the same time"""

    def __post_init__(self) -> None:
        if self.kind == "force" and self.position is None:
            raise ValueError('position is missing; a shaker of kind "force" pushes at one point')
        if self.direction is not None and not any(self.direction):
            raise ValueError("direction must not be zero")
        if self.also and self.position is None:
            raise ValueError("position is missing; also adds points to it")

    @property
    def forces(self) -> tuple[tuple[float | str, float], ...]:
        """Points at which the force acts, and its factor at each."""
        return (
            () if self.position is None else ((self.position, 1.0), *((f.position, f.factor) for f in self.also or ()))
        )

    @property
    def unit_direction(self) -> np.ndarray:
        """(3,) unit vector along which the base moves."""
        direction = np.array(self.direction or (0.0, 0.0, 1.0))
        return direction / np.linalg.norm(direction)

    def label(self, kind: str) -> str:
        """Return node and direction of an excitation, such as "100:+Z".

        Parameters
        ----------
        kind : str
            "base" or "force".
        """
        if kind == "base":
            along = self.unit_direction
            axis = int(np.argmax(np.abs(along)))
            return f"{BASE_NODE}:{'-' if along[axis] < 0 else '+'}{AXES[axis]}"
        return _label(SHAKER_NODE, 0.0 if self.position is None else self.position)


_ON_BEAM = {"type": "number", "exclusiveMinimum": 0}
_POINTS_ON_BEAM: dict[str, Any] = {
    "properties": {
        **{kind: {"items": {"properties": {"position": _ON_BEAM}}} for kind in ("masses", "sensors")},
        "bushings": {"items": {"properties": {"position": _ON_BEAM, "to": _ON_BEAM}}},
        "shaker": {"properties": {"position": _ON_BEAM, "also": {"items": {"properties": {"position": _ON_BEAM}}}}},
        "structure": False,
    }
}
_BEAM_OR_STRUCTURE = {
    "required": ["name", "bushings", "sensors"],
    "if": {"required": ["structure"]},
    "then": {"properties": {"beam": False}},
    "else": {"required": ["beam"], **_POINTS_ON_BEAM},
}


@checked(RigError, name="", schema=_BEAM_OR_STRUCTURE)
class Rig:
    """A complete rig.

    Raises
    ------
    RigError
        For any value that no rig can have; the message names the field and the allowed range.
    """

    name: Annotated[Text, Field(min_length=1)]
    """for people; also in messages and results"""
    beam: Beam | None
    """the structure, where it is a uniform cantilever; otherwise None"""
    bushings: tuple[Bushing, ...]
    """the clearances, without overlap; may be none"""
    sensors: Annotated[tuple[Sensor, ...], Field(min_length=1)]
    """at least one"""
    masses: tuple[PointMass, ...] = ()
    """fixed to the structure"""
    shaker: Shaker = Shaker()
    """how the rig is excited"""
    description: Text = ""
    """for people"""
    structure: AnyStructure | None = None
    """the structure, where it is not a ``beam``"""

    def __post_init__(self) -> None:
        if (self.beam is None) == (self.structure is None):
            raise ValueError(
                f"{'structure stands beside beam' if self.beam else 'beam is missing'}; give either [beam], a uniform "
                f"cantilever, or [structure], of one of the kinds {', '.join(Structure.known)}"
            )
        points = {
            f"{kind}[{i}].position": item.position
            for kind in ("masses", "bushings", "sensors")
            for i, item in enumerate(getattr(self, kind))
        }
        points |= {f"bushings[{i}].to": b.to for i, b in enumerate(self.bushings) if b.to is not None}
        if self.shaker.position is not None:
            points["shaker.position"] = self.shaker.position
        points |= {f"shaker.also[{i}].position": force.position for i, force in enumerate(self.shaker.also or ())}
        for name, point in points.items():
            self._check(name, point)
        taken: set[str] = set()
        for i, sensor in enumerate(self.sensors):
            label = sensor.label.replace("-", "+")
            if label in taken:
                raise ValueError(f"sensors[{i}].node {sensor.node} is used twice; each sensor needs its own node")
            taken.add(label)
        self._check_bushings()

    def _check(self, name: str, point: float | str) -> None:
        try:
            self.linear.check(point)
        except ValueError as error:
            raise ValueError(f"{name} {error}") from None

    def _check_bushings(self) -> None:
        on_shafts: dict[str, list[tuple[float, float, int]]] = {}
        for i, b in enumerate(self.bushings):
            if b.to == b.position:
                raise ValueError(f"bushings[{i}].to is the bushing's own position; give another point")
            place = parse_place(b.position)
            if place is None:
                if b.length:
                    raise ValueError(f"bushings[{i}].length must be 0, as its position is a degree of freedom")
                continue
            for point in b.joined:
                self._check_ends(i, point)
            first, last = place[1] - b.length / 2, place[1] + b.length / 2
            on_shafts.setdefault(place[0], []).append((first, last, i))
        for spans in on_shafts.values():
            for (_, end, i), (start, _, j) in pairwise(sorted(spans)):
                if end >= start:
                    raise ValueError(
                        f"bushings[{j}] overlaps bushings[{i}]: it starts at {start:g} m, the other ends at {end:g} m"
                    )

    def _check_ends(self, i: int, point: float | str) -> None:
        """Refuse a bushing that reaches past the shaft on which a point of it is."""
        length, place = self.bushings[i].length, parse_place(point)
        try:
            for end in self.bushings[i].ends_of(point):
                self.linear.check(end)
        except ValueError as error:
            middle = place[1] if place else 0.0
            reach = f"from {middle - length / 2:g} to {middle + length / 2:g} m"
            past = str(error).partition("lies outside ")[2] or str(error)
            raise ValueError(f"bushings[{i}].length {length:g} m makes it reach {reach}, past {past}") from None

    @property
    def linear(self) -> Structure:
        """The linear structure: ``beam`` or ``structure``."""
        return self.beam or self.structure  # type: ignore[return-value]

    @property
    def point_masses(self) -> tuple[PointMass, ...]:
        """Point masses of the shaft, the sensors' own included."""
        loading = (PointMass(s.position, s.mass, f"sensor {s.node}") for s in self.sensors if s.mass)
        return (*self.masses, *loading)

    @property
    def total_mass(self) -> float | None:
        """Mass of structure and point masses in kg; None where the structure does not tell it."""
        mass = self.linear.total_mass
        return None if mass is None else mass + sum(m.mass for m in self.point_masses)

    @property
    def sensor_labels(self) -> list[str]:
        """Degree of freedom of each sensor, such as "7:+Z"."""
        return [s.label for s in self.sensors]

    @property
    def probe_labels(self) -> list[str]:
        """Degree of freedom of each clearance's relative displacement in records, such as "6:+Z".

        Its node is that of the sensor that sits in a bushing around a shaft. Other clearances, at named degrees of
        freedom, between two points or without a sensor, have nodes of their own: those from 301 on that no sensor has.
        """
        taken = {s.node for s in self.sensors}
        free = (node for node in itertools.count(PROBE_NODE) if node not in taken)
        found: dict[str, None] = {}
        for bushing in self.bushings:
            node = self._node_in(bushing)
            label = _label(next(free) if node is None else node, bushing.position)
            found[label if label not in found else _label(next(free), bushing.position)] = None
        return list(found)

    def _node_in(self, bushing: Bushing) -> int | None:
        """Node of the sensor nearest to the middle of a bushing around a shaft, None if it is not inside."""
        place = parse_place(bushing.position)
        if place is None or bushing.to is not None:
            return None
        places = ((s.node, parse_place(s.position)) for s in self.sensors)
        inside = [
            (abs(at[1] - place[1]), node)
            for node, at in places
            if at and at[0] == place[0] and place[1] - bushing.length / 2 <= at[1] <= place[1] + bushing.length / 2
        ]
        return min(inside)[1] if inside else None

    def replace(self, **changes: Any) -> Rig:
        """Return a copy with other values; it is checked again.

        Parameters
        ----------
        **changes
            Fields and their new values.
        """
        return dataclasses.replace(self, **changes)

    @classmethod
    def load(cls, path: str | Path) -> Rig:
        """Read a rig from a TOML file; files that it names are taken relative to its folder.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        RigError
            If the file is missing, is not TOML, has unknown or missing keys or impossible values.
        """
        data = read_plain(path, RigError)
        try:
            return cls.from_dict(data, Path(path).parent)
        except RigError as error:
            raise RigError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, data: dict[str, Any], folder: str | Path = ".") -> Rig:
        """Build a rig from the nested dictionary that a rig file holds.

        Parameters
        ----------
        data : dict
            Nested plain data.
        folder : str or Path
            What names of files in it are relative to.

        Raises
        ------
        RigError
            If it has unknown or missing keys or impossible values.
        """
        if isinstance(data, dict):
            data = {"beam": None, **_with_files(data, lambda n: n if is_embedded(n) else str(Path(folder) / n))}
        return from_plain(cls, data, "", RigError)

    def to_dict(self) -> dict[str, Any]:
        """Return the rig as nested plain data."""
        return to_plain(self)

    def content(self) -> dict[str, Any]:
        """Return plain data that two rigs share if they are the same, for caches: `to_dict` with digests of files."""
        return _with_files(self.to_dict(), _digest)

    def copied(self, folder: str | Path) -> Rig:
        """Return the same rig, its structure read from copies of its files.

        Parameters
        ----------
        folder : str or Path
            Where the copies go; made if there are any.
        """
        return self.replace(structure=self.structure.copied(Path(folder))) if self.structure else self

    def save(self, path: str | Path) -> None:
        """Write the rig as TOML; an existing file is replaced only once the new one is whole.

        Files that its structure was read from stay where they are: the rig file names them relative to its folder.
        Arrays that it was given get a file beside the rig file.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        folder = Path(path).absolute().parent
        structure = self.structure and self.structure.saved_beside(Path(path))
        data = _with_files(
            self.replace(structure=structure).to_dict(), lambda name: Path(os.path.relpath(name, folder)).as_posix()
        )
        with replacing(path) as temporary:
            temporary.write_text(tomli_w.dumps(data), encoding="utf-8")


def _digest(name: str) -> str:
    try:
        return content([name], None)
    except OSError as error:
        raise RigError(f"{name}: cannot be read ({error.strerror})") from None


def _with_files(data: dict[str, Any], named: Callable[[str], str]) -> dict[str, Any]:
    """Plain data of a rig with other names of the files that its structure is read from."""
    structure = data.get("structure") if isinstance(data, dict) else None
    kind = str(structure.get("kind")) if isinstance(structure, dict) else ""
    if structure is None or kind not in Structure.known:
        return data
    files = Structure.known[kind].files
    names = {field: named(structure[field]) for field in files if isinstance(structure.get(field), str)}
    return data | {"structure": structure | names}


def rig_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a rig file; rules between values are checked by `Rig` alone."""
    return json_schema(Rig, "clearance_mj rig")
