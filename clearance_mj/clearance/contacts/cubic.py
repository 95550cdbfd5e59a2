"""A contact whose spring hardens with the cube of the penetration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from ...core.validation import NotNegative, Positive
from ..contact import ContactModel, Numbers, register

__all__ = ["Cubic"]


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
        """Secant stiffness k + k₃ δ², damping c + α (k δ + k₃ δ³)."""
        out[0] = p[0] + p[1] * depth * depth
        out[1] = p[2] + p[3] * out[0] * depth

    @staticmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """½ k δ² + ¼ k₃ δ⁴."""
        return (0.5 * p[0] + 0.25 * p[1] * depth * depth) * depth * depth

    def largest(self, gap: float) -> tuple[float, float]:
        """Tangent stiffness and damping at one gap of penetration."""
        force = (self.stiffness + self.cubic * gap**2) * gap
        return self.stiffness + 3 * self.cubic * gap**2, self.damping + self.loss * force
