"""The longest stable step of a model with stiff contacts, limits, springs and servos."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ModelError
from .elements import KINDS, find, inverse_inertia
from .friction import frictions
from .softness import stiffness_damping

__all__ = ["Stable", "hardest", "largest_step", "slow", "softness_of"]

_FAR = 1e3
"""m, distance up to which nearest points of geoms are looked for"""
_RIGID = 1e6
"""Share of the inertia behind a row from which on its parasitic mass makes no difference"""
_LONG = 1.0
"""s, longest step that is looked at"""
_Bits, _Constraint, _Integrator = mujoco.mjtDisableBit, mujoco.mjtConstraint, mujoco.mjtIntegrator
_Mask: TypeAlias = dict[str, np.ndarray]


class Stable(NamedTuple):
    """A longest stable step, and what makes it so short."""

    step: float  # s; infinite where nothing is stiff
    element: str
    pose: int  # index of the pose


class _Row(NamedTuple):
    """A direction in which a spring and a damper press, with a force k r + c ṙ - μ a."""

    element: str
    along: np.ndarray  # (nv,)
    k: float
    c: float
    mass: float = 0.0  # μ, the parasitic one of MuJoCo's constraints
    kind: str = "constraint"  # or of a damper that integrators may take implicitly: "joint", "force"


class _Pose(NamedTuple):
    """What presses in a pose."""

    number: int
    mass: np.ndarray  # (nv, nv)
    inverse: np.ndarray  # (nv, nv)
    together: list[_Row]  # at once
    alone: list[_Row]  # each beside those


def largest_step(model: mujoco.MjModel, poses: ArrayLike | None = None) -> float:
    """Longest step, s, at which a model's contacts, limits, springs and servos are stable.

    The semi-implicit step of a spring and damper is stable below h = 2/(δ + √(δ² + ω²)); for all together, with an
    implicit damping D and an explicit C, below the h at which 4M + h (2D - 2C) - h² K is singular, M the mass matrix of
    a pose. Joint dampers are implicit in Euler; those of tendons and servos too in implicit and implicitfast, where
    they fit into the pattern of M; constraints in none. RK4 has its own limit, discrete none.

    Counted at once are all limits, springs, dampers, bristles and servos (actuators with an affine bias, the gains of
    others at the end of their ctrlrange) and all contacts that touch; each other pair of geoms as if it touched too,
    where it is nearest. Not counted are constraints whose solref is a time constant, since MuJoCo keeps those stable
    itself (unless flag refsafe is disabled: then they count), geoms without a pair that do not touch in the pose,
    MuJoCo's own friction, muscles, DC motors, activations, delays, flexes, fluids and what callbacks do; of polynomial
    springs and dampers the linear coefficient counts. Accuracy takes a tenth of this step or less.

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
    found = Stable(np.inf, "nothing", 0)
    if model.opt.integrator == _Integrator.mjINT_DISCRETE:
        return found
    implicit, runge_kutta = _implicit(model), model.opt.integrator == _Integrator.mjINT_RK4
    limit = _runge_kutta if runge_kutta else _semi_implicit
    for pose in _poses(model, poses):
        rates = {row.element: _rate(row, pose, implicit) for row in pose.together}
        step = limit(pose, pose.together, implicit)
        worst = max(rates, key=lambda element: rates[element], default="nothing")
        found = min(found, Stable(step, worst, pose.number), key=lambda stable: stable.step)
        for rate, row in sorted(((_rate(row, pose, implicit), row) for row in pose.alone), key=lambda r: -r[0]):
            if not runge_kutta and 1 / (1 / step + rate) > found.step:
                break  # two springs or dampers need a step that is at worst as short as both in a row
            beside = Stable(limit(pose, [*pose.together, row], implicit), row.element, pose.number)
            found = min(found, beside, key=lambda stable: stable.step)
    return found


