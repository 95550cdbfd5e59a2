"""Drives inside actuators: rotor, play, teeth and friction in the actuator's activation, without an additional joint.

A drive stands in the model as ``<custom><numeric name="physical:drive:motor" data="..."/>``, the numbers of `DRIVE` and
then stiffness and force of each element of its hysteresis, and is read there at every step. The actuator keeps its
gains in ``gainprm`` and ``biasprm``; its activation is what `DriveState` has, and is integrated with the model's.
"""

from __future__ import annotations

import numbers
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ModelError
from .actuators import ON_JOINT, actuator_count, fix_damping, fix_ranges, output_of
from .clearances import half_gap
from .damping import damping_ratio_of
from .elements import change_spec, compile_target, find, name_of, require_spec
from .records import MARK, marked_names, note_softener, write_numbers
from .softness import Softness, softness
from .transmission import DriveFriction, Efficiency

__all__ = ["BEGUN", "DRIVE", "DriveState", "PlacedDrive", "add_drive", "drive_state", "drives", "friction_numbers"]

_FRICTION = [field.name for field in fields(DriveFriction) if field.name != "efficiency"]
_NOT_COULOMB = ("k", "c", "viscous", "stribeck_speed", "stribeck_exponent")
_DRY = [*(f"friction_{name}" for name in _FRICTION if name not in _NOT_COULOMB), "loss_forward", "loss_backward"]
_ROTOR_FIELDS = "inertia", "gap", "k", "c", "encoder", "dynamics", "early"
_LOSS_FIELDS = *(f"friction_{name}" for name in _FRICTION), "loss_forward", "loss_backward"
DRIVE = np.dtype([(name, np.float64) for name in (*_ROTOR_FIELDS, *_LOSS_FIELDS)])
"""Parameters of a drive; ``encoder`` 0: motor, 1: load; ``dynamics``, ``early``: of the actuator before add_drive"""

ANGLE, SPEED, MOTOR_TORQUE, BEGUN, INPUT, BRISTLES = range(6)
"""Indices in the actuator's activation; deflections of the hysteresis and, last, the torque on the load follow"""
_DYNAMICS = {
    mujoco.mjtDyn.mjDYN_NONE: 0, mujoco.mjtDyn.mjDYN_INTEGRATOR: 1, mujoco.mjtDyn.mjDYN_FILTER: 2,
    mujoco.mjtDyn.mjDYN_FILTEREXACT: 3,
}  # fmt: skip
_ENCODERS = ("motor", "load")
_ALTERNATIVE = ", or give its joint play with add_backlash(), which any actuator can drive"


class PlacedDrive(NamedTuple):
    """A drive of a model, and its location there."""

    name: str
    actuator: int
    numeric: int  # address in numeric_data
    hysteresis: int  # number of elements

    def numbers(self, model: mujoco.MjModel) -> np.void:
        """Return its current parameters, a DRIVE."""
        return model.numeric_data[self.numeric : self.numeric + len(DRIVE.names or ())].view(DRIVE)[0]

    def has_dry_friction(self, model: mujoco.MjModel) -> bool:
        """Return True if it has dry friction."""
        numbers = self.numbers(model)
        return any(numbers[name] for name in _DRY)

    def hysteresis_elements(self, model: mujoco.MjModel) -> np.ndarray:
        """Return stiffness and slip force (n, 2) of the elements of its hysteresis."""
        first = self.numeric + len(DRIVE.names or ())
        return model.numeric_data[first : first + 2 * self.hysteresis].reshape(-1, 2)


class DriveState(NamedTuple):
    """Angle, speed and torques of a drive's motor, in units of the actuator's joint or tendon."""

    angle: Any
    """of the motor, rad (m)"""
    speed: Any
    """of the motor, rad/s (m/s)"""
    motor_torque: Any
    """N m (N), of the last step"""
    load_torque: Any
    """N m (N), of the drive on the load, of the last step"""


