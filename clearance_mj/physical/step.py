"""The longest stable step of a model with stiff contacts and limits."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ..errors import ModelError
from .elements import KINDS, inverse_inertia
from .softness import stiffness_damping

__all__ = ["Stable", "hardest", "largest_step", "softness_of"]

_FAR = 1e3
"""m, distance up to which nearest points of geoms are looked for"""


class Stable(NamedTuple):
    """A longest stable step, and what makes it so short."""

    step: float  # s; infinite where nothing is stiff
    element: str
    pose: int  # index of the pose


class _Row(NamedTuple):
    """A direction in which a spring and a damper press."""

    element: str
    along: np.ndarray  # (nv,)
    k: float
    c: float


def largest_step(model: mujoco.MjModel, poses: ArrayLike | None = None) -> float:
    """Longest step, s, at which a model's contacts, limits and springs are stable.

    MuJoCo's integrators are explicit in them: h < 2/(δ + √(δ² + ω²)) with ω² the largest eigenvalue of M⁻¹K and 2δ that
    of M⁻¹C, of the mass matrix at each pose and all limits, springs and touching contacts at once; each other pair of
    geoms as if it touched too, where it is nearest. Limits and pairs whose solref is not in physical units count for
    nothing, since MuJoCo keeps those stable itself, nor do servos. Accuracy takes a tenth of this step or less.

    Parameters
    ----------
    model : mujoco.MjModel
        Not changed.
    poses : array_like, shape (n, nq) or (nq,), optional
        Without them the model's initial pose and its keyframes. At other poses the limit may be lower.

    Returns
    -------
    float
        Infinite for a model in which nothing is stiff.

    Raises
    ------
    ModelError
        For poses of another size than the model's.
    """
    return hardest(model, poses).step


def hardest(model: mujoco.MjModel, poses: ArrayLike | None = None) -> Stable:
    """Return the longest stable step with what makes it so short; see `largest_step`."""
    given = np.vstack((model.qpos0, model.key_qpos)) if poses is None else np.atleast_2d(np.asarray(poses, dtype=float))
    if given.shape[-1] != model.nq or given.ndim != 2 or not len(given):
        raise ModelError(f"poses of shape {given.shape}; the model's need {model.nq} numbers each")
    data, found = mujoco.MjData(model), Stable(np.inf, "nothing", 0)
    for i, pose in enumerate(given):
        data.qpos[:] = pose
        found = min(found, _at_pose(model, data, i), key=lambda stable: stable.step)
    return found


def softness_of(model: mujoco.MjModel, kind: str, index: int) -> tuple[float, float] | None:
    """Stiffness and damping of a contact or limit; None where its solver parameters are not physical units."""
    solref, solimp = (getattr(model, field)[index] for field in KINDS[kind].model)
    inverse = inverse_inertia(model, kind, index)
    if solref[0] >= 0 or solimp[0] != solimp[1] or inverse <= 0:
        return None
    k, c = stiffness_damping(solref, solimp[0], inverse)
    return float(k), float(c)


def _at_pose(model: mujoco.MjModel, data: mujoco.MjData, pose: int) -> Stable:
    mujoco.mj_fwdPosition(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    if not model.nv:
        return Stable(np.inf, "nothing", pose)
    root = np.linalg.inv(np.linalg.cholesky(mass))
    touching = {frozenset(c.geom.tolist()) for c in data.contact[: data.ncon] if c.dist <= 0}
    together = [*_joint_rows(model), *_tendon_rows(model, data)]
    alone: list[_Row] = []
    for geoms, row in _pair_rows(model, data):
        (together if geoms in touching else alone).append(row)
    springs = np.zeros((2, model.nv, model.nv))
    hardest_row = ("nothing", 0.0)
    for row in together:
        direction = root @ row.along
        springs += np.multiply.outer((row.k, row.c), np.outer(direction, direction))
        hardest_row = max(hardest_row, (row.element, row.k * direction @ direction), key=lambda named: named[1])
    found = Stable(_step(springs), hardest_row[0], pose)
    for row in alone:
        direction = root @ row.along
        step = _step(springs + np.multiply.outer((row.k, row.c), np.outer(direction, direction)))
        if step < found.step:
            found = Stable(step, row.element, pose)
    return found


def _step(springs: np.ndarray) -> float:
    omega2, twice_decay = (max(float(np.linalg.eigvalsh(matrix)[-1]), 0.0) for matrix in springs)
    rate = twice_decay / 2 + np.sqrt(twice_decay**2 / 4 + omega2)
    return 2 / rate if rate > 0 else np.inf


def _joint_rows(model: mujoco.MjModel) -> list[_Row]:
    rows, unit = [], np.eye(model.nv)
    widths = {mujoco.mjtJoint.mjJNT_FREE: 6, mujoco.mjtJoint.mjJNT_BALL: 3}
    for i in range(model.njnt):
        first, name = model.jnt_dofadr[i], f'joint "{model.joint(i).name}"'
        along = unit[first : first + widths.get(mujoco.mjtJoint(int(model.jnt_type[i])), 1)]
        soft = softness_of(model, "joint", i) if model.jnt_limited[i] else None
        rows += [_Row(name, row, *soft) for row in along if soft]
        rows += [_Row(name, row, model.jnt_stiffness[i], 0.0) for row in along if model.jnt_stiffness[i]]
    return rows


def _tendon_rows(model: mujoco.MjModel, data: mujoco.MjData) -> list[_Row]:
    rows = []
    for i in range(model.ntendon):
        name, along = f'tendon "{model.tendon(i).name}"', _lengthening(model, data, i)
        soft = softness_of(model, "tendon", i) if model.tendon_limited[i] else None
        rows += [_Row(name, row, *soft) for row in along if soft]
        rows += [_Row(name, row, model.tendon_stiffness[i], 0.0) for row in along if model.tendon_stiffness[i]]
    return rows


def _lengthening(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> np.ndarray:
    """(n, nv) direction in which a tendon lengthens; all three where two sites coincide."""
    first, count = model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon]
    row = np.zeros((1, model.nv))
    row[0, model.ten_J_colind[first : first + count]] = data.ten_J[first : first + count]
    if row.any() or model.tendon_num[tendon] != 2:
        return row
    ends = model.wrap_objid[model.tendon_adr[tendon] : model.tendon_adr[tendon] + 2]
    if np.any(model.wrap_type[model.tendon_adr[tendon] : model.tendon_adr[tendon] + 2] != mujoco.mjtWrap.mjWRAP_SITE):
        return row
    return _apart(model, data, model.site_bodyid[ends], data.site_xpos[ends])


def _pair_rows(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[frozenset[int], _Row]]:
    rows, ends = [], np.zeros(6)
    for i in range(model.npair):
        soft, geoms = softness_of(model, "pair", i), (int(model.pair_geom1[i]), int(model.pair_geom2[i]))
        if not soft:
            continue
        distance = mujoco.mj_geomDistance(model, data, *geoms, _FAR, ends)
        apart = _apart(model, data, model.geom_bodyid[list(geoms)], ends.reshape(2, 3))
        normal = ends[3:] - ends[:3]
        length = np.linalg.norm(normal)
        if abs(distance) < _FAR and length > 0:
            rows.append((frozenset(geoms), _Row(f'pair "{model.pair(i).name}"', normal / length @ apart, *soft)))
    return rows


def _apart(model: mujoco.MjModel, data: mujoco.MjData, bodies: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(3, nv) velocity of a point of the second body less that of one of the first, per coordinate's."""
    jacobians = np.zeros((2, 3, model.nv))
    for jacobian, body, point in zip(jacobians, bodies, points):
        mujoco.mj_jac(model, data, jacobian, None, point, body)
    return jacobians[1] - jacobians[0]
