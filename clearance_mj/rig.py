"""The rig: a clamped shaft, its point masses, bushings with clearance, sensors and shaker.

Plain frozen data in SI units, read from and written to TOML. Every impossible value is refused by
`RigError` with a message that names the field.
"""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import AfterValidator, Field

from .errors import RigError
from .files import replacing
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

__all__ = ["Beam", "Bushing", "Contact", "Grease", "PointMass", "Rig", "Sensor", "Shaker", "rig_schema"]

BASE_NODE = 100
"""Node of the base acceleration in records."""
SHAKER_NODE = 200
"""Node of the shaker's (or hammer's) force in records."""

_EITHER_SECTION = {
    "oneOf": [
        {"required": ["diameter"], "properties": {"width": False, "height": False}},
        {"required": ["width", "height"], "properties": {"diameter": False}},
    ]
}


@checked(RigError, schema=_EITHER_SECTION)
class Beam:
    """A uniform Euler-Bernoulli shaft, clamped at x = 0 and free at x = length.

    Give ``diameter`` for a round section, or ``width`` and ``height`` (in the direction of vibration) for a
    rectangular one.
    """

    length: Positive
    """m"""
    young_modulus: Positive
    """Pa"""
    density: Positive
    """kg/m³"""
    diameter: Positive | None = None
    """m"""
    width: Positive | None = None
    """m"""
    height: Positive | None = None
    """m, in the direction of vibration"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K, Eq. 6"""

    def __post_init__(self) -> None:
        rectangle = (self.width is not None, self.height is not None)
        if any(rectangle) != all(rectangle) or any(rectangle) == (self.diameter is not None):
            raise ValueError("give either diameter, or width and height")

    @property
    def area(self) -> float:
        """Cross-section in m²."""
        width, height = self._rectangle
        return math.pi * self.diameter**2 / 4 if self.diameter else width * height

    @property
    def second_moment(self) -> float:
        """Second moment of area in m⁴."""
        width, height = self._rectangle
        return math.pi * self.diameter**4 / 64 if self.diameter else width * height**3 / 12

    @property
    def _rectangle(self) -> tuple[float, float]:
        return self.width or 0.0, self.height or 0.0

    @property
    def bending_stiffness(self) -> float:
        """E I in N m²."""
        return self.young_modulus * self.second_moment

    @property
    def mass_per_length(self) -> float:
        """ρ A in kg/m."""
        return self.density * self.area


@checked(RigError)
class PointMass:
    """A mass fixed to the shaft at one position."""

    position: Positive
    """m from the clamp"""
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
    """A bushing around the shaft: it touches at its two ends once the shaft has moved by the radial gap."""

    position: Positive
    """m from the clamp to the bushing's middle"""
    gap: Positive
    """radial clearance d, m"""
    length: Positive
    """m along the shaft; contact happens at both ends, each with half of k and c"""
    grease: Grease
    """what fills the gap"""
    contact: Contact
    """what happens beyond it"""

    @property
    def ends(self) -> tuple[float, float]:
        """Positions of the two contact points in m."""
        return self.position - self.length / 2, self.position + self.length / 2


def _free_node(node: int) -> int:
    if node in (BASE_NODE, SHAKER_NODE):
        raise ValueError(f"must not be {BASE_NODE} (base) or {SHAKER_NODE} (shaker)")
    return node


_NOT_TAKEN: dict[str, Any] = {"not": {"enum": [BASE_NODE, SHAKER_NODE]}}


@checked(RigError)
class Sensor:
    """An accelerometer on the shaft, identified by its node number in files."""

    node: Annotated[Whole, Field(ge=1, le=999_999_999, json_schema_extra=_NOT_TAKEN), AfterValidator(_free_node)]
    """positive, unique in the rig; 100 (base) and 200 (shaker) are taken"""
    position: Positive
    """m from the clamp"""
    mass: NotNegative = 0.0
    """kg, loads the shaft like a point mass"""


_FORCE_NEEDS_POSITION = {
    "if": {"properties": {"kind": {"const": "force"}}, "required": ["kind"]},
    "then": {"required": ["position"]},
}