def drive_state(model: mujoco.MjModel, act: ArrayLike, actuator: Any) -> DriveState:
    """Return angle, speed and torques of a drive inside an actuator.

    Parameters
    ----------
    model : mujoco.MjModel
        The model.
    act : array_like, shape (..., na)
        Activations: ``data.act``, or those of many steps, the last ``na`` numbers of what ``mujoco.rollout`` returns.
    actuator : str or mujoco.MjsActuator
        Of `add_drive`.

    Returns
    -------
    DriveState
        Numbers, or arrays (...); all zero before the first step.

    Raises
    ------
    ModelError
        For an actuator without a drive, or activations of another model.
    """
    name, states = name_of(actuator), np.asarray(act, dtype=float)
    if states.shape[-1:] != (model.na,):
        raise ModelError(f"act has the shape {states.shape}; the model's needs {model.na} numbers in its last axis")
    for drive in drives(model):
        if drive.name == name:
            first, count = model.actuator_actadr[drive.actuator], model.actuator_actnum[drive.actuator]
            activation = states[..., first : first + count].copy()  # no view of data that change
            gear = model.actuator_gear[output_of(model, drive.actuator), 0]
            angle, speed, torque = (activation[..., index][()] for index in (ANGLE, SPEED, MOTOR_TORQUE))
            return DriveState(angle, speed, torque, activation[..., count - 1] * gear)
    raise ModelError(f'actuator "{name}" has no drive; give it one with add_drive()')


def add_drive(
    spec: mujoco.MjSpec, actuator: Any, gap: float | None = None, k: float | None = None, c: float | None = None,
    inertia: float | None = None, *, backlash: float | None = None, damping_ratio: float | None = None,
    restitution: float | None = None, encoder: str = "motor", friction: DriveFriction | None = None,
    hysteresis: Sequence[tuple[float, float]] = (),
) -> None:  # fmt: skip
    """Put a rotor behind elastic teeth with play into an actuator, without an additional joint or solver row.

    The joint (or tendon) is the load and is not changed. The actuator's law, a motor's or a servo's, drives the rotor,
    which presses on the load with k r + c ṙ beyond the gap to either side, never pulling. The state of
    rotor and friction is the actuator's activation: MuJoCo saves, restores, copies and resets it with the data, and
    ``rollout`` and ``batch`` return it; after a reset the rotor is in the middle of the play, wherever the load is. It
    moves only with a `Softener`.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place.
    actuator : str or mujoco.MjsActuator, or a list of them
        Motors or servos of a hinge, slide or tendon (gain and bias fixed or affine; activation none, integrator or
        filter); several are compiled once.
    gap : float
        To either side, rad (m), >= 0: half of the play; 0 for an elastic drive without play.
    backlash : float
        Instead of the gap: from side to side, degrees, as catalogues have it; of a hinge.
    k : float
        Stiffness of the teeth at the load, N m/rad (N/m), > 0.
    c : float
        Their damping, N m s/rad (N s/m), >= 0.
    damping_ratio, restitution : float, optional
        Instead of c, of rotor and load against each other in the model's initial pose; see `contact`.
    inertia : float, optional
        Of the rotor at the load (times gear ratio squared), kg m² (kg), > 0; by default the joint's armature, which is
        set to 0.
    encoder : str
        Where a servo measures: at the "motor", before the play, or at the "load".
    friction : DriveFriction, optional
        At the motor, seen at the load.
    hysteresis : sequence of (float, float)
        Stiffness, N m/rad, and largest torque, N m, of elements in parallel to the teeth that stick and slip
        (Maxwell-slip).

    Raises
    ------
    ModelError
        For an actuator that the model does not have, has a drive already or is of another kind, and numbers out of
        range.
    LawError
        For a stiffness or damping out of range.
    """
    model = compile_target(require_spec(spec))
    names = [name_of(element) for element in (actuator if isinstance(actuator, list) else [actuator])]
    teeth = softness(k, c, None, 0.0, damping_ratio_of(c, damping_ratio, restitution))
    slips = [(float(stiffness), float(force)) for stiffness, force in hysteresis]
    if encoder not in _ENCODERS:
        raise ModelError(f'actuator "{names[0]}": encoder "{encoder}"; known: {", ".join(_ENCODERS)}')
    common = float(_ENCODERS.index(encoder)), friction_numbers(friction), slips
    makers = [_drive_writer(spec, model, name, (gap, backlash), teeth, inertia, *common) for name in names]
    saved = [np.array(key.act) for key in spec.keys]

    def inside(changed: mujoco.MjSpec) -> None:
        fix_damping(changed, model)
        for put_in in makers:
            put_in(changed)
        note_softener(changed)
        for key in changed.keys:
            key.act = np.zeros(0)

    _, changed_model = change_spec(spec, inside)
    _extend_keys(spec, saved, model, changed_model, names)