def slow(model: mujoco.MjModel, poses: ArrayLike | None = None) -> dict[str, tuple[float, float, int]]:
    """Find where the parasitic mass of contacts and limits is largest beside the inertia behind them.

    Returns
    -------
    dict
        By element: μ a, which makes ringing slower by √(1 + μ a), with a = J M⁻¹ Jᵀ, 1/kg, this a, and the pose.
    """
    found: dict[str, tuple[float, float, int]] = {}
    for pose in _poses(model, poses):
        for row in (row for row in (*pose.together, *pose.alone) if row.mass):
            behind = float(row.along @ pose.inverse @ row.along)
            case = row.mass * behind, behind, pose.number
            found[row.element] = max(found.get(row.element, case), case)
    return found


def softness_of(model: mujoco.MjModel, kind: str, index: int) -> tuple[float, float] | None:
    """Stiffness and damping of a contact or limit; None where its solver parameters are not physical units."""
    solref, solimp = (getattr(model, field)[index] for field in KINDS[kind].model)
    inverse = inverse_inertia(model, kind, index)
    if solref[0] >= 0 or solimp[0] != solimp[1] or inverse <= 0:
        return None
    k, c = stiffness_damping(solref, solimp[0], inverse)
    return float(k), float(c)


def _implicit(model: mujoco.MjModel) -> _Mask:
    """(nv, nv) which derivatives of dampers an integrator takes implicitly, by the kind of damper."""
    if model.opt.integrator in (_Integrator.mjINT_IMPLICIT, _Integrator.mjINT_IMPLICITFAST):
        fits = np.zeros((model.nv, model.nv))
        for row, first, count in zip(fits, model.D_rowadr, model.D_rownnz):
            row[model.D_colind[first : first + count]] = 1
        return {"joint": fits, "force": fits}
    if model.opt.integrator == _Integrator.mjINT_EULER and not model.opt.disableflags & _Bits.mjDSBL_EULERDAMP:
        return {"joint": np.eye(model.nv)}
    return {}


def _rate(row: _Row, pose: _Pose, implicit: _Mask) -> float:
    """1/s, the inverse of the longest stable step of one row alone, (δ + √(δ² + ω²))/2."""
    inertia = row.mass + 1 / max(float(row.along @ pose.inverse @ row.along), np.finfo(float).tiny)
    decay = (-row.c if row.kind in implicit else row.c) / (2 * inertia)
    return float(decay + np.sqrt(decay**2 + row.k / inertia)) / 2


