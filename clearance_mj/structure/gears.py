"""Torsional systems with gears: inertias about their axes, joined by torsion shafts and by meshes.

Each angle counts in the sense in which the drive turns its inertia, so that meshing gears, external or internal, all
turn forwards. "3:RX" is the angle of inertia 3, rad, and "3:X" the motion of its base circle along the line of action,
base radius times angle, m: the teeth of gears 1 and 2 move relative to each other by "1:X" less "2:X", whatever idlers
lie before them. Angles are those beyond steady turning.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..core.errors import RigError
from ..core.validation import NotNegative, Positive, Text, Whole, checked
from .base import Assembly, Structure, parse_dof, register
from .shafts import Spring, add_springs, check_ends

__all__ = ["Gears", "Inertia"]


@checked(RigError)
class Inertia:
    """A rotating inertia about one axis: a gear with the parts fixed to it, or a clutch disc, a flywheel, a car."""

    node: Annotated[Whole, Field(ge=1, le=999_999_999)]
    """its number in names of points, such as 3 in "3:RX" and "3:X" """
    polar_inertia: Positive
    """kg m², about its axis"""
    base_radius: Positive | None = None
    """m, of a gear: the pitch radius times the cosine of the pressure angle; None without teeth"""
    drag: NotNegative = 0.0
    """N m s/rad, viscous, to the housing, for motion beyond steady turning; the mean drag torque is a load"""
    name: Text = ""
    """for people"""


@register
@checked(RigError)
class Gears(Structure):
    """Rotating inertias, joined by shafts and meshes without backlash; meshes with backlash are the rig's clearances.

    A torque is a load, order or force at "1:RX"; a mesh is a clearance at "1:X" to "2:X" whose gap is half the backlash
    along the line of action.
    """

    inertias: Annotated[tuple[Inertia, ...], Field(min_length=1)]
    """rotating inertias"""
    springs: tuple[Spring, ...] = ()
    """torsion shafts, between two angles such as "1:RX" and "2:RX" or to the housing, N m/rad and N m s/rad; meshes
    that never open, between "1:X" and "2:X", N/m and N s/m"""
    kind: Literal["gears"] = "gears"
    """of structure"""
    is_torsional: ClassVar[bool] = True

    def __post_init__(self) -> None:
        nodes = [each.node for each in self.inertias]
        for i, node in enumerate(nodes):
            if node in nodes[:i]:
                raise ValueError(f"inertias[{i}].node {node} is used twice; each inertia needs its own")
        for i, spring in enumerate(self.springs):
            check_ends(f"springs[{i}]", spring, self.check)
            if len({str(point)[-2:] == "RX" for point in spring.joined}) > 1:
                raise ValueError(
                    f'springs[{i}].to "{spring.to}" and position "{spring.position}": one is an angle, one a length; '
                    "give two alike"
                )

    @property
    def named_points(self) -> tuple[str, ...]:
        """Angles, and motions of base circles; see `Structure.named_points`."""
        return tuple(f"{g.node}:{axis}" for g in self.inertias for axis in (("RX", "X") if g.base_radius else ("RX",)))

    def check(self, point: float | str) -> None:
        """Raise a ValueError for other points than angles and base circles; see `Structure.check`."""
        self._inertia_and_lever(point)

    def refusal(self, kind: str) -> str:
        """Return that a base moves no gears; see `Structure.refusal`."""
        if kind == "force":
            return ""
        return f'a base moves no gears; drive them by a force, kind = "force" and position = "{self.named_points[0]}"'

    def _inertia_and_lever(self, point: float | str) -> tuple[int, float]:
        """Return the index of a point's inertia, from 0, and the point's motion per rad."""
        dof = parse_dof(point)
        if dof is None or dof[1] not in ("X", "RX"):
            raise ValueError(
                f'"{point}" is no motion of gears: "{self.inertias[0].node}:RX" is the angle of an inertia, '
                f'"{self.inertias[0].node}:X" the way of its base circle'
            )
        node, axis, sign = dof
        for i, inertia in enumerate(self.inertias):
            if inertia.node == node and axis == "RX":
                return i, sign
            if inertia.node == node and inertia.base_radius is None:
                raise ValueError(f'"{point}" needs inertias[{i}].base_radius, m, of a gear with teeth')
            if inertia.node == node:
                return i, sign * (inertia.base_radius or 0.0)
        raise ValueError(f'"{point}" is of no inertia; the nodes are {", ".join(str(g.node) for g in self.inertias)}')

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return inertias, and stiffness and damping of springs and drag; the base moves none of the angles."""
        n = len(self.inertias)

        def rows(at: Sequence[float | str]) -> np.ndarray:
            motion = np.zeros((len(at), n))
            for row, point in zip(motion, at):
                i, row[i] = self._inertia_and_lever(point)
            return motion

        stiffness, viscous = np.zeros((n, n)), np.diag([each.drag for each in self.inertias])
        add_springs(self.springs, rows, stiffness, viscous)
        mass = np.diag([each.polar_inertia for each in self.inertias])
        return Assembly(mass, stiffness, np.zeros((n, 3)), rows, viscous=viscous if viscous.any() else None)
