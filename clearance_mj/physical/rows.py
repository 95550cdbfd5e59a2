"""The springs, dampers, contacts, limits, bristles and servos of a model in a pose, as rows of a Jacobian."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ModelError
from .actuators import actuator_count, control_of, output_of
from .bristles import frictions, rubbing
from .bushings import Joined, joined
from .drives import PlacedDrive, drives
from .elements import KINDS, find, inverse_inertia, pairs_of
from .softness import stiffness_damping

__all__ = ["ParasiticMass", "Pose", "Row", "bent_poses", "parasitic_mass", "poses_of", "softness_of"]

_NEAREST_WITHIN = 1e3  # m, distance up to which nearest points of geoms are looked for
_LIFT = 1e-6  # m
BENT_POSES = 24
_NEXT_TO_RIGID = 1e6  # share of the inertia behind a row from which on its parasitic mass makes no difference
_ADDED = ("friction of ", "teeth of ", "hysteresis of ", "drive of ", "bushing ")  # how the names of such rows begin
_Bits, _Constraint = mujoco.mjtDisableBit, mujoco.mjtConstraint


class Row(NamedTuple):
    """A direction in which a spring and a damper press, with a force k r + c ṙ - μ a."""

    element: str
    direction: np.ndarray  # (n,) of the model's nv velocities and those of its drives' rotors
    k: float
    c: float
    mass: float = 0.0  # μ, the parasitic one of MuJoCo's constraints
    kind: str = "constraint"  # or of a damper that integrators may take implicitly: "joint", "force"; "rotor": always

    @property
    def added(self) -> bool:
        """Whether it is the `Softener` that adds it to the forces: bristles, and drives inside actuators."""
        return self.element.startswith(_ADDED)


class Pose(NamedTuple):
    """What presses in a pose."""

    number: int
    mass: np.ndarray  # (n, n)
    inverse: np.ndarray  # (n, n)
    together: list[Row]  # at once
    alone: list[list[Row]]  # of pairs of geoms that do not touch, each pair beside those


class ParasiticMass(NamedTuple):
    """What the parasitic mass of a contact or limit does to the inertia behind it."""

    ratio: float  # μ a: ringing is slower by √(1 + μ a)
    inverse_inertia: float  # a = J M⁻¹ Jᵀ, 1/kg
    pose: int  # index of the pose


def parasitic_mass(model: mujoco.MjModel, poses: ArrayLike | None = None) -> dict[str, ParasiticMass]:
    """Return, by element, where the parasitic mass of contacts and limits is largest beside the inertia behind them."""
    found: dict[str, ParasiticMass] = {}
    for pose in poses_of(model, poses):
        for row in (row for row in (*pose.together, *itertools.chain(*pose.alone)) if row.mass):
            inverse = float(row.direction @ pose.inverse @ row.direction)
            case = ParasiticMass(row.mass * inverse, inverse, pose.number)
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


def poses_of(model: mujoco.MjModel, poses: ArrayLike | None, contacts: bool = True) -> Iterator[Pose]:
    """Yield what presses in each pose; the initial one and those of the keyframes if none are given.

    Without ``contacts`` no geoms touch.
    """
    given = np.vstack((model.qpos0, model.key_qpos)) if poses is None else np.atleast_2d(np.asarray(poses, dtype=float))
    if given.shape[-1] != model.nq or given.ndim != 2 or not len(given):
        raise ModelError(f"poses of shape {given.shape}; the model's need {model.nq} numbers each")
    rubs = rubbing(model)
    placed = model if contacts and not rubs else copy.copy(model)
    if not contacts:
        placed.opt.disableflags |= int(_Bits.mjDSBL_CONTACT)
    placed.pair_dim[[find(model, KINDS["pair"].object, name) for name in rubs]] = 1  # friction's rows are the bristles'
    data, mass, inside = mujoco.MjData(model), np.zeros((model.nv, model.nv)), list(drives(model))
    rotors = np.diag([0.0] * model.nv + [float(drive.numbers(model)["inertia"]) for drive in inside])
    for number, qpos in enumerate(given if model.nv else ()):
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(placed, data)
        mujoco.mj_fullM(model, data, mass)
        whole = rotors + np.pad(mass, (0, len(inside)))
        inverse = np.linalg.inv(whole)
        bristles = _bristles(model, data)
        apart = [list(_padded(rows, len(whole))) for rows in _apart(model, data, bristles)]
        together = [
            *_passive(model, data), *_servos(model, data), *_limits(model, data), *itertools.chain(*bristles.values()),
            *_active(model, data),
        ]  # fmt: skip
        together = [*_padded(together, len(whole)), *_turning(model, data, inside)]
        yield Pose(number, whole, inverse, [_softened(row, inverse) for row in together], apart)


def bent_poses(model: mujoco.MjModel) -> np.ndarray:
    """Return poses (n, nq) over the ranges of a model's hinges and slides, the same at every call.

    Each has these joints at the ends or in the middle of their ranges, and those without a range as they are.
    """
    single = np.isin(model.jnt_type, (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)))
    bent = np.flatnonzero(single & (model.jnt_limited != 0))
    ranges, count = model.jnt_range[bent], BENT_POSES if bent.size else 0
    shares = np.random.default_rng(0).choice((0.0, 0.5, 1.0), (count, bent.size))
    poses = np.tile(model.qpos0, (count, 1))
    poses[:, model.jnt_qposadr[bent]] = ranges[:, 0] + shares * np.ptp(ranges, axis=1)
    return poses


def _padded(rows: Iterable[Row], size: int) -> Iterator[Row]:
    """Yield rows that move no rotor."""
    return (row._replace(direction=np.pad(row.direction, (0, size - len(row.direction)))) for row in rows)


def _turning(model: mujoco.MjModel, data: mujoco.MjData, inside: list[PlacedDrive]) -> Iterator[Row]:
    """Yield teeth, hysteresis, friction and servos of drives inside actuators; servos as if they measured the rotor."""
    for i, drive in enumerate(inside):
        numbers, name = drive.numbers(model), f'drive of actuator "{drive.name}"'
        rotor = np.eye(model.nv + len(inside))[model.nv + i]
        moment, gear = _moment(model, data, drive.actuator)
        between = rotor - np.pad(moment / gear, (0, len(inside)))
        yield Row(f"teeth of {name}", between, float(numbers["k"]), float(numbers["c"]))
        for k, _ in drive.slips(model):
            yield Row(f"hysteresis of {name}", between, float(k), 0.0)
        if drive.rubs(model):
            yield Row(f"friction of {name}", rotor, float(numbers["friction_k"]), float(numbers["friction_c"]))
        k, c = np.maximum(-model.actuator_biasprm[drive.actuator, 1:3], 0.0) * gear**2
        yield Row(name, rotor, float(k), float(c + numbers["friction_viscous"]), kind="rotor")


def _moment(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> tuple[np.ndarray, float]:
    """What an actuator's length gains per velocity (nv,), and its gear."""
    output = output_of(model, actuator)
    first, count = data.moment_rowadr[output], data.moment_rownnz[output]
    direction = np.zeros(model.nv)
    direction[data.moment_colind[first : first + count]] = data.actuator_moment[first : first + count]
    return direction, float(model.actuator_gear[output, 0])


