"""The equilibrium of a MuJoCo model, and mass, damping and stiffness of small motions about it.

Forces are differentiated by centred differences in the tangent space of the joints. Equality constraints (closed loops)
hold: small motions are those that they allow, and their forces turn with the joints (Bathe, Finite Element Procedures,
2014, section 6.3, geometric stiffness). Contacts, joint limits and dry friction are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
import scipy.linalg

__all__ = ["Linearised", "linearised"]

DIFFERENCE = 1e-5  # rad, m and their rates: step of centred differences
FORCE_TOLERANCE = 1e-9  # of the largest force at a joint: what may be left of the forces' sum at equilibrium
SMALLEST_STEP = 1e-10  # rad or m, below which a step no longer moves the model
LARGEST_STEP = 0.3  # rad or m, of one step towards the equilibrium
MAX_STEPS = 300  # steps towards the equilibrium
UNSTABLE = 1e-7  # of the largest stiffness per mass: a negative one that rounding does not explain


@dataclass(frozen=True, eq=False)
class Linearised:
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
        moved, turned = np.zeros((2, 3, self.model.nv))
        site = kind == mujoco.mjtObj.mjOBJ_SITE
        (mujoco.mj_jacSite if site else mujoco.mj_jacBody)(self.model, self.data, moved, turned, number)
        return (turned if axis[0] == "R" else moved)["XYZ".index(axis[-1])] @ self.allowed

    def place(self, kind: mujoco.mjtObj, number: int) -> np.ndarray:
        """Return where a site or body is (3,), m."""
        return np.array((self.data.site_xpos if kind == mujoco.mjtObj.mjOBJ_SITE else self.data.xpos)[number])


def linearised(model: mujoco.MjModel, key: int = -1) -> Linearised:
    """Linearise a model about its equilibrium; a ValueError says what it lacks.

    Parameters
    ----------
    model : mujoco.MjModel
        Model that is linearised; its options are changed.
    key : int
        Keyframe from which the equilibrium is looked for; -1 for the initial position.
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
    state = _settle(model, data)
    squares, shapes = _modes(state)
    if squares[0] < -UNSTABLE * np.abs(squares).max():
        joint = _joint(model, int(np.argmax(np.abs(state.allowed @ shapes[:, 0]))))
        raise ValueError(f"the equilibrium is unstable, joint {joint} moves away; give a keyframe near the stable one")
    allowed = state.allowed
    damping, carried = _damping(model, data, allowed), allowed.T @ _carried(model, data)
    return Linearised(model, data, allowed, state.mass, state.stiffness, damping, carried)


class _State(NamedTuple):
    """What acts in a position, in the motions that the constraints allow."""

    force: np.ndarray  # (n,) on them
    size: float  # of the forces whose sum it is
    allowed: np.ndarray  # (nv, n)
    mass: np.ndarray  # (n, n)
    stiffness: np.ndarray  # (n, n)
    mend: np.ndarray  # (nv,) motion that takes the constraints' violation away


def _settle(model: mujoco.MjModel, data: mujoco.MjData) -> _State:
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
    joint = _joint(model, int(np.argmax(np.abs(state.allowed @ state.force))))
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
    held = np.linalg.lstsq(jacobian.T, -force)[0] if len(jacobian) else np.zeros(0)
    stiffness = np.zeros((model.nv, allowed.shape[1]))
    start = data.qpos.copy()
    for i, motion in enumerate(allowed.T):
        for sign in (1, -1):
            mujoco.mj_integratePos(model, data.qpos, motion, sign * DIFFERENCE)
            moved = _force(model, data)[0]
            if len(jacobian):
                moved = moved + data.efc_J.reshape(-1, model.nv)[: data.nefc][rows].T @ held
            stiffness[:, i] -= sign * moved / (2 * DIFFERENCE)
            data.qpos[:] = start
    _force(model, data)  # what else depends on the position, back again
    mass, stiffness = allowed.T @ mass @ allowed, allowed.T @ stiffness
    back = -np.linalg.lstsq(jacobian, violation)[0] if len(jacobian) else np.zeros(model.nv)
    return _State(allowed.T @ force, size, allowed, mass, (stiffness + stiffness.T) / 2, back)


def _force(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, float]:
    """Sum (nv,) of springs, actuators, gravity and motion, without constraints, and the size of its parts."""
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_fwdActuation(model, data)
    parts = np.array([data.qfrc_passive, data.qfrc_actuator, -data.qfrc_bias])
    return parts.sum(axis=0), float(np.abs(parts).max()) or 1.0


def _modes(state: _State) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness per mass, 1/s², from the lowest on, and motions of unit mass."""
    return scipy.linalg.eigh(state.stiffness, state.mass)


def _damping(model: mujoco.MjModel, data: mujoco.MjData, allowed: np.ndarray) -> np.ndarray:
    """Damping (n, n) of the motions that the constraints allow."""
    found = np.zeros((model.nv, allowed.shape[1]))
    for i, motion in enumerate(allowed.T):
        for sign in (1, -1):
            data.qvel[:] = sign * DIFFERENCE * motion
            found[:, i] -= sign * _force(model, data)[0] / (2 * DIFFERENCE)
    data.qvel[:] = 0.0
    _force(model, data)
    found = allowed.T @ found
    return (found + found.T) / 2


def _carried(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Σ m J of the bodies' centres of mass (nv, 3): armatures of joints are not carried by the base."""
    found, moved = np.zeros((model.nv, 3)), np.zeros((3, model.nv))
    for body in range(1, model.nbody):
        mujoco.mj_jacBodyCom(model, data, moved, None, body)
        found += model.body_mass[body] * moved.T
    return found


def _joint(model: mujoco.MjModel, dof: int) -> str:
    number = int(model.dof_jntid[dof])
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, number) or f"number {number}"
