"""Parts of shafts: cross-sections, constant or tapered, of elastic materials; supports and discs."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema

from ..core.errors import RigError
from ..core.validation import NotNegative, Number, Positive, Text, checked, seldom

__all__ = ["HELD", "CrossSection", "Disc", "Material", "Section", "Support", "check_sizes"]

TORSION_TERMS = 200  # of a series whose terms fall with the fifth power


class CrossSection(NamedTuple):
    """Properties of a section for bending and torsion, at some positions."""

    area: np.ndarray  #: m²
    second_moment: np.ndarray  #: m⁴
    shear_coefficient: np.ndarray  #: fraction of the area that carries shear
    polar_moment: np.ndarray  #: m⁴, of both second moments
    torsion_constant: np.ndarray  #: m⁴, torque over shear modulus and twist per length


def _as_taper(value: Any) -> Any:
    return (value, value) if isinstance(value, int | float) else value


_TAPER_SCHEMA = {
    "anyOf": [
        {"type": "number", "exclusiveMinimum": 0},
        {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}, "minItems": 2, "maxItems": 2},
    ]
}
Taper: TypeAlias = Annotated[tuple[Positive, Positive], BeforeValidator(_as_taper), WithJsonSchema(_TAPER_SCHEMA)]
"""A dimension of a section, m: one number, or two where it changes linearly from the section's start to its end"""


def check_sizes(diameter: object, width: object, height: object) -> None:
    """Raise a ValueError unless the sizes are those of a round section or a rectangle."""
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
    """None: the shaft's"""

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
            Properties (n,).
        """
        nu = poisson_ratio
        if self.diameter is None:
            width, height = _interpolate(self.width, share), _interpolate(self.height, share)
            shear = np.full_like(share, 10 * (1 + nu) / (12 + 11 * nu))
            polar = width * height * (width**2 + height**2) / 12
            return CrossSection(width * height, width * height**3 / 12, shear, polar, _rectangle_torsion(width, height))
        outer = _interpolate(self.diameter, share)
        inner = _interpolate(self.inner_diameter or (0.0, 0.0), share)
        square = (1 + (inner / outer) ** 2) ** 2
        hollow = (20 + 12 * nu) * (inner / outer) ** 2
        shear = 6 * (1 + nu) * square / ((7 + 6 * nu) * square + hollow)
        second = np.pi * (outer**4 - inner**4) / 64
        return CrossSection(np.pi * (outer**2 - inner**2) / 4, second, shear, 2 * second, 2 * second)

    @property
    def cuts(self) -> np.ndarray:
        """Positions over the length between which no dimension changes by more than a factor 2."""
        sizes = [size for size in (self.diameter, self.width, self.height) if size]
        if self.diameter and self.inner_diameter:
            sizes.append((self.diameter[0] - self.inner_diameter[0], self.diameter[1] - self.inner_diameter[1]))
        ratio = max((end / start for start, end in sizes), key=lambda change: max(change, 1 / change))
        pieces = math.ceil(abs(math.log2(ratio)))
        return (ratio ** (np.arange(1, pieces) / pieces) - 1) / (ratio - 1) if pieces > 1 else np.zeros(0)


def _rectangle_torsion(width: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return the torsion constant (n,), m⁴ (Timoshenko & Goodier, Theory of Elasticity, 1970, section 109)."""
    short, long = np.minimum(width, height), np.maximum(width, height)
    odd = np.arange(1, TORSION_TERMS, 2)
    series = np.sum(np.tanh(odd * np.pi / 2 * (long / short)[..., None]) / odd**5, axis=-1)
    return np.asarray(long * short**3 / 3 * (1 - 192 / np.pi**5 * short / long * series))


def _interpolate(ends: tuple[float, float] | None, x: np.ndarray) -> np.ndarray:
    """Interpolate a dimension between its two ends."""
    assert ends is not None
    return ends[0] + (ends[1] - ends[0]) * x


