"""Foreign models with softness on each contact, limit and play, and the row of each by itself."""

import copy
import importlib.util
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

import clearance_mj.physical as physical

GYMNASIUM, SUITE, ROBOTICS = "gymnasium/envs/mujoco/assets", "dm_control/suite", "gymnasium_robotics/envs/assets"
MODELS = {
    **{f"gymnasium {n}": f"{GYMNASIUM}/{n}.xml" for n in (
        "ant", "half_cheetah", "hopper", "humanoid", "inverted_double_pendulum", "pusher", "reacher", "swimmer",
        "walker2d",
    )},
    **{f"dm_control {n}": f"{SUITE}/{n}.xml" for n in (
        "ball_in_cup", "cartpole", "finger", "humanoid_CMU", "manipulator", "quadruped",
    )},
    "gymnasium-robotics hand": f"{ROBOTICS}/hand/reach.xml",
    "gymnasium-robotics door": f"{ROBOTICS}/adroit_hand/adroit_door.xml",
    "gymnasium-robotics fetch": f"{ROBOTICS}/fetch/pick_and_place.xml",
}  # fmt: skip
RINGS, RATIO = 2 * np.pi * 100.0, 0.01  # rad/s and damping ratio of each spring with the inertia of the initial pose
GAP = 0.01
PROBE = "probe"
_BITS = mujoco.mjtDisableBit


def path_of(name: str) -> Path | None:
    """Return the path of a model; None if its package is not installed."""
    package, _, rest = MODELS[name].partition("/")
    spec = importlib.util.find_spec(package)
    return Path(spec.submodule_search_locations[0]) / rest if spec else None


def load(name: str) -> mujoco.MjSpec:
    """Read a foreign model."""
    with warnings.catch_warnings(action="ignore"):
        return mujoco.MjSpec.from_file(str(path_of(name)))


@dataclass(frozen=True)
class Row:
    """A limit or contact, and the stiffness and damping that it was given."""

    kind: str  # "joint", "tendon", "pair"
    name: str
    k: float
    c: float


def softened(name: str) -> tuple[mujoco.MjModel, list[Row]]:
    """Give every limit of a model, and the contacts of its geoms with a probe, a stiffness and damping of its own."""
    spec = load(name)
    body = spec.worldbody.add_body(name=PROBE, mocap=True)
    body.add_geom(name=PROBE, size=[0.02, 0, 0], contype=0, conaffinity=0, condim=1)
    _name_all(spec)
    model = _compiled(spec)
    rows = [_row(model, "joint", model.joint(i).name) for i in np.flatnonzero(model.jnt_limited)]
    rows += [_row(model, "tendon", model.tendon(i).name) for i in np.flatnonzero(model.tendon_limited)]
    rows += [_row(model, "pair", f"{PROBE} - {model.geom(i).name}") for i in _solid(model)]
    for row in rows:
        _give(spec, row)
    return _compiled(spec), rows


def _row(model: mujoco.MjModel, kind: str, name: str) -> Row:
    """Stiffness and damping for the inertia that a row has in the initial pose."""
    data, along, mass = mujoco.MjData(model), np.zeros(model.nv), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    if kind == "joint":
        along[model.joint(name).dofadr] = 1.0
    elif kind == "tendon":
        _, along, _ = length_of(model, data, Row(kind, name, 0, 0), 1)
    inverse = along @ np.linalg.solve(mass, along) if along.any() else invweight(model, name)
    return Row(kind, name, RINGS**2 / inverse, 2 * RATIO * RINGS / inverse)


def invweight(model: mujoco.MjModel, pair: str) -> float:
    return model.body_invweight0[model.geom_bodyid[model.geom(pair.removeprefix(f"{PROBE} - ")).id], 0]


def _give(spec: mujoco.MjSpec, row: Row) -> None:
    with warnings.catch_warnings(action="ignore"):
        if row.kind == "joint":
            physical.joint_limit(spec, row.name, row.k, row.c)
        elif row.kind == "tendon":
            physical.tendon_limit(spec, row.name, row.k, row.c)
        else:
            other = row.name.removeprefix(f"{PROBE} - ")
            spec.add_pair(name=row.name, geomname1=PROBE, geomname2=other, condim=1)
            physical.contact(spec, (PROBE, other), row.k, row.c)


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    with warnings.catch_warnings(action="ignore"):
        return spec.compile()


def _name_all(spec: mujoco.MjSpec) -> None:
    for what in (spec.geoms, spec.joints, spec.tendons):
        for i, element in enumerate(what):
            element.name = element.name or f"unnamed {i}"


def _solid(model: mujoco.MjModel) -> list[int]:
    """Round geoms that collide, on bodies that move: their distance to a sphere is known in closed form."""
    round_ones = (int(mujoco.mjtGeom.mjGEOM_SPHERE), int(mujoco.mjtGeom.mjGEOM_CAPSULE))
    moves, collides = model.body_weldid[model.geom_bodyid] > 0, model.geom_contype | model.geom_conaffinity
    moves &= model.body_invweight0[model.geom_bodyid, 0] > 0
    return [i for i in np.flatnonzero(moves & (collides > 0)) if model.geom_type[i] in round_ones]


