"""Numbers of a MuJoCo model that a fit varies: where each stands in a specification, and how it is written there."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from ...core.errors import ModelError
from ...estimate.parameter import Parameter
from ..actuators import settle
from ..bristles import frictions
from ..drives import DRIVE, PlacedDrive, drives
from ..elements import KINDS, Asked, Target, apply, asked, compiled, find, give, nearest
from ..records import MARK, write_numbers
from ..rows import softness_of
from .record import drive_columns

__all__ = ["open_parameters", "put", "value_of", "written_into"]

RANGE = 100.0  # Factor below and above its start within which a parameter lies, if no bounds are given
RANGES = {"stribeck_exponent": 3.0}  # The same, of what no record tells once it is large
SOFTNESS = ("k", "c")
INERTIAL = (".armature", ".mass", ".inertia")
JOINT = {"damping": "N m s/rad", "stiffness": "N m/rad", "frictionloss": "N m", "armature": "kg m²"}
"""Fields of hinges and slides, with their units at hinges"""
SERVO = {"gain": "", "kp": "", "kv": ""}
"""Of an actuator: force per control, of a motor its constant; a servo's, whose bias goes along"""
OF_RECORD = {"delay": "s", "bias": ""}
"""What a record has and the model has not: how late a control acts, what a sensor shows too much; with its unit"""
MAY_VANISH = {"delay": (0.0, 0.01), "bias": (-math.inf, 0.1), "loss_forward": (0.0, 0.3), "loss_backward": (0.0, 0.3)}
"""What varies by itself and not by its logarithm: lower bound, and how large it is known to be before, SI units"""
RECORD = "record:"  # begins the names of custom numbers that hold them
DRIVE_UNITS = {
    "gap": "rad", "k": "N m/rad", "c": "N m s/rad", "inertia": "kg m²", "coulomb": "N m", "viscous": "N m s/rad",
    "stribeck": "N m", "stribeck_speed": "rad/s", "friction_k": "N m/rad", "friction_c": "N m s/rad",
} | dict.fromkeys(
    ("stribeck_exponent", "motor", "external", "stribeck_motor", "stribeck_external", "motor_square",
     "external_square", "loss_forward", "loss_backward"), "",
)  # fmt: skip
"""Numbers of a drive inside an actuator: its own, and by their names those of its `DriveFriction`, whose stiffness and
damping are friction_k and friction_c; of its efficiency the losses, 1/forward - 1 and 1 - backward"""
BRISTLES = {"friction": "N m", "friction_k": "N m/rad", "friction_c": "N m s/rad"}
"""Numbers of bristles, in their order"""
BODY = {"mass": "kg", "inertia": "kg m²"}
SLIDE = {"N m/rad": "N/m", "N m s/rad": "N s/m", "N m": "N", "kg m²": "kg", "rad": "m", "rad/s": "m/s", "": ""}


@dataclass(frozen=True)
class _Place:
    """One number of a specification."""

    unit: str
    value: float
    write: Callable[[Target, float], None]  #: into a specification or a model


def open_parameters(
    spec: mujoco.MjSpec, wanted: Sequence[str | Parameter] | Mapping[str, tuple[float, float]]
) -> tuple[Parameter, ...]:
    """Return the parameters by "element.quantity", which start where the specification has them."""
    if isinstance(wanted, str):
        raise ModelError(f'parameters is the text "{wanted}"; give a list of names')
    bounds = wanted if isinstance(wanted, Mapping) else {}
    found = []
    for given in wanted:
        if isinstance(given, Parameter):
            _place(spec, given.name)
            found.append(given)
            continue
        place = _place(spec, given)
        if (quantity := given.rpartition(".")[2]) in MAY_VANISH:
            least, std = MAY_VANISH[quantity]
            low, high = bounds.get(given) or (least, math.inf)
            start = min(max(place.value, low), high)
            found.append(Parameter(given, place.unit, start, float(low), float(high), std, "linear"))
            continue
        wide = RANGES.get(quantity, RANGE)
        low, high = bounds.get(given) or (place.value / wide, place.value * wide)
        if place.value <= 0 and given not in bounds:
            raise ModelError(f'"{given}" is {place.value:g} in the specification; start with a value > 0')
        if not (0 < low < high < math.inf and low <= place.value <= high):
            raise ModelError(f'bounds {low:g} to {high:g} of "{given}" must be > 0 and about its start {place.value:g}')
        found.append(Parameter(given, place.unit, place.value, float(low), float(high)))
    names = [p.name for p in found]
    if not names or len(set(names)) < len(names):
        raise ModelError(f"parameters are {', '.join(names) or 'none'}; name each of one or more once")
    return tuple(found)


def written_into(spec: mujoco.MjSpec, values: Mapping[str, float]) -> mujoco.MjSpec:
    """Return a copy of the specification with values by "element.quantity"."""
    changed = spec.copy()
    for name, value in values.items():
        _place(changed, name).write(changed, value)
    return changed


