"""Clearances added to a specification: play between a joint and its drive, and a shaft in a bushing."""

from __future__ import annotations

import numbers
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from ..core.errors import ModelError
from .actuators import drives_joint, fix_damping, fix_ranges
from .damping import damping_ratio_of
from .elements import change_spec, compile_target, find, joint_kind, name_of, require_spec, store_softness
from .softness import Softness, softness

if TYPE_CHECKING:
    from ..clearance.law import Law

__all__ = ["add_annular_clearance", "add_backlash", "half_gap"]

_TINY = 1e-9  # kg and kg m², of a body that only carries a drive's inertia


def add_backlash(
    spec: mujoco.MjSpec, joint: Any, gap: float | None = None, k: float | None = None, c: float | None = None,
    inertia: float | None = None, *, backlash: float | None = None, damping_ratio: float | None = None,
    restitution: float | None = None, law: Law | None = None, native: bool = False,
    implicit: bool = False,
) -> Any:  # fmt: skip
    """Put play between a joint and its drive, which becomes a separate joint.

    The joint remains the load's position, with its limits, springs, dampers and sensors. The drive, a new
    joint "NAME drive", takes over the actuators and the armature. Tendon "NAME backlash", the load's position less
    the drive's, is limited to ±gap: the teeth press with k r + c ṙ, never pulling, r the excess over the gap.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place; its keyframes get the drive at the load's position.
    joint : str or mujoco.MjsJoint, or a list of them
        Hinges or slides; several are compiled once.
    gap : float
        To either side, rad (m for a slide), > 0: half the backlash that makers of gears state.
    backlash : float
        Instead of the gap: from side to side, degrees, as catalogues have it; of a hinge.
    k : float
        Stiffness of the teeth at the joint, N m/rad (N/m), > 0.
    c : float
        Their damping, N m s/rad (N s/m), >= 0.
    damping_ratio, restitution : float, optional
        Instead of c, of drive and load against each other; see `contact`.
    inertia : float, optional
        Of the drive at the joint (rotor times gear ratio squared), kg m² (kg), > 0; by default the joint's armature,
        which is set to 0.
    law : Law, optional
        Instead of k and c, with grease too; a `Softener` makes the teeth follow it.
    native : bool
        Make the tendon a spring with a dead band instead of a limit: k and gap are exact in every integrator,
        ``discrete`` too, in MJX and MuJoCo Warp, without a row of the solver's; its damping acts inside the gap too,
        and it may pull while teeth part. It needs c.
    implicit : bool
        Let teeth, rotor and load interact as by backward Euler: stable at any time step; see `contact`.

    Returns
    -------
    mujoco.MjsJoint, or a list of them
        The drive, to give it friction and damping.

    Raises
    ------
    ModelError
        For a joint that the model does not have, of another type, or moved by a tendon or an equality instead of an
        actuator, a gap that is not > 0, and a drive without inertia. The specification is then unchanged.
    LawError
        For a stiffness or damping out of range.
    """
    model = compile_target(require_spec(spec))
    names = [name_of(element) for element in (joint if isinstance(joint, list) else [joint])]
    kinds = {name: joint_kind(model, name, "backlash") for name in names}
    half = half_gap(gap, backlash, all(kind == mujoco.mjtJoint.mjJNT_HINGE for kind in kinds.values()))
    contact = _clearance_softness(half, k, c, law, damping_ratio_of(c, damping_ratio, restitution), implicit)
    if native and (law is not None or contact.ratio is not None or implicit):
        raise ModelError("native backlash is a spring and a damper: give k and c")
    inertias = {}
    for name in names:
        if spec.joint(f"{name} drive"):
            raise ModelError(f'joint "{name}" has backlash already')
        _require_own_actuator(spec, model, name)
        given, words = (inertia, ":") if inertia is not None else (spec.joint(name).armature, " has no armature: give")
        if not 0 < given < np.inf:
            raise ModelError(f'joint "{name}"{words} inertia of the drive > 0, got {given:g}')
        inertias[name] = float(given)
    positions = {name: [_position(key.qpos, model, name) for key in spec.keys] for name in names}
    saved = [np.array(key.qpos) for key in spec.keys], [np.array(key.qvel) for key in spec.keys]

    def between(changed: mujoco.MjSpec) -> list[mujoco.MjsJoint]:
        drive_joints = []
        fix_damping(changed, model)
        for name in names:
            load = changed.joint(name)
            drive = _add_drive(changed, load, kinds[name], inertias[name])
            load.armature = 0.0
            for actuator in changed.actuators:
                if drives_joint(actuator, name):
                    fix_ranges(actuator, model)
                    actuator.target = drive.name
            tendon = _add_tendon(changed, f"{name} backlash", (-half, half))
            tendon.wrap_joint(name, 1.0)
            tendon.wrap_joint(drive.name, -1.0)
            if native:
                tendon.limited, tendon.springlength = mujoco.mjtLimited.mjLIMITED_FALSE, (-half, half)
                tendon.stiffness[0], tendon.damping[0] = contact.k, contact.c
            else:
                store_softness(changed, "tendon", [tendon.name], contact)
            drive_joints.append(drive)
        for key in changed.keys:
            key.qpos, key.qvel = np.zeros(0), np.zeros(0)
        return drive_joints

    drives, changed_model = change_spec(spec, between)
    ordered = sorted(((changed_model.joint(drive.name), positions[name]) for drive, name in zip(drives, names)),
                    key=lambda element: element[0].qposadr[0])  # fmt: skip
    _extend_keys(spec, ordered, *saved)
    return drives if isinstance(joint, list) else drives[0]


