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
from ..bristles import frictions
from ..elements import KINDS, Asked, Softness, Target, apply, asked, compiled, find, give, nearest
from ..records import MARK
from ..rows import softness_of

__all__ = ["open_parameters", "put", "written_into"]

RANGE = 100.0  # Factor below and above its start within which a parameter lies, if no bounds are given
SOFTNESS = ("k", "c")
JOINT = {"damping": "N m s/rad", "stiffness": "N m/rad", "frictionloss": "N m", "armature": "kg m²"}
"""Fields of hinges and slides, with their units at hinges"""
SLIDE = {"N m/rad": "N/m", "N m s/rad": "N s/m", "N m": "N", "kg m²": "kg", "rad": "m"}


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
        low, high = bounds.get(given) or (place.value / RANGE, place.value * RANGE)
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
    for name in sorted(values, key=lambda name: not name.endswith(".armature")):  # on which Â depends
        _place(changed, name).write(changed, values[name])
    return changed


def _place(spec: Target, name: str) -> _Place:
    element, dot, quantity = name.rpartition(".")
    if not dot:
        raise ModelError(f'parameter "{name}" needs an element and a quantity, such as "elbow backlash.gap"')
    model = compiled(spec)
    soft = {e.name: e for e in asked(model)}
    if quantity in SOFTNESS:
        if element not in soft:
            raise ModelError(
                f'parameter "{name}": no contact, limit or clearance "{element}"; {nearest(element, soft)}'
            )
        return _softness(model, quantity, soft[element])
    if quantity == "gap":
        tendons = [n for n, e in soft.items() if e.kind == "tendon"]
        if element not in tendons:
            raise ModelError(f'parameter "{name}": no clearance "{element}"; {nearest(element, tendons)}')
        return _gap(model, element)
    if quantity == "friction":
        return _friction(model, element)
    if quantity in JOINT:
        return _joint(model, element, quantity)
    raise ModelError(f'parameter "{name}": {nearest(quantity, [*SOFTNESS, "gap", "friction", *JOINT])}')


def _softness(model: mujoco.MjModel, quantity: str, element: Asked) -> _Place:
    kind, name, softness = element
    if softness.law:
        raise ModelError(f'parameter "{name}.{quantity}": "{name}" follows a law; give it k and c to identify them')
    hinge = _angular(model, kind, name)

    def write(target: Target, value: float) -> None:
        own = compiled(target)
        if target is own:
            now = Softness(*softness_of(own, kind, _index(own, kind, name)) or ())
        else:
            now = next(e.softness for e in asked(own) if (e.kind, e.name) == (kind, name))
        changed = Softness(value, now.c) if quantity == "k" else Softness(now.k, value)
        give(target, own, kind, [name], changed)

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


def _friction(model: mujoco.MjModel, element: str) -> _Place:
    """The force at which bristles slip, of a pair its ratio to the normal force."""
    known = {f.name: f for f in frictions(model)}
    if element not in known:
        raise ModelError(f'parameter "{element}.friction": no friction of "{element}"; {nearest(element, known)}')
    kind, _, at, _ = known[element]
    hinge = _angular(model, kind, element)

    def write(target: Target, value: float) -> None:
        if isinstance(target, mujoco.MjModel):
            target.numeric_data[at] = value
            return
        numeric = next(n for n in target.numerics if n.name == f"{MARK}friction:{kind}:{element}")
        numeric.data = [value, *list(numeric.data)[1:]]

    return _Place("" if kind == "pair" else _unit("N m", hinge), float(model.numeric_data[at]), write)


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
                mujoco.mj_setConst(target, mujoco.MjData(target))
                apply(target)
            return
        joint = target.joint(element)
        several = np.size(getattr(joint, quantity)) > 1
        setattr(joint, quantity, [value, *getattr(joint, quantity)[1:]] if several else value)

    return _Place(_unit(JOINT[quantity], _hinge(model, index)), float(field[at]), write)


def _index(model: mujoco.MjModel, kind: str, name: str) -> int:
    return find(model, KINDS[kind].object, name)


def _unit(angular: str, hinge: bool) -> str:
    return angular if hinge else SLIDE[angular]


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
