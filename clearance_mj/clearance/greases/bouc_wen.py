"""Bouc-Wen hysteresis (Eq. 9) with a squeeze film: the grease of rig files.

It holds λ k x²/2 + (1-λ) k z²/(2A) and loses (1-λ) k/A |z|ⁿ (β |z ẋ| + γ z ẋ), which is never negative for -β ≤ γ ≤ β
(Erlicher & Point, C. R. Mécanique 332, 2004).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from numba.extending import register_jitable

from ...rig import Bushing, Grease
from ..contact import Numbers
from ..family import DECADE, FamilyParameter, FillingFamily, positive_parameter, register_family
from ..grease import GreaseModel, Vector
from ..lanes import any_below, larger, power, signed
from ..vectors import TINY, along, answer, length, minus, of_one_or_two, plus, read, times, write

__all__ = [
    "BoucWen", "Hysteretic", "LinearWithFilm", "bouc_wen_step", "film_damping", "spring_and_film", "values_of_film",
]  # fmt: skip


@register_jitable(inline="always")
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
        """Return the stiffness k and damping c."""
        return self.grease.stiffness, self.grease.damping

    def is_linear(self) -> bool:
        """Return True if there is neither hysteresis nor a film."""
        g = self.grease
        return (g.elastic_ratio == 1 or g.stiffness == 0) and not (g.film_height and g.damping)

    def largest(self) -> tuple[float, float]:
        """k, and the damping of the thinnest film."""
        g = self.grease
        return g.stiffness, g.damping / (g.film_limit if g.film_height else 1.0) ** 2

    @staticmethod
    def law(p: Sequence[float], state: Numbers, r: Vector, dr: Vector, spin: float, step: float, out: Numbers) -> None:
        """Advance the rate-independent state over the displacement, by the midpoint rule, and write the force."""
        if any_below(p[1], 1.0):  # else there is no slip
            write(state, 0, bouc_wen_step(read(state, 0, r), dr, p[2], p[3], p[4], p[5]))
        force = times(p[0], plus(times(p[1], r), times(1.0 - p[1], read(state, 0, r))))
        answer(out, force, film_damping(length(r), p[6], p[7], p[8]))

    @staticmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], r: Vector, dr: Vector, out: Numbers
    ) -> None:
        """Write the energies of the module docstring, the loss at the mean deflection of the step."""
        spring, current = (1.0 - p[1]) * p[0] / p[2], read(state, 0, r)
        mean = times(0.5, plus(read(before, 0, r), current))
        displacement = along(mean, dr)
        out[0] = 0.5 * (p[1] * p[0] * along(r, r) + spring * along(current, current))
        out[1] = spring * length(mean) ** p[5] * (p[4] * displacement + p[3] * abs(displacement))


def _slope_one(z: Any, dr: Any, a: Any, beta: Any, gamma: Any, exponent: Any) -> Any:
    return (dr[0] * (a - power(abs(z[0]), exponent) * (gamma + signed(beta, dr[0] * z[0]))),)


def _slope_two(z: Any, dr: Any, a: Any, beta: Any, gamma: Any, exponent: Any) -> Any:
    size = larger(length(z), TINY)
    displacement = along(dr, z) / size
    drag = power(size, exponent) * (gamma * displacement + beta * abs(displacement)) / size
    return minus(times(a, dr), times(drag, z))


slope = of_one_or_two(
    _slope_one,
    _slope_two,
    """Return dz = A du - |z|ⁿ e (β |du·e| + γ du·e) along e = z/|z|, isotropic; β and γ in 1/mⁿ.

    Park, Wen & Ang (Earthquake Eng. Struct. Dyn. 14, 1986) have β (|du_y z_y| + |du_z z_z|) in the place of β |du·z|,
    which would let the force depend on how the axes lie; on an axis both are the law of one coordinate.
    """,
)


@register_jitable
def bouc_wen_step(z: Vector, dr: Vector, a: float, beta: float, gamma: float, exponent: float) -> Vector:
    """Return z after a displacement dr, m, by the midpoint rule, of second order in dr; β and γ are in 1/mⁿ."""
    half = plus(z, times(0.5, slope(z, dr, a, beta, gamma, exponent)))
    return plus(z, slope(half, dr, a, beta, gamma, exponent))


@register_family
class LinearWithFilm(FillingFamily):
    """Linear springs with a squeeze film, without slip. It is fitted first of all fillings."""

    name: ClassVar[str] = "linear"
    model: ClassVar[type] = BoucWen
    begins_from: ClassVar[str | None] = None

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return stiffness, damping and film height."""
        return spring_and_film(bushing)

    def make(self, bushing: Bushing, *values: float) -> Grease:
        """Return the grease of stiffness, damping and film height."""
        stiffness, damping, height = values
        return Grease(stiffness, damping, film_height=height)

    def holds(self, model: GreaseModel) -> bool:
        """Return True if it is a rig file's grease without slip."""
        return isinstance(model, BoucWen) and model.grease.elastic_ratio == 1

    def values(self, bushing: Bushing, model: BoucWen) -> dict[str, float]:
        """Return stiffness and damping, and the film's height if it has one."""
        return values_of_film(model.grease.stiffness, model.grease.damping, model.grease.film_height)


