"""Elements of a MuJoCo model that have a softness: their names, Â, solver parameters, and what was asked of them.

What is asked stands in the model itself, as ``<custom><text name="physical:joint:elbow" data="k=500.0 c=2.0"/>``: it is
saved and attached with the model, and `apply` can give it anew after any change of the inertias, on which Â depends. A
law stands there as in its file, with the depth at which it is linearised, until a `Softener` follows it.
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
from .softness import Softness, implicit_impedance, read_softness, solref_solimp, written

__all__ = [
    "KINDS", "Asked", "Kind", "Target", "apply", "ask", "asked", "change", "compiled", "find", "give",
    "inverse_inertia", "joint_kind", "name_of", "nearest", "pairs_of", "solver_parameters",
    "specification", "write_all", "write_parameters",
]  # fmt: skip

Target: TypeAlias = mujoco.MjSpec | mujoco.MjModel
T = TypeVar("T")
Parameters: TypeAlias = tuple[np.ndarray, np.ndarray] | None


@dataclass(frozen=True)
class Kind:
    """Where a kind of element has its solver parameters, in a specification and in a model."""

    noun: str
    object: mujoco.mjtObj
    spec: tuple[str, str]  # solref and solimp
    model: tuple[str, str]
    starts: dict[str, str]  # in the specification: in the model; where else than at zero violation the force begins
    inverse: str  # where the model has Â


KINDS = {
    "joint": Kind(
        "joint limit", mujoco.mjtObj.mjOBJ_JOINT, ("solref_limit", "solimp_limit"), ("jnt_solref", "jnt_solimp"),
        {"margin": "jnt_margin"}, "dof_invweight0",
    ),
    "tendon": Kind(
        "tendon limit", mujoco.mjtObj.mjOBJ_TENDON, ("solref_limit", "solimp_limit"),
        ("tendon_solref_lim", "tendon_solimp_lim"), {"margin": "tendon_margin"}, "tendon_invweight0",
    ),
    "pair": Kind(
        "contact", mujoco.mjtObj.mjOBJ_PAIR, ("solref", "solimp"), ("pair_solref", "pair_solimp"),
        {"margin": "pair_margin", "gap": "pair_gap"}, "body_invweight0",
    ),
}  # fmt: skip
"""By the names that records of them have"""


def compiled(target: Target) -> mujoco.MjModel:
    """Return the model itself, or what a specification compiles to.

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


def specification(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Return a specification, or raise a ModelError if it is none."""
    if not isinstance(spec, mujoco.MjSpec):
        raise ModelError(f"got {type(spec).__name__}, needs a mujoco.MjSpec: a compiled model cannot get new elements")
    return spec


def name_of(element: Any) -> str:
    """Return the name of an element that is given by its name or itself."""
    name = element if isinstance(element, str) else getattr(element, "name", None)
    if not isinstance(name, str) or not name:
        raise ModelError(f"{element!r} has no name; give the element a name and use that")
    return name


def find(model: mujoco.MjModel, object_type: mujoco.mjtObj, name: str) -> int:
    """Return the index of an element of a model.

    Raises
    ------
    ModelError
        If there is none; names those that are like it.
    """
    index = mujoco.mj_name2id(model, object_type, name)
    if index >= 0:
        return index
    places = range(model.nnames_map)  # of which no kind of element has more
    known = [mujoco.mj_id2name(model, object_type, i) for i in places]
    noun = object_type.name.removeprefix("mjOBJ_").lower()
    raise ModelError(f'the model has no {noun} "{name}"; {nearest(name, known)}')


def nearest(name: str, known: Iterable[str | None]) -> str:
    """Return words that point to a known name that is like one that is not; else to some that are known."""
    names = [each for each in known if each]
    near = difflib.get_close_matches(name, names, n=1)
    there = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
    return f'did you mean "{near[0]}"?' if near else f"it has {there or 'none with a name'}"


def pairs_of(model: mujoco.MjModel) -> dict[frozenset[int], int]:
    """Return the numbers of a model's explicit pairs by their geoms."""
    return {frozenset(p): i for i, p in enumerate(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist()))}


def joint_kind(model: mujoco.MjModel, name: str, what: str) -> mujoco.mjtJoint:
    """Return the type of a joint that is to have something: a hinge or slide; refuses other joints."""
    kind = mujoco.mjtJoint(int(model.jnt_type[find(model, mujoco.mjtObj.mjOBJ_JOINT, name)]))
    if kind not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        raise ModelError(f'joint "{name}" is {kind.name.removeprefix("mjJNT_").lower()}; {what} needs a hinge or slide')
    return kind