def _matrices(pose: _Pose, rows: list[_Row]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, with the parasitic one, stiffness and damping."""
    along = np.array([row.along for row in rows]).reshape(len(rows), len(pose.mass))
    mass, stiffness, damping = (
        (along.T * [getattr(row, name) for row in rows]) @ along for name in ("mass", "k", "c")
    )  # fmt: skip
    return pose.mass + mass, stiffness, damping


def _semi_implicit(pose: _Pose, rows: list[_Row], implicit: _Mask) -> float:
    """Longest step of v₊ = v + h (M + hD)⁻¹ M a, M' a = -K q - C v, q₊ = q + h v₊, M' with the parasitic mass.

    An eigenvalue becomes -1 at h = 1/λ, where 4M' λ² + (4M'M⁻¹D - 2C) λ - K is singular; before that none leaves the
    unit circle as long as all matrices are symmetric, which M'M⁻¹D is but for constraints that are next to rigid.
    """
    mass, stiffness, damping = _matrices(pose, rows)
    size, implied = len(mass), np.zeros_like(mass)
    for kind, fits in implicit.items():
        implied += fits * _matrices(pose, [row for row in rows if row.kind == kind])[2]
    springs, dampers = np.linalg.solve(mass, np.stack((stiffness, damping)))
    late = dampers / 2 - pose.inverse @ implied
    rates = np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], [springs / 4, late]]))
    fastest = max(rates.real[np.abs(rates.imag) <= 1e-6 * np.abs(rates)], default=0.0)
    longest = 1 / fastest if fastest > 0 else np.inf

    def grows(h: float) -> bool:
        share = np.linalg.inv(pose.mass + h * implied) @ pose.mass
        k, c = h * share @ springs, np.eye(size) - h * share @ dampers
        return bool(np.max(np.abs(np.linalg.eigvals(np.block([[np.eye(size) - h * k, h * c], [-k, c]])))) > 1 + 1e-6)

    stable, unstable = 0.0, min(longest, _LONG)
    if not implied.any() or not any(row.mass for row in rows) or not grows((1 - 1e-6) * unstable):
        return longest
    while unstable - stable > 1e-6 * unstable:
        middle = (stable + unstable) / 2
        stable, unstable = (stable, middle) if grows(middle) else (middle, unstable)
    return stable


def _runge_kutta(pose: _Pose, rows: list[_Row], implicit: _Mask) -> float:
    """Longest step: that at which Σ (hλ)ⁿ/n!, n = 0...4, leaves the unit circle for an eigenvalue λ of the motion."""
    mass, stiffness, damping = _matrices(pose, rows)
    size = len(mass)
    rates = np.linalg.eigvals(
        np.block([
            [np.zeros((size, size)), np.eye(size)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
        ])
    )  # fmt: skip
    rates = rates[np.abs(rates) > 0]
    turned = rates / np.abs(rates)
    turned = np.where(turned.real < -1e-9, turned, 1j * turned.imag)  # undamped but for rounding
    stable, unstable = np.zeros(len(rates)), np.full(len(rates), 4.0)
    for _ in range(50):
        middle = (stable + unstable) / 2
        z = middle * turned
        inside = np.abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) <= 1 + 1e-12
        stable, unstable = np.where(inside, middle, stable), np.where(inside, unstable, middle)
    return float(min(stable / np.abs(rates), default=np.inf))


def _poses(model: mujoco.MjModel, poses: ArrayLike | None) -> Iterator[_Pose]:
    """Yield what presses in each pose; the initial one and those of the keyframes if none are given."""
    given = np.vstack((model.qpos0, model.key_qpos)) if poses is None else np.atleast_2d(np.asarray(poses, dtype=float))
    if given.shape[-1] != model.nq or given.ndim != 2 or not len(given):
        raise ModelError(f"poses of shape {given.shape}; the model's need {model.nq} numbers each")
    data, mass = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    for number, qpos in enumerate(given if model.nv else ()):
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, mass)
        inverse = np.linalg.inv(mass)
        together = [
            *_passive(model, data), *_servos(model, data), *_limits(model, data), *_bristles(model, data),
            *_active(model, data),
        ]  # fmt: skip
        yield _Pose(number, mass.copy(), inverse, [_softened(row, inverse) for row in together], _apart(model, data))


def _softened(row: _Row, inverse: np.ndarray) -> _Row:
    """Leave out of a constraint that is next to rigid what is lost in rounding anyway."""
    share = min(1.0, _RIGID / max(row.mass * float(row.along @ inverse @ row.along), 1.0))
    return row._replace(k=share * row.k, c=share * row.c, mass=share * row.mass)


def _passive(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[_Row]:
    """Yield springs and dampers of joints and tendons."""
    springs = not model.opt.disableflags & _Bits.mjDSBL_SPRING
    dampers = not model.opt.disableflags & _Bits.mjDSBL_DAMPER
    for i, along in enumerate(np.eye(model.nv)):
        joint = model.dof_jntid[i]
        k, c = springs * model.jnt_stiffness[joint], dampers * model.dof_damping[i]
        if k or c:
            yield _Row(f'joint "{model.joint(joint).name}"', along, k, c, kind="joint")
    for i in range(model.ntendon):
        k, c = springs * model.tendon_stiffness[i], dampers * model.tendon_damping[i]
        for along in _lengthening(model, data, i) if k or c else ():
            yield _Row(f'tendon "{model.tendon(i).name}"', along, k, c, kind="force")


def _servos(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[_Row]:
    """Yield what actuators feed back, gain g u + b with b = b₀ + b₁ l + b₂ v, and g the same where it is affine."""
    off = model.opt.disableflags
    for i in range(model.nu):
        output, group = model.actuator_outadr[i], model.actuator_group[i]
        first, count = data.moment_rowadr[output], data.moment_rownnz[output]
        along, name = np.zeros(model.nv), f'actuator "{model.actuator(i).name}"'
        along[data.moment_colind[first : first + count]] = data.actuator_moment[first : first + count]
        if model.actuator_damping[i] and not off & _Bits.mjDSBL_DAMPER:
            joint = model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_TENDON
            yield _Row(name, along, 0.0, model.actuator_damping[i], kind="joint" if joint else "force")
        if off & _Bits.mjDSBL_ACTUATION or (0 <= group < 31 and model.opt.disableactuator >> group & 1):
            continue
        k, c = -model.actuator_biasprm[i, 1:3] * (model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE)
        if model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_AFFINE and model.actuator_ctrllimited[i]:
            gain = np.outer(model.actuator_ctrlrange[i], model.actuator_gainprm[i, 1:3])
            k, c = np.array((k, c)) + np.maximum(-gain, 0).max(axis=0)
        if k > 0 or c > 0:
            yield _Row(name, along, max(k, 0.0), max(c, 0.0), kind="force")


def _limits(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[_Row]:
    """Yield the limits of joints and tendons, whether they are reached or not."""
    if model.opt.disableflags & (_Bits.mjDSBL_CONSTRAINT | _Bits.mjDSBL_LIMIT):
        return
    unit = np.eye(model.nv)
    for i in np.flatnonzero(model.jnt_limited).tolist():
        first, ball = model.jnt_dofadr[i], model.jnt_type[i] == mujoco.mjtJoint.mjJNT_BALL
        yield from _element(model, "joint", i, unit[first : first + (3 if ball else 1)])
    for i in np.flatnonzero(model.tendon_limited).tolist():
        yield from _element(model, "tendon", i, _lengthening(model, data, i))


def _bristles(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[_Row]:
    """Yield the friction of joints and tendons, and that of pairs of geoms where they are nearest."""
    for kind, name, at in frictions(model):
        k, c = model.numeric_data[at + 1 : at + 3]
        index = find(model, KINDS[kind].object, name)
        if kind == "joint":
            along = np.eye(model.nv)[model.jnt_dofadr[index]][None]
        elif kind == "tendon":
            along = _lengthening(model, data, index)
        else:
            normal, between = _nearest(model, data, index)
            along = np.linalg.svd(normal[None])[2][1:] @ between
        for row in along:
            yield _Row(f'friction of {kind} "{name}"', row, k, c)


def _element(model: mujoco.MjModel, kind: str, index: int, along: np.ndarray) -> Iterator[_Row]:
    """Yield rows of a contact or limit, of which impedance, the largest, and Â tell k, c and μ = 1/R."""
    solref, solimp = (getattr(model, field)[index] for field in KINDS[kind].model)
    inverse = inverse_inertia(model, kind, index)
    if inverse <= 0 or not _counts(model, solref):
        return
    most, width = np.clip((max(solimp[:2]), solimp[1]), mujoco.mjMINIMP, mujoco.mjMAXIMP)
    if solref[0] > 0:
        stiffness, damping = 1 / (width * solref[0] * solref[1]) ** 2, 2 / (width * solref[0])
    else:
        stiffness, damping = -solref[0] / width**2, -solref[1] / width
    mass = most / ((1 - most) * inverse)
    name = f'{kind} "{mujoco.mj_id2name(model, KINDS[kind].object, index) or index}"'
    for row in along:
        yield _Row(name, row, stiffness * most * mass, damping * mass, mass)


def _counts(model: mujoco.MjModel, solref: np.ndarray) -> bool:
    """Tell whether a constraint may be unstable: MuJoCo takes care of those that have a time constant."""
    return bool(solref[0] <= 0 or model.opt.disableflags & _Bits.mjDSBL_REFSAFE)


def _active(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[_Row]:
    """Yield the solver's rows of contacts that touch and of equalities."""
    pairs = {frozenset(p): i for i, p in enumerate(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist()))}
    for r in range(data.nefc):
        if data.efc_type[r] == _Constraint.mjCNSTR_EQUALITY:
            element, solref = f'equality "{model.equality(data.efc_id[r]).name}"', model.eq_solref[data.efc_id[r]]
        elif data.efc_type[r] < int(_Constraint.mjCNSTR_CONTACT_FRICTIONLESS):
            continue
        else:
            contact = data.contact[data.efc_id[r]]
            pair = pairs.get(frozenset(contact.geom.tolist()))
            names = " - ".join(model.geom(g).name or str(g) for g in contact.geom)
            element = f'pair "{model.pair(pair).name or pair}"' if pair is not None else f'contact "{names}"'
            solref = contact.solref
        if _counts(model, solref):
            (stiffness, damping, impedance, _), mass = data.efc_KBIP[r], 1 / data.efc_R[r]
            yield _Row(element, _jacobian(model, data, r), stiffness * impedance * mass, damping * mass, mass)


