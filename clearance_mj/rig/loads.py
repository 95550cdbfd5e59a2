"""Constant loads and orders of the spin, which act on a structure in addition to its shakers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, TypeAlias

import numpy as np
from pydantic import Field

from ..core.errors import RigError
from ..core.validation import Number, Text, checked, seldom
from ..structure import Point
from ..structure.base import AXES, is_rotation, parse_direction, parse_dof, parse_place
from .instruments import Direction, Shaker

__all__ = ["Load", "Order", "check_points", "forced_points", "load_force", "order_forces"]

UP = (0.0, 0.0, 1.0)
Directed: TypeAlias = Callable[[Sequence[float | str], np.ndarray], np.ndarray]
"""Displacement (n_points, n) of points along directions per coordinate"""


@checked(RigError)
class Load:
    """A force or a torque that never changes, such as a belt's tension or the torque that a gear transmits."""

    position: Point
    """m along the shaft, or a degree of freedom such as "12:+Z" """
    name: Text = seldom(default="")
    """for people, and in messages"""
    force: Number | Direction | None = None
    """N: a number along the point's own direction, which is z on a shaft, or (x, y, z)"""
    torque: Number | None = None
    """N m, about the shaft's axis at the point, or about the rotation that the position names"""

    def __post_init__(self) -> None:
        _check_one(self.force, self.torque)
        if isinstance(self.force, tuple) and parse_direction(self.position) and not parse_dof(self.position):
            raise ValueError(f'force (x, y, z) stands beside the direction of "{self.position}"; give a number')

    @property
    def points(self) -> tuple[float | str, ...]:
        """Points of action: its position, the degrees of freedom along its vector, or the rotation that it turns."""
        if self.torque is not None:
            return (rotation(self.position),)
        dof = parse_dof(self.position)
        if not dof or not isinstance(self.force, tuple):
            return (self.position,)
        return tuple(f"{dof[0]}:{axis}" for axis, part in zip(AXES, self.force) if part)

    def on(self, directed: Directed) -> np.ndarray:
        """Return the force (n,) on coordinates.

        Parameters
        ----------
        directed : callable
            As of `load_force`.
        """
        along, amounts = UP, [self.force if self.torque is None else self.torque]
        if isinstance(self.force, tuple):
            along = self.force
            amounts = [part for part in along if part] if parse_dof(self.position) else [1.0]
        return np.asarray(np.array(amounts) @ directed(self.points, np.array(along)))


@checked(RigError)
class Order:
    """A force or torque that comes a number of times in each turn of the shaft, whose angle is φ, with order k.

    A force turns: F cos(k φ + phase) along y and F sin(k φ + phase) along z. A torque pulsates: T cos(k φ + phase).
    """

    position: Point
    """m along the shaft, or a degree of freedom across it such as "12:+Z" """
    order: Number
    """k, times in each turn: 2 of a joint or a misaligned coupling, the number of teeth or blades, or a fraction; 1 of
    a bent shaft, the force that would bend a straight one like it; < 0 of a force that turns against the shaft"""
    force: Annotated[Number, Field(gt=0)] | None = None
    """N"""
    torque: Annotated[Number, Field(gt=0)] | None = None
    """N m, about the shaft's axis"""
    phase: Number = seldom(default=0.0)
    """rad, at the shaft's angle 0"""

    def __post_init__(self) -> None:
        _check_one(self.force, self.torque)
        if not self.order:
            raise ValueError("order 0 does not turn; give a constant force as one of loads")

    @property
    def points(self) -> tuple[float | str, ...]:
        """Points of action."""
        if self.torque is not None:
            return (rotation(self.position),)
        dof = parse_dof(self.position)
        return tuple(f"{dof[0]}:{axis}" for axis in "YZ") if dof else (self.position, self.position)


def _check_one(force: float | Direction | None, torque: float | None) -> None:
    if (force is None) == (torque is None):
        raise ValueError(f"{'torque stands beside force' if force is not None else 'force is missing'}; give one")
    if not np.any(force if torque is None else torque):
        raise ValueError(f"{'force' if torque is None else 'torque'} must not be zero")


def rotation(position: float | str) -> str:
    """Return the rotation about the shaft's axis at a point, or the rotation that the point names."""
    if is_rotation(position):
        return str(position)
    dof, (name, x) = parse_dof(position), parse_place(position) or ("", 0.0)
    return f"{dof[0]}:RX" if dof else f"{name}@{x!r}:RX"


def check_points(kind: str, acting: Sequence[Load | Order], check: Callable[[str, float | str], None]) -> None:
    """Check every point at which loads or orders act; ``check`` takes its path in the rig file, and the point."""
    for i, item in enumerate(acting):
        for point in item.points:
            check(f"{kind}[{i}].{'force' if item.torque is None else 'torque'}", point)


def forced_points(inputs: Sequence[Shaker], loads: Sequence[Load]) -> list[tuple[float | str, float]]:
    """Return points and factors of forces outside of clearances, at which a basis of modes has static shapes."""
    shaken = [force for shaker in inputs if shaker.kind == "force" for force in shaker.forces]
    return shaken + [(point, 1.0) for load in loads for point in load.points]


def load_force(name: str, loads: Sequence[Load], directed: Directed, size: int) -> np.ndarray:
    """Return the constant force (n,) of loads on coordinates.

    Parameters
    ----------
    name : str
        Name of the rig.
    loads : sequence of Load
        Its loads.
    directed : callable
        Returns how points move in directions per coordinate, (n_points, n).
    size : int
        Number of coordinates, n.

    Raises
    ------
    RigError
        If nothing carries a load: it moves no coordinate.
    """
    total = np.zeros(size)
    for i, load in enumerate(loads):
        force = load.on(directed)
        if not force.any():
            label = f" {load.name!r}" if load.name else ""
            raise RigError(
                f"rig {name!r}: loads[{i}]{label} is carried by nothing: it moves no coordinate of the structure; "
                "give a direction in which its point can move"
            )
        total += force
    return total


def order_forces(orders: Sequence[Order], directed: Directed, size: int) -> np.ndarray:
    """Return the forces (2 n_orders, n) of orders on coordinates, of each per cos k φ and sin k φ.

    Parameters
    ----------
    orders : sequence of Order
        The orders.
    directed, size
        As of `load_force`.
    """
    forces = np.zeros((2 * len(orders), size))
    for i, item in enumerate(orders):
        cos, sin, rows = np.cos(item.phase), np.sin(item.phase), directed(item.points, np.eye(3)[-len(item.points) :])
        y, z = (item.force or item.torque or 0.0) * np.vstack((rows, np.zeros(size)))[:2]
        forces[2 * i], forces[2 * i + 1] = cos * y + sin * z, cos * z - sin * y
    return forces
