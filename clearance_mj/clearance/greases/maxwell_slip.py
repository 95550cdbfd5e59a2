"""Maxwell-slip hysteresis: parallel springs, each in series with a Coulomb slider.

W. D. Iwan, "A distributed-element model for hysteresis and its steady-state dynamic response", J. Appl. Mech. 33, 1966;
that friction falls with speed: R. Stribeck, Z. VDI 46, 1902, in the form of Bo & Pavelescu, Wear 82, 1982.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from ...core.validation import NotNegative, Number, Positive
from ..contact import Numbers
from ..grease import GreaseModel, register
from ..lanes import any_below, exponential, larger, smaller, whole
from .bouc_wen import film_damping

__all__ = ["MaxwellSlip"]


@register
class MaxwellSlip(GreaseModel):
    """Σ kᵢ zᵢ + k x + c ẋ / max(1 - |x|/h, ε)²: each zᵢ follows the motion while kᵢ zᵢ stays within ±Wᵢ s(ẋ).

    s = 1, or with a Stribeck speed 1 + (r - 1) exp(-(ẋ/v)²): what slides slowly slides harder.
    """

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
    static_ratio: Annotated[Number, Field(ge=1)] = 1.0
    """r, force at which a spring begins to slide, over Wᵢ"""
    stribeck_speed: Positive | None = None
    """v, m/s, at which the force has fallen by 63 % of the way to Wᵢ; None: it does not depend on speed"""

    def __post_init__(self) -> None:
        if len(self.forces) != len(self.springs):
            raise ValueError(f"forces must be {len(self.springs)} numbers, one for each spring, got {len(self.forces)}")
        if self.static_ratio > 1 and self.stribeck_speed is None:
            raise ValueError("stribeck_speed is missing; static_ratio > 1 needs a speed over which the force falls")

    def small_motion(self) -> tuple[float, float]:
        """Before anything slides."""
        return self.elastic + sum(self.springs), self.damping

    def states(self) -> int:
        """One deflection for each spring, m."""
        return len(self.springs)

    def parameters(self) -> tuple[float, ...]:
        """N, k, c, 1/h (0 without film), ε, r - 1, 1/v, the springs, the forces."""
        film = 1 / self.film_height if self.film_height else 0.0, self.film_limit
        falls = self.static_ratio - 1, 1 / self.stribeck_speed if self.stribeck_speed else 0.0
        return len(self.springs), self.elastic, self.damping, *film, *falls, *self.springs, *self.forces

    def largest(self) -> tuple[float, float]:
        """Stiffness before anything slides, and the damping of the thinnest film."""
        return self.small_motion()[0], self.damping / (self.film_limit if self.film_height else 1.0) ** 2

    @staticmethod
    def law(p: Sequence[float], state: Numbers, x: float, dx: float, step: float, out: Numbers) -> None:
        """Each spring follows the motion up to its limit: exact for any step."""
        n, force, more = whole(p[0]), p[1] * x, p[5]
        if any_below(0.0 - more, 0.0):
            ratio = dx / step * p[6]
            more = more * exponential(0.0 - ratio * ratio)
        for i in range(n):
            limit = (1.0 + more) * p[7 + n + i] / p[7 + i]
            state[i] = smaller(larger(state[i] + dx, 0.0 - limit), limit)
            force += p[7 + i] * state[i]
        out[0] = force
        out[1] = film_damping(x, p[2], p[3], p[4])

    @staticmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], x: float, dx: float, out: Numbers
    ) -> None:
        """½ k x² + Σ ½ kᵢ zᵢ², and the force of each spring times the way that its slider went.

        Where the force has fallen since the step before, it is the mean of the two.
        """
        n = int(p[0])
        stored = p[1] * x * x
        lost = 0.0
        for i in range(n):
            stored += p[7 + i] * state[i] * state[i]
            now = abs(state[i])
            lost += p[7 + i] * max(now, 0.5 * (now + abs(before[i]))) * abs(before[i] + dx - state[i])
        out[0] = 0.5 * stored
        out[1] = lost
