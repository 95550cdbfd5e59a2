"""Hunt and Crossley's contact with a damping coefficient of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from ...core.validation import NotNegative, Number, Positive
from ..contact import ContactModel, Numbers, register
from ..lanes import power

__all__ = ["HuntCrossley1975"]


@register
class HuntCrossley1975(ContactModel):
    """F = K δⁿ + λ δⁿ δ̇ with a constant λ (Hunt & Crossley, J. Appl. Mech. 42, 1975).

    It needs no speed of impact, and is defined for a shaft that rests on the bushing. A slow impact at v has the
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
        """Stiffness K δⁿ⁻¹, damping λ δⁿ."""
        risen = power(depth, p[2] - 1.0)
        out[0] = p[0] * risen
        out[1] = p[1] * risen * depth

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """K δⁿ⁺¹/(n + 1)."""
        return p[0] * depth ** (p[2] + 1.0) / (p[2] + 1.0)

    def largest(self, gap: float) -> tuple[float, float]:
        """Stiffness and damping at one gap of penetration."""
        return self.exponent * self.stiffness * gap ** (self.exponent - 1), self.damping * gap**self.exponent