@register_family
class Hysteretic(FillingFamily):
    """Bouc-Wen hysteresis with A = 1 and a squeeze film.

    k, λ and the yield displacement z = (β+γ)^(-1/n) give the loop its size, n and β/(β+γ) its shape.
    """

    name: ClassVar[str] = "Bouc-Wen"
    model: ClassVar[type] = BoucWen

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return stiffness, damping, film height, λ, z, n and β/(β+γ); γ ≤ β keeps the loop dissipative."""
        return [
            *spring_and_film(bushing),
            positive_parameter("grease elastic ratio", "1", 0.8, 0.5, high=1.0),
            positive_parameter("grease yield displacement", "m", 0.5 * bushing.gap, 1.0),
            positive_parameter("grease exponent", "1", 1.5, 0.3, 1.0, 3.0),
            positive_parameter("grease beta / (beta + gamma)", "1", 0.7, 0.3, 0.5, 3.0),
        ]

    def make(self, bushing: Bushing, *values: float) -> Grease:
        """Return the grease of stiffness, damping, film height, λ, z, n and β/(β+γ)."""
        stiffness, damping, height, ratio, slip, exponent, beta_ratio = values
        total = slip**-exponent
        beta = max(beta_ratio, 0.5) * total
        shape = {"beta": beta, "gamma": total - beta, "exponent": exponent, "film_height": height}
        return Grease(stiffness=stiffness, damping=damping, elastic_ratio=ratio, **shape)

    def holds(self, model: GreaseModel) -> bool:
        """Return True if it is a rig file's grease with slip."""
        return isinstance(model, BoucWen) and model.grease.elastic_ratio < 1

    def values(self, bushing: Bushing, model: BoucWen) -> dict[str, float]:
        """Return all parameters; without a film, all but its height."""
        g = model.grease
        return values_of_film(g.stiffness, g.damping, g.film_height) | {
            "grease elastic ratio": g.elastic_ratio,
            "grease yield displacement": g.yield_displacement,
            "grease exponent": g.exponent,
            "grease beta / (beta + gamma)": g.beta / (g.beta + g.gamma),
        }


def spring_and_film(bushing: Bushing) -> list[FamilyParameter]:
    """Return the parameters k, c and h of a spring without slip and of a squeeze film.

    If the rig file has no stiffness or damping, a fit starts with a spring ten times softer than the contact, and with
    a damping of 1 ms times the spring's stiffness.
    """
    stiffness = bushing.grease.stiffness or 0.1 * bushing.contact.stiffness
    damping = bushing.grease.damping or 1e-3 * stiffness
    return [
        positive_parameter("grease stiffness", "N/m", stiffness, DECADE, tracked_as="grease stiffness"),
        positive_parameter("grease damping", "N s/m", damping, DECADE, tracked_as="grease damping"),
        positive_parameter("grease film height", "m", 3 * bushing.gap, 0.7, 0.5 * bushing.gap),
    ]


def values_of_film(stiffness: float, damping: float, height: float | None) -> dict[str, float]:
    """Return the values of `spring_and_film`, without the height if there is no film."""
    values = {"grease stiffness": stiffness, "grease damping": damping}
    return values | ({"grease film height": height} if height else {})
