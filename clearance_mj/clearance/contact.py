"""Contact forces beyond the gap.

Every model is seen by the engines as the stiffness and damping that hold at this moment, f = k δ + c δ̇ with δ the
penetration: that is what makes them exact in an engine whose contacts are springs and dampers. A Hertz contact
F = K δⁿ (1 + κ δ̇/v_i) becomes k = K δⁿ⁻¹, c = κ K δⁿ / v_i, with v_i the speed at which this contact began.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numba
from pydantic import Field

from ..errors import LawError
from ..validation import Flag, NotNegative, Number, Positive, checked

__all__ = [
    "CONTACTS",
    "Flores",
    "HertzDamped",
    "HuntCrossley",
    "KelvinVoigt",
    "LankaraniNikravesh",
    "contact_force",
    "instantaneous",
    "register",
]

SLOWEST_IMPACT = 1e-6
"""m/s; a contact that begins more slowly is damped as if it began at this speed"""

CONTACTS: dict[str, type] = {}
"""The contact models by the name that law files give them."""


def register(model: type) -> type:
    """Make a contact model known by its ``name``, so that laws can hold it and be saved; a class decorator.

    Parameters
    ----------
    model : type
        A dataclass of numbers, with attributes stiffness, damping, exponent, kappa and adhesion.
    """
    CONTACTS[model.name] = model
    return model


@register
@checked(LawError, name="contact")
class KelvinVoigt:
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
    exponent: ClassVar[float] = 1.0
    kappa: ClassVar[float] = 0.0

    def force(self, penetration, speed, impact_speed=0.0):
        """Force against the penetration.

        Parameters
        ----------
        penetration, speed : float
            δ, m, and δ̇, m/s.
        impact_speed : float
            Not used.

        Returns
        -------
        float
            N.
        """
        return contact_force(self.stiffness, self.damping, penetration, speed, self.adhesion)


@checked(LawError, name="contact")
class HertzDamped:
    """F = K δⁿ (1 + κ δ̇/v_i); the subclasses differ in κ(e).

    Parameters
    ----------
    stiffness : float
        K, N/mⁿ.
    restitution : float
        e, in 0..1 (above 0).
    exponent : float
        n, 1.5 for Hertz.

    Raises
    ------
    LawError
        For values outside these ranges.
    """

    stiffness: Positive
    restitution: Annotated[Positive, Field(le=1)]
    exponent: Annotated[Number, Field(ge=1)] = 1.5
    damping: ClassVar[float] = 0.0
    adhesion: ClassVar[bool] = False

    def force(self, penetration, speed, impact_speed):
        """Force against the penetration.

        Parameters
        ----------
        penetration, speed : float
            δ, m, and δ̇, m/s.
        impact_speed : float
            v_i, m/s: δ̇ when this contact began.

        Returns
        -------
        float
            N.
        """
        k, c = instantaneous(self.stiffness, 0.0, self.exponent, self.kappa, penetration, impact_speed)
        return contact_force(k, c, penetration, speed, False)


@register
@checked(LawError, name="contact")
class HuntCrossley(HertzDamped):
    """κ = 3 (1-e)/2 (Hunt & Crossley, J. Appl. Mech. 42, 1975)."""

    name: ClassVar[str] = "hunt-crossley"

    @property
    def kappa(self) -> float:
        """Damping factor."""
        return 1.5 * (1 - self.restitution)


@register
@checked(LawError, name="contact")
class LankaraniNikravesh(HertzDamped):
    """κ = 3 (1-e²)/4 (Lankarani & Nikravesh, J. Mech. Des. 112, 1990)."""

    name: ClassVar[str] = "lankarani-nikravesh"

    @property
    def kappa(self) -> float:
        """Damping factor."""
        return 0.75 * (1 - self.restitution**2)


@register
@checked(LawError, name="contact")
class Flores(HertzDamped):
    """κ = 8 (1-e)/(5e) (Flores et al., Multibody Syst. Dyn. 25, 2011)."""

    name: ClassVar[str] = "flores"

    @property
    def kappa(self) -> float:
        """Damping factor."""
        return 1.6 * (1 - self.restitution) / self.restitution


@numba.njit(cache=True, nogil=True, inline="always")
def instantaneous(stiffness, damping, exponent, kappa, penetration, impact_speed):
    """Return stiffness and damping (k, c) that hold at this moment, N/m and N s/m.

    Parameters
    ----------
    stiffness, damping : float
        K, N/mⁿ, and c, N s/m, of the model; c counts for n = 1 and κ = 0 only.
    exponent, kappa : float
        n and κ.
    penetration : float
        δ, m.
    impact_speed : float
        v_i, m/s: δ̇ when this contact began.
    """
    if exponent == 1.0 and kappa == 0.0:
        return stiffness, damping
    if penetration <= 0.0:
        return 0.0, 0.0
    k = stiffness * penetration ** (exponent - 1.0)
    return k, kappa * k * penetration / max(impact_speed, SLOWEST_IMPACT)


@numba.njit(cache=True, nogil=True, inline="always")
def contact_force(k, c, penetration, speed, adhesion):
    """Return the force k δ + c δ̇ during contact, N; without adhesion it never pulls.

    Parameters
    ----------
    k, c : float
        N/m and N s/m.
    penetration, speed : float
        δ, m, and δ̇, m/s.
    adhesion : bool
        Let the damper pull at release.
    """
    if penetration <= 0.0:
        return 0.0
    force = k * penetration + c * speed
    return force if adhesion else max(force, 0.0)