def half_gap(gap: float | None, backlash: float | None, turns: bool) -> float:
    """Return the play to either side, rad (m), given that or a backlash from side to side, degrees.

    Raises
    ------
    ModelError
        For both or neither, and a backlash in degrees of what is no hinge.
    """
    if (gap is None) == (backlash is None):
        raise ModelError("give gap, to either side, rad (m), or backlash, from side to side, degrees")
    if backlash is None:
        return gap  # type: ignore[return-value]
    if not turns:
        raise ModelError("backlash in degrees is of a hinge; give a slide or a tendon a gap to either side")
    if not isinstance(backlash, numbers.Real):
        raise ModelError(f"backlash {backlash} must be a number of degrees")
    return float(np.deg2rad(backlash)) / 2


def add_annular_clearance(
    spec: mujoco.MjSpec, site_a: Any, site_b: Any, gap: float, k: float | None = None, c: float | None = None, *,
    law: Law | None = None, implicit: bool = False,
) -> mujoco.MjsTendon:  # fmt: skip
    """Let two sites move apart freely up to a gap: a bushing or a ball joint with play.

    Tendon "A in B", the distance of the sites, is limited to [0, gap]: a radial contact without friction in any
    direction, of force k r + c ṙ, never pulling, r the excess over the gap. For sites that coincide in the model's
    initial pose use `compile`, or `apply` to the model: MuJoCo knows the inertia behind them in one direction
    only, and may make the limit rigid.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place.
    site_a, site_b : str or mujoco.MjsSite
        On two bodies, such as the shaft's axis and the bushing's centre.
    gap : float
        Radial clearance, m, > 0.
    k : float
        Stiffness, N/m, > 0.
    c : float
        Damping, N s/m, >= 0.
    law : Law, optional
        Instead of k and c; a `Softener` makes the contact follow it. Its grease acts along the tendon.
    implicit : bool
        Apply it as by backward Euler; see `contact`.

    Returns
    -------
    mujoco.MjsTendon
        The tendon.

    Raises
    ------
    ModelError
        For a site that the model does not have, sites on one body, and a gap that is not > 0.
    LawError
        For a stiffness or damping out of range.
    """
    contact = _clearance_softness(gap, k, c, law, implicit=implicit)
    model, names = compile_target(require_spec(spec)), [name_of(site) for site in (site_a, site_b)]
    bodies = [model.body_weldid[model.site_bodyid[find(model, "site", name)]] for name in names]
    if bodies[0] == bodies[1]:
        raise ModelError(f'sites "{names[0]}" and "{names[1]}" are on one rigid body, so there is no clearance')

    def between(changed: mujoco.MjSpec) -> mujoco.MjsTendon:
        tendon = _add_tendon(changed, " in ".join(names), (0.0, gap))
        for name in names:
            tendon.wrap_site(name)
        store_softness(changed, "tendon", [tendon.name], contact)
        return tendon

    return change_spec(spec, between)[0]


