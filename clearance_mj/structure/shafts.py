"""Several parallel shafts, joined by springs and by the rig's clearances."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Sequence
from typing import Annotated, Literal

import numpy as np
import scipy.linalg
from pydantic import Field

from ..core.checks import naming
from ..core.errors import RigError
from ..core.validation import NotNegative, Share, checked
from .base import SHAFT_NAME, Assembly, Point, Rows, Structure, in_other_plane, parse_direction, parse_place, register
from .shaft import Shaft

__all__ = ["Shafts", "Spring", "add_springs", "check_ends"]


@checked(RigError)
class Spring:
    """A spring and a damper in parallel between two shafts, or a shaft and the base."""

    position: Point
    """on one of the shafts, such as "inner@0.4" """
    stiffness: NotNegative
    """N/m; N m/rad between rotations"""
    to: Point | None = None
    """on another shaft; None: the base"""
    damping: NotNegative = 0.0
    """N s/m; N m s/rad between rotations"""

    @property
    def joined(self) -> tuple[float | str, ...]:
        """Points whose relative motion stretches it: ``position`` and, unless it is the base, ``to``."""
        return (self.position,) if self.to is None else (self.position, self.to)

    @property
    def in_other_plane(self) -> Spring:
        """The same spring between the points that `base.in_other_plane` names."""
        to = None if self.to is None else in_other_plane(self.to)
        return dataclasses.replace(self, position=in_other_plane(self.position), to=to)


def check_ends(name: str, spring: Spring, check: Callable[[float | str], None]) -> None:
    """Raise a ValueError for a spring to its own position, or with a point for which ``check`` raises one."""
    for field, point in zip(("position", "to"), spring.joined):
        with naming(f"{name}.{field}", ValueError, ValueError, "{} {}"):
            check(point)
    if spring.to == spring.position:
        raise ValueError(f"{name}.to is the spring's own position; give another point")


def add_springs(springs: Sequence[Spring], rows: Rows, stiffness: np.ndarray, viscous: np.ndarray) -> None:
    """Add springs and dampers to matrices, in place; ``rows`` are those of their points."""
    for spring in springs:
        ends = rows(spring.joined)
        stretch = ends[0] - ends[1:].sum(axis=0)
        stiffness += spring.stiffness * np.outer(stretch, stretch)
        viscous += spring.damping * np.outer(stretch, stretch)


@register
@checked(RigError)
class Shafts(Structure):
    """Parallel shafts that vibrate in one plane, each with a name; a point is such as "inner@0.4"."""

    parts: Annotated[tuple[Shaft, ...], Field(min_length=1)]
    """the shafts, with names and Rayleigh damping"""
    springs: tuple[Spring, ...] = ()
    """between them, or to the base"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K of the whole, in addition to that of the shafts"""
    damping_ratios: tuple[Share, ...] = ()
    """of the modes, in addition; the last one holds for all that follow"""
    kind: Literal["shafts"] = "shafts"
    """of structure"""

    def __post_init__(self) -> None:
        names = [part.name for part in self.parts]
        for i, part in enumerate(self.parts):
            if not re.fullmatch(SHAFT_NAME, part.name):
                raise ValueError(f'parts[{i}].name "{part.name}" must be letters, digits, spaces, _ and -')
            if part.name in names[:i]:
                raise ValueError(f'parts[{i}].name "{part.name}" is used twice; each shaft needs its own')
            if part.damping_ratios:
                raise ValueError(f"parts[{i}].damping_ratios: only the modes of the whole have them; give them there")
        for i, spring in enumerate(self.springs):
            check_ends(f"springs[{i}]", spring, self.check)

    @property
    def shafts(self) -> tuple[Shaft, ...]:
        """The shafts; see `Structure.shafts`."""
        return self.parts

    @property
    def in_other_plane(self) -> Shafts:
        """The shafts as they bend along y, with the same springs; see `Structure.in_other_plane`."""
        twisted = [any((parse_direction(p) or "Z")[0] == "RX" for p in spring.joined) for spring in self.springs]
        springs = tuple(spring.in_other_plane for spring, twists in zip(self.springs, twisted) if not twists)
        return dataclasses.replace(self, parts=tuple(part.in_other_plane for part in self.parts), springs=springs)

    @property
    def total_mass(self) -> float:
        """Mass in kg, with the discs."""
        return sum(part.total_mass for part in self.parts)

    def check(self, point: float | str) -> None:
        """Raise a ValueError for a point on none of the shafts; see `Structure.check`."""
        name, _ = parse_place(point) or ("", 0.0)
        for part in self.parts:
            if part.name == name:
                return part.check(point)
        names = ", ".join(f'"{part.name}@..."' for part in self.parts)
        shown = f'"{point}"' if isinstance(point, str) else f"{point:g} m"
        raise ValueError(f"{shown} is on none of the shafts: name one, {names}")

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return mass and stiffness of the shafts' beam elements and of the springs."""
        loads = [*points, *(point for spring in self.springs for point in spring.joined)]
        named = [(point, place[0]) for point in loads if (place := parse_place(point))]
        n_modes = modes + len(self.springs)  # a spring raises each frequency at most to the next one
        models = [part.assemble(tuple(p for p, name in named if name == part.name), n_modes) for part in self.parts]
        starts = np.cumsum([0, *(len(model.mass) for model in models)])

        def rows(at: Sequence[float | str]) -> np.ndarray:
            motions = np.zeros((len(at), starts[-1]))
            names = [(parse_place(point) or ("", 0.0))[0] for point in at]
            for part, model, start in zip(self.parts, models, starts):
                selected = [i for i, name in enumerate(names) if name == part.name]
                motions[selected, start : start + len(model.mass)] = model.rows([at[i] for i in selected])
            return motions

        stiffness = scipy.linalg.block_diag(*(model.stiffness for model in models))
        viscous = scipy.linalg.block_diag(*map(_part_damping, models))
        add_springs(self.springs, rows, stiffness, viscous)
        mass = scipy.linalg.block_diag(*(model.mass for model in models))
        influence = np.vstack([model.influence for model in models])
        rocking = np.concatenate([model.rocking for model in models if model.rocking is not None])
        damping = self.rayleigh, self.damping_ratios, viscous if viscous.any() else None
        return Assembly(mass, stiffness, influence, rows, *damping, rocking)


def _part_damping(model: Assembly) -> np.ndarray:
    """Return the damping (n, n) of a shaft: η1 M + η2 K, and its supports' dampers."""
    eta1, eta2 = model.rayleigh
    damping = eta1 * model.mass + eta2 * model.stiffness
    return damping if model.viscous is None else damping + model.viscous
