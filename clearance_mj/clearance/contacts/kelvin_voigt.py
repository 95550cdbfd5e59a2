"""Kelvin and Voigt's contact (Eq. 10)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from ...validation import Flag, NotNegative, Positive
from ..contact import ContactModel, Numbers, register

__all__ = ["KelvinVoigt"]


@register
class KelvinVoigt(ContactModel):
    """Spring and damper in parallel (Eq. 10).

    Parameters
    ----------
    stiffness : float
        k, N/m.
    damping : float
        c, N s/m.
    adhesion : bool
        Let the damper pull at release; by default the force never pulls.

    Raises
    ------
    LawError
        For negative values.
    """

    name: ClassVar[str] = "kelvin-voigt"
    stiffness: Positive
    damping: NotNegative = 0.0
    adhesion: Flag = False

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
        """K and c."""
        return self.stiffness, self.damping
