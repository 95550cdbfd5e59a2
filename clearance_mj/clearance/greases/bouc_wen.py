"""Bouc-Wen hysteresis (Eq. 9) with a squeeze film: the grease of rig files.

It holds λ k x²/2 + (1-λ) k z²/(2A) and loses (1-λ) k/A |z|ⁿ (β |z ẋ| + γ z ẋ), which is never negative for -β ≤ γ ≤ β
(Erlicher & Point, C. R. Mécanique 332, 2004).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba

from ...rig import Grease
from ..contact import Numbers
from ..grease import GreaseModel
from ..lanes import any_below, larger, power, signed

__all__ = ["BoucWen", "bouc_wen_step", "film_damping"]


@numba.njit(cache=True, nogil=True, inline="always")
def bouc_wen_step(z: float, dx: float, a: float, beta: float, gamma: float, exponent: float) -> float:
    """Advance the state z over the displacement dx, m, by the midpoint rule (second order in dx); β and γ in 1/mⁿ."""
    half = z + 0.5 * dx * _slope(z, dx, a, beta, gamma, exponent)
    return z + dx * _slope(half, dx, a, beta, gamma, exponent)


@numba.njit(cache=True, nogil=True, inline="always")
def _slope(z: float, dx: float, a: float, beta: float, gamma: float, exponent: float) -> float:
    """dz/dx = A - |z|ⁿ (γ + β sign(dx z))."""
    return a - power(abs(z), exponent) * (gamma + signed(beta, dx * z))


@numba.njit(cache=True, nogil=True, inline="always")
def film_damping(x: float, damping: float, inverse_film: float, limit: float) -> float:
    """Return the squeeze-film damping c / max(1 - |x|/h, ε)², N s/m, at a displacement x, m; 1/h is 0 without film."""
    thin = larger(1.0 - abs(x) * inverse_film, limit)
    return damping / (thin * thin)


@dataclass(frozen=True)
class BoucWen(GreaseModel):
    """The model of a `Grease`, λ k x + (1-λ) k z + c ẋ / max(1 - |x|/h, ε)²."""

    grease: Grease
    """the parameters"""

    def parameters(self) -> tuple[float, ...]:
        """k, λ, A, β, γ, n, c, 1/h (0 without film), ε."""
        g = self.grease
        film = 1 / g.film_height if g.film_height else 0.0, g.film_limit
        return g.stiffness, g.elastic_ratio, g.amplitude, g.beta, g.gamma, g.exponent, g.damping, *film

    def small_motion(self) -> tuple[float, float]:
        """Stiffness k and damping c."""
        return self.grease.stiffness, self.grease.damping

    def is_linear(self) -> bool:
        """Whether there is neither a hysteretic share nor a film."""
        g = self.grease
        return (g.elastic_ratio == 1 or g.stiffness == 0) and not (g.film_height and g.damping)

    def largest(self) -> tuple[float, float]:
        """k, and the damping of the thinnest film."""
        g = self.grease
        return g.stiffness, g.damping / (g.film_limit if g.film_height else 1.0) ** 2

    @staticmethod
    def law(p: Sequence[float], state: Numbers, x: float, dx: float, step: float, out: Numbers) -> None:
        """Bouc-Wen does not depend on rate: its state is advanced over the displacement."""
        if any_below(p[1], 1.0):  # else nothing slides
            state[0] = bouc_wen_step(state[0], dx, p[2], p[3], p[4], p[5])
        out[0] = p[0] * (p[1] * x + (1.0 - p[1]) * state[0])
        out[1] = film_damping(x, p[6], p[7], p[8])

    @staticmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], x: float, dx: float, out: Numbers
    ) -> None:
        """See the module; the loss is that at the mean z of the step."""
        spring, z = (1.0 - p[1]) * p[0] / p[2], 0.5 * (before[0] + state[0])
        out[0] = 0.5 * (p[1] * p[0] * x * x + spring * state[0] * state[0])
        out[1] = spring * abs(z) ** p[5] * (p[4] * z * dx + p[3] * abs(z * dx))
