"""What holds a shaft, and the discs on it."""

from __future__ import annotations

from typing import Literal

from ..core.errors import RigError
from ..core.validation import NotNegative, Number, Positive, Text, checked, seldom

__all__ = ["HELD", "Disc", "Support"]

HELD = {"clamped": (0, 1), "pinned": (0,), "guided": (1,), "elastic": ()}
"""What a kind of support holds: deflection (0), rotation (1)."""


@checked(RigError)
class Support:
    """What holds a shaft at one position: a kind of support, or springs and dampers, or both."""

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
    """N/m across the plane of vibration, of a shaft that turns; None: as ``translation``"""
    rotation_y: Positive | None = seldom(default=None)
    """N m/rad across the plane of vibration, of a shaft that turns; None: as ``rotation``"""

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
        springs = (self.translation, self.rotation, self.twist)
        if self.kind == "elastic" and not any(
            (*springs, self.translation_damping, self.rotation_damping, self.twist_damping)
        ):
            raise ValueError("holds nothing; give kind (clamped, pinned or guided), or springs or dampers")

    @property
    def holds_twist(self) -> bool:
        """Whether the shaft cannot twist there."""
        return self.twist == "rigid" or (self.twist is None and self.kind == "clamped")

    @property
    def in_other_plane(self) -> Support:
        """The same support with its springs and dampers of the other plane."""
        translation, rotation = self.translation_damping_y, self.rotation_damping_y
        return Support(
            self.position, self.kind, self.translation_y or self.translation, self.rotation_y or self.rotation,
            self.translation_damping if translation is None else translation,
            self.rotation_damping if rotation is None else rotation, twist=self.twist, twist_damping=self.twist_damping,
        )  # fmt: skip


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