def poses(model: mujoco.MjModel, count: int, seed: int = 0) -> Iterator[np.ndarray]:
    """Yield random positions within the limits: a radian or metre about the initial ones where there are none."""
    rng, data = np.random.default_rng(seed), mujoco.MjData(model)
    for _ in range(count):
        data.qpos[:] = model.qpos0
        mujoco.mj_integratePos(model, data.qpos, rng.uniform(-1, 1, model.nv), 1.0)
        for j in np.flatnonzero(model.jnt_limited & (model.jnt_type >= int(mujoco.mjtJoint.mjJNT_SLIDE))):
            low, high = model.jnt_range[j]
            data.qpos[model.jnt_qposadr[j]] = rng.uniform(low, high)
        yield data.qpos.copy()


def alone(model: mujoco.MjModel, row: Row) -> mujoco.MjModel:
    """Copy a model in which nothing acts but this limit or contact."""
    model = copy.copy(model)
    bits = _BITS.mjDSBL_EQUALITY | _BITS.mjDSBL_FRICTIONLOSS | _BITS.mjDSBL_SPRING | _BITS.mjDSBL_DAMPER
    model.opt.disableflags |= int(bits | _BITS.mjDSBL_GRAVITY | _BITS.mjDSBL_ACTUATION)
    model.opt.viscosity, model.opt.density = 0, 0
    keep = _id(model, row)
    if row.kind == "pair":
        model.opt.disableflags |= int(_BITS.mjDSBL_LIMIT)
        model.geom_contype[:], model.geom_conaffinity[:] = 0, 0
        others = np.arange(model.npair) != keep
        model.pair_margin[others] = -1e3
    else:
        model.opt.disableflags |= int(_BITS.mjDSBL_CONTACT)
        for kind, limited in (("joint", model.jnt_limited), ("tendon", model.tendon_limited)):
            limited[np.arange(len(limited)) != (keep if kind == row.kind else -1)] = 0
    return model


def _id(model: mujoco.MjModel, row: Row) -> int:
    return getattr(model, row.kind)(row.name).id


_TYPES = {
    "joint": mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT,
    "tendon": mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON,
    "pair": mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS,
}


def active(model: mujoco.MjModel, data: mujoco.MjData, row: Row) -> list[int]:
    """Rows of the solver that a limit or contact has now."""
    rows = np.flatnonzero(data.efc_type == _TYPES[row.kind])
    if row.kind != "pair":
        return [r for r in rows if data.efc_id[r] == _id(model, row)]
    pair = _id(model, row)
    geoms = {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
    return [r for r in rows if set(data.contact[data.efc_id[r]].geom.tolist()) == geoms]


def length_of(model: mujoco.MjModel, data: mujoco.MjData, row: Row, side: int) -> tuple[float, np.ndarray, float]:
    """Value of a joint or tendon, its direction (nv,), and its limit on a side."""
    i, along = _id(model, row), np.zeros(model.nv)
    mujoco.mj_fwdPosition(model, data)
    if row.kind == "joint":
        along[model.jnt_dofadr[i]] = 1.0
        return data.qpos[model.jnt_qposadr[i]], along, model.jnt_range[i, (side + 1) // 2]
    entries = slice(model.ten_J_rowadr[i], model.ten_J_rowadr[i] + model.ten_J_rownnz[i])
    along[model.ten_J_colind[entries]] = data.ten_J[entries]
    return data.ten_length[i], along, model.tendon_range[i, (side + 1) // 2]


def driven(model: mujoco.MjModel, most: int = 6) -> list[str]:
    """Hinges that actuators drive."""
    joint = int(mujoco.mjtTrn.mjTRN_JOINT)
    ids = [int(i) for i, trn in zip(model.actuator_trnid[:, 0], model.actuator_trntype) if trn == joint]
    hinges = [i for i in dict.fromkeys(ids) if model.jnt_type[i] == int(mujoco.mjtJoint.mjJNT_HINGE)]
    return [model.joint(i).name for i in hinges[:most]]


def geared(name: str, recipe: bool, scale: float = 1.0) -> tuple[mujoco.MjModel, list[Row]]:
    """A model with play in its driven hinges: ours, or by a second hinge with a limit of the default softness."""
    spec = load(name)
    _name_all(spec)
    plain, rows = _compiled(spec), []
    for joint in driven(plain):
        row = _row(plain, "joint", joint)
        inertia = row.k / RINGS**2  # of the drive: the load's own in the initial pose
        if recipe:
            if len(spec.joint(joint).parent.joints) > 5:
                continue  # MuJoCo allows six in one body
            load_joint, degrees = spec.joint(joint), spec.compiler.degree
            limits = np.array([-GAP, GAP])
            load_joint.parent.add_joint(
                name=f"{joint} play", axis=load_joint.axis, pos=load_joint.pos, armature=1e-3 * inertia, margin=0,
                limited=mujoco.mjtLimited.mjLIMITED_TRUE, range=np.rad2deg(limits) if degrees else limits,
                solref_limit=[0.02, 1], solimp_limit=[0.9, 0.95, 0.001, 0.5, 2],
            )  # fmt: skip
            rows.append(Row("joint", f"{joint} play", row.k, row.c))
        else:
            with warnings.catch_warnings(action="ignore"):
                armature = spec.joint(joint).armature
                physical.add_backlash(spec, joint, GAP, row.k, row.c, inertia=inertia)
                spec.joint(joint).armature = armature  # most of such links' inertia, for which their step is made
            rows.append(Row("tendon", f"{joint} backlash", row.k, row.c))
    model = _compiled(spec)
    if scale != 1:  # heavier links, the same k and c
        model.body_mass[:] *= scale
        model.body_inertia[:] *= scale
        mujoco.mj_setConst(model, mujoco.MjData(model))
    physical.apply(model)
    return model, rows
