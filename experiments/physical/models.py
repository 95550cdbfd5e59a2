"""Softness of foreign MuJoCo models: `python -m experiments.physical.models --out FOLDER`.

Limits, contacts and backlash in the models that come with gymnasium, dm_control and gymnasium-robotics (only the files
are read), each at random poses: the static force against k r, the frequency of ringing against √(k a - (c a/2)²) with
a = J M⁻¹ Jᵀ of the pose, and beside it what MuJoCo makes of its default solref, of solref="-k -c", and of two hinges.
"""

from __future__ import annotations

import argparse
import copy
import importlib.util
import json
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
DEPTH = {"joint": 1e-4, "tendon": 1e-5, "pair": 1e-6}  # rad or m, of the violation at rest; it rings by a fifth of that
PERIODS, PER_PERIOD = 3, 200
GAP = 0.01
PROBE = "probe"
_BITS = mujoco.mjtDisableBit


def path_of(name: str) -> Path | None:
    """Where a model is; None if its package is not installed."""
    package, _, rest = MODELS[name].partition("/")
    found = importlib.util.find_spec(package)
    return Path(found.submodule_search_locations[0]) / rest if found else None


def load(name: str) -> mujoco.MjSpec:
    """Read a foreign model."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
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
        _, along, _ = _length(model, data, Row(kind, name, 0, 0), 1)
    inverse = along @ np.linalg.solve(mass, along) if along.any() else _inverse_mass(model, name)
    return Row(kind, name, RINGS**2 / inverse, 2 * RATIO * RINGS / inverse)


def _inverse_mass(model: mujoco.MjModel, pair: str) -> float:
    geom = model.geom(pair.removeprefix(f"{PROBE} - ")).id
    return model.body_invweight0[model.geom_bodyid[geom], 0]


def _give(spec: mujoco.MjSpec, row: Row) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if row.kind == "joint":
            physical.joint_limit(spec, row.name, row.k, row.c)
        elif row.kind == "tendon":
            physical.tendon_limit(spec, row.name, row.k, row.c)
        else:
            other = row.name.removeprefix(f"{PROBE} - ")
            spec.add_pair(name=row.name, geomname1=PROBE, geomname2=other, condim=1)
            physical.contact(spec, (PROBE, other), row.k, row.c)


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
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
    found = np.flatnonzero(data.efc_type == _TYPES[row.kind])
    if row.kind != "pair":
        return [r for r in found if data.efc_id[r] == _id(model, row)]
    pair = _id(model, row)
    geoms = {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
    return [r for r in found if set(data.contact[data.efc_id[r]].geom.tolist()) == geoms]


def jacobian(model: mujoco.MjModel, data: mujoco.MjData, r: int) -> np.ndarray:
    """(nv,) row of the solver's Jacobian."""
    if not mujoco.mj_isSparse(model):
        return data.efc_J.reshape(-1, model.nv)[r].copy()
    full, first = np.zeros(model.nv), data.efc_J_rowadr[r]
    entries = slice(first, first + data.efc_J_rownnz[r])
    full[data.efc_J_colind[entries]] = data.efc_J[entries]
    return full


def violate(model: mujoco.MjModel, data: mujoco.MjData, row: Row, depth: float, side: int) -> int | None:
    """Move a pose until a limit or contact is violated by so much; return the solver's row, or None if it cannot be."""
    if row.kind == "pair":
        tries = (_press(model, data, row, depth, n) for n in range(30))
        return next((r for r in tries if r is not None), None)
    for _ in range(30):
        value, along, target = _length(model, data, row, side)
        wrong = target + side * depth - value
        if along @ along < 1e-12:
            return None
        mujoco.mj_integratePos(model, data.qpos, along * wrong / (along @ along), 1.0)
        if abs(wrong) < 1e-12:
            break
    return _single(model, data, row, depth)


def _single(model: mujoco.MjModel, data: mujoco.MjData, row: Row, depth: float) -> int | None:
    mujoco.mj_forward(model, data)
    rows = active(model, data, row)
    return rows[0] if len(rows) == 1 and data.efc_pos[rows[0]] < -0.5 * depth else None