def inverse_inertia(model: mujoco.MjModel, kind: str, index: int) -> float:
    """Â of an element's row, 1/kg or 1/(kg m²): the constant of the model with which MuJoCo scales its softness.

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


class Asked(NamedTuple):
    """An element of which a softness was asked."""

    kind: str
    name: str
    softness: Softness


def asked(model: mujoco.MjModel) -> Iterator[Asked]:
    """Yield every element that was given a softness in its specification."""
    for kind, name, data in texts(model):
        if kind in KINDS:
            try:
                yield Asked(kind, name, read_softness(data))
            except (IndexError, TypeError, ValueError, KeyError):
                raise ModelError(
                    f'text "{MARK}{kind}:{name}" holds "{data}", needs "k=STIFFNESS c=DAMPING" or a law'
                ) from None


def give(target: Target, model: mujoco.MjModel, kind: str, names: list[str], wanted: Softness) -> None:
    """Give elements a softness: at once in a model, with a record in a specification, which compiles to ``model``.

    Raises
    ------
    ModelError
        For a law that a model, which has no room for its record, is to follow, and elements without inertia.
    """
    if isinstance(target, mujoco.MjModel):
        if wanted.law:
            raise ModelError("a law must be given to the MjSpec: a compiled model has no room for its record")
        for name in names:
            _write_model(target, kind, name, wanted)
        return
    behind = [inverse_inertia(model, kind, find(model, KINDS[kind].object, name)) for name in names]
    found = solver_parameters(kind, names, wanted, behind, model.opt.timestep)
    ask(target, kind, names, wanted)
    for name, parameters in zip(names, found):
        write_parameters(getattr(target, kind)(name), kind, parameters)


def change(spec: mujoco.MjSpec, make: Callable[[mujoco.MjSpec], T]) -> tuple[T, mujoco.MjModel]:
    """Change a specification and give anew what was asked of it; if that fails it stays as it was.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place.
    make : callable
        Makes the change, first of a copy, which has to compile.

    Returns
    -------
    tuple
        What ``make`` returns, and the model that the changed specification compiles to.

    Raises
    ------
    ModelError
        If the changed specification does not compile, or an element has no inertia behind it.
    """
    trial = spec.copy()
    with naming("the specification cannot be changed", ValueError, ModelError):
        make(trial)
    model = compiled(trial)
    write_all(trial, model)
    made = make(spec)
    write_all(spec, model)
    return made, model


def ask(spec: mujoco.MjSpec, kind: str, names: list[str], wanted: Softness) -> None:
    """Record a softness of elements, which `apply` or `compile` gives them."""
    for name in names:
        write_text(spec, kind, name, wanted.data)


def apply(target: Target) -> None:
    """Give all contacts, limits and clearances anew the stiffness and damping that were asked of them.

    MuJoCo scales softness by inverse inertias that it computes when it compiles: whoever changes bodies, joints or
    masses afterwards, or loads a saved model, calls this (or `compile`).

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place.

    Raises
    ------
    ModelError
        If an element is gone, or has no inertia behind it.
    """
    if isinstance(target, mujoco.MjModel):
        for element in asked(target):
            _write_model(target, *element)
    else:
        write_all(target, compiled(target))


def write_all(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Write into a specification, which compiles to a model, everything that was asked of its elements."""
    for kind, name, wanted in asked(model):
        behind = inverse_inertia(model, kind, find(model, KINDS[kind].object, name))
        found = solver_parameters(kind, [name], wanted, [behind], model.opt.timestep)
        write_parameters(getattr(spec, kind)(name), kind, found[0])


def _write_model(model: mujoco.MjModel, kind: str, name: str, wanted: Softness) -> None:
    there, index = KINDS[kind], find(model, KINDS[kind].object, name)
    inverse = inverse_inertia(model, kind, index)
    if kind == "tendon" and not model.tendon_length0[index]:  # whose direction there is arbitrary
        inverse = model.tendon_invweight0[index] = max(inverse, _of_its_ends(model, index))
    solref, solimp = there.model
    found = _checked(kind, name, solref_solimp, wanted, inverse, model.opt.timestep)
    getattr(model, solref)[index], getattr(model, solimp)[index] = found
    for field in there.starts.values():
        getattr(model, field)[index] = 0


def _of_its_ends(model: mujoco.MjModel, tendon: int) -> float:
    """1/kg, sum over the bodies whose sites a tendon passes."""
    first = model.tendon_adr[tendon]
    wraps = slice(first, first + model.tendon_num[tendon])
    sites = model.wrap_objid[wraps][model.wrap_type[wraps] == int(mujoco.mjtWrap.mjWRAP_SITE)]
    return float(model.body_invweight0[model.site_bodyid[sites], 0].sum())


def solver_parameters(
    kind: str, names: list[str], wanted: Softness, behind: Sequence[float], step: float
) -> list[Parameters]:  # fmt: skip
    """Return solref and solimp, as a specification gets them, of elements with Â ``behind`` them.

    Raises
    ------
    ModelError
        For an element without inertia behind it, but for a tendon: `apply` to the compiled model finds one.
    """
    return [
        None if inverse <= 0 and kind == "tendon" else _checked(kind, name, written, wanted, inverse, step)
        for name, inverse in zip(names, behind)
    ]


def write_parameters(element: Any, kind: str, parameters: Parameters) -> None:
    """Write solref and solimp into an element of a specification, and let its force begin at zero violation."""
    if parameters is None:
        return
    for field, value in zip(KINDS[kind].spec, parameters):
        setattr(element, field, value)
    for field in KINDS[kind].starts:
        setattr(element, field, 0)


def _checked(
    kind: str, name: str, mapping: Any, wanted: Softness, inverse: float, step: float
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    noun = f'{KINDS[kind].noun} "{name}"'
    if inverse <= 0:
        raise ModelError(f"{noun} moves nothing that has an inertia, so it cannot be soft")
    with naming(noun, LawError, ModelError):
        numbers: tuple[float, ...] = (*wanted.at_step(inverse, step), inverse)
        if wanted.implicit:
            numbers = *numbers, implicit_impedance(wanted.k, wanted.damping(inverse), inverse, step)
        return _mapped(mapping, *numbers)


@functools.lru_cache(1024)
def _mapped(mapping: Any, *numbers: float) -> tuple[np.ndarray, np.ndarray]:
    """Return solver parameters, which are the same for many elements of a model."""
    return mapping(*numbers)
