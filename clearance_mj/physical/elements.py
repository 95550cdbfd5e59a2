"""Elements of a MuJoCo model that have a softness: their names, Â, solver parameters, and what was asked of them.

What is asked stands in the model itself, as ``<custom><text name="physical:joint:elbow" data="k=500.0 c=2.0"/>``: it is
saved and attached with the model, and `apply` can give it anew after any change of the inertias, on which Â depends. A
law stands there as in its file, with the depth at which it is linearised, until a `Softener` follows it.
"""

from __future__ import annotations

import difflib
import json
import numbers
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import mujoco
import numpy as np

from ..core.checks import naming
from ..core.errors import LawError, ModelError
from .softness import solref_solimp, written

if TYPE_CHECKING:
    from ..clearance.law import Law

__all__ = [
    "KINDS", "MARK", "Asked", "Kind", "Softness", "Target", "apply", "ask", "asked", "compiled", "find", "give",
    "inverse_inertia", "joint_kind", "marked", "name_of", "nearest", "note_softener", "softness", "specification",
    "texts", "write_numbers", "write_text",
]  # fmt: skip

Target: TypeAlias = mujoco.MjSpec | mujoco.MjModel


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
_NOTE = (
    "friction, laws and drives of this model act only while clearance_mj.physical.Softener(model) is in use, or its "
    "update() is called in every step; without it nothing rubs, actuators with drives exert nothing, and stiffness "
    "stays that of a law's nominal depth"
)
MARK = "physical:"  # begins the names of texts that hold what was asked


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


class Softness(NamedTuple):
    """Stiffness and damping of an element, and the law that they are the hardest of, if there is one."""

    k: float  # N/m, or N m/rad
    c: float
    law: Law | None = None
    depth: float = 0.0  # m or rad, of the penetration at which a law that hardens is linearised

    @property
    def data(self) -> str:
        """What a model holds of it."""
        if self.law is None:
            return f"k={float(self.k)!r} c={float(self.c)!r}"
        return json.dumps({"law": self.law.to_dict(), "depth": self.depth})


def softness(k: float | None, c: float | None, law: Law | None, depth: float) -> Softness:
    """Return what a user asked: a stiffness and a damping, or a law.

    Raises
    ------
    LawError
        For both or neither, a stiffness that is not > 0, a damping that is not >= 0, and laws that engines cannot
        have as a limit.
    """
    if law is None:
        if k is None or c is None:
            raise LawError("give a stiffness k and a damping c, or a law")
        for label, value in (("k", k), ("c", c)):
            if not isinstance(value, numbers.Real):
                raise LawError(f"{label} must be a number, got {value!r}")
        found = Softness(k, c)
    else:
        if k is not None or c is not None:
            raise LawError("give a stiffness k and a damping c, or a law, not both")
        if not hasattr(law, "largest"):
            raise LawError(f"law must be a law such as clearance_mj.clearance.ContactLaw, got {law!r}")
        if np.any(law.table(1).adhesion):
            raise LawError("MuJoCo's contacts and limits never pull, so a law with adhesion cannot be theirs")
        hardest_k, hardest_c = (float(most[0]) for most in law.largest([depth]))
        found = Softness(hardest_k, hardest_c, law, depth)
    solref_solimp(found.k, found.c, 1.0)  # refuses what cannot be
    return found


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
                yield Asked(kind, name, _read(data))
            except (IndexError, TypeError, ValueError, KeyError):
                raise ModelError(
                    f'text "{MARK}{kind}:{name}" holds "{data}", needs "k=STIFFNESS c=DAMPING" or a law'
                ) from None


def _read(data: str) -> Softness:
    if data.startswith("{"):
        from ..clearance.law_files import law_from_dict

        values = json.loads(data)
        return softness(None, None, law_from_dict(values["law"]), float(values["depth"]))
    k, c = (float(part.split("=")[1]) for part in data.split())
    return Softness(k, c)


def texts(model: mujoco.MjModel) -> Iterator[tuple[str, str, str]]:
    """Yield kind, name and data of every text of a model that was written by this package."""
    for i, before, after in marked(model, mujoco.mjtObj.mjOBJ_TEXT, MARK):
        kind, _, name = after.partition(":")
        begin = model.text_adr[i]
        data = bytes(model.text_data[begin : begin + model.text_size[i]]).rstrip(b"\0").decode()
        yield kind, before + name, data


