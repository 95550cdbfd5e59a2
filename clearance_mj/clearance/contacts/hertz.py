"""Hertz contacts with damping in proportion to the force, F = K δⁿ (1 + κ δ̇/v), v the impact speed."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, ClassVar

import scipy.optimize
from pydantic import Field

from ...core.errors import LawError
from ...core.validation import Number, Positive, checked
from ..contact import ContactModel, Numbers, register
from ..follower import SLOWEST_IMPACT
from ..lanes import larger, power, where_above

__all__ = ["Flores", "HertzDamped", "HuntCrossley", "LankaraniNikravesh"]

_ELASTIC = 1e-3  # 1 - e below which κ is a series in it, with error 1e-6
_PLASTIC = 0.03  # e below which κ is 1/e, with error 1e-13


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
        out[0] = where_above(p[0] * power(depth, p[1] - 1.0), depth)  # in the gap the power with n = 1 would be 1
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
    """κ of the restitution e: κ (1+e) = ln[(1+κ)/(1-κe)] (Hunt & Crossley, J. Appl. Mech. 42, 1975)."""

    name: ClassVar[str] = "hunt-crossley"
    first_order: bool = False
    """use κ = 3 (1-e)/2 as published: correct to first order in 1-e, e = 0.3 gives a rebound of 0.58"""

    @property
    def kappa(self) -> float:
        """Damping factor."""
        return 1.5 * (1 - self.restitution) if self.first_order else _damping_factor(self.restitution)


@lru_cache(1024)
def _damping_factor(e: float) -> float:
    """Return κ of the energy loss of an impact with restitution e."""
    if 1 - e < _ELASTIC:  # the logarithms cancel; first terms of their series
        return 1.5 * (1 - e**2) / (1 + e**3)
    if e < _PLASTIC:
        return 1 / e
    root = scipy.optimize.brentq(
        lambda kappa: kappa * (1 + e) - math.log1p(kappa) + math.log1p(-kappa * e), 1.5 * (1 - e), (1 - 1e-15) / e,
        xtol=1e-15,
    )  # fmt: skip
    return float(root)


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