HELD = {"clamped": (0, 1), "pinned": (0,), "guided": (1,), "elastic": ()}
"""Motions that a kind of support fixes: deflection (0), rotation (1)."""


@checked(RigError)
class Support:
    """Support of a shaft at one position: rigid in some motions, or springs and dampers, or both."""

    position: Number
    """m along the shaft"""
    kind: Literal["clamped", "pinned", "guided", "elastic"] = "elastic"
    """clamped: no deflection, rotation or twist; pinned: no deflection; guided: no rotation; elastic: springs and
    dampers"""
    translation: NotNegative = 0.0
    """N/m"""
    rotation: NotNegative = 0.0
    """N m/rad"""
    translation_damping: NotNegative = 0.0
    """N s/m"""
    rotation_damping: NotNegative = 0.0
    """N m s/rad"""
    translation_y: Positive | None = seldom(default=None)
    """N/m across the plane of vibration, of a turning shaft; None: as ``translation``"""
    rotation_y: Positive | None = seldom(default=None)
    """N m/rad across the plane of vibration, of a turning shaft; None: as ``rotation``"""

    translation_damping_y: NotNegative | None = seldom(default=None)
    """N s/m across the plane of vibration; None: as ``translation_damping``"""
    rotation_damping_y: NotNegative | None = seldom(default=None)
    """N m s/rad across the plane of vibration; None: as ``rotation_damping``"""
    twist: NotNegative | Literal["rigid"] | None = seldom(default=None)
    """N m/rad about the shaft's axis, or "rigid"; None: rigid for clamped, else 0"""
    twist_damping: NotNegative = seldom(default=0.0)
    """N m s/rad about the shaft's axis"""

    def __post_init__(self) -> None:
        for held, motion in enumerate(("translation", "rotation")):
            if getattr(self, f"{motion}_y") and not getattr(self, motion):
                raise ValueError(f"{motion}_y has no effect without {motion}: give the stiffness of both planes")
            for name in (motion, f"{motion}_damping", f"{motion}_damping_y"):
                if held in HELD[self.kind] and getattr(self, name):
                    raise ValueError(
                        f'{name} has no effect, as a support of kind "{self.kind}" allows no {motion}; one that gives '
                        'is of kind "elastic", with springs'
                    )
        if self.twist_damping and self.holds_twist:
            raise ValueError("twist_damping has no effect, as the support allows no twist; give twist, N m/rad")
        motions = ("translation", "rotation", "twist")
        if self.kind == "elastic" and not any(getattr(self, m) or getattr(self, f"{m}_damping") for m in motions):
            raise ValueError("holds nothing; give kind (clamped, pinned or guided), or springs or dampers")

    @property
    def holds_twist(self) -> bool:
        """True if the shaft cannot twist there."""
        return self.twist == "rigid" or (self.twist is None and self.kind == "clamped")

    @property
    def in_other_plane(self) -> Support:
        """The same support with its springs and dampers of the other plane."""
        names = ("translation", "rotation", "translation_damping", "rotation_damping")
        other = {name: getattr(self, f"{name}_y") for name in names}
        springs = {name: getattr(self, name) if value is None else value for name, value in other.items()}
        return Support(self.position, self.kind, twist=self.twist, twist_damping=self.twist_damping, **springs)


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
    polar_inertia: NotNegative | None = seldom(default=None)
    """kg m², about the shaft's axis; None: twice ``inertia``, that of a thin disc"""

    def __post_init__(self) -> None:
        if self.polar_inertia is not None and self.polar_inertia > 2 * self.inertia:
            raise ValueError(
                f"polar_inertia {self.polar_inertia:g} kg m² is more than twice inertia {self.inertia:g} kg m²; "
                "no body has more than a thin disc"
            )

    @property
    def about_axis(self) -> float:
        """Inertia about the shaft's axis, kg m²."""
        return 2 * self.inertia if self.polar_inertia is None else self.polar_inertia
