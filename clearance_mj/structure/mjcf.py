"""Structures that are MuJoCo models, linearised about their equilibrium."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import mujoco
import numpy as np
from pydantic import Field

from ..core.checks import naming
from ..core.errors import RigError
from ..core.validation import NotNegative, Share, Text, checked
from .base import AXES, Assembly, StructureOfFiles, parse_dof, register
from .files import FileName, absolute, content
from .linearise import Linearised, linearised

__all__ = ["Mjcf"]

PLACE_KINDS = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_BODY
"""Objects that a place may name, in the order in which a name is looked for."""


@register
@checked(RigError, eq=False)
class Mjcf(StructureOfFiles):
    """A MuJoCo model, linearised about its equilibrium: M, C and K of small motions of its joints.

    Points are sites or bodies by name, such as "tip:+Z", in the world's directions. Springs, tendons, gravity, fluid,
    actuators at their control, and equality constraints count; contacts, joint limits and dry friction do not, for the
    rig's own clearances stand for them. Two are equal if the files' contents are.
    """

    file: FileName
    """MJCF (.xml), or a compiled model (.mjb)"""
    keyframe: Text | None = None
    """of the model, from which the equilibrium is looked for, and whose controls act; None: the initial position"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K, in addition"""
    damping_ratios: tuple[Share, ...] = ()
    """of the modes, in addition; the last one holds for all that follow"""
    sha256: Annotated[Text, Field(pattern="^[0-9a-f]{64}$")] | None = None
    """of the file's bytes; if it is given, a changed file is refused"""
    kind: Literal["mjcf"] = "mjcf"
    """of structure"""
    files: ClassVar[tuple[str, ...]] = ("file",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "file", absolute(self.file))
        object.__setattr__(self, "sha256", content([self.file], self.sha256))
        _linearised(self)

    @property
    def total_mass(self) -> float:
        """Mass in kg of all bodies that can move or not."""
        return float(mujoco.mj_getTotalmass(_linearised(self).model))

    def check(self, point: float | str) -> None:
        """Refuse what is no site or body, or cannot move; see `Structure.check`."""
        row = self._row(point)
        if not np.isfinite(row).all():
            raise ValueError(f'"{point}" is at no finite position')
        if not row.any():
            raise ValueError(f'"{point}" cannot move; a clearance to the base has no "to"')

    @property
    def named_points(self) -> tuple[str, ...]:
        """Degrees of freedom of sites and bodies that can move; see `Structure.named_points`."""
        names = dict.fromkeys(name for kind in PLACE_KINDS for name in self._names(kind) if parse_dof(f"{name}:X"))
        points = (f"{name}:{axis}" for name in names for axis in AXES)
        return tuple(point for point in points if self._row(point).any())

    def _names(self, kind: mujoco.mjtObj) -> list[str]:
        """Names of the model's sites or bodies, the world's apart."""
        model = _linearised(self).model
        count = model.nsite if kind == mujoco.mjtObj.mjOBJ_SITE else model.nbody
        names = (mujoco.mj_id2name(model, kind, i) for i in range(count))
        return [name for name in names if name and name != "world"]

    def coordinates(self, point: float | str) -> np.ndarray:
        """Return where a site or body is at equilibrium; see `Structure.coordinates`."""
        return _linearised(self).place(*self._named(point))

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return the matrices of small motions; see `Structure.assemble`."""
        found = _linearised(self)

        def rows(at: Sequence[float | str]) -> np.ndarray:
            return np.reshape([self._row(point) for point in at], (len(at), len(found.mass)))

        return Assembly(
            found.mass, found.stiffness, found.influence, rows, self.rayleigh, self.damping_ratios, found.damping
        )

    def _row(self, point: float | str) -> np.ndarray:
        """Displacement of a point along its direction, per coordinate."""
        if (dof := parse_dof(point)) is None:
            raise ValueError(f'"{point}" is no point of a MuJoCo model, such as "tip:+Z" (site or body, direction)')
        return dof[2] * _linearised(self).row(*self._named(point), dof[1])

    def _named(self, point: float | str) -> tuple[mujoco.mjtObj, int]:
        """Kind and number of the site or body of a point."""
        dof, model = parse_dof(point), _linearised(self).model
        name = str(dof[0]) if dof else ""
        for kind in PLACE_KINDS:
            if (number := mujoco.mj_name2id(model, kind, name)) >= 0:
                return kind, number
        near = difflib.get_close_matches(name, [known for kind in PLACE_KINDS for known in self._names(kind)], 3, 0.0)
        raise ValueError(
            f'"{point}" is at no site or body of {Path(self.file).name}; '
            + (f"the nearest names are {', '.join(near)}" if near else "name one in the model")
        )


@functools.lru_cache(maxsize=32)
def _linearised(structure: Mjcf) -> Linearised:
    name = structure.file
    content([name], structure.sha256)
    try:
        binary = name.endswith(".mjb")
        model = mujoco.MjModel.from_binary_path(name) if binary else mujoco.MjModel.from_xml_path(name)
    except ValueError as error:
        raise ValueError(f"file {name}: {' '.join(str(error).split())}") from None
    key = -1
    if structure.keyframe is not None:
        key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, structure.keyframe)
        if key < 0:
            known = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, i) for i in range(model.nkey)]
            has = f"it has {', '.join(filter(None, known))}" if any(known) else "it has none with a name"
            raise ValueError(f'keyframe "{structure.keyframe}" is none of {name}; {has}')
    with naming(f"file {name}", ValueError):
        return linearised(model, key)
