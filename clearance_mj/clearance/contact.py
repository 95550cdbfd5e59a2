"""What a contact model is: one class, which runs on every engine, in energy balances, identification and law files.

Every model is seen as the stiffness and damping that hold at this moment, f = k δ + c δ̇ with δ the penetration: that is
what makes it exact in an engine whose contacts are springs and dampers.
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

Numbers = MutableSequence[float]  # what compiled functions get: numbers by index


CONTACTS: dict[str, type[ContactModel]] = {}  # The contact models by the name that law files give them


class ContactModel(Registered, ABC):
    """A contact of shaft and bushing. Subclasses are fields of numbers and four functions, under `register`.

    ``law`` and ``energy`` are compiled, so they may call ``math``, numpy and other functions compiled by numba only.
    """

    known, refusal, called = CONTACTS, LawError, "contact"
    adhesion: bool = False
    """whether the force may pull"""

    @staticmethod
    @abstractmethod
    def law(p: Sequence[float], depth: float, speed: float, impact_speed: float, out: Numbers) -> None:
        """Find the stiffness and damping that hold at this moment.

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
        """Return what the contact's spring holds, J.

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
            m; contacts that harden are looked at at one gap of penetration.
        """

    def parameters(self) -> tuple[float, ...]:
        """Return the numbers that `law` and `energy` get: the fields, unless a subclass has others."""
        return tuple(float(getattr(self, f.name)) for f in dataclasses.fields(self))  # type: ignore[arg-type]

    @classmethod
    def addresses(cls) -> tuple[int, int]:
        """Return the addresses of the compiled `law` and `energy`."""
        return address(cls.law, contact_law_of(1)), address(cls.energy, CONTACT_ENERGY)

    def force(self, depth: float, speed: float, impact_speed: float = 0.0) -> float:
        """Return the force against the penetration, N; it pulls only where the model adheres.

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