def _jacobian(model: mujoco.MjModel, data: mujoco.MjData, r: int) -> np.ndarray:
    if not mujoco.mj_isSparse(model):
        return data.efc_J.reshape(-1, model.nv)[r].copy()
    along, first = np.zeros(model.nv), data.efc_J_rowadr[r]
    entries = slice(first, first + data.efc_J_rownnz[r])
    along[data.efc_J_colind[entries]] = data.efc_J[entries]
    return along


def _apart(model: mujoco.MjModel, data: mujoco.MjData) -> list[_Row]:
    """Pairs of geoms that do not touch, where they are nearest."""
    rows: list[_Row] = []
    if model.opt.disableflags & (_Bits.mjDSBL_CONSTRAINT | _Bits.mjDSBL_CONTACT):
        return rows
    touching = {frozenset(c.geom.tolist()) for c in data.contact[: data.ncon] if c.efc_address >= 0}
    for i in range(model.npair):
        geoms = int(model.pair_geom1[i]), int(model.pair_geom2[i])
        if frozenset(geoms) not in touching and _counts(model, model.pair_solref[i]):
            normal, between = _nearest(model, data, i)
            if normal.any():
                rows += _element(model, "pair", i, (normal @ between)[None])
    return rows


def _nearest(model: mujoco.MjModel, data: mujoco.MjData, pair: int) -> tuple[np.ndarray, np.ndarray]:
    """Normal (3,) of a pair of geoms where they are nearest, 0 if that is far, and (3, nv) what moves them apart."""
    geoms, ends = [int(model.pair_geom1[pair]), int(model.pair_geom2[pair])], np.zeros(6)
    distance = mujoco.mj_geomDistance(model, data, *geoms, _FAR, ends)
    normal = ends[3:] - ends[:3]
    length = np.linalg.norm(normal)
    known = abs(distance) < _FAR and length > 0
    return normal / length if known else np.zeros(3), _between(
        model, data, model.geom_bodyid[geoms], ends.reshape(2, 3)
    )


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
    return _between(model, data, model.site_bodyid[ends], data.site_xpos[ends])


def _between(model: mujoco.MjModel, data: mujoco.MjData, bodies: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(3, nv) velocity of a point of the second body less that of one of the first, per coordinate's."""
    jacobians = np.zeros((2, 3, model.nv))
    for jacobian, body, point in zip(jacobians, bodies, points):
        mujoco.mj_jac(model, data, jacobian, None, point, body)
    return jacobians[1] - jacobians[0]