def put(model: mujoco.MjModel, values: Mapping[str, float]) -> mujoco.MjModel:
    """Return a copy of a model with values by "element.quantity"."""
    changed = copy.copy(model)
    for name in sorted(values, key=lambda name: not name.endswith(INERTIAL)):  # on which Â depends
        _place(changed, name).write(changed, values[name])
    return changed


def _place(spec: Target, name: str) -> _Place:
    element, dot, quantity = name.rpartition(".")
    if not dot:
        raise ModelError(f'parameter "{name}" needs an element and a quantity, such as "elbow backlash.gap"')
    model = compiled(spec)
    soft, own = {e.name: e for e in asked(model)}, {d.name: d for d in drives(model)}
    if quantity in DRIVE_UNITS and element in own:
        return _of_drive(model, quantity, own[element])
    if quantity in SOFTNESS:
        if element not in soft:
            raise ModelError(
                f'parameter "{name}": no contact, limit or clearance "{element}"; {nearest(element, [*soft, *own])}'
            )
        return _softness(model, quantity, soft[element])
    if quantity == "gap":
        tendons = [n for n, e in soft.items() if e.kind == "tendon"]
        if element not in tendons:
            raise ModelError(f'parameter "{name}": no clearance "{element}"; {nearest(element, [*tendons, *own])}')
        return _gap(model, element)
    if quantity in OF_RECORD:
        kind = mujoco.mjtObj.mjOBJ_ACTUATOR if quantity == "delay" else mujoco.mjtObj.mjOBJ_SENSOR
        if element not in drive_columns(model):
            find(model, kind, element)
        return _of_record(model, name)
    further = dict.fromkeys(BRISTLES, _friction) | dict.fromkeys(JOINT, _joint) | dict.fromkeys(SERVO, _servo)
    further |= dict.fromkeys(BODY, _body)
    if quantity not in further:
        known = dict.fromkeys([*SOFTNESS, "gap", *further, *OF_RECORD, *DRIVE_UNITS])
        raise ModelError(f'parameter "{name}": {nearest(quantity, known)}')
    return further[quantity](model, element, quantity)


def _of_record(model: mujoco.MjModel, name: str) -> _Place:
    """What a record has and the model has not stands in its custom numbers."""

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            target.numeric_data[target.numeric(RECORD + name).adr] = value
        else:
            write_numbers(target, RECORD + name, [value])

    there = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, RECORD + name) >= 0
    return _Place(OF_RECORD[name.rpartition(".")[2]], value_of(model, name) if there else 0.0, write)


def value_of(model: mujoco.MjModel, name: str) -> float:
    """Return a delay or bias of a record that stands in a model's custom numbers."""
    return float(model.numeric(RECORD + name).data[0])


def _of_drive(model: mujoco.MjModel, quantity: str, drive: PlacedDrive) -> _Place:
    names = DRIVE.names or ()
    place = names.index(quantity if quantity in names else f"friction_{quantity}")
    unit = _unit(DRIVE_UNITS[quantity], _turns(model, drive.actuator))
    (numeric,) = np.flatnonzero(model.numeric_adr == drive.numeric)
    return _numeric(model, model.numeric(int(numeric)).name, drive.numeric, place, unit)


def _servo(model: mujoco.MjModel, element: str, quantity: str) -> _Place:
    """An actuator's gain; of a servo kp and kv, with which its bias goes along."""
    index = find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, element)
    gain, bias = model.actuator_gainprm[index], model.actuator_biasprm[index]
    missing = {"kp": not gain[0] == -bias[1] != 0, "kv": not bias[2]}
    if missing.get(quantity):
        raise ModelError(f'parameter "{element}.{quantity}": actuator "{element}" is no servo with {quantity}')
    speed = quantity == "kv" and gain[0] == -bias[2]  # of a servo of speeds, whose gain it is

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            gains, biases = target.actuator_gainprm[index], target.actuator_biasprm[index]
        else:
            motor = target.actuator(element)
            settle(motor, model)
            gains, biases = motor.gainprm, motor.biasprm
        if quantity != "kv" or speed:
            gains[0] = value
        if quantity != "gain":
            biases[1 if quantity == "kp" else 2] = -value

    return _Place("", float(-bias[2] if quantity == "kv" else gain[0]), write)


def _body(model: mujoco.MjModel, element: str, quantity: str) -> _Place:
    """Return a body's mass, with which its moments of inertia go, or the largest of these, with which the others go."""
    index = find(model, mujoco.mjtObj.mjOBJ_BODY, element)
    mass, inertia = float(model.body_mass[index]), model.body_inertia[index].copy()
    value = mass if quantity == "mass" else float(inertia.max())

    def write(target: Target, changed: float) -> None:
        moments, own = inertia * (changed / value), changed if quantity == "mass" else mass
        if isinstance(target, mujoco.MjModel):
            target.body_mass[index], target.body_inertia[index] = own, moments
            _settle_inertia(target)
            return
        body = target.body(element)
        body.explicitinertial, body.mass, body.inertia = True, own, moments
        body.ipos, body.iquat = model.body_ipos[index], model.body_iquat[index]
        body.fullinertia = np.full(6, np.nan)

    return _Place(BODY[quantity], value, write)