def _length(model: mujoco.MjModel, data: mujoco.MjData, row: Row, side: int) -> tuple[float, np.ndarray, float]:
    """Value of a joint or tendon, its direction (nv,), and its limit on a side."""
    i, along = _id(model, row), np.zeros(model.nv)
    mujoco.mj_fwdPosition(model, data)
    if row.kind == "joint":
        along[model.jnt_dofadr[i]] = 1.0
        return data.qpos[model.jnt_qposadr[i]], along, model.jnt_range[i, (side + 1) // 2]
    entries = slice(model.ten_J_rowadr[i], model.ten_J_rowadr[i] + model.ten_J_rownnz[i])
    along[model.ten_J_colind[entries]] = data.ten_J[entries]
    return data.ten_length[i], along, model.tendon_range[i, (side + 1) // 2]


def _press(model: mujoco.MjModel, data: mujoco.MjData, row: Row, depth: float, n: int) -> int | None:
    """Press the probe so deep on a geom, in a direction of pose and n; None if the geom hardly gives there."""
    mujoco.mj_fwdPosition(model, data)
    geom = model.geom(row.name.removeprefix(f"{PROBE} - ")).id
    probe, centre = model.geom(PROBE).id, data.geom_xpos[geom].copy()
    away = np.sin(1e3 * data.qpos.sum() + n + np.array([0.0, 2.1, 4.3]))
    away /= np.linalg.norm(away)
    place = model.geom_rbound[geom] + model.geom_size[probe, 0]
    for _ in range(40):
        data.mocap_pos[0] = centre + place * away
        mujoco.mj_kinematics(model, data)
        wrong = mujoco.mj_geomDistance(model, data, geom, probe, 10.0, None) + depth
        place -= wrong
        if abs(wrong) < 1e-13:
            break
    r = _single(model, data, row, depth)
    if r is None or inverse_inertia(model, data, jacobian(model, data, r)) < 0.1 * _inverse_mass(model, row.name):
        return None
    return r


def inverse_inertia(model: mujoco.MjModel, data: mujoco.MjData, along: np.ndarray) -> float:
    """J M⁻¹ Jᵀ."""
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return float(along @ np.linalg.solve(mass, along))


def static_force(model: mujoco.MjModel, data: mujoco.MjData, row: Row, r: int) -> float:
    """Force of a row while the whole model is held at rest in its pose, by forces that inverse dynamics tells."""
    data.qvel[:], data.qacc[:] = 0, 0
    mujoco.mj_inverse(model, data)
    data.qfrc_applied[:] = data.qfrc_inverse - data.qfrc_actuator
    mujoco.mj_forward(model, data)
    return float(data.efc_force[active(model, data, row)[0]])


def frequency(model: mujoco.MjModel, row: Row, pose: np.ndarray, side: int) -> tuple[float, float] | None:
    """Frequency, Hz, of a limit's or contact's ringing in a pose, alone, and the closed form's."""
    model = alone(model, row)
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    depth = DEPTH[row.kind]
    r = violate(model, data, row, depth, side)
    if r is None:
        return None
    along, mass = jacobian(model, data, r), np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    moves = np.linalg.solve(mass, along)
    inverse, preload = along @ moves, row.k * -data.efc_pos[r]
    expected = np.sqrt(row.k * inverse - (row.c * inverse / 2) ** 2) / (2 * np.pi)
    if not np.isfinite(expected):
        return None
    data.qfrc_applied[:] = -preload * along
    data.qvel[:] = 0.2 * depth * 2 * np.pi * expected * moves / inverse
    model.opt.timestep = 1 / (expected * PER_PERIOD)
    start, moved = data.qpos.copy(), np.zeros(model.nv)
    height = np.zeros((PERIODS + 1) * PER_PERIOD)
    for i in range(len(height)):
        mujoco.mj_step(model, data)
        mujoco.mj_differentiatePos(model, moved, 1.0, start, data.qpos)
        height[i] = along @ moved
    up = np.flatnonzero((height[:-1] < 0) & (height[1:] >= 0))
    at = (up + height[up] / (height[up] - height[up + 1])) * model.opt.timestep
    return (len(at) - 1) / (at[-1] - at[0]) if len(at) > 1 else np.nan, expected


@dataclass
class Errors:
    """Largest errors of a model's rows, and how many were measured."""

    rows: int = 0
    cases: int = 0
    static: float = 0.0
    ringing: float = 0.0


def measure(model: mujoco.MjModel, rows: list[Row], count: int, ringing: bool = True) -> dict[str, Errors]:
    """Largest relative errors of the static force and of the ringing frequency, by kind of row."""
    found = {kind: Errors() for kind in ("joint", "tendon", "pair")}
    data, places = mujoco.MjData(model), list(poses(model, count))
    for row in rows:
        cases, errors = 0, found[row.kind]
        for n, pose in enumerate(places):
            side = 1 if n % 2 else -1
            mujoco.mj_resetData(model, data)
            data.qpos[:] = pose
            r = violate(model, data, row, DEPTH[row.kind], side)
            if r is None:
                continue
            expected = row.k * -data.efc_pos[r]
            errors.static = max(errors.static, abs(static_force(model, data, row, r) / expected - 1))
            rings = frequency(model, row, pose, side) if ringing else None
            if rings:
                errors.ringing = max(errors.ringing, abs(rings[0] / rings[1] - 1))
            cases += 1
        errors.rows, errors.cases = errors.rows + bool(cases), errors.cases + cases
    return found


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
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                physical.add_backlash(spec, joint, GAP, row.k, row.c, inertia=inertia)
            rows.append(Row("tendon", f"{joint} backlash", row.k, row.c))
    model = _compiled(spec)
    if scale != 1:  # heavier links, the same k and c
        model.body_mass[:] *= scale
        model.body_inertia[:] *= scale
        mujoco.mj_setConst(model, mujoco.MjData(model))
    physical.apply(model)
    return model, rows


def teeth(model: mujoco.MjModel, row: Row, pose: np.ndarray, side: int) -> tuple[float, float]:
    """Stiffness and play to a side, from the static forces at two angles between load and drive."""
    data, forces, angles = mujoco.MjData(model), [], []
    load, _, how = row.name.rpartition(" ")
    for depth in (1e-4, 2e-4):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = pose
        r = violate(model, data, row, depth, side)
        turned = data.joint(row.name).qpos[0] if how == "play" else (
            data.joint(load).qpos[0] - data.joint(f"{load} drive").qpos[0]
        )  # fmt: skip
        angles.append(abs(turned))
        forces.append(static_force(model, data, row, r))
    stiffness = (forces[1] - forces[0]) / (angles[1] - angles[0])
    return stiffness, angles[0] - forces[0] / stiffness


def measure_backlash(name: str, count: int) -> dict[str, float]:
    """Largest errors of stiffness and play over poses and over links ten times as heavy; and what the recipe gives."""
    found = {"joints": 0, "stiffness": 0.0, "play": 0.0, "ringing": 0.0}
    values: dict[str, list[float]] = {}
    for scale in (1.0, 10.0):
        for recipe in (False, True):
            model, rows = geared(name, recipe, scale)
            if recipe:
                model = alone_in_force(model)
            for row in rows:
                for n, pose in enumerate(poses(model, count)):
                    stiffness, play = teeth(model, row, pose, 1 if n % 2 else -1)
                    if recipe:
                        values.setdefault(row.name, []).append(stiffness / row.k)
                        continue
                    found["stiffness"] = max(found["stiffness"], abs(stiffness / row.k - 1))
                    found["play"] = max(found["play"], abs(play / GAP - 1))
            if not recipe and scale == 1:
                found["joints"] = len(rows)
                found["ringing"] = max((e.ringing for e in measure(model, rows, count).values()), default=0.0)
    ratios = [max(v) / min(v) for v in values.values()]
    return found | {"two hinges, stiffest over softest": max(ratios, default=np.nan)}


def alone_in_force(model: mujoco.MjModel) -> mujoco.MjModel:
    """The model without contacts, whose hard ones in a random pose would hide what a default limit does."""
    model.opt.disableflags |= int(_BITS.mjDSBL_CONTACT)
    return model


def defaults(name: str, count: int) -> dict[str, float]:
    """What the limits of a model are, as it comes, in N m/rad: the softest and the stiffest."""
    model, rows = softened(name)
    rows = [row for row in rows if row.kind == "joint"]
    model.jnt_solref[:], model.jnt_solimp[:] = (0.02, 1), (0.9, 0.95, 0.001, 0.5, 2)
    model, found = alone_in_force(model), []
    data = mujoco.MjData(model)
    for row in rows:
        for pose in poses(model, count):
            mujoco.mj_resetData(model, data)
            data.qpos[:] = pose
            r = violate(model, data, row, 1e-3, 1)
            if r is not None:
                found.append(static_force(model, data, row, r) / 1e-3)
    return {"softest": min(found, default=np.nan), "stiffest": max(found, default=np.nan)}


def table(found: dict[str, dict]) -> str:
    """Write the results as Markdown."""
    lines = [
        "| model | limits and contacts | cases | static error | ringing error | default limits, N m/rad | backlash in "
        "| its stiffness | its play | its ringing | two hinges: stiffest/softest |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, row in found.items():
        kinds, teeth_of, default = row["rows"].values(), row["backlash"], row["default"]
        lines.append(
            f"| {name} | {sum(e['rows'] for e in kinds)} | {sum(e['cases'] for e in kinds)} "
            f"| {max(e['static'] for e in kinds):.1e} | {max(e['ringing'] for e in kinds):.1e} "
            f"| {default['softest']:.3g} to {default['stiffest']:.3g} | {teeth_of['joints']} "
            f"| {teeth_of['stiffness']:.1e} | {teeth_of['play']:.1e} | {teeth_of['ringing']:.1e} "
            f"| {teeth_of['two hinges, stiffest over softest']:.3g} |"
        )
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/physical_models"))
    parser.add_argument("--poses", type=int, default=20)
    parser.add_argument("--models", nargs="*", default=list(MODELS))
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    found: dict[str, dict] = {}
    for name in options.models:
        if not path_of(name):
            print(f"{name}: its package is not installed")
            continue
        rows = {kind: vars(errors) for kind, errors in measure(*softened(name), options.poses).items()}
        found[name] = {
            "rows": rows, "backlash": measure_backlash(name, options.poses), "default": defaults(name, options.poses)
        }  # fmt: skip
        (options.out / "physical_models.json").write_text(json.dumps(found, indent=1, default=float))
        (options.out / "physical_models.md").write_text(table(found))
        print(name, found[name], flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