def _softened(row: Row, inverse: np.ndarray) -> Row:
    """Leave out of a constraint that is next to rigid what is lost in rounding anyway."""
    share = min(1.0, _NEXT_TO_RIGID / max(row.mass * float(row.direction @ inverse @ row.direction), 1.0))
    return row._replace(k=share * row.k, c=share * row.c, mass=share * row.mass)


def _passive(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Row]:
    """Yield springs and dampers of joints and tendons."""
    springs = not model.opt.disableflags & _Bits.mjDSBL_SPRING
    dampers = not model.opt.disableflags & _Bits.mjDSBL_DAMPER
    for i, direction in enumerate(np.eye(model.nv)):
        joint = model.dof_jntid[i]
        k, c = springs * model.jnt_stiffness[joint], dampers * model.dof_damping[i]
        if k or c:
            yield Row(f'joint "{model.joint(joint).name}"', direction, k, c, kind="joint")
    for i in range(model.ntendon):
        k, c = springs * model.tendon_stiffness[i], dampers * model.tendon_damping[i]
        for direction in _lengthening(model, data, i) if k or c else ():
            yield Row(f'tendon "{model.tendon(i).name}"', direction, k, c, kind="force")


def _servos(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Row]:
    """Yield what actuators feed back, gain g u + b with b = b₀ + b₁ l + b₂ v, and g the same where it is affine."""
    off = model.opt.disableflags
    for i in range(actuator_count(model)):
        group, name = model.actuator_group[i], f'actuator "{model.actuator(i).name}"'
        direction, _ = _moment(model, data, i)
        if model.actuator_damping[i] and not off & _Bits.mjDSBL_DAMPER:
            joint = model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_TENDON
            yield Row(name, direction, 0.0, model.actuator_damping[i], kind="joint" if joint else "force")
        if off & _Bits.mjDSBL_ACTUATION or (0 <= group < 31 and model.opt.disableactuator >> group & 1):
            continue
        k, c = -model.actuator_biasprm[i, 1:3] * (model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE)
        control = control_of(model, i)
        if model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_AFFINE and model.actuator_ctrllimited[control]:
            gain = np.outer(model.actuator_ctrlrange[control], model.actuator_gainprm[i, 1:3])
            k, c = np.array((k, c)) + np.maximum(-gain, 0).max(axis=0)
        if k > 0 or c > 0:
            yield Row(name, direction, max(k, 0.0), max(c, 0.0), kind="force")


