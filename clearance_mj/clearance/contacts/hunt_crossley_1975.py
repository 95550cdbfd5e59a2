"""Hunt and Crossley's contact with a constant damping coefficient."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from ...core.validation import NotNegative, Number, Positive
from ...rig import Bushing
from ..contact import ContactModel, Numbers, register
from ..family import DECADE, ContactFamily, EarlierFit, FamilyParameter, GapForces, positive_parameter, register_family
from ..lanes import power

__all__ = ["HuntCrossley1975", "PowerLaw", "loss_factor"]


@register
class HuntCrossley1975(ContactModel):
    """F = K δⁿ + λ δⁿ δ̇ with a constant λ (Hunt & Crossley, J. Appl. Mech. 42, 1975).

    It needs no impact speed, and is defined for a shaft at rest on the bushing. A slow impact at v has the
    restitution 1 - 2 λ v/(3 K).
    """

    name: ClassVar[str] = "hunt-crossley-1975"
    stiffness: Positive
    """K, N/mⁿ"""
    damping: NotNegative = 0.0
    """λ, N s/mⁿ⁺¹"""
    exponent: Annotated[Number, Field(ge=1)] = 1.5
    """n, 1.5 for Hertz"""

    @staticmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Return the stiffness K δⁿ⁻¹, damping λ δⁿ."""
        factor = power(depth, p[2] - 1.0)
        out[0] = p[0] * factor
        out[1] = p[1] * factor * depth

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """K δⁿ⁺¹/(n + 1)."""
        return p[0] * depth ** (p[2] + 1.0) / (p[2] + 1.0)

    def largest(self, gap: float) -> tuple[float, float]:
        """Return the stiffness and damping at one gap of penetration."""
        return self.exponent * self.stiffness * gap ** (self.exponent - 1), self.damping * gap**self.exponent


@register_family
class PowerLaw(ContactFamily):
    """F = F₁ (δ/d)ⁿ (1 + α δ̇) with the force F₁ at one gap d of penetration.

    Records determine F₁; K = F₁/dⁿ alone depends on the exponent by orders of magnitude.
    """

    name: ClassVar[str] = "power law"
    model: ClassVar[type] = HuntCrossley1975

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return F₁, α and n; the exponents lie between a linear spring's and twice Hertz's."""
        force = bushing.contact.stiffness * bushing.gap
        return [
            positive_parameter("contact force at one gap", "N", force, DECADE, tracked_as="stiffness"),
            loss_factor(),
            positive_parameter("contact exponent", "1", 1.5, 0.3, 1.0, 3.0, tracked_as="exponent"),
        ]

    def make(self, bushing: Bushing, *values: float) -> HuntCrossley1975:
        """Return the contact of F₁, α and n."""
        force, loss, exponent = values
        stiffness = force / bushing.gap**exponent
        return HuntCrossley1975(stiffness, loss * stiffness, exponent)

    def values(self, bushing: Bushing, model: HuntCrossley1975) -> dict[str, float]:
        """Return F₁, α and n."""
        return {
            "contact force at one gap": model.stiffness * bushing.gap**model.exponent,
            "contact loss": model.damping / model.stiffness,
            "contact exponent": model.exponent,
        }

    def start(self, fit: EarlierFit, forces: GapForces) -> dict[str, float]:
        """Return F₁ and n of the power law that has the other contact's force at a half and at one gap."""
        force_half, force_full = (fit.contact_model.force(depth * fit.nominal.gap, 0.0) for depth in (0.5, 1.0))
        return {"contact force at one gap": force_full, "contact exponent": math.log2(force_full / force_half)}


def loss_factor() -> FamilyParameter:
    """Return the parameter α of damping in proportion to the force, α F δ̇."""
    return positive_parameter("contact loss", "s/m", 2.0, 0.5 * DECADE, tracked_as="damping")