def _drive_writer(
    spec: mujoco.MjSpec, model: mujoco.MjModel, name: str, play: tuple[float | None, float | None], teeth: Softness,
    inertia: float | None, encoder: float, losses: tuple[float, ...], slips: list[tuple[float, float]],
) -> Callable[[mujoco.MjSpec], None]:  # fmt: skip
    """Return a function that puts a drive inside an actuator of a specification, which compiles to the model.

    Raises
    ------
    ModelError
        For an actuator that cannot have one, and numbers out of range.
    """
    index, motor = find(model, "actuator", name), spec.actuator(name)
    where = f'actuator "{name}"'
    if any(drive.name == name for drive in drives(model)):
        raise ModelError(f"{where} has a drive already")
    _require_supported(model, index, where)
    on_tendon, limits = model.actuator_trntype[index] == mujoco.mjtTrn.mjTRN_TENDON, _motor_limits(model, index, where)
    joint = 0 if on_tendon else int(model.actuator_trnid[index, 0])
    gap = half_gap(*play, not on_tendon and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE)
    positives = {"gap": gap} | ({} if inertia is None else {"inertia": inertia})
    positives |= {f"hysteresis[{i}]": min(slip) for i, slip in enumerate(slips)}
    for label, value in positives.items():
        if not isinstance(value, numbers.Real) or not (value > 0 or (label == "gap" and value == 0)) or np.isinf(value):
            raise ModelError(f"{where}: {label} {value} must be finite and {'>=' if label == 'gap' else '>'} 0")
    armature = 0.0 if on_tendon else float(spec.joint(motor.target).armature)
    if inertia is None:
        inertia = armature
        if not inertia > 0:
            raise ModelError(f"{where}: its {'tendon' if on_tendon else 'joint'} has no armature; give inertia > 0")
    load_inverse = model.tendon_invweight0[model.actuator_trnid[index, 0]] if on_tendon else (
        model.dof_invweight0[model.jnt_dofadr[joint]])  # fmt: skip
    inverse = 1 / inertia + 1 / max(1 / max(load_inverse, np.finfo(float).tiny) - armature, np.finfo(float).tiny)
    values = (
        inertia, gap, teeth.k, teeth.damping(inverse), encoder,
        _DYNAMICS[mujoco.mjtDyn(int(model.actuator_dyntype[index]))], model.actuator_actearly[index], *losses,
    )  # fmt: skip

    def inside(changed: mujoco.MjSpec) -> None:
        write_numbers(changed, f"{MARK}drive:{name}", [*values, *(value for slip in slips for value in slip)])
        motor = changed.actuator(name)
        fix_ranges(motor, model)
        if not on_tendon:
            load = changed.joint(motor.target)
            load.armature, load.actfrclimited = 0.0, mujoco.mjtLimited.mjLIMITED_FALSE
        if model.actuator_gaintype[index] == mujoco.mjtGain.mjGAIN_FIXED:
            motor.gainprm[1:3] = 0
        if model.actuator_biastype[index] == mujoco.mjtBias.mjBIAS_NONE:
            motor.biasprm[:3] = 0
        motor.dyntype, motor.gaintype, motor.biastype = (
            mujoco.mjtDyn.mjDYN_USER, mujoco.mjtGain.mjGAIN_USER, mujoco.mjtBias.mjBIAS_USER
        )  # fmt: skip
        if hasattr(motor, "ctrlspec"):
            motor.ctrlspec = 0  # inputs that a servo declares; the number of controls stays one
        motor.actdim, motor.actearly = BRISTLES + 2 + len(slips), True
        motor.actlimited = motor.forcelimited = mujoco.mjtLimited.mjLIMITED_FALSE
        motor.actrange = model.actuator_actrange[index] if model.actuator_actlimited[index] else (0, 0)
        motor.forcerange = limits

    return inside


def friction_numbers(friction: DriveFriction | None) -> tuple[float, ...]:
    """Return the numbers of a friction in a DRIVE."""
    parameters = friction or DriveFriction(1.0)
    efficiency = Efficiency(*parameters.efficiency)
    losses = 1 / efficiency.forward - 1, 1 - efficiency.backward
    return *(float(getattr(parameters, name)) for name in _FRICTION), *losses


