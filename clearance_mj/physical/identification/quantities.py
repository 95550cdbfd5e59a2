"""Parameters of a MuJoCo model that a fit varies: their location in a specification, unit and start value."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ...core.errors import ModelError
from ...estimate.parameter import Parameter
from ..actuators import fix_ranges
from ..bristles import bristles_of
from ..drives import DRIVE, PlacedDrive, drives
from ..elements import SoftElement, Target, apply, compile_target, find, requested_softness, set_softness, suggestion
from ..records import write_numbers
from ..rows import softness_of
from .record import drive_columns

__all__ = ["open_parameters", "put", "value_of", "written_into"]

RANGE = 100.0  # default bounds of a parameter, as a factor below and above its start
RANGES = {"stribeck_exponent": 3.0}  # the same, of parameters without effect once large
SOFTNESS = ("k", "c")
INERTIAL = (".armature", ".mass", ".inertia")
JOINT = {"damping": "N m s/rad", "stiffness": "N m/rad", "frictionloss": "N m", "armature": "kg m²"}
"""Fields of hinges and slides, with their units at hinges"""
SERVO = {"gain": "", "kp": "", "kv": ""}
"""Gains of an actuator: of a motor force per control; of a servo, whose bias changes with them"""
OF_RECORD = {"delay": "s", "bias": ""}
"""Units of parameters of the record, not of the model: delay of a control, bias of a sensor"""
MAY_VANISH = {"delay": (0.0, 0.01), "bias": (-math.inf, 0.1), "loss_forward": (0.0, 0.3), "loss_backward": (0.0, 0.3)}
"""Parameters that vary linearly, not as logarithms: lower bound and prior standard deviation, SI units"""
RECORD = "record:"  # prefix of their custom numerics
DRIVE_UNITS = {
    "gap": "rad", "k": "N m/rad", "c": "N m s/rad", "inertia": "kg m²", "coulomb": "N m", "viscous": "N m s/rad",
    "stribeck": "N m", "stribeck_speed": "rad/s", "friction_k": "N m/rad", "friction_c": "N m s/rad",
} | dict.fromkeys(
    ("stribeck_exponent", "motor", "external", "stribeck_motor", "stribeck_external", "motor_square",
     "external_square", "loss_forward", "loss_backward"), "",
)  # fmt: skip
"""Units of a drive's parameters: its own and those of its `DriveFriction`, whose stiffness and damping are friction_k
and friction_c; of its efficiency the losses, 1/forward - 1 and 1 - backward"""
BRISTLES = {"friction": "N m", "friction_k": "N m/rad", "friction_c": "N m s/rad"}
"""Units of the numbers of bristles, in their order"""
BODY = {"mass": "kg", "inertia": "kg m²"}
SLIDE = {"N m/rad": "N/m", "N m s/rad": "N s/m", "N m": "N", "kg m²": "kg", "rad": "m", "rad/s": "m/s", "": ""}


@dataclass(frozen=True)
class _Number:
    """A number of a specification: unit, value, and the function that writes it."""

    unit: str
    value: float
    write: Callable[[Target, float], None]  #: into a specification or a model


def open_parameters(
    spec: mujoco.MjSpec, names_or_bounds: Sequence[str | Parameter] | Mapping[str, tuple[float, float]]
) -> tuple[Parameter, ...]:
    """Return parameters of names "element.quantity", which start at the specification's values."""
    if isinstance(names_or_bounds, str):
        raise ModelError(f'parameters is the text "{names_or_bounds}"; give a list of names')
    bounds = names_or_bounds if isinstance(names_or_bounds, Mapping) else {}
    parameters = []
    for item in names_or_bounds:
        if isinstance(item, Parameter):
            _locate(spec, item.name)
            parameters.append(item)
            continue
        number = _locate(spec, item)
        if (quantity := item.rpartition(".")[2]) in MAY_VANISH:
            least, std = MAY_VANISH[quantity]
            low, high = bounds.get(item) or (least, math.inf)
            start = min(max(number.value, low), high)
            parameters.append(Parameter(item, number.unit, start, float(low), float(high), std, "linear"))
            continue
        factor = RANGES.get(quantity, RANGE)
        low, high = bounds.get(item) or (number.value / factor, number.value * factor)
        if number.value <= 0 and item not in bounds:
            raise ModelError(f'"{item}" is {number.value:g} in the specification; start with a value > 0')
        if not (0 < low < high < math.inf and low <= number.value <= high):
            raise ModelError(f'bounds {low:g} to {high:g} of "{item}" must be > 0 and about its start {number.value:g}')
        parameters.append(Parameter(item, number.unit, number.value, float(low), float(high)))
    names = [p.name for p in parameters]
    if not names or len(set(names)) < len(names):
        raise ModelError(f"parameters are {', '.join(names) or 'none'}; name each of one or more once")
    return tuple(parameters)


