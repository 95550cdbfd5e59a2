"""The contact of multibody models: the function IMPACT of MSC ADAMS."""

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

    STEP rises from 0 to c_max within the depth d as s² (3 - 2s), s = δ/d, and is constant beyond, so that the force
    begins at zero at any speed. k of an ADAMS model in mm, in N/mmᵉ, is here times 1000ᵉ, c_max times 1000.
    """

    name: ClassVar[str] = "adams-impact"
    stiffness: Positive
    """k, N/mᵉ"""
    exponent: Annotated[Number, Field(ge=1)]
    """e"""
    damping: NotNegative
    """c_max, N s/m"""
    depth: Positive
    """d, m, beyond which the damping is c_max"""

    @staticmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Return the stiffness k δᵉ⁻¹, damping c_max s² (3 - 2s)."""
        s = smaller(depth / p[3], 1.0)
        out[0] = p[0] * power(depth, p[1] - 1.0)
        out[1] = p[2] * s * s * (3.0 - 2.0 * s)

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """Return k δᵉ⁺¹/(e + 1)."""
        return p[0] * depth ** (p[1] + 1.0) / (p[1] + 1.0)

    def largest(self, gap: float) -> tuple[float, float]:
        """Return the stiffness at one gap of penetration, and c_max."""
        return self.exponent * self.stiffness * gap ** (self.exponent - 1), self.damping
