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
from .bristles import bristles_of, pairs_with_bristles
from .bushings import SiteBushing, bushings_of
from .drives import PlacedDrive, drives
from .elements import KINDS, find, inverse_inertia, pairs_of
from .softness import stiffness_damping

__all__ = ["ContactRow", "ParasiticMass", "Pose", "bent_poses", "parasitic_mass", "poses_of", "softness_of"]

_NEAREST_WITHIN = 1e3  # m, range of the search for nearest points of geoms
_LIFT = 1e-6  # m
BENT_POSES = 24
_LARGEST_MASS_RATIO = 1e6  # parasitic mass over inertia, above which a row counts as rigid
_ADDED = ("friction of ", "teeth of ", "hysteresis of ", "drive of ", "bushing ")  # rows that the `Softener` adds
_Bits, _Constraint = mujoco.mjtDisableBit, mujoco.mjtConstraint


class ContactRow(NamedTuple):
    """A direction with a spring and damper: force k r + c ṙ - μ a."""

    element: str
    direction: np.ndarray  # (n,) of the model's nv velocities and those of its drives' rotors
    k: float
    c: float
    mass: float = 0.0  # μ, the parasitic one of MuJoCo's constraints
    kind: str = "constraint"  # or of a damper that integrators may take implicitly: "joint", "force"; "rotor": always

    @property
    def added(self) -> bool:
        """True if the `Softener` adds its force: bristles, drives inside actuators and bushings."""
        return self.element.startswith(_ADDED)


class Pose(NamedTuple):
    """Inertia and rows of a pose."""

    number: int
    mass: np.ndarray  # (n, n)
    inverse: np.ndarray  # (n, n)
    together: list[ContactRow]  # acting at once
    alone: list[list[ContactRow]]  # per pair of geoms that do not touch, in addition to those


class ParasiticMass(NamedTuple):
    """Parasitic mass of a contact or limit, compared with the inertia behind it."""

    ratio: float  # μ a: ringing is slower by √(1 + μ a)
    inverse_inertia: float  # a = J M⁻¹ Jᵀ, 1/kg
    pose: int  # index of the pose


def parasitic_mass(model: mujoco.MjModel, poses: ArrayLike | None = None) -> dict[str, ParasiticMass]:
    """Return, by element, the largest ratio of parasitic mass to the inertia behind it, over the poses."""
    masses: dict[str, ParasiticMass] = {}
    for pose in poses_of(model, poses):
        for row in (row for row in (*pose.together, *itertools.chain(*pose.alone)) if row.mass):
            inverse = float(row.direction @ pose.inverse @ row.direction)
            case = ParasiticMass(row.mass * inverse, inverse, pose.number)
            masses[row.element] = max(masses.get(row.element, case), case)
    return masses


def softness_of(model: mujoco.MjModel, kind: str, index: int) -> tuple[float, float] | None:
    """Return stiffness and damping of a contact or limit; None if its solver parameters are not in physical units."""
    solref, solimp = (getattr(model, field)[index] for field in KINDS[kind].model)
    inverse = inverse_inertia(model, kind, index)
    if solref[0] >= 0 or solimp[0] != solimp[1] or inverse <= 0:
        return None
    k, c = stiffness_damping(solref, solimp[0], inverse)
    return float(k), float(c)