def written_into(spec: mujoco.MjSpec, values: Mapping[str, float]) -> mujoco.MjSpec:
    """Return a copy of the specification with values by "element.quantity"."""
    changed = spec.copy()
    for name, value in values.items():
        _locate(changed, name).write(changed, value)
    return changed


def put(model: mujoco.MjModel, values: Mapping[str, float]) -> mujoco.MjModel:
    """Return a copy of a model with values by "element.quantity"."""
    changed = copy.copy(model)
    for name in sorted(values, key=lambda name: not name.endswith(INERTIAL)):  # on which Â depends
        _locate(changed, name).write(changed, values[name])
    return changed


def _locate(spec: Target, name: str) -> _Number:
    element, dot, quantity = name.rpartition(".")
    if not dot:
        raise ModelError(f'parameter "{name}" needs an element and a quantity, such as "elbow backlash.gap"')
    model = compile_target(spec)
    soft, driven = {e.name: e for e in requested_softness(model)}, {d.name: d for d in drives(model)}
    if quantity in DRIVE_UNITS and element in driven:
        return _drive_number(model, quantity, driven[element])
    if quantity in SOFTNESS:
        if element not in soft:
            raise _unknown_element(name, "contact, limit or clearance", [*soft, *driven])
        return _softness_number(model, quantity, soft[element])
    if quantity == "gap":
        tendons = [n for n, e in soft.items() if e.kind == "tendon"]
        if element not in tendons:
            raise _unknown_element(name, "clearance", [*tendons, *driven])
        return _tendon_gap(model, element)
    if quantity in OF_RECORD:
        if element not in drive_columns(model):
            find(model, "actuator" if quantity == "delay" else "sensor", element)
        return _record_number(model, name)
    locators = dict.fromkeys(BRISTLES, _bristles) | dict.fromkeys(JOINT, _joint) | dict.fromkeys(SERVO, _servo_gain)
    locators |= dict.fromkeys(BODY, _body_inertia)
    if quantity not in locators:
        known = dict.fromkeys([*SOFTNESS, "gap", *locators, *OF_RECORD, *DRIVE_UNITS])
        raise ModelError(f'parameter "{name}": {suggestion(quantity, known)}')
    return locators[quantity](model, element, quantity)


def _unknown_element(parameter: str, what: str, known: Iterable[str]) -> ModelError:
    """Return the error for a parameter of an element that the model does not have, or not with that quantity."""
    element = parameter.rpartition(".")[0]
    return ModelError(f'parameter "{parameter}": no {what} "{element}"; {suggestion(element, known)}')


def _record_number(model: mujoco.MjModel, name: str) -> _Number:
    """Return a delay or bias of the record, which the model stores as a custom numeric."""

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            target.numeric_data[target.numeric(RECORD + name).adr] = value
        else:
            write_numbers(target, RECORD + name, [value])

    exists = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, RECORD + name) >= 0
    return _Number(OF_RECORD[name.rpartition(".")[2]], value_of(model, name) if exists else 0.0, write)


