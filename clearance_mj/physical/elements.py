"""Elements of a MuJoCo model that have a softness: their names, Â, solver parameters and stored softness.

It is stored in the model itself, as ``<custom><text name="physical:joint:elbow" data="k=500.0 c=2.0"/>``: it is
saved and attached with the model, and `apply` can apply it again after a change of the inertias, on which Â depends. A
law is stored as in its file, with the depth at which it is linearised, until a `Softener` follows it.
"""

from __future__ import annotations

import difflib
import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias, TypeVar

import mujoco
import numpy as np

from ..core.checks import naming
from ..core.errors import LawError, ModelError
from .records import MARK, texts, write_text
from .softness import Softness, implicit_impedance, read_softness, rounded_solref_solimp, solref_solimp

__all__ = [
    "KINDS", "Kind", "SoftElement", "Target", "apply", "change_spec", "compile_target", "find", "inverse_inertia",
    "joint_kind", "name_of", "pairs_of", "requested_softness", "require_spec", "set_softness",
    "solver_parameters", "store_softness", "suggestion", "write_elements", "write_softness",
]  # fmt: skip

Target: TypeAlias = mujoco.MjSpec | mujoco.MjModel
T = TypeVar("T")
Parameters: TypeAlias = tuple[np.ndarray, np.ndarray] | None


@dataclass(frozen=True)
class Kind:
    """Fields of a kind of element with its solver parameters, in a specification and in a model."""

    noun: str
    spec: tuple[str, str]  # solref and solimp
    model: tuple[str, str]
    starts: dict[str, str]  # offsets of the violation at which the force begins, in the specification: in the model
    inverse: str  # field of the model with Â


KINDS = {
    "joint": Kind(
        "joint limit", ("solref_limit", "solimp_limit"), ("jnt_solref", "jnt_solimp"), {"margin": "jnt_margin"},
        "dof_invweight0",
    ),
    "tendon": Kind(
        "tendon limit", ("solref_limit", "solimp_limit"), ("tendon_solref_lim", "tendon_solimp_lim"),
        {"margin": "tendon_margin"}, "tendon_invweight0",
    ),
    "pair": Kind(
        "contact", ("solref", "solimp"), ("pair_solref", "pair_solimp"), {"margin": "pair_margin", "gap": "pair_gap"},
        "body_invweight0",
    ),
}  # fmt: skip
"""Kinds by their names in stored texts"""


def compile_target(target: Target) -> mujoco.MjModel:
    """Return the model itself, or the compiled specification.

    Raises
    ------
    ModelError
        If it does not compile, or is neither.
    """
    if isinstance(target, mujoco.MjModel):
        return target
    if not isinstance(target, mujoco.MjSpec):
        raise ModelError(f"got {type(target).__name__}, needs a mujoco.MjSpec or a mujoco.MjModel")
    with naming("the specification does not compile", ValueError, ModelError):
        return target.compile()


def require_spec(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Return a specification, or raise a ModelError if it is none."""
    if not isinstance(spec, mujoco.MjSpec):
        raise ModelError(f"got {type(spec).__name__}, needs a mujoco.MjSpec: a compiled model cannot get new elements")
    return spec


def name_of(element: Any) -> str:
    """Return the name of an element given by name or as an object."""
    name = element if isinstance(element, str) else getattr(element, "name", None)
    if not isinstance(name, str) or not name:
        raise ModelError(f"{element!r} has no name; give the element a name and use that")
    return name


def find(model: mujoco.MjModel, kind: str, name: str) -> int:
    """Return the index of an element of a model; kinds are MuJoCo's objects, such as "joint", "site" or "actuator".

    Raises
    ------
    ModelError
        If there is none; the message suggests similar names.
    """
    object_type = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
    index = mujoco.mj_name2id(model, object_type, name)
    if index >= 0:
        return index
    known = [mujoco.mj_id2name(model, object_type, i) for i in range(model.nnames_map)]  # at most that many elements
    raise ModelError(f'the model has no {kind} "{name}"; {suggestion(name, known)}')


def suggestion(name: str, known: Iterable[str | None]) -> str:
    """Return a hint at the known name that is most similar to an unknown one, or a list of known names."""
    names = [label for label in known if label]
    matches = difflib.get_close_matches(name, names, n=1)
    listed = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
    return f'did you mean "{matches[0]}"?' if matches else f"it has {listed or 'none with a name'}"


def pairs_of(model: mujoco.MjModel) -> dict[frozenset[int], int]:
    """Return the indices of a model's explicit pairs by their geoms."""
    return {frozenset(p): i for i, p in enumerate(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist()))}


