"""Maxwell-slip hysteresis: parallel springs, each in series with a Coulomb slider.

W. D. Iwan, "A distributed-element model for hysteresis and its steady-state dynamic response", J. Appl. Mech. 33, 1966.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from ...validation import NotNegative, Positive
from ..contact import Numbers
from ..grease import GreaseModel, register
from .bouc_wen import film_damping

__all__ = ["MaxwellSlip"]


@register
class MaxwellSlip(GreaseModel):
    """Σ kᵢ zᵢ + k x + c ẋ / max(1 - |x|/h, ε)²: each zᵢ follows the motion while kᵢ zᵢ stays within ±Wᵢ."""

    name: ClassVar[str] = "maxwell-slip"
    springs: Annotated[tuple[Positive, ...], Field(min_length=1)]
    """kᵢ, N/m"""
    forces: tuple[Positive, ...]
    """Wᵢ at which they slide, N"""
    elastic: NotNegative = 0.0
    """k that does not slide, N/m"""
    damping: NotNegative = 0.0
    """c of the centred shaft, N s/m"""
    film_height: Positive | None = None
    """h, m: film thickness at which the squeeze film would close; None: damping does not grow"""
    film_limit: Annotated[Positive, Field(le=1)] = 0.2
    """ε, smallest relative film thickness"""

    def __post_init__(self) -> None:
        if len(self.forces) != len(self.springs):
            raise ValueError(f"forces must be {len(self.springs)} numbers, one for each spring, got {len(self.forces)}")

    def small_motion(self) -> tuple[float, float]:
        """Before anything slides."""
        return self.elastic + sum(self.springs), self.damping

    def states(self) -> int:
        """One deflection for each spring, m."""
        return len(self.springs)

    def parameters(self) -> tuple[float, ...]:
        """N, k, c, 1/h (0 without film), ε, the springs, the forces."""
        film = 1 / self.film_height if self.film_height else 0.0, self.film_limit
        return len(self.springs), self.elastic, self.damping, *film, *self.springs, *self.forces

    def largest(self) -> tuple[float, float]:
        """Stiffness before anything slides, and the damping of the thinnest film."""
        return self.small_motion()[0], self.damping / (self.film_limit if self.film_height else 1.0) ** 2

    @staticmethod
    def law(p: Sequence[float], state: Numbers, x: float, dx: float, step: float, out: Numbers) -> None:
        """Each spring follows the motion up to its limit: exact for any step."""
        n = int(p[0])
        force = p[1] * x
        for i in range(n):
            limit = p[5 + n + i] / p[5 + i]
            state[i] = min(max(state[i] + dx, -limit), limit)
            force += p[5 + i] * state[i]
        out[0] = force
        out[1] = film_damping(x, p[2], p[3], p[4])

    @staticmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], x: float, dx: float, out: Numbers
    ) -> None:
        """½ k x² + Σ ½ kᵢ zᵢ², and Wᵢ times the way that each slider went."""
        n = int(p[0])
        stored = p[1] * x * x
        lost = 0.0
        for i in range(n):
            stored += p[5 + i] * state[i] * state[i]
            lost += p[5 + n + i] * abs(before[i] + dx - state[i])
        out[0] = 0.5 * stored
        out[1] = lost