def value_of(model: mujoco.MjModel, name: str) -> float:
    """Return a delay or bias of the record from a model's custom numerics."""
    return float(model.numeric(RECORD + name).data[0])


def _drive_number(model: mujoco.MjModel, quantity: str, drive: PlacedDrive) -> _Number:
    names = DRIVE.names or ()
    index = names.index(quantity if quantity in names else f"friction_{quantity}")
    unit = _unit(DRIVE_UNITS[quantity], _is_rotary(model, drive.actuator))
    return _numeric_element(model, drive.numeric, index, unit)


def _servo_gain(model: mujoco.MjModel, element: str, quantity: str) -> _Number:
    """Return an actuator's gain, or kp or kv of a servo, whose bias is written with it."""
    index = find(model, "actuator", element)
    gain, bias = model.actuator_gainprm[index], model.actuator_biasprm[index]
    missing = {"kp": not gain[0] == -bias[1] != 0, "kv": not bias[2]}
    if missing.get(quantity):
        raise ModelError(f'parameter "{element}.{quantity}": actuator "{element}" is no servo with {quantity}')
    speed = quantity == "kv" and gain[0] == -bias[2]  # velocity servo, whose gain is kv

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            gains, biases = target.actuator_gainprm[index], target.actuator_biasprm[index]
        else:
            motor = target.actuator(element)
            fix_ranges(motor, model)
            gains, biases = motor.gainprm, motor.biasprm
        if quantity != "kv" or speed:
            gains[0] = value
        if quantity != "gain":
            biases[1 if quantity == "kp" else 2] = -value

    return _Number("", float(-bias[2] if quantity == "kv" else gain[0]), write)


def _body_inertia(model: mujoco.MjModel, element: str, quantity: str) -> _Number:
    """Return a body's mass or largest moment of inertia; all moments are scaled in proportion."""
    index = find(model, "body", element)
    mass, inertia = float(model.body_mass[index]), model.body_inertia[index].copy()
    value = mass if quantity == "mass" else float(inertia.max())

    def write(target: Target, changed: float) -> None:
        moments, new_mass = inertia * (changed / value), changed if quantity == "mass" else mass
        if isinstance(target, mujoco.MjModel):
            target.body_mass[index], target.body_inertia[index] = new_mass, moments
            _update_inertia(target)
            return
        body = target.body(element)
        body.explicitinertial, body.mass, body.inertia = True, new_mass, moments
        body.ipos, body.iquat = model.body_ipos[index], model.body_iquat[index]
        body.fullinertia = np.full(6, np.nan)

    return _Number(BODY[quantity], value, write)


def _update_inertia(model: mujoco.MjModel) -> None:
    """Recompute the constants and softness that depend on a model's inertia."""
    mujoco.mj_setConst(model, mujoco.MjData(model))
    apply(model)


def _softness_number(model: mujoco.MjModel, quantity: str, element: SoftElement) -> _Number:
    kind, name, softness = element
    if softness.law:
        raise ModelError(f'parameter "{name}.{quantity}": "{name}" follows a law; give it k and c to identify them')
    hinge = _is_angular(model, kind, name)

    def write(target: Target, value: float) -> None:
        trial = compile_target(target)
        current = next(e.softness for e in requested_softness(trial) if (e.kind, e.name) == (kind, name))
        if target is trial or current.ratio is not None:  # keep the damping fixed
            k, c = softness_of(trial, kind, find(trial, kind, name)) or (current.k, current.c)
            current = current._replace(k=k, c=c - current.implicit * trial.opt.timestep * k, ratio=None)
        set_softness(
            target, trial, kind, [name], current._replace(k=value) if quantity == "k" else current._replace(c=value)
        )

    return _Number(_unit({"k": "N m/rad", "c": "N m s/rad"}[quantity], hinge), getattr(softness, quantity), write)


