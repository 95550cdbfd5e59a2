"""Base class of contact models, for engines, energy balances, identification and law files.

Every model gives the current stiffness and damping of f = k δ + c δ̇, δ the penetration, so that it is exact in an
engine whose contacts are springs and dampers.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import MutableSequence, Sequence

from ..core.errors import LawError
from ..core.validation import Registered, register
from .pointers import CONTACT_ENERGY, address
from .registers import contact_law_of

__all__ = ["CONTACTS", "ContactModel", "Numbers", "register"]

Numbers = MutableSequence[float]  # argument of compiled functions: numbers by index


CONTACTS: dict[str, type[ContactModel]] = {}  # The contact models by their names in law files


class ContactModel(Registered, ABC):
    """A contact of shaft and bushing. Subclasses are fields of numbers and four functions, under `register`.

    ``law`` and ``energy`` are compiled, so they may call ``math``, numpy and other functions compiled by numba only.
    """

    known, refusal, called = CONTACTS, LawError, "contact"
    adhesion: bool = False
    """True if the force may pull"""

    @staticmethod
    @abstractmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Write the current stiffness and damping.

        Parameters
        ----------
        p : sequence of float
            The model's `parameters`.
        depth, speed : float
            δ, m, not negative, and δ̇, m/s.
        impact_speed : float
            m/s, above 0: δ̇ when this contact began; 0 in the gap.
        out : sequence of float
            Filled with k, N/m, and c, N s/m.
        """

    @staticmethod
    @abstractmethod
    def energy(p: Sequence[float], depth: float) -> float:
        """Return the energy of the contact's spring, J.

        Parameters
        ----------
        p : sequence of float
            The model's `parameters`.
        depth : float
            δ, m, not negative.
        """

    @abstractmethod
    def largest(self, gap: float) -> tuple[float, float]:
        """Return the largest stiffness dF/dδ, N/m, and damping, N s/m, that time steps must follow.

        Parameters
        ----------
        gap : float
            m; hardening contacts are evaluated at one gap of penetration.
        """

    def parameters(self) -> tuple[float, ...]:
        """Return the parameters p of `law` and `energy`: by default the fields."""
        return tuple(float(getattr(self, f.name)) for f in dataclasses.fields(self))  # type: ignore[arg-type]

    @classmethod
    def addresses(cls) -> tuple[int, int]:
        """Return the addresses of the compiled `law` and `energy`."""
        return address(cls.law, contact_law_of(1)), address(cls.energy, CONTACT_ENERGY)

    def force(self, depth: float, speed: float, impact_speed: float = 0.0) -> float:
        """Return the force against the penetration, N; it pulls only with adhesion.

        Parameters
        ----------
        depth, speed : float
            δ, m, and δ̇, m/s.
        impact_speed : float
            δ̇ when this contact began, m/s.
        """
        if depth <= 0:
            return 0.0
        out = [0.0, 0.0]
        self.law(self.parameters(), depth, speed, impact_speed, out)
        force = out[0] * depth + out[1] * speed
        return force if self.adhesion else max(force, 0.0)