def poses_of(model: mujoco.MjModel, poses: ArrayLike | None, contacts: bool = True) -> Iterator[Pose]:
    """Yield the rows of each pose; by default of the initial one and those of the keyframes.

    Without ``contacts`` no geoms touch.
    """
    table = np.vstack((model.qpos0, model.key_qpos)) if poses is None else np.atleast_2d(np.asarray(poses, dtype=float))
    if table.shape[-1] != model.nq or table.ndim != 2 or not len(table):
        raise ModelError(f"poses of shape {table.shape}; the model's need {model.nq} numbers each")
    bristle_pairs = pairs_with_bristles(model)
    variant = model if contacts and not bristle_pairs else copy.copy(model)
    if not contacts:
        variant.opt.disableflags |= int(_Bits.mjDSBL_CONTACT)
    variant.pair_dim[[find(model, "pair", name) for name in bristle_pairs]] = 1  # MuJoCo's friction off
    data, mass, placed_drives = mujoco.MjData(model), np.zeros((model.nv, model.nv)), list(drives(model))
    rotors = np.diag([0.0] * model.nv + [float(drive.numbers(model)["inertia"]) for drive in placed_drives])
    for number, qpos in enumerate(table if model.nv else ()):
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(variant, data)
        mujoco.mj_fullM(model, data, mass)
        inertia = rotors + np.pad(mass, (0, len(placed_drives)))
        inverse = np.linalg.inv(inertia)
        bristles = _friction_rows(model, data)
        separated = [list(_pad_rows(rows, len(inertia))) for rows in _separated_rows(model, data, bristles)]
        together = [
            *_passive_rows(model, data), *_servo_rows(model, data), *_limit_rows(model, data),
            *itertools.chain(*bristles.values()), *_active_rows(model, data),
        ]  # fmt: skip
        together = [*_pad_rows(together, len(inertia)), *_drive_rows(model, data, placed_drives)]
        yield Pose(number, inertia, inverse, [_limit_stiffness(row, inverse) for row in together], separated)


def bent_poses(model: mujoco.MjModel) -> np.ndarray:
    """Return poses (n, nq) over the ranges of a model's hinges and slides, the same at every call.

    Each has these joints at the ends or in the middle of their ranges, and those without a range as they are.
    """
    single = np.isin(model.jnt_type, (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)))
    limited = np.flatnonzero(single & (model.jnt_limited != 0))
    ranges, count = model.jnt_range[limited], BENT_POSES if limited.size else 0
    positions = np.random.default_rng(0).choice((0.0, 0.5, 1.0), (count, limited.size))
    poses = np.tile(model.qpos0, (count, 1))
    poses[:, model.jnt_qposadr[limited]] = ranges[:, 0] + positions * np.ptp(ranges, axis=1)
    return poses


def _pad_rows(rows: Iterable[ContactRow], size: int) -> Iterator[ContactRow]:
    """Yield rows extended by zeros for the rotors."""
    return (row._replace(direction=np.pad(row.direction, (0, size - len(row.direction)))) for row in rows)


def _drive_rows(model: mujoco.MjModel, data: mujoco.MjData, placed_drives: list[PlacedDrive]) -> Iterator[ContactRow]:
    """Yield teeth, hysteresis, friction and servos of drives inside actuators; servos as if they measured the rotor."""
    for i, drive in enumerate(placed_drives):
        parameters, name = drive.numbers(model), f'drive of actuator "{drive.name}"'
        rotor = np.eye(model.nv + len(placed_drives))[model.nv + i]
        moment, gear = _moment(model, data, drive.actuator)
        difference = rotor - np.pad(moment / gear, (0, len(placed_drives)))
        yield ContactRow(f"teeth of {name}", difference, float(parameters["k"]), float(parameters["c"]))
        for k, _ in drive.hysteresis_elements(model):
            yield ContactRow(f"hysteresis of {name}", difference, float(k), 0.0)
        if drive.has_dry_friction(model):
            yield ContactRow(
                f"friction of {name}", rotor, float(parameters["friction_k"]), float(parameters["friction_c"])
            )
        k, c = np.maximum(-model.actuator_biasprm[drive.actuator, 1:3], 0.0) * gear**2
        yield ContactRow(name, rotor, float(k), float(c + parameters["friction_viscous"]), kind="rotor")


