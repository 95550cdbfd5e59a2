"""The contact that multibody models bring along: the function IMPACT of MSC ADAMS."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from ...core.validation import NotNegative, Number, Positive
from ..contact import ContactModel, Numbers, register
from ..lanes import power, smaller

__all__ = ["AdamsImpact"]


@register
class AdamsImpact(ContactModel):
    """F = k δᵉ + STEP(δ, 0, 0, d, c_max) δ̇, never pulling (MSC ADAMS, functions IMPACT and STEP).

    STEP rises from 0 to c_max within the depth d as s² (3 - 2s), s = δ/d, and stays there, so that the force begins at
    zero at any speed. An ADAMS model in mm has k in N/mmᵉ: here it is that times 1000ᵉ, and c_max that times 1000.
    """

    name: ClassVar[str] = "adams-impact"
    stiffness: Positive
    """k, N/mᵉ"""
    exponent: Annotated[Number, Field(ge=1)]
    """e"""
    damping: NotNegative
    """c_max, N s/m"""
    depth: Positive
    """d, m, from which on the damping is c_max"""

    @staticmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Return the stiffness k δᵉ⁻¹, damping c_max s² (3 - 2s)."""
        share = smaller(depth / p[3], 1.0)
        out[0] = p[0] * power(depth, p[1] - 1.0)
        out[1] = p[2] * share * share * (3.0 - 2.0 * share)

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """Return k δᵉ⁺¹/(e + 1)."""
        return p[0] * depth ** (p[1] + 1.0) / (p[1] + 1.0)

    def largest(self, gap: float) -> tuple[float, float]:
        """Return the stiffness at one gap of penetration, and c_max."""
        return self.exponent * self.stiffness * gap ** (self.exponent - 1), self.damping
