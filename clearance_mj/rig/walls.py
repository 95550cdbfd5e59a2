"""Walls of clearances: one class for each, which runs on every engine and along given motions."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping, MutableSequence, Sequence
from importlib import import_module
from typing import Any, ClassVar

from ..core.errors import RigError
from ..core.validation import Registered, register

__all__ = ["WALLS", "Wall", "coordinates_of", "register", "wall_of"]

WALLS: dict[str, type[Wall]] = {}
"""The walls by the shape that rig files give them"""
COORDINATES = {"slot": 1, "stop": 1, "round": 2}  # of the usual ones, which need not be imported to be known


def wall_of(shape: str, numbers: Mapping[str, Any]) -> Wall:
    """Return the wall of a shape, with its numbers other than the gap.

    Parameters
    ----------
    shape : str
        As rig files give it.
    numbers : mapping of str to number
        The wall's fields.

    Raises
    ------
    RigError
        If the shape is unknown, or a number is.
    """
    return _wall_class(shape)(**numbers)


def coordinates_of(shape: str) -> int:
    """Return the number of coordinates of a clearance with a wall of a shape.

    Parameters
    ----------
    shape : str
        As rig files give it.

    Raises
    ------
    RigError
        If the shape is unknown.
    """
    return COORDINATES.get(shape) or _wall_class(shape).coordinates


def _wall_class(shape: str) -> type[Wall]:
    import_module("clearance_mj.clearance.walls")  # compiled laws, which a rig is read without
    if shape not in WALLS:
        raise RigError(f'shape "{shape}" is unknown; known: {", ".join(WALLS)}')
    return WALLS[shape]


class Wall(Registered, ABC):
    """The wall of a clearance. Subclasses have fields of numbers other than the gap, and `law`, under `register`.

    ``law`` is compiled, so it may call ``math``, numpy and other functions compiled by numba only.
    """

    known, refusal, called = WALLS, RigError, 'shape "{name}"'
    coordinates: ClassVar[int] = 2
    """of the clearance: 1 of walls across one direction, 2 of one in the y-z plane"""

    @staticmethod
    @abstractmethod
    def law(p: Sequence[float], r: tuple[float, float], out: MutableSequence[float]) -> None:
        """Find how deep a point is in the wall, and in which direction.

        Parameters
        ----------
        p : sequence of float
            The wall's `parameters`.
        r : tuple of float
            y and z from the clearance's middle, m; of a wall of one coordinate that coordinate stands in the place of
            z, and what slides along the wall in that of y.
        out : sequence of float
            Filled with the depth, m, the distance to the nearest point of the wall, below 0 in the gap; and the unit
            vector along y and z in which it grows.
        """

    @abstractmethod
    def reach(self, gap: float) -> float:
        """Return the distance from the middle, m, within which nothing touches.

        Parameters
        ----------
        gap : float
            Radial clearance, m.
        """

    def parameters(self, gap: float) -> tuple[float, ...]:
        """Return the numbers that `law` gets: the gap, then the fields, unless a subclass has others.

        Parameters
        ----------
        gap : float
            Radial clearance, m.
        """
        return gap, *(float(getattr(self, f.name)) for f in dataclasses.fields(self))  # type: ignore[arg-type]