def joint_kind(model: mujoco.MjModel, name: str, what: str) -> mujoco.mjtJoint:
    """Return the type of a joint, hinge or slide; raise ModelError for other types."""
    kind = mujoco.mjtJoint(int(model.jnt_type[find(model, "joint", name)]))
    if kind not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        raise ModelError(f'joint "{name}" is {kind.name.removeprefix("mjJNT_").lower()}; {what} needs a hinge or slide')
    return kind


def inverse_inertia(model: mujoco.MjModel, kind: str, index: int) -> float:
    """Return Â of an element's row, 1/kg or 1/(kg m²): the constant with which MuJoCo scales its softness.

    Parameters
    ----------
    model : mujoco.MjModel
        The model.
    kind : str
        "joint", "tendon" or "pair".
    index : int
        Index of the joint, tendon or pair.

    Returns
    -------
    float
        Zero for a tendon that no coordinate lengthens in the model's initial pose, such as one between two sites
        that coincide there.
    """
    if kind == "joint":
        return float(model.dof_invweight0[model.jnt_dofadr[index]])
    if kind == "tendon":
        return float(model.tendon_invweight0[index])
    bodies = model.geom_bodyid[[model.pair_geom1[index], model.pair_geom2[index]]]
    return float(model.body_invweight0[bodies, 0].sum())


class SoftElement(NamedTuple):
    """An element and the softness that was requested for it."""

    kind: str
    name: str
    softness: Softness


def requested_softness(model: mujoco.MjModel) -> Iterator[SoftElement]:
    """Yield every element with a softness in its specification."""
    for kind, name, data in texts(model):
        if kind in KINDS:
            try:
                yield SoftElement(kind, name, read_softness(data))
            except (IndexError, TypeError, ValueError, KeyError):
                raise ModelError(
                    f'text "{MARK}{kind}:{name}" holds "{data}", needs "k=STIFFNESS c=DAMPING" or a law'
                ) from None


def set_softness(target: Target, model: mujoco.MjModel, kind: str, names: list[str], wanted: Softness) -> None:
    """Give elements a softness: at once in a model; stored in a specification, which compiles to ``model``.

    Raises
    ------
    ModelError
        For a law given to a model, which cannot store it, and elements without inertia.
    """
    if isinstance(target, mujoco.MjModel):
        if wanted.law:
            raise ModelError("a law must be given to the MjSpec: a compiled model has no room for its record")
        for name in names:
            _write_model(target, kind, name, wanted)
        return
    inverse_inertias = [inverse_inertia(model, kind, find(model, kind, name)) for name in names]
    parameter_list = solver_parameters(kind, names, wanted, inverse_inertias, model.opt.timestep)
    write_elements(target, kind, [getattr(target, kind)(name) for name in names], wanted, parameter_list)


def write_elements(
    spec: mujoco.MjSpec, kind: str, elements: Sequence[Any], wanted: Softness, parameter_list: Sequence[Parameters]
) -> None:
    """Store a softness of elements of a specification, and write their solver parameters into them."""
    store_softness(spec, kind, [element.name for element in elements], wanted)
    for element, parameters in zip(elements, parameter_list):
        _write_parameters(element, kind, parameters)


def change_spec(spec: mujoco.MjSpec, make: Callable[[mujoco.MjSpec], T]) -> tuple[T, mujoco.MjModel]:
    """Change a specification and apply its softness again; if that fails it stays as it was.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place.
    make : callable
        Makes the change, first of a copy, which has to compile.

    Returns
    -------
    tuple
        The result of ``make``, and the compiled model of the changed specification.

    Raises
    ------
    ModelError
        If the changed specification does not compile, or an element has no inertia behind it.
    """
    trial = spec.copy()
    with naming("the specification cannot be changed", ValueError, ModelError):
        make(trial)
    model = compile_target(trial)
    write_softness(trial, model)
    result = make(spec)
    write_softness(spec, model)
    return result, model