@checked(RigError, schema=_FORCE_NEEDS_POSITION)
class Shaker:
    """How the rig is excited: at the base plate that carries clamp and bushings, or by a force at one point."""

    kind: Literal["base", "force"] = "base"
    """ "base" or "force" """
    position: Positive | None = None
    """m from the clamp; for a force"""

    def __post_init__(self) -> None:
        if self.kind == "force" and self.position is None:
            raise ValueError('position is missing; a shaker of kind "force" pushes at one point')


@checked(RigError, name="")
class Rig:
    """A complete rig.

    Raises
    ------
    RigError
        For any value that no rig can have; the message names the field and the allowed range.
    """

    name: Annotated[Text, Field(min_length=1)]
    """for people; also in messages and results"""
    beam: Beam
    """the shaft"""
    bushings: tuple[Bushing, ...]
    """around the shaft, without overlap; may be none"""
    sensors: Annotated[tuple[Sensor, ...], Field(min_length=1)]
    """at least one"""
    masses: tuple[PointMass, ...] = ()
    """fixed to the shaft"""
    shaker: Shaker = Shaker()
    """how the rig is excited"""
    description: Text = ""
    """for people"""

    def __post_init__(self) -> None:
        l = self.beam.length
        positions = {
            f"{kind}[{i}].position": item.position
            for kind in ("masses", "bushings", "sensors")
            for i, item in enumerate(getattr(self, kind))
        }
        for name, position in (positions | {"shaker.position": self.shaker.position or l}).items():
            if position > l:
                raise ValueError(f"{name} {position:g} m lies outside the beam (0 < x <= {l:g} m)")
        nodes: set[int] = set()
        for i, sensor in enumerate(self.sensors):
            if sensor.node in nodes:
                raise ValueError(f"sensors[{i}].node {sensor.node} is used twice; each sensor needs its own node")
            nodes.add(sensor.node)
        self._check_bushings()

    def _check_bushings(self) -> None:
        l = self.beam.length
        for i, b in enumerate(self.bushings):
            if b.ends[0] <= 0 or b.ends[1] > l:
                raise ValueError(
                    f"bushings[{i}].length {b.length:g} m makes it reach from {b.ends[0]:g} to {b.ends[1]:g} m, "
                    f"past the beam (0 < x <= {l:g} m)"
                )
        for (i, first), (j, second) in pairwise(sorted(enumerate(self.bushings), key=lambda item: item[1].position)):
            if first.ends[1] >= second.ends[0]:
                raise ValueError(
                    f"bushings[{j}] overlaps bushings[{i}]: it starts at {second.ends[0]:g} m, "
                    f"the other ends at {first.ends[1]:g} m"
                )

    @property
    def point_masses(self) -> tuple[PointMass, ...]:
        """Point masses of the shaft, the sensors' own included."""
        loading = (PointMass(s.position, s.mass, f"sensor {s.node}") for s in self.sensors if s.mass)
        return (*self.masses, *loading)

    @property
    def total_mass(self) -> float:
        """Mass of shaft and point masses in kg."""
        return self.beam.mass_per_length * self.beam.length + sum(m.mass for m in self.point_masses)

    @property
    def sensor_labels(self) -> list[str]:
        """Degree of freedom of each sensor as "node:+Z"."""
        return [f"{s.node}:+Z" for s in self.sensors]

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
        """Read a rig from a TOML file.

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
            return cls.from_dict(data)
        except RigError as error:
            raise RigError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Rig:
        """Build a rig from the nested dictionary that a rig file holds.

        Parameters
        ----------
        data : dict
            Nested plain data.

        Raises
        ------
        RigError
            If it has unknown or missing keys or impossible values.
        """
        return from_plain(cls, data, "", RigError)

    def to_dict(self) -> dict[str, Any]:
        """Return the rig as nested plain data."""
        return to_plain(self)

    def save(self, path: str | Path) -> None:
        """Write the rig as TOML; an existing file is replaced only once the new one is whole.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        with replacing(path) as temporary:
            temporary.write_text(tomli_w.dumps(self.to_dict()), encoding="utf-8")


def rig_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a rig file; rules between values are checked by `Rig` alone."""
    return json_schema(Rig, "clearance_mj rig")