def _clearance_softness(
    gap: float, k: float | None, c: float | None, law: Law | None, ratio: float | None = None, implicit: bool = False
) -> Softness:  # fmt: skip
    if not isinstance(gap, numbers.Real) or not 0 < gap < np.inf:
        raise ModelError(f"gap {gap} must be > 0 and finite; it is the play to one side")
    return softness(k, c, law, gap, ratio, implicit)


def _add_drive(spec: mujoco.MjSpec, load: Any, kind: mujoco.mjtJoint, inertia: float) -> mujoco.MjsJoint:
    """Add a joint with this inertia alone, independent of the specification's defaults."""
    name, body = f"{load.name} drive", load.parent
    carrier = body.parent.add_body(
        name=name, pos=body.pos, mass=_TINY, ipos=[0, 0, 0], inertia=[_TINY] * 3, explicitinertial=True
    )
    return carrier.add_joint(
        name=name, type=kind, axis=load.axis, ref=load.ref, armature=inertia, limited=mujoco.mjtLimited.mjLIMITED_FALSE,
        stiffness=[0, 0, 0], damping=[0, 0, 0], frictionloss=0, margin=0, actfrclimited=load.actfrclimited,
        actfrcrange=load.actfrcrange, actgravcomp=0,
    )  # fmt: skip


def _add_tendon(spec: mujoco.MjSpec, name: str, limits: tuple[float, float]) -> mujoco.MjsTendon:
    return spec.add_tendon(
        name=name, limited=mujoco.mjtLimited.mjLIMITED_TRUE, range=limits, margin=0, stiffness=[0, 0, 0],
        damping=[0, 0, 0], frictionloss=0, armature=0, actfrclimited=mujoco.mjtLimited.mjLIMITED_FALSE,
    )  # fmt: skip


def _position(qpos: Any, model: mujoco.MjModel, joint: str) -> float:
    """Return the position of a joint in a keyframe; that of qpos0 in an empty one."""
    qpos = np.asarray(qpos)
    return float((qpos if qpos.size else model.qpos0)[model.joint(joint).qposadr[0]])


def _extend_keys(
    spec: mujoco.MjSpec, drives: list[tuple[Any, list[float]]], qpos: list[np.ndarray], qvel: list[np.ndarray]
) -> None:
    """Insert drives, in the order of their addresses, into the keyframes."""
    for i, (key, values, speed) in enumerate(zip(spec.keys, qpos, qvel)):
        for drive, positions in drives:
            values = np.insert(values, drive.qposadr[0], positions[i]) if values.size else values
            speed = np.insert(speed, drive.dofadr[0], 0.0) if speed.size else speed
        key.qpos, key.qvel = values, speed


def _require_own_actuator(spec: mujoco.MjSpec, model: mujoco.MjModel, joint: str) -> None:
    """Raise ModelError for a joint moved by a tendon or equality alone, which would bypass its drive."""
    if any(drives_joint(actuator, joint) for actuator in spec.actuators):
        return
    joint_id = model.joint(joint).id
    wraps_joint = (model.wrap_type == int(mujoco.mjtWrap.mjWRAP_JOINT)) & (model.wrap_objid == joint_id)
    tendons = set(np.repeat(np.arange(model.ntendon), model.tendon_num)[wraps_joint].tolist())
    for actuator in np.flatnonzero(model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON)).tolist():
        if (tendon := int(model.actuator_trnid[actuator, 0])) in tendons:
            raise ModelError(
                f'joint "{joint}" is driven by actuator "{model.actuator(actuator).name}" through tendon '
                f'"{model.tendon(tendon).name}", which would bypass a drive of the joint: give the actuator the play '
                "with add_drive()"
            )
    coupled = {mujoco.mjtEq.mjEQ_JOINT: {joint_id}, mujoco.mjtEq.mjEQ_TENDON: tendons}
    for i, kind in enumerate(model.eq_type.tolist()):
        if coupled.get(mujoco.mjtEq(kind), set()) & {int(model.eq_obj1id[i]), int(model.eq_obj2id[i])}:
            raise ModelError(
                f'joint "{joint}" is driven by equality "{model.equality(i).name or i}", which would bypass a drive of '
                "the joint: in the equality's place couple the two by a fixed tendon with limited range -gap to gap, "
                "and give that tendon_limit()"
            )
