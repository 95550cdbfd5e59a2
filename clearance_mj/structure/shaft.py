"""Shafts of sections, with supports, springs and discs."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, WithJsonSchema

from ..errors import RigError
from ..validation import NotNegative, Number, Positive, Share, Text, checked
from .base import LinearModel, Structure, parse_place

__all__ = ["Disc", "Material", "Section", "Shaft", "Support"]


def _both_ends(value: Any) -> Any:
    return (value, value) if isinstance(value, int | float) else value


_TAPER_SCHEMA = {
    "anyOf": [
        {"type": "number", "exclusiveMinimum": 0},
        {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}, "minItems": 2, "maxItems": 2},
    ]
}
Taper: TypeAlias = Annotated[tuple[Positive, Positive], BeforeValidator(_both_ends), WithJsonSchema(_TAPER_SCHEMA)]
"""A dimension of a section, m: one number, or two where it changes linearly from the section's start to its end"""


@checked(RigError)
class Material:
    """An elastic material."""

    young_modulus: Positive
    """Pa"""
    density: Positive
    """kg/m³"""
    poisson_ratio: Annotated[Number, Field(ge=0, lt=0.5)] = 0.3
    """for the shear modulus of Timoshenko's theory"""
    name: Text = ""
    """for people"""


@checked(RigError)
class Section:
    """A piece of a shaft, constant or linearly tapered: round, a tube or a rectangle."""

    length: Positive
    """m"""
    diameter: Taper | None = None
    """m; [start, end] of a taper, here and below"""
    inner_diameter: Taper | None = None
    """m, of a tube"""
    width: Taper | None = None
    """m, of a rectangle"""
    height: Taper | None = None
    """m, of a rectangle, in the direction of vibration"""
    material: Material | None = None
    """if it is not the shaft's"""

    def __post_init__(self) -> None:
        rectangle = (self.width is not None, self.height is not None)
        if any(rectangle) != all(rectangle) or any(rectangle) == (self.diameter is not None):
            raise ValueError("give either diameter, or width and height")
        if self.inner_diameter is not None:
            if self.diameter is None:
                raise ValueError("inner_diameter needs a diameter")
            if any(inner >= outer for inner, outer in zip(self.inner_diameter, self.diameter)):
                raise ValueError(f"inner_diameter {self.inner_diameter} m must be less than diameter {self.diameter} m")


@checked(RigError)
class Support:
    """What holds a shaft at one position: a kind of support, or springs and dampers, or both."""

    position: Number
    """m along the shaft"""
    kind: Literal["clamped", "pinned", "guided", "elastic"] = "elastic"
    """no deflection and no rotation; no deflection; no rotation; springs and dampers alone"""
    translation: NotNegative = 0.0
    """N/m"""
    rotation: NotNegative = 0.0
    """N m/rad"""
    translation_damping: NotNegative = 0.0
    """N s/m"""
    rotation_damping: NotNegative = 0.0
    """N m s/rad"""


@checked(RigError)
class Disc:
    """A rigid disc on a shaft."""

    position: Number
    """m along the shaft"""
    mass: NotNegative
    """kg"""
    inertia: NotNegative = 0.0
    """kg m², about a diameter"""
    name: Text = ""
    """for people"""


@checked(RigError)
class Shaft(Structure):
    """A straight shaft of one or more sections, free where no support holds it."""

    sections: Annotated[tuple[Section, ...], Field(min_length=1)]
    """one after the other, from ``start`` on"""
    supports: tuple[Support, ...] = ()
    """anywhere on the shaft"""
    discs: tuple[Disc, ...] = ()
    """anywhere on the shaft"""
    material: Material | None = None
    """of every section that names no other"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K"""
    damping_ratios: tuple[Share, ...] = ()
    """of the modes, in addition; the last one holds for all that follow"""
    theory: Literal["auto", "euler", "timoshenko"] = "auto"
    """of bending; auto: Timoshenko's where a shaft is short for its depth"""
    start: Number = 0.0
    """m, where the shaft begins"""
    name: Text = ""
    """of one of several shafts"""
    kind: Literal["shaft"] = "shaft"
    """of structure"""

    @property
    def end(self) -> float:
        """Where the shaft ends, m."""
        return self.start + sum(section.length for section in self.sections)

    @property
    def shafts(self) -> tuple[Shaft, ...]:
        """Itself; see `Structure.shafts`."""
        return (self,)

    def check(self, point: float | str) -> None:
        """Refuse what is not on the shaft; see `Structure.check`."""
        place = parse_place(point)
        if place is None or place[0] not in ("", self.name):
            raise ValueError(f'"{point}" is no position on the shaft, a number of m')
        if not self.start <= place[1] <= self.end:
            raise ValueError(f"{place[1]:g} m lies outside the shaft ({self.start:g} <= x <= {self.end:g} m)")

    def assemble(self, points: tuple[float | str, ...], modes: int) -> LinearModel:
        """Return mass and stiffness of beam elements."""
        raise NotImplementedError
