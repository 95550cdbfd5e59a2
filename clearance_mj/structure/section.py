"""Cross-sections of shafts: round, tubes and rectangles, constant or tapered, of elastic materials."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema

from ..core.errors import RigError
from ..core.validation import Number, Positive, Text, checked

__all__ = ["CrossSection", "Material", "Section", "check_sizes"]

TORSION_TERMS = 200  # of a series whose terms fall with the fifth power


class CrossSection(NamedTuple):
    """What bending and torsion ask of a section, at some positions."""

    area: np.ndarray  #: m²
    second_moment: np.ndarray  #: m⁴
    shear_coefficient: np.ndarray  #: share of the area that carries shear
    polar_moment: np.ndarray  #: m⁴, of both second moments
    torsion_constant: np.ndarray  #: m⁴, torque over shear modulus and twist per length


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


def check_sizes(diameter: object, width: object, height: object) -> None:
    """Refuse what is neither a round section nor a rectangle."""
    if (width is None) != (height is None) or (width is None) == (diameter is None):
        raise ValueError("give either diameter, or width and height")


@checked(RigError)
class Material:
    """An elastic material."""

    young_modulus: Positive
    """Pa"""
    density: Positive
    """kg/m³"""
    poisson_ratio: Annotated[Number, Field(ge=0, lt=0.5)] = 0.3
    """for the shear modulus of Timoshenko's theory and of twist"""
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
        check_sizes(self.diameter, self.width, self.height)
        if self.inner_diameter is not None:
            if self.diameter is None:
                raise ValueError("inner_diameter needs a diameter")
            if any(inner >= outer for inner, outer in zip(self.inner_diameter, self.diameter)):
                raise ValueError(f"inner_diameter {self.inner_diameter} m must be less than diameter {self.diameter} m")

    def across(self, share: np.ndarray, poisson_ratio: float) -> CrossSection:
        """Return the cross-section along the piece, with the shear coefficients of Cowper (J. Appl. Mech. 33, 1966).

        Parameters
        ----------
        share : ndarray, shape (n,)
            Position in the section: 0 at its start, 1 at its end.
        poisson_ratio : float
            Poisson's ratio of the material.

        Returns
        -------
        CrossSection
            Of arrays (n,).
        """
        nu = poisson_ratio
        if self.diameter is None:
            width, height = _along(self.width, share), _along(self.height, share)
            shear = np.full_like(share, 10 * (1 + nu) / (12 + 11 * nu))
            polar = width * height * (width**2 + height**2) / 12
            return CrossSection(width * height, width * height**3 / 12, shear, polar, _of_rectangle(width, height))
        outer = _along(self.diameter, share)
        inner = _along(self.inner_diameter or (0.0, 0.0), share)
        square = (1 + (inner / outer) ** 2) ** 2
        hollow = (20 + 12 * nu) * (inner / outer) ** 2
        shear = 6 * (1 + nu) * square / ((7 + 6 * nu) * square + hollow)
        second = np.pi * (outer**4 - inner**4) / 64
        return CrossSection(np.pi * (outer**2 - inner**2) / 4, second, shear, 2 * second, 2 * second)

    @property
    def cuts(self) -> np.ndarray:
        """Positions, shares of the length, between which no dimension changes by more than a factor 2."""
        sizes = [size for size in (self.diameter, self.width, self.height) if size]
        if self.diameter and self.inner_diameter:
            sizes.append((self.diameter[0] - self.inner_diameter[0], self.diameter[1] - self.inner_diameter[1]))
        ratio = max((end / start for start, end in sizes), key=lambda change: max(change, 1 / change))
        pieces = math.ceil(abs(math.log2(ratio)))
        return (ratio ** (np.arange(1, pieces) / pieces) - 1) / (ratio - 1) if pieces > 1 else np.zeros(0)


def _of_rectangle(width: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Torsion constant (n,), m⁴ (Timoshenko & Goodier, Theory of Elasticity, 1970, section 109)."""
    short, long = np.minimum(width, height), np.maximum(width, height)
    odd = np.arange(1, TORSION_TERMS, 2)
    series = np.sum(np.tanh(odd * np.pi / 2 * (long / short)[..., None]) / odd**5, axis=-1)
    return np.asarray(long * short**3 / 3 * (1 - 192 / np.pi**5 * short / long * series))


def _along(ends: tuple[float, float] | None, share: np.ndarray) -> np.ndarray:
    """A dimension between its two ends."""
    assert ends is not None
    return ends[0] + (ends[1] - ends[0]) * share