def drives(model: mujoco.MjModel) -> Iterator[PlacedDrive]:
    """Yield the drives inside a model's actuators.

    Raises
    ------
    ModelError
        For one whose actuator was removed or changed.
    """
    for i, prefix, suffix in marked_names(model, mujoco.mjtObj.mjOBJ_NUMERIC, f"{MARK}drive:"):
        name, extra = prefix + suffix, int(model.numeric_size[i]) - len(DRIVE.names or ())
        actuator = find(model, "actuator", name)
        if (
            extra < 0 or extra % 2 or model.actuator_dyntype[actuator] != mujoco.mjtDyn.mjDYN_USER
            or model.actuator_actnum[actuator] != BRISTLES + 2 + extra // 2
        ):  # fmt: skip
            raise ModelError(f'actuator "{name}" is no longer what add_drive() made of it')
        yield PlacedDrive(name, actuator, int(model.numeric_adr[i]), extra // 2)


def _require_supported(model: mujoco.MjModel, index: int, where: str) -> None:
    """Raise ModelError for an actuator that cannot drive a rotor."""
    allowed = {
        "trntype": (*ON_JOINT, mujoco.mjtTrn.mjTRN_TENDON), "dyntype": tuple(_DYNAMICS),
        "gaintype": (mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtGain.mjGAIN_AFFINE),
        "biastype": (mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE),
    }  # fmt: skip
    on_joint = mujoco.mjtTrn(int(model.actuator_trntype[index])) in ON_JOINT
    way_round = _ALTERNATIVE if on_joint else ""
    for field, supported in allowed.items():
        kind = type(supported[0])(int(getattr(model, f"actuator_{field}")[index]))
        if kind not in supported:
            needs = " or ".join(_type_name(c) for c in supported)
            raise ModelError(f"{where} is {_type_name(kind)}; a drive needs {needs}{way_round}")
    joint = model.actuator_trnid[index, 0]
    if on_joint and mujoco.mjtJoint(int(model.jnt_type[joint])) not in (
        mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
    ):  # fmt: skip
        raise ModelError(f"{where}: a drive needs a hinge or slide")
    if getattr(model, "actuator_ctrlnum", np.ones(actuator_count(model)))[index] != 1:
        raise ModelError(f"{where} has {model.actuator_ctrlnum[index]} controls; a drive needs one{way_round}")
    for field in ("delay", "armature", "damping"):
        if np.any(getattr(model, f"actuator_{field}", np.zeros(actuator_count(model)))[index]):
            raise ModelError(f"{where} has {field}, which a drive cannot take over; set it to 0{way_round}")
    if not model.actuator_gear[output_of(model, index), 0]:
        raise ModelError(f"{where} has gear 0")


def _type_name(kind: Any) -> str:
    return str(kind.name.partition("_")[2].lower())


def _motor_limits(model: mujoco.MjModel, index: int, where: str) -> np.ndarray:
    """Return the range (2,) of the motor's force, within that of its joint's actuators; zeros for none."""
    limits, joint = np.array((-np.inf, np.inf)), model.actuator_trnid[index, 0]
    on_joint = model.actuator_trntype < mujoco.mjtTrn.mjTRN_TENDON.value
    if on_joint[index] and model.jnt_actfrclimited[joint]:
        if np.sum((model.actuator_trnid[:, 0] == joint) & on_joint) > 1:
            raise ModelError(f"{where}: its joint has other actuators and a common actuatorfrcrange; set that of each")
        limits = np.sort(model.jnt_actfrcrange[joint] / model.actuator_gear[output_of(model, index), 0])
    if model.actuator_forcelimited[index]:
        force_range = model.actuator_forcerange[index]
        limits = np.array((max(limits[0], force_range[0]), min(limits[1], force_range[1])))
    return limits if np.isfinite(limits).all() else np.zeros(2)


def _extend_keys(
    spec: mujoco.MjSpec, saved: Sequence[np.ndarray], model: mujoco.MjModel, changed: mujoco.MjModel, names: list[str]
) -> None:
    """Extend keyframes' activations by the drives' states: the input is kept, all else is 0."""
    for key, act in zip(spec.keys, saved):
        if not act.size:
            continue
        extended = np.zeros(changed.na)
        for i in range(actuator_count(model)):
            old, new, count = model.actuator_actadr[i], changed.actuator_actadr[i], model.actuator_actnum[i]
            if changed.actuator(i).name in names:
                new += INPUT
            if count:
                extended[new : new + count] = act[old : old + count]
        key.act = extended
