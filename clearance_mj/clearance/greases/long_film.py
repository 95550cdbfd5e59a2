"""A spring with the squeeze film of a long bearing: damping c/(1 - ε²)^1.5 at an eccentricity ratio ε = e/h.

Sommerfeld's solution for a journal squeezed towards its bearing without turning (Hamrock, Schmid & Jacobson,
Fundamentals of Fluid Film Lubrication, 2004, chapter 11), here in every direction: grease does not turn with the shaft.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from numba.extending import register_jitable

from ...core.validation import NotNegative, Positive
from ...rig import Bushing
from ..contact import Numbers
from ..family import FamilyParameter, FillingFamily, register_family
from ..grease import GreaseModel, Vector, register
from ..lanes import power, smaller
from ..vectors import along, answer, length, times
from .bouc_wen import spring_and_film

__all__ = ["LongFilm", "LongFilmed"]

CLOSEST = 0.97  # largest eccentricity ratio: beyond it the film thickness is constant


@register_jitable
def _damping(e: Any, damping: Any, per_height: Any) -> Any:
    ratio = smaller(e * per_height, CLOSEST)
    thin = 1.0 - ratio * ratio
    return damping / (thin * power(thin, 0.5))


@register
class LongFilm(GreaseModel):
    """A spring and the squeeze film of a long bearing."""

    name: ClassVar[str] = "long-film"
    stiffness: NotNegative
    """N/m"""
    damping: NotNegative
    """N s/m, in the middle"""
    height: Positive
    """h, m, of the film in the middle"""

    def parameters(self) -> tuple[float, ...]:
        """Return stiffness, damping and 1/h."""
        return self.stiffness, self.damping, 1 / self.height

    def states(self, coordinates: int) -> int:
        """Return 0: the film has no state."""
        return 0

    def small_motion(self) -> tuple[float, float]:
        """Return the spring and the damping in the middle."""
        return self.stiffness, self.damping

    def largest(self) -> tuple[float, float]:
        """Return the spring and the damping of the thinnest film."""
        return self.stiffness, self.damping / (1 - CLOSEST**2) ** 1.5

    @staticmethod
    def law(p: Sequence[float], state: Numbers, r: Vector, dr: Vector, spin: float, step: float, out: Numbers) -> None:
        """Write the spring's force and the film's damping; see the module."""
        answer(out, times(p[0], r), _damping(length(r), p[1], p[2]))

    @staticmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], r: Vector, dr: Vector, out: Numbers
    ) -> None:
        """Write the spring's energy."""
        out[0] = 0.5 * p[0] * along(r, r)
        out[1] = 0.0


@register_family
class LongFilmed(FillingFamily):
    """A spring with the squeeze film of a long bearing, in round clearances."""

    name: ClassVar[str] = "long film"
    model: ClassVar[type] = LongFilm
    round_only: ClassVar[bool] = True

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return stiffness, damping and film height."""
        return spring_and_film(bushing)

    def make(self, bushing: Bushing, *values: float) -> LongFilm:
        """Return the grease of stiffness, damping and film height."""
        return LongFilm(*values)

    def values(self, bushing: Bushing, model: LongFilm) -> dict[str, float]:
        """Return stiffness, damping and film height."""
        return dict(zip((p.name for p in self.parameters(bushing)), (model.stiffness, model.damping, model.height)))
