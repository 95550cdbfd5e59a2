"""The oil film of a rig's bushing as a model, and as a family with the viscosity as parameter."""

from __future__ import annotations

import math
from typing import ClassVar

from ...core.errors import LawError
from ...rig import Bushing
from ..family import FamilyParameter, FillingFamily, positive_parameter, register_family
from ..grease import GreaseModel
from ..oil_bearing import OilBearing
from .finite_bearing import FiniteBearing
from .short_bearing import ShortBearing

__all__ = ["OilFilled", "film_bearing"]

WITHIN = math.log(2.0)  # prior standard deviation, for the unknown temperature of the film


def film_bearing(bushing: Bushing, radius: float, viscosity: float | None = None) -> OilBearing:
    """Return the bearing model of a bushing with an oil film.

    Parameters
    ----------
    bushing : Bushing
        One with a film.
    radius : float
        Of the shaft in it, m.
    viscosity : float, optional
        Pa s; default: the film's.
    """
    film = bushing.film
    if film is None:
        raise LawError("the bushing has no oil; give it a film")
    bearing = FiniteBearing if film.width == "finite" else ShortBearing
    viscosity = film.viscosity if viscosity is None else viscosity
    return bearing(viscosity, radius, bushing.length, bushing.gap, film.asperities, film.cavitated)


@register_family
class OilFilled(FillingFamily):
    """Oil in a round clearance, short or of finite width as in the rig file."""

    name: ClassVar[str] = "oil film"
    model: ClassVar[type] = OilBearing
    begins_from: ClassVar[str | None] = None
    round_only: ClassVar[bool] = True

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return the viscosity, which the rig file gives within a factor of two."""
        if bushing.film is None:
            raise LawError("the bushing has no oil of which a viscosity could be found; give it a film")
        return [positive_parameter("grease viscosity", "Pa s", bushing.film.viscosity, WITHIN)]

    def make(self, bushing: Bushing, *values: float) -> GreaseModel:
        """Return the bearing of a viscosity; the bushing's ``radius`` is that of the shaft in it."""
        if bushing.radius is None:
            raise LawError("the radius of the shaft in the bushing is missing; give the bushing's radius")
        (viscosity,) = values
        return film_bearing(bushing, bushing.radius, viscosity)

    def values(self, bushing: Bushing, model: OilBearing) -> dict[str, float]:
        """Return the viscosity."""
        return {"grease viscosity": model.viscosity}
