"""A contact whose spring hardens with the cube of the penetration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from ...core.validation import NotNegative, Positive
from ...rig import Bushing
from ..contact import ContactModel, Numbers, register
from ..family import DECADE, ContactFamily, FamilyParameter, positive_parameter, register_family
from .hunt_crossley_1975 import loss_factor
from .kelvin_voigt import spring_and_damper

__all__ = ["Cubic", "LinearAndCubic"]


@register
class Cubic(ContactModel):
    """F = (k δ + k₃ δ³) (1 + α δ̇) + c δ̇, never pulling."""

    name: ClassVar[str] = "cubic"
    stiffness: Positive
    """k, N/m"""
    cubic: NotNegative
    """k₃, N/m³"""
    damping: NotNegative = 0.0
    """c, N s/m"""
    loss: NotNegative = 0.0
    """α, s/m"""

    @staticmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Return the secant stiffness k + k₃ δ², damping c + α (k δ + k₃ δ³)."""
        out[0] = p[0] + p[1] * depth * depth
        out[1] = p[2] + p[3] * out[0] * depth

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """½ k δ² + ¼ k₃ δ⁴."""
        return (0.5 * p[0] + 0.25 * p[1] * depth * depth) * depth * depth

    def largest(self, gap: float) -> tuple[float, float]:
        """Return the tangent stiffness and damping at one gap of penetration."""
        force = (self.stiffness + self.cubic * gap**2) * gap
        return self.stiffness + 3 * self.cubic * gap**2, self.damping + self.loss * force


@register_family
class LinearAndCubic(ContactFamily):
    """Hardening springs, with linear damping and damping in proportion to the force.

    It is fitted first of all contacts: it approximates any other, whose fit then starts from it.
    """

    name: ClassVar[str] = "linear + cubic"
    model: ClassVar[type] = Cubic
    begins_from: ClassVar[str | None] = None

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return k, c, k₃ and α; at one gap of penetration the cubic spring starts as stiff as the linear one."""
        cubic = bushing.contact.stiffness / bushing.gap**2
        return [
            *spring_and_damper(bushing),
            positive_parameter("contact cubic stiffness", "N/m³", cubic, DECADE, tracked_as="stiffness"),
            loss_factor(),
        ]

    def make(self, bushing: Bushing, *values: float) -> Cubic:
        """Return the contact of k, c, k₃ and α."""
        stiffness, damping, cubic, loss = values
        return Cubic(stiffness, cubic, damping, loss)

    def values(self, bushing: Bushing, model: Cubic) -> dict[str, float]:
        """Return k, c, k₃ and α."""
        return {
            "contact stiffness": model.stiffness,
            "contact damping": model.damping,
            "contact cubic stiffness": model.cubic,
            "contact loss": model.loss,
        }
