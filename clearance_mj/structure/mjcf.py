"""Structures that are MuJoCo models, linearised about their equilibrium.

Forces are differentiated by centred differences in the tangent space of the joints. Equality constraints (closed loops)
hold: small motions satisfy them, and their forces turn with the joints (Bathe, Finite Element Procedures,
2014, section 6.3, geometric stiffness). Contacts, joint limits and dry friction are left out.
"""

from __future__ import annotations

import difflib
import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal, NamedTuple

import mujoco
import numpy as np
import scipy.linalg
from pydantic import Field

from ..core.checks import naming
from ..core.errors import RigError
from ..core.validation import NotNegative, Share, Text, checked
from .base import AXES, Assembly, StructureOfFiles, parse_dof, register
from .files import FileName, absolute, content

__all__ = ["LinearisedModel", "Mjcf", "linearised"]

PLACE_KINDS = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_BODY
"""Objects that a place may name, in the order of the search."""


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
    """of the model, from which the search for the equilibrium starts, and whose controls act; None: initial position"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K, in addition"""
    damping_ratios: tuple[Share, ...] = ()
    """of the modes, in addition; the last one holds for all that follow"""
    sha256: Annotated[Text, Field(pattern="^[0-9a-f]{64}$")] | None = None
    """of the file's bytes; if it is given, a changed file raises an error"""
    kind: Literal["mjcf"] = "mjcf"
    """of structure"""
    files: ClassVar[tuple[str, ...]] = ("file",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "file", absolute(self.file))
        object.__setattr__(self, "sha256", content([self.file], self.sha256))
        _linearised(self)

    @property
    def total_mass(self) -> float:
        """Mass in kg of all bodies, fixed ones too."""
        return float(mujoco.mj_getTotalmass(_linearised(self).model))

    def check(self, point: float | str) -> None:
        """Raise a ValueError for a point that is no site or body, or cannot move; see `Structure.check`."""
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
        """Return names of the model's sites or bodies, without the world."""
        model = _linearised(self).model
        count = model.nsite if kind == mujoco.mjtObj.mjOBJ_SITE else model.nbody
        names = (mujoco.mj_id2name(model, kind, i) for i in range(count))
        return [name for name in names if name and name != "world"]

    def coordinates(self, point: float | str) -> np.ndarray:
        """Return the position of a site or body at equilibrium; see `Structure.coordinates`."""
        return _linearised(self).place(*self._find_place(point))

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return the matrices of small motions; see `Structure.assemble`."""
        system = _linearised(self)

        def rows(at: Sequence[float | str]) -> np.ndarray:
            return np.reshape([self._row(point) for point in at], (len(at), len(system.mass)))

        damping = self.rayleigh, self.damping_ratios, system.damping
        return Assembly(system.mass, system.stiffness, system.influence, rows, *damping)

    def _row(self, point: float | str) -> np.ndarray:
        """Return the displacement of a point along its direction, per coordinate."""
        if (dof := parse_dof(point)) is None:
            raise ValueError(f'"{point}" is no point of a MuJoCo model, such as "tip:+Z" (site or body, direction)')
        return dof[2] * _linearised(self).row(*self._find_place(point), dof[1])

    def _find_place(self, point: float | str) -> tuple[mujoco.mjtObj, int]:
        """Return kind and number of the site or body of a point."""
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
def _linearised(structure: Mjcf) -> LinearisedModel:
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


DIFFERENCE = 1e-5  # rad, m and their rates: step of centred differences
FORCE_TOLERANCE = 1e-9  # of the largest force at a joint: residual of the forces' sum at equilibrium
SMALLEST_STEP = 1e-10  # rad or m, below which a step no longer moves the model
LARGEST_STEP = 0.3  # rad or m, of one step towards the equilibrium
MAX_STEPS = 300  # steps towards the equilibrium
UNSTABLE = 1e-7  # of the largest stiffness per mass: negative ones below it are within rounding


@dataclass(frozen=True, eq=False)
class LinearisedModel:
    """A model at equilibrium, in coordinates y of small motions: joints move by ``allowed`` y."""

    model: mujoco.MjModel
    """the model, without contacts, limits and dry friction"""
    data: mujoco.MjData
    """at equilibrium"""
    allowed: np.ndarray
    """(nv, n) motions of the joints that equality constraints allow, orthonormal; the unit matrix without them"""
    mass: np.ndarray
    """(n, n)"""
    stiffness: np.ndarray
    """(n, n)"""
    damping: np.ndarray
    """(n, n)"""
    influence: np.ndarray
    """(n, 3) inertia forces per unit acceleration of the base along X, Y and Z"""

    def row(self, kind: mujoco.mjtObj, number: int, axis: str) -> np.ndarray:
        """Return the displacement (n,) of a site or body along X, Y or Z, or its rotation about it, per coordinate."""
        translation, rotation = np.zeros((2, 3, self.model.nv))
        site = kind == mujoco.mjtObj.mjOBJ_SITE
        (mujoco.mj_jacSite if site else mujoco.mj_jacBody)(self.model, self.data, translation, rotation, number)
        return (rotation if axis[0] == "R" else translation)["XYZ".index(axis[-1])] @ self.allowed

    def place(self, kind: mujoco.mjtObj, number: int) -> np.ndarray:
        """Return the position (3,) of a site or body, m."""
        return np.array((self.data.site_xpos if kind == mujoco.mjtObj.mjOBJ_SITE else self.data.xpos)[number])


def linearised(model: mujoco.MjModel, key: int = -1) -> LinearisedModel:
    """Linearise a model about its equilibrium; a ValueError says why it cannot be.

    Parameters
    ----------
    model : mujoco.MjModel
        Model that is linearised; its options are changed.
    key : int
        Keyframe from which the search for the equilibrium starts; -1 for the initial position.
    """
    if not model.nv:
        raise ValueError("the model has no joints, so nothing moves")
    bits = mujoco.mjtDisableBit
    model.opt.disableflags |= bits.mjDSBL_CONTACT | bits.mjDSBL_LIMIT | bits.mjDSBL_FRICTIONLOSS
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(model)
    if key >= 0:
        mujoco.mj_resetDataKeyframe(model, data, key)
    data.qvel[:] = 0.0
    state = _find_equilibrium(model, data)
    squares, shapes = _modes(state)
    if squares[0] < -UNSTABLE * np.abs(squares).max():
        joint = _joint_name(model, int(np.argmax(np.abs(state.allowed @ shapes[:, 0]))))
        raise ValueError(f"the equilibrium is unstable, joint {joint} moves away; give a keyframe near the stable one")
    allowed = state.allowed
    damping, influence = _damping(model, data, allowed), allowed.T @ _base_inertia(model, data)
    return LinearisedModel(model, data, allowed, state.mass, state.stiffness, damping, influence)


class _State(NamedTuple):
    """Forces, mass and stiffness at a position, projected on the motions that the constraints allow."""

    force: np.ndarray  # (n,) sum on these motions
    size: float  # largest of the summed forces
    allowed: np.ndarray  # (nv, n)
    mass: np.ndarray  # (n, n)
    stiffness: np.ndarray  # (n, n)
    mend: np.ndarray  # (nv,) motion that removes the constraints' violation


def _find_equilibrium(model: mujoco.MjModel, data: mujoco.MjData) -> _State:
    """Move the data to the equilibrium, down the potential energy (Newton's method with |stiffness|)."""
    for _ in range(MAX_STEPS):
        state = _state(model, data)
        squares, shapes = _modes(state)
        floor = 1e-12 * np.abs(squares).max() or 1.0
        step = state.allowed @ (shapes @ (shapes.T @ state.force / np.maximum(np.abs(squares), floor)))
        balanced = np.abs(state.force).max() <= FORCE_TOLERANCE * state.size or np.abs(step).max() < SMALLEST_STEP
        if balanced and np.abs(state.mend).max() < SMALLEST_STEP:
            return state
        step += state.mend
        step *= LARGEST_STEP / max(LARGEST_STEP, np.abs(step).max())
        mujoco.mj_integratePos(model, data.qpos, step, 1.0)
    joint = _joint_name(model, int(np.argmax(np.abs(state.allowed @ state.force))))
    raise ValueError(
        f"no equilibrium is found: forces stay unbalanced at joint {joint}; hold it by a spring or an actuator, or "
        "give a keyframe near the equilibrium"
    )


def _state(model: mujoco.MjModel, data: mujoco.MjData) -> _State:
    force, size = _force(model, data)
    rows = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    jacobian = data.efc_J.reshape(-1, model.nv)[: data.nefc][rows].copy()
    violation = data.efc_pos[: data.nefc][rows].copy()
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    allowed = scipy.linalg.null_space(jacobian) if len(jacobian) else np.eye(model.nv)
    multipliers = np.linalg.lstsq(jacobian.T, -force)[0] if len(jacobian) else np.zeros(0)
    stiffness = np.zeros((model.nv, allowed.shape[1]))
    start = data.qpos.copy()
    for i, motion in enumerate(allowed.T):
        for sign in (1, -1):
            mujoco.mj_integratePos(model, data.qpos, motion, sign * DIFFERENCE)
            force_moved = _force(model, data)[0]
            if len(jacobian):
                force_moved = force_moved + data.efc_J.reshape(-1, model.nv)[: data.nefc][rows].T @ multipliers
            stiffness[:, i] -= sign * force_moved / (2 * DIFFERENCE)
            data.qpos[:] = start
    _force(model, data)  # restores the other fields that depend on the position
    mass, stiffness = allowed.T @ mass @ allowed, allowed.T @ stiffness
    correction = -np.linalg.lstsq(jacobian, violation)[0] if len(jacobian) else np.zeros(model.nv)
    return _State(allowed.T @ force, size, allowed, mass, (stiffness + stiffness.T) / 2, correction)


def _force(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, float]:
    """Return the sum (nv,) of springs, actuators, gravity and motion, without constraints, and its largest part."""
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_fwdActuation(model, data)
    parts = np.array([data.qfrc_passive, data.qfrc_actuator, -data.qfrc_bias])
    return parts.sum(axis=0), float(np.abs(parts).max()) or 1.0


def _modes(state: _State) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness per mass, 1/s², in ascending order, and motions of unit mass."""
    return scipy.linalg.eigh(state.stiffness, state.mass)


def _damping(model: mujoco.MjModel, data: mujoco.MjData, allowed: np.ndarray) -> np.ndarray:
    """Return the damping (n, n) of the motions that the constraints allow."""
    damping = np.zeros((model.nv, allowed.shape[1]))
    for i, motion in enumerate(allowed.T):
        for sign in (1, -1):
            data.qvel[:] = sign * DIFFERENCE * motion
            damping[:, i] -= sign * _force(model, data)[0] / (2 * DIFFERENCE)
    data.qvel[:] = 0.0
    _force(model, data)
    damping = allowed.T @ damping
    return (damping + damping.T) / 2


def _base_inertia(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Return Σ m J of the bodies' centres of mass (nv, 3): armatures of joints are not carried by the base."""
    influence, jacobian = np.zeros((model.nv, 3)), np.zeros((3, model.nv))
    for body in range(1, model.nbody):
        mujoco.mj_jacBodyCom(model, data, jacobian, None, body)
        influence += model.body_mass[body] * jacobian.T
    return influence


def _joint_name(model: mujoco.MjModel, dof: int) -> str:
    number = int(model.dof_jntid[dof])
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, number) or f"number {number}"