def _moment(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> tuple[np.ndarray, float]:
    """Return the moment arms (nv,) and the gear of an actuator."""
    output = output_of(model, actuator)
    row = data.moment_rowadr[output], data.moment_rownnz[output]
    return _dense_row(model, data.moment_colind, data.actuator_moment, *row), float(model.actuator_gear[output, 0])


def _dense_row(model: mujoco.MjModel, columns: np.ndarray, values: np.ndarray, first: int, count: int) -> np.ndarray:
    """Return a row (nv,) of a sparse matrix."""
    row, entries = np.zeros(model.nv), slice(first, first + count)
    row[columns[entries]] = values[entries]
    return row


def _limit_stiffness(row: ContactRow, inverse: np.ndarray) -> ContactRow:
    """Reduce stiffness of a nearly rigid constraint, whose effect is below rounding."""
    scale = min(1.0, _LARGEST_MASS_RATIO / max(row.mass * float(row.direction @ inverse @ row.direction), 1.0))
    return row._replace(k=scale * row.k, c=scale * row.c, mass=scale * row.mass)


def _passive_rows(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[ContactRow]:
    """Yield springs and dampers of joints and tendons."""
    springs = not model.opt.disableflags & _Bits.mjDSBL_SPRING
    dampers = not model.opt.disableflags & _Bits.mjDSBL_DAMPER
    for i, direction in enumerate(np.eye(model.nv)):
        joint = model.dof_jntid[i]
        k, c = springs * model.jnt_stiffness[joint], dampers * model.dof_damping[i]
        if k or c:
            yield ContactRow(f'joint "{model.joint(joint).name}"', direction, k, c, kind="joint")
    for i in range(model.ntendon):
        k, c = springs * model.tendon_stiffness[i], dampers * model.tendon_damping[i]
        for direction in _tendon_jacobian(model, data, i) if k or c else ():
            yield ContactRow(f'tendon "{model.tendon(i).name}"', direction, k, c, kind="force")


def _servo_rows(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[ContactRow]:
    """Yield feedback of actuators, force g u + b with b = b₀ + b₁ l + b₂ v, and g alike where it is affine."""
    off = model.opt.disableflags
    for i in range(actuator_count(model)):
        group, name = model.actuator_group[i], f'actuator "{model.actuator(i).name}"'
        direction, _ = _moment(model, data, i)
        if model.actuator_damping[i] and not off & _Bits.mjDSBL_DAMPER:
            joint = model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_TENDON
            yield ContactRow(name, direction, 0.0, model.actuator_damping[i], kind="joint" if joint else "force")
        if off & _Bits.mjDSBL_ACTUATION or (0 <= group < 31 and model.opt.disableactuator >> group & 1):
            continue
        k, c = -model.actuator_biasprm[i, 1:3] * (model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE)
        control = control_of(model, i)
        if model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_AFFINE and model.actuator_ctrllimited[control]:
            gain = np.outer(model.actuator_ctrlrange[control], model.actuator_gainprm[i, 1:3])
            k, c = np.array((k, c)) + np.maximum(-gain, 0).max(axis=0)
        if k > 0 or c > 0:
            yield ContactRow(name, direction, max(k, 0.0), max(c, 0.0), kind="force")


def _limit_rows(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[ContactRow]:
    """Yield the limits of joints and tendons, whether they are reached or not."""
    if model.opt.disableflags & (_Bits.mjDSBL_CONSTRAINT | _Bits.mjDSBL_LIMIT):
        return
    unit = np.eye(model.nv)
    for i in np.flatnonzero(model.jnt_limited).tolist():
        first, ball = model.jnt_dofadr[i], model.jnt_type[i] == mujoco.mjtJoint.mjJNT_BALL
        yield from _element_rows(model, "joint", i, unit[first : first + (3 if ball else 1)])
    for i in np.flatnonzero(model.tendon_limited).tolist():
        yield from _element_rows(model, "tendon", i, _tendon_jacobian(model, data, i))


def _friction_rows(model: mujoco.MjModel, data: mujoco.MjData) -> dict[int, list[ContactRow]]:
    """Return friction rows by pair of geoms, at their nearest points; those of joints and tendons at -1."""
    rows_of: dict[int, list[ContactRow]] = {-1: []}
    for kind, name, address, size in bristles_of(model):
        k, c = model.numeric_data[address + 1 : address + 3]
        index = find(model, kind, name)
        if kind == "joint":
            direction = np.eye(model.nv)[model.jnt_dofadr[index]][None]
        elif kind == "tendon":
            direction = _tendon_jacobian(model, data, index)
        else:
            normal, relative = _normal(model, data, index)
            direction = np.linalg.svd(normal[None])[2][1:] @ relative
            rows_of[index] = list(_spin_rows(model, data, index, name, model.numeric_data[address : address + size]))
        rows = [ContactRow(f'friction of {kind} "{name}"', row, k, c) for row in direction]
        rows_of[index if kind == "pair" else -1] += rows
    return rows_of


def _spin_rows(
    model: mujoco.MjModel, data: mujoco.MjData, pair: int, name: str, numbers: np.ndarray
) -> Iterator[ContactRow]:
    """Yield spin and rolling friction of touching geoms, with equal normal forces at all points."""
    geoms = {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
    coefficient, k, c, torsion, rolling = np.pad(numbers, (0, 5 - len(numbers)))
    touching = [contact for contact in data.contact[: data.ncon] if set(contact.geom.tolist()) == geoms]
    if not touching:
        return
    points = np.array([contact.pos for contact in touching])
    square = max(float(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))), torsion**2)
    rotations = np.zeros((2, 3, model.nv))
    for rotation, geom in zip(rotations, touching[0].geom):
        mujoco.mj_jacBody(model, data, None, rotation, model.geom_bodyid[geom])
    for row, arm_squared in zip(touching[0].frame.reshape(3, 3), (square, *2 * [(rolling / coefficient) ** 2])):
        if arm_squared > 0 and (direction := row @ (rotations[1] - rotations[0])).any():
            yield ContactRow(f'friction of pair "{name}"', direction, k * arm_squared, c * arm_squared)


def _element_rows(model: mujoco.MjModel, kind: str, index: int, direction: np.ndarray) -> Iterator[ContactRow]:
    """Yield rows of a contact or limit, with k, c and μ = 1/R of its largest impedance and Â."""
    solref, solimp = (getattr(model, field)[index] for field in KINDS[kind].model)
    inverse = inverse_inertia(model, kind, index)
    if inverse <= 0 or not _is_stiff(model, solref):
        return
    largest, width = np.clip((max(solimp[:2]), solimp[1]), mujoco.mjMINIMP, mujoco.mjMAXIMP)
    if solref[0] > 0:
        stiffness, damping = 1 / (width * solref[0] * solref[1]) ** 2, 2 / (width * solref[0])
    else:
        stiffness, damping = -solref[0] / width**2, -solref[1] / width
    mass = largest / ((1 - largest) * inverse)
    name = f'{kind} "{getattr(model, kind)(index).name or index}"'
    for row in direction:
        yield ContactRow(name, row, stiffness * largest * mass, damping * mass, mass)


def _is_stiff(model: mujoco.MjModel, solref: np.ndarray) -> bool:
    """Return True if a constraint may be unstable: MuJoCo limits those with a time constant."""
    return bool(solref[0] <= 0 or model.opt.disableflags & _Bits.mjDSBL_REFSAFE)


def _active_rows(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[ContactRow]:
    """Yield the solver's rows of contacts that touch and of equalities."""
    pairs, bushings = pairs_of(model), {bushing.equality: bushing for bushing in bushings_of(model)}
    for r in range(data.nefc):
        if data.efc_type[r] == _Constraint.mjCNSTR_EQUALITY and data.efc_id[r] in bushings:
            if r == 0 or data.efc_id[r - 1] != data.efc_id[r] or data.efc_type[r - 1] != data.efc_type[r]:
                yield from _bushing_rows(model, data, r, bushings[data.efc_id[r]])
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
        if _is_stiff(model, solref):
            (stiffness, damping, impedance, _), mass = data.efc_KBIP[r], 1 / data.efc_R[r]
            yield ContactRow(element, _jacobian(model, data, r), stiffness * impedance * mass, damping * mass, mass)


def _bushing_rows(model: mujoco.MjModel, data: mujoco.MjData, first: int, bushing: SiteBushing) -> Iterator[ContactRow]:
    """Yield rows along and about the axes of a bushing between two sites; ``first`` is the first of the solver's."""
    k, c = model.numeric_data[bushing.numeric :][: 2 * bushing.axes].reshape(2, -1)
    rows = np.array([_jacobian(model, data, r) for r in range(first, first + bushing.axes)])
    mass, scale = 1 / data.efc_R[first : first + bushing.axes], model.eq_data[bushing.equality, 10]
    rows[:3] = data.site_xmat[bushing.site].reshape(3, 3).T @ rows[:3]
    for j in range(bushing.axes):
        lever = 1.0 if j < 3 else 2 / scale  # residual to angle, see `bushing_loop`
        yield ContactRow(f'bushing "{bushing.name}"', lever * rows[j], k[j], c[j], mass[j] / lever**2)


def _jacobian(model: mujoco.MjModel, data: mujoco.MjData, r: int) -> np.ndarray:
    if not mujoco.mj_isSparse(model):
        return data.efc_J.reshape(-1, model.nv)[r].copy()
    return _dense_row(model, data.efc_J_colind, data.efc_J, data.efc_J_rowadr[r], data.efc_J_rownnz[r])


def _separated_rows(
    model: mujoco.MjModel, data: mujoco.MjData, bristles: dict[int, list[ContactRow]]
) -> Iterator[list[ContactRow]]:
    """Yield contact and friction rows of pairs of geoms that do not touch, at their nearest points.

    Their rows are removed from ``bristles``.
    """
    off = model.opt.disableflags & (_Bits.mjDSBL_CONSTRAINT | _Bits.mjDSBL_CONTACT)
    touching = {frozenset(c.geom.tolist()) for c in data.contact[: data.ncon] if c.efc_address >= 0}
    for i in range(model.npair):
        geoms = int(model.pair_geom1[i]), int(model.pair_geom2[i])
        if frozenset(geoms) in touching:
            continue
        rows = bristles.pop(i, [])
        if not off and _is_stiff(model, model.pair_solref[i]):
            normal, relative = _normal(model, data, i)
            if normal.any():
                rows += _element_rows(model, "pair", i, (normal @ relative)[None])
        if rows := [row for row in rows if row.direction.any()]:
            yield rows


def _normal(model: mujoco.MjModel, data: mujoco.MjData, pair: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal (3,) of a pair at its nearest points, 0 if far apart, and their relative Jacobian (3, nv)."""
    geoms = [int(model.pair_geom1[pair]), int(model.pair_geom2[pair])]
    distance, ends = _distance(model, data, geoms)
    normal = ends[3:] - ends[:3]
    if not normal.any() and abs(distance) < _NEAREST_WITHIN:  # they just touch: try displacements
        displacements = [_LIFT * lift for lift in (*np.eye(3), *-np.eye(3))]
        farthest = max((_distance(model, data, geoms, lift) for lift in displacements), key=lambda result: result[0])
        normal = farthest[1][3:] - farthest[1][:3]
    length = np.linalg.norm(normal)
    is_near = abs(distance) < _NEAREST_WITHIN and length > 0
    relative = _difference(model, data, model.geom_bodyid[geoms], ends.reshape(2, 3))
    return normal / length if is_near else np.zeros(3), relative


def _distance(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], lift: ArrayLike = 0.0
) -> tuple[float, np.ndarray]:  # fmt: skip
    """Return the distance of two geoms, the second displaced by ``lift``, m, and their nearest points (6,)."""
    position, ends = data.geom_xpos[geoms[1]], np.zeros(6)
    original = position.copy()
    position += lift
    distance = mujoco.mj_geomDistance(model, data, *geoms, _NEAREST_WITHIN, ends)
    position[:] = original
    return distance, ends


def _tendon_jacobian(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> np.ndarray:
    """Return the Jacobian (1, nv) of a tendon's length; (3, nv) where its two sites coincide."""
    first, count = model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon]
    row = _dense_row(model, model.ten_J_colind, data.ten_J, first, count)[None]
    wraps = slice(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
    if row.any() or model.wrap_type[wraps].tolist() != 2 * [int(mujoco.mjtWrap.mjWRAP_SITE)]:
        return row
    ends = model.wrap_objid[wraps]
    return _difference(model, data, model.site_bodyid[ends], data.site_xpos[ends])


def _difference(model: mujoco.MjModel, data: mujoco.MjData, bodies: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the Jacobian (3, nv) of the relative velocity of two points, second body less first."""
    jacobians = np.zeros((2, 3, model.nv))
    for jacobian, body, point in zip(jacobians, bodies, points):
        mujoco.mj_jac(model, data, jacobian, None, point, body)
    return jacobians[1] - jacobians[0]