def _settle_inertia(model: mujoco.MjModel) -> None:
    """Bring what depends on a model's inertia up to date."""
    mujoco.mj_setConst(model, mujoco.MjData(model))
    apply(model)


def _softness(model: mujoco.MjModel, quantity: str, element: Asked) -> _Place:
    kind, name, softness = element
    if softness.law:
        raise ModelError(f'parameter "{name}.{quantity}": "{name}" follows a law; give it k and c to identify them')
    hinge = _angular(model, kind, name)

    def write(target: Target, value: float) -> None:
        own = compiled(target)
        now = next(e.softness for e in asked(own) if (e.kind, e.name) == (kind, name))
        if target is own or now.ratio is not None:  # whose damping is to stay as it is
            k, c = softness_of(own, kind, _index(own, kind, name)) or (now.k, now.c)
            now = now._replace(k=k, c=c - now.implicit * own.opt.timestep * k, ratio=None)
        give(target, own, kind, [name], now._replace(k=value) if quantity == "k" else now._replace(c=value))

    return _Place(_unit({"k": "N m/rad", "c": "N m s/rad"}[quantity], hinge), getattr(softness, quantity), write)


def _gap(model: mujoco.MjModel, element: str) -> _Place:
    low, high = model.tendon_range[_index(model, "tendon", element)]
    if low not in (0.0, -high):
        raise ModelError(f'tendon "{element}" has the range {low:g} to {high:g}; a gap needs one from 0 or about 0')

    def write(target: Target, value: float) -> None:
        ends = [-value if low else 0.0, value]
        if isinstance(target, mujoco.MjModel):
            target.tendon_range[_index(target, "tendon", element)] = ends
        else:
            target.tendon(element).range = ends

    return _Place(_unit("rad", _angular(model, "tendon", element)), float(high), write)


def _friction(model: mujoco.MjModel, element: str, quantity: str) -> _Place:
    """The force at which bristles slip, of a pair its ratio to the normal force; their stiffness and damping."""
    known = {f.name: f for f in frictions(model)}
    if element not in known:
        raise ModelError(f'parameter "{element}.{quantity}": no friction of "{element}"; {nearest(element, known)}')
    kind, at, place = known[element].kind, known[element].numeric, [*BRISTLES].index(quantity)
    unit = "" if kind == "pair" and not place else _unit(BRISTLES[quantity], _angular(model, kind, element))
    return _numeric(model, f"{MARK}friction:{kind}:{element}", at, place, unit)


def _numeric(model: mujoco.MjModel, name: str, at: int, place: int, unit: str) -> _Place:
    """Return a number of a custom numeric, whose numbers begin at a place in the model's data."""

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            target.numeric_data[at + place] = value
            return
        numeric = next(n for n in target.numerics if n.name == name)
        numbers = list(numeric.data)
        numbers[place] = value
        numeric.data = numbers

    return _Place(unit, float(model.numeric_data[at + place]), write)


def _joint(model: mujoco.MjModel, element: str, quantity: str) -> _Place:
    index = _index(model, "joint", element)
    if mujoco.mjtJoint(int(model.jnt_type[index])) not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        raise ModelError(f'parameter "{element}.{quantity}" needs a hinge or slide')
    field: Any = model.jnt_stiffness if quantity == "stiffness" else getattr(model, f"dof_{quantity}")
    at = index if quantity == "stiffness" else model.jnt_dofadr[index]

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            (target.jnt_stiffness if quantity == "stiffness" else getattr(target, f"dof_{quantity}"))[at] = value
            if quantity == "armature":
                _settle_inertia(target)
            return
        joint = target.joint(element)
        several = np.size(getattr(joint, quantity)) > 1
        setattr(joint, quantity, [value, *getattr(joint, quantity)[1:]] if several else value)

    return _Place(_unit(JOINT[quantity], _hinge(model, index)), float(field[at]), write)


def _index(model: mujoco.MjModel, kind: str, name: str) -> int:
    return find(model, KINDS[kind].object, name)


def _unit(angular: str, hinge: bool) -> str:
    return angular if hinge else SLIDE[angular]


def _turns(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator turns a hinge, or a tendon of hinges."""
    if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_TENDON:
        return _angular(model, "tendon", model.tendon(model.actuator_trnid[actuator, 0]).name)
    return _hinge(model, model.actuator_trnid[actuator, 0])


def _hinge(model: mujoco.MjModel, joint: int) -> bool:
    return int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_HINGE)


def _angular(model: mujoco.MjModel, kind: str, name: str) -> bool:
    """Whether an element's motion is that of hinges: of a joint, or of all joints of a tendon."""
    index = _index(model, kind, name)
    if kind != "tendon":
        return kind == "joint" and _hinge(model, index)
    wraps = slice(model.tendon_adr[index], model.tendon_adr[index] + model.tendon_num[index])
    joints = model.wrap_type[wraps] == int(mujoco.mjtWrap.mjWRAP_JOINT)
    return bool(joints.all()) and all(_hinge(model, j) for j in model.wrap_objid[wraps])