def _tendon_gap(model: mujoco.MjModel, element: str) -> _Number:
    low, high = model.tendon_range[find(model, "tendon", element)]
    if low not in (0.0, -high):
        raise ModelError(f'tendon "{element}" has the range {low:g} to {high:g}; a gap needs one from 0 or about 0')

    def write(target: Target, value: float) -> None:
        ends = [-value if low else 0.0, value]
        if isinstance(target, mujoco.MjModel):
            target.tendon_range[find(target, "tendon", element)] = ends
        else:
            target.tendon(element).range = ends

    return _Number(_unit("rad", _is_angular(model, "tendon", element)), float(high), write)


def _bristles(model: mujoco.MjModel, element: str, quantity: str) -> _Number:
    """Return the slip force of bristles (of a pair its ratio to the normal force), their stiffness or damping."""
    by_name = {f.name: f for f in bristles_of(model)}
    if element not in by_name:
        raise _unknown_element(f"{element}.{quantity}", "friction of", by_name)
    kind, address, index = by_name[element].kind, by_name[element].numeric, [*BRISTLES].index(quantity)
    unit = "" if kind == "pair" and not index else _unit(BRISTLES[quantity], _is_angular(model, kind, element))
    return _numeric_element(model, address, index, unit)


def _numeric_element(model: mujoco.MjModel, address: int, index: int, unit: str) -> _Number:
    """Return one element of a custom numeric, which begins at ``address`` in the model's numeric data."""
    name = model.numeric(model.numeric_adr.tolist().index(address)).name

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            target.numeric_data[address + index] = value
            return
        numeric = target.numeric(name)
        numbers = list(numeric.data)
        numbers[index] = value
        numeric.data = numbers

    return _Number(unit, float(model.numeric_data[address + index]), write)


def _joint(model: mujoco.MjModel, element: str, quantity: str) -> _Number:
    index = find(model, "joint", element)
    if mujoco.mjtJoint(int(model.jnt_type[index])) not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        raise ModelError(f'parameter "{element}.{quantity}" needs a hinge or slide')
    of_joint = quantity == "stiffness"
    field, address = ("jnt_stiffness", index) if of_joint else (f"dof_{quantity}", model.jnt_dofadr[index])

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            getattr(target, field)[address] = value
            if quantity == "armature":
                _update_inertia(target)
            return
        joint = target.joint(element)
        is_array = np.size(getattr(joint, quantity)) > 1
        setattr(joint, quantity, [value, *getattr(joint, quantity)[1:]] if is_array else value)

    return _Number(_unit(JOINT[quantity], _is_hinge(model, index)), float(getattr(model, field)[address]), write)


def _unit(angular: str, hinge: bool) -> str:
    return angular if hinge else SLIDE[angular]


def _is_rotary(model: mujoco.MjModel, actuator: int) -> bool:
    """Return True if an actuator drives a hinge, or a tendon of hinges."""
    if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_TENDON:
        return _is_angular(model, "tendon", model.tendon(model.actuator_trnid[actuator, 0]).name)
    return _is_hinge(model, model.actuator_trnid[actuator, 0])


def _is_hinge(model: mujoco.MjModel, joint: int) -> bool:
    return int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_HINGE)


def _is_angular(model: mujoco.MjModel, kind: str, name: str) -> bool:
    """Return True if an element's displacement is an angle: of a hinge, or a tendon of hinges alone."""
    index = find(model, kind, name)
    if kind != "tendon":
        return kind == "joint" and _is_hinge(model, index)
    wraps = slice(model.tendon_adr[index], model.tendon_adr[index] + model.tendon_num[index])
    joints = model.wrap_type[wraps] == int(mujoco.mjtWrap.mjWRAP_JOINT)
    return bool(joints.all()) and all(_is_hinge(model, j) for j in model.wrap_objid[wraps])
