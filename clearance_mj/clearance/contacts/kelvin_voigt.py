"""Kelvin and Voigt's contact (Eq. 10)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from ...core.validation import Flag, NotNegative, Positive
from ...rig import Bushing
from ..contact import ContactModel, Numbers, register
from ..family import DECADE, ContactFamily, FamilyParameter, positive_parameter, register_family

__all__ = ["KelvinVoigt", "LinearContact", "spring_and_damper"]

LOSS_TIME = 1e-4  # s, damping over stiffness at the start of a fit if the rig file has no damping


@register
class KelvinVoigt(ContactModel):
    """Spring and damper in parallel (Eq. 10)."""

    name: ClassVar[str] = "kelvin-voigt"
    stiffness: Positive
    """k, N/m"""
    damping: NotNegative = 0.0
    """c, N s/m"""
    adhesion: Flag = False
    """True if the damper may pull at release"""

    @staticmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Return stiffness and damping, which are the parameters."""
        out[0] = p[0]
        out[1] = p[1]

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """½ k δ²."""
        return 0.5 * p[0] * depth * depth

    def largest(self, gap: float) -> tuple[float, float]:
        """Return the stiffness k and damping c."""
        return self.stiffness, self.damping


@register_family
class LinearContact(ContactFamily):
    """Linear springs and dampers."""

    name: ClassVar[str] = "linear"
    model: ClassVar[type] = KelvinVoigt

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return stiffness and damping, within decades of the datasheet's."""
        return spring_and_damper(bushing)

    def make(self, bushing: Bushing, *values: float) -> KelvinVoigt:
        """Return the contact of stiffness and damping."""
        stiffness, damping = values
        return KelvinVoigt(stiffness, damping)

    def values(self, bushing: Bushing, model: KelvinVoigt) -> dict[str, float]:
        """Return stiffness and damping."""
        return {"contact stiffness": model.stiffness, "contact damping": model.damping}


def spring_and_damper(bushing: Bushing) -> list[FamilyParameter]:
    """Return the parameters of a linear contact: k and c."""
    k, c = bushing.contact.stiffness, bushing.contact.damping or LOSS_TIME * bushing.contact.stiffness
    return [
        positive_parameter("contact stiffness", "N/m", k, DECADE, tracked_as="stiffness"),
        positive_parameter("contact damping", "N s/m", c, DECADE, tracked_as="damping"),
    ]
