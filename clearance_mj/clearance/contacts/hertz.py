"""Hertz contacts with damping in proportion to the force, F = K δⁿ (1 + κ δ̇/v), v the speed at which they began."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from ...core.errors import LawError
from ...core.validation import Number, Positive, checked
from ..contact import ContactModel, Numbers, register
from ..follower import SLOWEST_IMPACT
from ..lanes import larger, power, where_above

__all__ = ["Flores", "HertzDamped", "HuntCrossley", "LankaraniNikravesh"]


@checked(LawError, name="contact")
class HertzDamped(ContactModel):
    """F = K δⁿ (1 + κ δ̇/v); the subclasses differ in κ(e)."""

    stiffness: Positive
    """K, N/mⁿ"""
    restitution: Annotated[Positive, Field(le=1)]
    """e"""
    exponent: Annotated[Number, Field(ge=1)] = 1.5
    """n, 1.5 for Hertz"""

    @property
    @abstractmethod
    def kappa(self) -> float:
        """Damping factor κ."""

    def parameters(self) -> tuple[float, ...]:
        """K, n and κ."""
        return self.stiffness, self.exponent, self.kappa

    @staticmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Return the stiffness K δⁿ⁻¹, damping κ K δⁿ/v."""
        out[0] = where_above(p[0] * power(depth, p[1] - 1.0), depth)  # in the gap the power of n = 1 would be 1
        out[1] = p[2] * out[0] * depth / larger(impact_speed, SLOWEST_IMPACT)

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """K δⁿ⁺¹/(n + 1)."""
        return p[0] * depth ** (p[1] + 1.0) / (p[1] + 1.0)

    def largest(self, gap: float) -> tuple[float, float]:
        """Return the stiffness at one gap of penetration; the damping of an impact is small against it."""
        return self.exponent * self.stiffness * gap ** (self.exponent - 1), 0.0


@register
class HuntCrossley(HertzDamped):
    """κ = 3 (1-e)/2 (Hunt & Crossley, J. Appl. Mech. 42, 1975)."""

    name: ClassVar[str] = "hunt-crossley"

    @property
    def kappa(self) -> float:
        """Damping factor."""
        return 1.5 * (1 - self.restitution)


@register
class LankaraniNikravesh(HertzDamped):
    """κ = 3 (1-e²)/4 (Lankarani & Nikravesh, J. Mech. Des. 112, 1990)."""

    name: ClassVar[str] = "lankarani-nikravesh"

    @property
    def kappa(self) -> float:
        """Damping factor."""
        return 0.75 * (1 - self.restitution**2)


@register
class Flores(HertzDamped):
    """κ = 8 (1-e)/(5e) (Flores et al., Multibody Syst. Dyn. 25, 2011)."""

    name: ClassVar[str] = "flores"

    @property
    def kappa(self) -> float:
        """Damping factor."""
        return 1.6 * (1 - self.restitution) / self.restitution