def store_softness(spec: mujoco.MjSpec, kind: str, names: list[str], wanted: Softness) -> None:
    """Store a softness of elements, which `apply` or `compile` applies."""
    for name in names:
        write_text(spec, kind, name, wanted.data)


def apply(target: Target) -> None:
    """Apply the requested stiffness and damping of all contacts, limits and clearances again.

    MuJoCo scales softness by inverse inertias that it computes when it compiles: whoever changes bodies, joints or
    masses afterwards, or loads a saved model, calls this (or `compile`).

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place.

    Raises
    ------
    ModelError
        If an element was removed, or has no inertia behind it.
    """
    if isinstance(target, mujoco.MjModel):
        for element in requested_softness(target):
            _write_model(target, *element)
    else:
        write_softness(target, compile_target(target))


def write_softness(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Write the softness of all elements into a specification, which compiles to a model."""
    for kind, name, softness in requested_softness(model):
        inverse = inverse_inertia(model, kind, find(model, kind, name))
        values = solver_parameters(kind, [name], softness, [inverse], model.opt.timestep)
        _write_parameters(getattr(spec, kind)(name), kind, values[0])


def _write_model(model: mujoco.MjModel, kind: str, name: str, softness: Softness) -> None:
    fields, index = KINDS[kind], find(model, kind, name)
    inverse = inverse_inertia(model, kind, index)
    if kind == "tendon" and not model.tendon_length0[index]:  # its direction there is arbitrary
        inverse = model.tendon_invweight0[index] = max(inverse, _sum_over_ends(model, index))
    solref, solimp = fields.model
    values = _mapped(kind, name, solref_solimp, softness, inverse, model.opt.timestep)
    getattr(model, solref)[index], getattr(model, solimp)[index] = values
    for field in fields.starts.values():
        getattr(model, field)[index] = 0


def _sum_over_ends(model: mujoco.MjModel, tendon: int) -> float:
    """Return the sum of Â, 1/kg, over the bodies whose sites a tendon passes."""
    first = model.tendon_adr[tendon]
    wraps = slice(first, first + model.tendon_num[tendon])
    sites = model.wrap_objid[wraps][model.wrap_type[wraps] == int(mujoco.mjtWrap.mjWRAP_SITE)]
    return float(model.body_invweight0[model.site_bodyid[sites], 0].sum())


def solver_parameters(
    kind: str, names: list[str], wanted: Softness, behind: Sequence[float], step: float
) -> list[Parameters]:  # fmt: skip
    """Return solref and solimp of a specification's elements, with Â ``behind`` them.

    Raises
    ------
    ModelError
        For an element without inertia behind it; not for a tendon: `apply` to the compiled model estimates one.
    """
    return [
        None if kind == "tendon" and inverse <= 0 else _mapped(kind, name, rounded_solref_solimp, wanted, inverse, step)
        for name, inverse in zip(names, behind)
    ]


def _write_parameters(element: Any, kind: str, parameters: Parameters) -> None:
    """Write solref and solimp into an element of a specification, and let its force begin at zero violation."""
    if parameters is None:
        return
    for field, value in zip(KINDS[kind].spec, parameters):
        setattr(element, field, value)
    for field in KINDS[kind].starts:
        setattr(element, field, 0)


def _mapped(
    kind: str, name: str, mapping: Any, softness: Softness, inverse: float, step: float
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    noun = f'{KINDS[kind].noun} "{name}"'
    if inverse <= 0:
        raise ModelError(f"{noun} moves nothing that has an inertia, so it cannot be soft")
    with naming(noun, LawError, ModelError):
        numbers: tuple[float, ...] = (*softness.at_step(inverse, step), inverse)
        if softness.implicit:
            numbers = *numbers, implicit_impedance(softness.k, softness.damping(inverse), inverse, step)
        return _cached(mapping, *numbers)


@functools.lru_cache(1024)
def _cached(mapping: Any, *numbers: float) -> tuple[np.ndarray, np.ndarray]:
    """Return solver parameters, cached since they are the same for many elements of a model."""
    return mapping(*numbers)