def marked(model: mujoco.MjModel, object_type: mujoco.mjtObj, mark: str) -> Iterator[tuple[int, str, str]]:
    """Yield number and name of the texts or numbers of a model that hold a mark: what is before it, and after.

    A specification that is attached has its prefix before both.
    """
    for i in range(model.ntext if object_type == mujoco.mjtObj.mjOBJ_TEXT else model.nnumeric):
        before, found, after = (mujoco.mj_id2name(model, object_type, i) or "").partition(mark)
        if found:
            yield i, before, after


def write_text(spec: mujoco.MjSpec, kind: str, name: str, data: str) -> None:
    """Write, or write anew, what is asked of an element of a specification."""
    key = f"{MARK}{kind}:{name}"
    for text in spec.texts:
        if text.name == key:
            text.data = data
            return
    spec.add_text(name=key, data=data)


def write_numbers(spec: mujoco.MjSpec, name: str, data: Sequence[float]) -> None:
    """Write, or write anew, custom numbers of a specification."""
    for numeric in spec.numerics:
        if numeric.name == name:
            numeric.data = data
            return
    spec.add_numeric(name=name, data=data, size=len(data))


def note_softener(spec: mujoco.MjSpec) -> None:
    """Write into a specification what its model does without a `Softener`."""
    write_text(spec, "softener", "note", _NOTE)


def give(target: Target, kind: str, names: list[str], wanted: Softness) -> None:
    """Give elements a softness: at once in a model, with a record in a specification.

    Raises
    ------
    ModelError
        For a law that a model, which has no room for its record, is to follow.
    """
    if isinstance(target, mujoco.MjModel):
        if wanted.law:
            raise ModelError("a law must be given to the MjSpec: a compiled model has no room for its record")
        for name in names:
            _write_model(target, kind, name, wanted.k, wanted.c)
        return
    ask(target, kind, names, wanted)
    apply(target)


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
    model = compiled(target)
    for kind, name, (k, c, *_) in asked(model):
        if isinstance(target, mujoco.MjModel):
            _write_model(model, kind, name, k, c)
        else:
            _write_spec(target, model, kind, name, k, c)


def _write_model(model: mujoco.MjModel, kind: str, name: str, k: float, c: float) -> None:
    there, index = KINDS[kind], find(model, KINDS[kind].object, name)
    inverse = inverse_inertia(model, kind, index)
    if kind == "tendon" and not model.tendon_length0[index]:  # whose direction there is arbitrary
        inverse = model.tendon_invweight0[index] = max(inverse, _of_its_ends(model, index))
    solref, solimp = there.model
    getattr(model, solref)[index], getattr(model, solimp)[index] = _checked(kind, name, solref_solimp, k, c, inverse)
    for field in there.starts.values():
        getattr(model, field)[index] = 0


def _of_its_ends(model: mujoco.MjModel, tendon: int) -> float:
    """1/kg, sum over the bodies whose sites a tendon passes."""
    first = model.tendon_adr[tendon]
    wraps = slice(first, first + model.tendon_num[tendon])
    sites = model.wrap_objid[wraps][model.wrap_type[wraps] == int(mujoco.mjtWrap.mjWRAP_SITE)]
    return float(model.body_invweight0[model.site_bodyid[sites], 0].sum())


def _write_spec(spec: mujoco.MjSpec, model: mujoco.MjModel, kind: str, name: str, k: float, c: float) -> None:
    there, index = KINDS[kind], find(model, KINDS[kind].object, name)
    element = getattr(spec, kind)(name)
    inverse = inverse_inertia(model, kind, index)
    if inverse <= 0 and kind == "tendon":
        return  # no number would do; `apply` to the compiled model
    for field, value in zip(there.spec, _checked(kind, name, written, k, c, inverse)):
        setattr(element, field, value)
    for field in there.starts:
        setattr(element, field, 0)


def _checked(kind: str, name: str, mapping: Any, k: float, c: float, inverse: float) -> tuple[np.ndarray, np.ndarray]:
    noun = f'{KINDS[kind].noun} "{name}"'
    if inverse <= 0:
        raise ModelError(f"{noun} moves nothing that has an inertia, so it cannot be soft")
    with naming(noun, LawError, ModelError):
        return mapping(k, c, inverse)
