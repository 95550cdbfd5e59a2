"""Base class of grease models, for engines, energy balances, identification and law files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, TypeAlias

from ..core.errors import LawError
from ..core.validation import Registered, register
from .contact import Numbers
from .pointers import FILLING_ENERGIES, address
from .registers import filling_law_of

__all__ = ["GREASES", "GreaseModel", "Vector", "register"]

Vector: TypeAlias = tuple[float, ...]

GREASES: dict[str, type[GreaseModel]] = {}
"""The grease models by their names in law files; a rig's, which needs no name, is Bouc-Wen's"""


class GreaseModel(Registered, ABC):
    """Grease in a bushing. Subclasses are fields of numbers and their functions, under `register`.

    ``law`` and ``energy`` are compiled, so they may call ``math``, numpy and other functions compiled by numba only.
    """

    known, refusal, called = GREASES, LawError, "grease"
    is_circulatory: ClassVar[bool] = False
    """True if its elastic force is due to the turning of the shaft, and stores no energy"""

    @abstractmethod
    def parameters(self) -> Sequence[float]:
        """Return the parameters p of `law` and `energy`."""

    def states(self, coordinates: int) -> int:
        """Return the number of state variables, initially 0.

        Parameters
        ----------
        coordinates : int
            Of the clearance, 1 or 2.
        """
        return coordinates

    @abstractmethod
    def small_motion(self) -> tuple[float, float]:
        """Return stiffness, N/m, and damping, N s/m, of small motions about the centre."""

    def is_linear(self) -> bool:
        """Return True if stiffness and damping are constant."""
        return False

    def largest(self) -> tuple[float, float]:
        """Return the largest stiffness, N/m, and damping, N s/m, that time steps must follow."""
        return self.small_motion()

    @staticmethod
    @abstractmethod
    def law(p: Sequence[float], state: Numbers, r: Vector, dr: Vector, spin: float, step: float, out: Numbers) -> None:
        """Advance the state by one step and write the force, elastic + damping times velocity.

        Vectors are tuples of one coordinate or two; `vectors` has functions for both.

        Parameters
        ----------
        p : sequence of float
            The model's `parameters`.
        state : sequence of float
            Before the step; changed in place.
        r, dr : tuple of float
            Displacement from the clearance's middle after the step, and its change, m: along it, or along y and z.
        spin : float
            Ω of the shaft, rad/s, > 0 from y to z.
        step : float
            Time of the step, s.
        out : sequence of float
            Filled with the elastic force, N, and the damping, N s/m: two numbers, or y, z, then yy, yz, zy, zz.
        """

    @staticmethod
    @abstractmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], r: Vector, dr: Vector, out: Numbers
    ) -> None:
        """Write the energy stored by the elastic force and its loss in a step, without that of the damping.

        Parameters
        ----------
        p : sequence of float
            The model's `parameters`.
        before, state : sequence of float
            Before and after the step.
        r, dr : tuple of float
            As in `law`.
        out : sequence of float
            Filled with the energies stored and lost, J.
        """

    def at_rest(self, offset: Vector) -> tuple[tuple[float, ...], float]:
        """Return force, N, and energy, J, of the springs of a shaft at rest off the clearance's middle.

        Parameters
        ----------
        offset : tuple of float
            m from the middle, one coordinate or two.
        """
        size = len(offset)
        p, states, zero = self.parameters(), [0.0] * self.states(size), (0.0,) * size
        force, energy = [0.0] * (size + size * size), [0.0, 0.0]
        if any(offset):
            self.law(p, list(states), offset, zero, 0.0, 1.0, force)
            self.energy(p, states, states, offset, zero, energy)
        return tuple(force[:size]), energy[0]

    def addresses(self, coordinates: int) -> tuple[int, int]:
        """Return the addresses of the compiled `law` and `energy`.

        Parameters
        ----------
        coordinates : int
            Of the clearance, 1 or 2.
        """
        model = type(self)
        energy = address(model.energy, FILLING_ENERGIES[coordinates])
        return address(model.law, filling_law_of(coordinates, 1)), energy
