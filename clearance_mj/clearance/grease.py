"""What a grease model is: one class, which runs on every engine, in energy balances, identification and law files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from ..core.errors import LawError
from ..core.validation import Registered, register
from .contact import Numbers
from .pointers import GREASE_ENERGY, GREASE_LAW, ROUND_ENERGY, ROUND_LAW, address

__all__ = ["GREASES", "GreaseModel", "register"]


GREASES: dict[str, type[GreaseModel]] = {}
"""The grease models by the name that law files give them; a rig's own, which needs none, is Bouc-Wen's"""


class GreaseModel(Registered, ABC):
    """Grease in a bushing. Subclasses are fields of numbers and their functions, under `register`.

    ``law`` and ``energy`` are compiled, so they may call ``math``, numpy and other functions compiled by numba only.
    """

    known, refusal, called = GREASES, LawError, "grease"
    turned: ClassVar[bool] = False
    """whether its elastic force is what the turning of the shaft does to it, which holds no energy"""

    @abstractmethod
    def parameters(self) -> Sequence[float]:
        """Return the numbers that `law` and `energy` get."""

    def states(self) -> int:
        """Return how many numbers remember the motion; all are 0 at first."""
        return 1

    @abstractmethod
    def small_motion(self) -> tuple[float, float]:
        """Return stiffness, N/m, and damping, N s/m, of small motions about the centre."""

    def is_linear(self) -> bool:
        """Return whether nothing but stiffness and damping of small motions ever acts."""
        return False

    def largest(self) -> tuple[float, float]:
        """Return the largest stiffness, N/m, and damping, N s/m, that time steps must follow."""
        return self.small_motion()

    @staticmethod
    @abstractmethod
    def law(p: Sequence[float], state: Numbers, x: float, dx: float, step: float, out: Numbers) -> None:
        """Advance the state by one step and find the force, elastic + damping ẋ.

        Parameters
        ----------
        p : sequence of float
            The model's `parameters`.
        state : sequence of float
            Before the step; changed in place.
        x, dx : float
            Displacement from the bushing's middle after the step, and its change, m.
        step : float
            Time that it took, s.
        out : sequence of float
            Filled with the elastic force, N, and the damping, N s/m.
        """

    @staticmethod
    @abstractmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], x: float, dx: float, out: Numbers
    ) -> None:
        """Find the energy that the elastic force holds, and what it lost in a step; the damping's is found elsewhere.

        Parameters
        ----------
        p : sequence of float
            The model's `parameters`.
        before, state : sequence of float
            Before and after the step.
        x, dx : float
            Displacement from the bushing's middle after the step, and its change, m.
        out : sequence of float
            Filled with the energies stored and lost, J.
        """

    def round_states(self) -> int:
        """Return how many numbers remember a motion along y and z; all are 0 at first."""
        raise self._one_direction()

    @staticmethod
    def round_law(
        p: Sequence[float], state: Numbers, y: float, z: float, dy: float, dz: float, spin: float, step: float,
        out: Numbers,
    ) -> None:  # fmt: skip
        """Advance a motion along y and z by one step and find the force, elastic + damping times velocity.

        On a line through the middle it is that of `law`.

        Parameters
        ----------
        p : sequence of float
            The model's `parameters`.
        state : sequence of float
            `round_states` numbers before the step; changed in place.
        y, z, dy, dz : float
            Displacement from the bushing's middle after the step, and its change, m.
        spin : float
            Ω of the shaft, rad/s, > 0 from y to z.
        step : float
            Time that it took, s.
        out : sequence of float
            Filled with the elastic force along y and z, N, and the damping, N s/m: yy, yz, zy, zz.
        """

    @staticmethod
    def round_energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], y: float, z: float, dy: float, dz: float,
        out: Numbers,
    ) -> None:  # fmt: skip
        """Find the energy that the elastic force of `round_law` holds, and what it lost in a step.

        Parameters
        ----------
        p, before, state, y, z, dy, dz
            As in `round_law`, the states before and after the step.
        out : sequence of float
            Filled with the energies stored and lost, J.
        """

    def round_addresses(self) -> tuple[int, int]:
        """Return the addresses of the compiled `round_law` and `round_energy`.

        Raises
        ------
        LawError
            If the model knows motion in one direction only.
        """
        kind = type(self)
        if kind.round_law is GreaseModel.round_law:
            raise self._one_direction()
        return address(kind.round_law, ROUND_LAW), address(kind.round_energy, ROUND_ENERGY)

    def _one_direction(self) -> LawError:
        return LawError(
            f'grease "{getattr(self, "name", type(self).__name__)}" knows motion in one direction only; '
            "for a spatial rig give it round_states, round_law and round_energy"
        )

    def at_rest(self, offset: float) -> tuple[float, float]:
        """Return force, N, and energy, J, of the springs of a shaft that has come to rest off the bushing's middle.

        Parameters
        ----------
        offset : float
            m from the middle.
        """
        p, states = self.parameters(), [0.0] * self.states()
        force, energy = [0.0, 0.0], [0.0, 0.0]
        if offset:
            self.law(p, list(states), offset, 0.0, 1.0, force)
            self.energy(p, states, states, offset, 0.0, energy)
        return force[0], energy[0]

    @classmethod
    def addresses(cls) -> tuple[int, int]:
        """Return the addresses of the compiled `law` and `energy`."""
        return address(cls.law, GREASE_LAW), address(cls.energy, GREASE_ENERGY)