def _limits(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Row]:
    """Yield the limits of joints and tendons, whether they are reached or not."""
    if model.opt.disableflags & (_Bits.mjDSBL_CONSTRAINT | _Bits.mjDSBL_LIMIT):
        return
    unit = np.eye(model.nv)
    for i in np.flatnonzero(model.jnt_limited).tolist():
        first, ball = model.jnt_dofadr[i], model.jnt_type[i] == mujoco.mjtJoint.mjJNT_BALL
        yield from _element(model, "joint", i, unit[first : first + (3 if ball else 1)])
    for i in np.flatnonzero(model.tendon_limited).tolist():
        yield from _element(model, "tendon", i, _lengthening(model, data, i))


def _bristles(model: mujoco.MjModel, data: mujoco.MjData) -> dict[int, list[Row]]:
    """Return the friction of pairs of geoms where they are nearest, by pair, and that of joints and tendons at -1."""
    found: dict[int, list[Row]] = {-1: []}
    for kind, name, at, size in frictions(model):
        k, c = model.numeric_data[at + 1 : at + 3]
        index = find(model, KINDS[kind].object, name)
        if kind == "joint":
            direction = np.eye(model.nv)[model.jnt_dofadr[index]][None]
        elif kind == "tendon":
            direction = _lengthening(model, data, index)
        else:
            normal, between = _nearest(model, data, index)
            direction = np.linalg.svd(normal[None])[2][1:] @ between
            found[index] = list(_turned(model, data, index, name, model.numeric_data[at : at + size]))
        rows = [Row(f'friction of {kind} "{name}"', row, k, c) for row in direction]
        found[index if kind == "pair" else -1] += rows
    return found


def _turned(model: mujoco.MjModel, data: mujoco.MjData, pair: int, name: str, numbers: np.ndarray) -> Iterator[Row]:
    """Yield what resists that geoms that touch spin and roll, with their points' arms as if all pressed alike."""
    geoms = {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
    coefficient, k, c, torsion, rolling = np.pad(numbers, (0, 5 - len(numbers)))
    touching = [contact for contact in data.contact[: data.ncon] if set(contact.geom.tolist()) == geoms]
    if not touching:
        return
    places = np.array([contact.pos for contact in touching])
    square = max(float(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1))), torsion**2)
    turns = np.zeros((2, 3, model.nv))
    for turn, geom in zip(turns, touching[0].geom):
        mujoco.mj_jacBody(model, data, None, turn, model.geom_bodyid[geom])
    for row, arms in zip(touching[0].frame.reshape(3, 3), (square, *2 * [(rolling / coefficient) ** 2])):
        if arms > 0 and (direction := row @ (turns[1] - turns[0])).any():
            yield Row(f'friction of pair "{name}"', direction, k * arms, c * arms)


def _element(model: mujoco.MjModel, kind: str, index: int, direction: np.ndarray) -> Iterator[Row]:
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
    for row in direction:
        yield Row(name, row, stiffness * most * mass, damping * mass, mass)


def _counts(model: mujoco.MjModel, solref: np.ndarray) -> bool:
    """Tell whether a constraint may be unstable: MuJoCo takes care of those that have a time constant."""
    return bool(solref[0] <= 0 or model.opt.disableflags & _Bits.mjDSBL_REFSAFE)


