"""Kelvin and Voigt's contact (Eq. 10)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from ...core.validation import Flag, NotNegative, Positive
from ..contact import ContactModel, Numbers, register

__all__ = ["KelvinVoigt"]


@register
class KelvinVoigt(ContactModel):
    """Spring and damper in parallel (Eq. 10)."""

    name: ClassVar[str] = "kelvin-voigt"
    stiffness: Positive
    """k, N/m"""
    damping: NotNegative = 0.0
    """c, N s/m"""
    adhesion: Flag = False
    """let the damper pull at release"""

    @staticmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Stiffness and damping are the parameters."""
        out[0] = p[0]
        out[1] = p[1]

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """½ k δ²."""
        return 0.5 * p[0] * depth * depth

    def largest(self, gap: float) -> tuple[float, float]:
        """Stiffness k and damping c."""
        return self.stiffness, self.damping