def _active(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Row]:
    """Yield the solver's rows of contacts that touch and of equalities."""
    pairs, bushings = pairs_of(model), {bushing.equality: bushing for bushing in joined(model)}
    for r in range(data.nefc):
        if data.efc_type[r] == _Constraint.mjCNSTR_EQUALITY and data.efc_id[r] in bushings:
            if r == 0 or data.efc_id[r - 1] != data.efc_id[r] or data.efc_type[r - 1] != data.efc_type[r]:
                yield from _bushing(model, data, r, bushings[data.efc_id[r]])
            continue
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
            yield Row(element, _jacobian(model, data, r), stiffness * impedance * mass, damping * mass, mass)


def _bushing(model: mujoco.MjModel, data: mujoco.MjData, first: int, bushing: Joined) -> Iterator[Row]:
    """Yield what presses along and about the axes of a bushing between two sites, whose rows begin at the first."""
    k, c = model.numeric_data[bushing.numeric :][: 2 * bushing.axes].reshape(2, -1)
    rows = np.array([_jacobian(model, data, r) for r in range(first, first + bushing.axes)])
    mass, scale = 1 / data.efc_R[first : first + bushing.axes], model.eq_data[bushing.equality, 10]
    rows[:3] = data.site_xmat[bushing.site].reshape(3, 3).T @ rows[:3]
    for j in range(bushing.axes):
        turns = 1.0 if j < 3 else 2 / scale  # angle of a row's residual, see `bushing_loop`
        yield Row(f'bushing "{bushing.name}"', turns * rows[j], k[j], c[j], mass[j] / turns**2)


def _jacobian(model: mujoco.MjModel, data: mujoco.MjData, r: int) -> np.ndarray:
    if not mujoco.mj_isSparse(model):
        return data.efc_J.reshape(-1, model.nv)[r].copy()
    direction, first = np.zeros(model.nv), data.efc_J_rowadr[r]
    entries = slice(first, first + data.efc_J_rownnz[r])
    direction[data.efc_J_colind[entries]] = data.efc_J[entries]
    return direction


def _apart(model: mujoco.MjModel, data: mujoco.MjData, bristles: dict[int, list[Row]]) -> Iterator[list[Row]]:
    """Yield what presses and rubs between pairs of geoms that do not touch, where they are nearest.

    Their bristles are taken out of those that are given.
    """
    off = model.opt.disableflags & (_Bits.mjDSBL_CONSTRAINT | _Bits.mjDSBL_CONTACT)
    touching = {frozenset(c.geom.tolist()) for c in data.contact[: data.ncon] if c.efc_address >= 0}
    for i in range(model.npair):
        geoms = int(model.pair_geom1[i]), int(model.pair_geom2[i])
        if frozenset(geoms) in touching:
            continue
        rows = bristles.pop(i, [])
        if not off and _counts(model, model.pair_solref[i]):
            normal, between = _nearest(model, data, i)
            if normal.any():
                rows += _element(model, "pair", i, (normal @ between)[None])
        if rows := [row for row in rows if row.direction.any()]:
            yield rows


def _nearest(model: mujoco.MjModel, data: mujoco.MjData, pair: int) -> tuple[np.ndarray, np.ndarray]:
    """Normal (3,) of a pair of geoms where they are nearest, 0 if that is far, and (3, nv) what moves them apart."""
    geoms = [int(model.pair_geom1[pair]), int(model.pair_geom2[pair])]
    distance, ends = _distance(model, data, geoms)
    normal = ends[3:] - ends[:3]
    if not normal.any() and abs(distance) < _NEAREST_WITHIN:  # they just touch: what parts them most shows the normal
        lifts = [_LIFT * lift for lift in (*np.eye(3), *-np.eye(3))]
        lifted = max((_distance(model, data, geoms, lift) for lift in lifts), key=lambda each: each[0])
        normal = lifted[1][3:] - lifted[1][:3]
    length = np.linalg.norm(normal)
    known = abs(distance) < _NEAREST_WITHIN and length > 0
    return normal / length if known else np.zeros(3), _between(
        model, data, model.geom_bodyid[geoms], ends.reshape(2, 3)
    )


def _distance(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], lift: ArrayLike = 0.0
) -> tuple[float, np.ndarray]:  # fmt: skip
    """Distance of two geoms, the second of them lifted, m, and their points (6,) that are nearest."""
    place, ends = data.geom_xpos[geoms[1]], np.zeros(6)
    before = place.copy()
    place += lift
    distance = mujoco.mj_geomDistance(model, data, *geoms, _NEAREST_WITHIN, ends)
    place[:] = before
    return distance, ends


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
