"""Contacts and limits that are springs and dampers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from ..core.errors import ModelError
from .bristles import give_friction, pair_friction, pairs_with_bristles
from .damping import damping_ratio_of
from .elements import (
    Target,
    compile_target,
    find,
    name_of,
    pairs_of,
    set_softness,
    solver_parameters,
    write_elements,
)
from .records import MARK, marked_names, texts, write_numbers, write_text
from .softness import Softness, read_softness, softness

if TYPE_CHECKING:
    from ..clearance.law import Law

__all__ = ["add_missing_pairs", "colliding_pairs", "contact", "joint_limit", "tendon_limit", "uncovered_contacts"]

_BRISTLE_RATIO = 0.1  # damping ratio of bristles of a law without constant damping
_GEOM_FRICTION = f"{MARK}friction of geom:"  # prefix of numerics with the friction of all contacts of one geom
ONE_GEOM = "geom", "frictionless geom"
"""Kinds of the texts with the softness of all contacts of one geom: without friction, or with it left out"""


def joint_limit(
    target: Target, joint: Any, k: float | None = None, c: float | None = None, *, law: Law | None = None,
    damping_ratio: float | None = None, restitution: float | None = None, implicit: bool = False,
) -> None:  # fmt: skip
    """Make a joint's limits springs and dampers: torque k r + c ṙ, never pulling, r beyond the range.

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place. A specification stores the request; see `compile`.
    joint : str, mujoco.MjsJoint, or several of them in a list
        With a range; hinge, slide or ball. The limit's margin is set to zero.
    k : float
        Stiffness, N m/rad (N/m for a slide), > 0, whichever unit the range is in.
    c : float
        Damping, N m s/rad (N s/m), >= 0.
    law : Law, optional
        Instead of k and c, such as ``ContactLaw(HuntCrossley(...))``; a `Softener` makes the limit follow it. Its
        amplitude and its grease are those of the motion about the middle of the range.
    damping_ratio, restitution : float, optional
        Instead of c, of the inertia behind the limit in the model's initial pose; see `contact`.
    implicit : bool
        Apply it as by backward Euler; see `contact`.

    Raises
    ------
    ModelError
        For a joint that the model does not have, or one without limits.
    LawError
        For a stiffness or damping out of range, or a law that cannot be a limit's.
    """
    _set_limits(target, "joint", joint, (k, c, law), damping_ratio_of(c, damping_ratio, restitution), implicit)


def tendon_limit(
    target: Target, tendon: Any, k: float | None = None, c: float | None = None, *, law: Law | None = None,
    damping_ratio: float | None = None, restitution: float | None = None, implicit: bool = False,
) -> None:  # fmt: skip
    """Make a tendon's limits springs and dampers: force k r + c ṙ, never pulling, r beyond the range.

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place. A specification stores the request; see `compile`.
    tendon : str, mujoco.MjsTendon, or several of them in a list
        With a range. The limit's margin is set to zero.
    k : float
        Stiffness, N/m (of a fixed tendon: force per its length, which has the unit of coefficient times joint), > 0.
    c : float
        Damping, N s/m, >= 0.
    law : Law, optional
        Instead of k and c; see `joint_limit`. Lengths of a spatial tendon whose range begins at 0 count from there.
    damping_ratio, restitution : float, optional
        Instead of c, of the inertia behind the limit in the model's initial pose; see `contact`.
    implicit : bool
        Apply it as by backward Euler; see `contact`.

    Raises
    ------
    ModelError
        For a tendon that the model does not have, or one without limits.
    LawError
        For a stiffness or damping out of range, or a law that cannot be a limit's.
    """
    _set_limits(target, "tendon", tendon, (k, c, law), damping_ratio_of(c, damping_ratio, restitution), implicit)


def _set_limits(
    target: Target, kind: str, elements: Any, given: tuple[Any, Any, Law | None], ratio: float | None, implicit: bool
) -> None:  # fmt: skip
    model, fields = compile_target(target), "jnt" if kind == "joint" else kind
    names = [name_of(e) for e in (elements if isinstance(elements, list | tuple) else [elements])]
    ids = [find(model, kind, name) for name in names]
    for name, i in zip(names, ids):
        if not getattr(model, f"{fields}_limited")[i]:
            raise ModelError(f'{kind} "{name}" has no limits; give it a range (and limited="true")')
    widths = getattr(model, f"{fields}_range")[ids] @ (-0.5, 0.5)
    values = [softness(*given, float(width), ratio, implicit) for width in (widths if given[2] else widths[:1])]
    for group, element_softness in zip([[name] for name in names] if given[2] else [names], values):
        set_softness(target, model, kind, group, element_softness)


def contact(
    target: Target, geoms: Any, k: float | None = None, c: float | None = None, frictionless: bool = False, *,
    damping_ratio: float | None = None, restitution: float | None = None, friction: float | None = None,
    torsion: float = 0.0, rolling: float = 0.0, law: Law | None = None, depth: float = 1e-3, points: str = "each",
    implicit: bool = False,
) -> None:  # fmt: skip
    """Make contacts springs and dampers: normal force k r + c ṙ, never pulling, r the depth; and give them friction.

    In a specification each contact becomes an explicit pair, which begins where the surfaces touch. Geoms that meet
    in several points, such as a box on a plane or a height field, have k and c at each: `check` names them.

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place. A specification stores the request; see `compile`. A model must have the pair already.
    geoms : str, mujoco.MjsGeom, two of them in a tuple, or a list of such tuples
        One geom: its contacts with all that it can touch, also with geoms added to the specification before
        `compile`; two: the contact between them.
    k : float
        Stiffness, N/m, > 0.
    c : float
        Damping, N s/m, >= 0.
    frictionless : bool
        Must be True if the model has friction at such a contact (``condim`` above 1, MuJoCo's default): it is then
        left out, since MuJoCo's rows of friction change the normal stiffness. ``friction`` gives bristles instead.
    damping_ratio : float, optional
        Instead of c: ζ of the critical damping 2 √(k m), m the mass behind the contact in the model's initial pose, of
        the two bodies together; c follows it when masses change and the model is compiled again.
    restitution : float, optional
        Instead of c: that of the mass m.
    friction : float, optional
        Coefficient μ of dry friction by bristles as stiff and as damped across as the contact is along its normal
        (where a law has no constant damping, a tenth of the critical one); see `friction` for others. It takes a
        `Softener`.
    torsion, rolling : float
        Arms of friction against spin and rolling, m; see `friction`.
    law : Law, optional
        Instead of k and c; a `Softener` makes the contact follow it. Without grease and not over amplitude, which
        only a clearance has.
    depth : float
        Penetration, m, up to which a law that hardens is to be stable.
    points : str
        "each": k and c, or the law, hold for each point; "share": for the mean depth of all points of the pair, however
        many there are, which takes a `Softener`.
    implicit : bool
        Apply it as by backward Euler: stable at any time step, as exact at rest, its ringing damped by the step
        (an amplitude by 1/√(1 + h²ω²) in each). It has neither friction nor a law, and is right for the step that the
        model is compiled with; see `apply`.

    Raises
    ------
    ModelError
        For a geom that the model does not have, geoms that cannot touch, and friction.
    LawError
        For a stiffness or damping out of range, or a law that cannot be a contact's.
    """
    ModelError.require_known("points", points, ("each", "share"))
    requested = softness(k, c, law, depth, damping_ratio_of(c, damping_ratio, restitution), implicit)
    model = compile_target(target)
    bristles = None
    if implicit and (friction is not None or points == "share"):
        raise ModelError("an implicit contact has neither friction nor shared points: a Softener's forces are explicit")
    if friction is not None:
        if isinstance(target, mujoco.MjModel):
            raise ModelError("friction must be given to the MjSpec: a compiled model has no room for its record")
        frictionless, bristles = True, pair_friction(friction, requested.k, requested.c, torsion, rolling)
    if points == "share":
        if requested.ratio is not None:
            raise ModelError('points="share" needs c: several points have no mass of their own')
        requested = _share_law(requested, depth)
    pairs, single_geoms = pairs_of(model), []
    selected: list[frozenset[int]] = []
    for names in _geom_names(geoms):
        ids = [find(model, "geom", name) for name in names]
        if len(ids) == 2:
            matches = [frozenset(ids)] if len(set(ids)) == 2 else []
        else:
            single_geoms += names
            matches = [p for p in pairs if ids[0] in p]
            if isinstance(target, mujoco.MjSpec):
                matches += [p for p in colliding_pairs(model, ids[0]) if p not in pairs]
        if not matches:
            raise ModelError(
                f'geom "{names[0]}" touches '
                + ("itself" if len(ids) == 2 else "nothing: see contype, conaffinity, exclude; or name two geoms")
            )
        if isinstance(target, mujoco.MjModel) and not set(matches) <= pairs.keys():
            raise ModelError(f'the model has no pair of geoms "{names[0]}" and "{names[1]}"; give it to the MjSpec')
        selected += [pair for pair in matches if pair not in selected]
    with_bristles = pairs_with_bristles(model)
    for pair in selected:
        _require_frictionless(model, pair, pairs.get(pair), frictionless, with_bristles)
    if isinstance(target, mujoco.MjModel):
        model.pair_dim[[pairs[pair] for pair in selected if model.pair(pairs[pair]).name not in with_bristles]] = 1
        set_softness(model, model, "pair", [_pair_name(model, pairs[pair]) for pair in selected], requested)
        return

    _set_pairs(target, model, selected, requested, bristles)
    for name in single_geoms:
        write_text(target, ONE_GEOM[frictionless], name, requested.data)
        if bristles:
            write_numbers(target, f"{_GEOM_FRICTION}{name}", bristles)


def _share_law(single: Softness, depth: float) -> Softness:
    """Return a softness that the points of a pair share, as a law."""
    from ..clearance import ContactLaw, KelvinVoigt

    return softness(None, None, single.law or ContactLaw(KelvinVoigt(single.k, single.c)), depth)._replace(shared=True)


def _geom_names(geoms: Any) -> Iterator[list[str]]:
    """Yield the names of one geom or two, for each requested contact."""
    groups = geoms if isinstance(geoms, list) and any(isinstance(each, tuple) for each in geoms) else [geoms]
    for group in groups:
        names = [name_of(g) for g in ([group] if isinstance(group, str) or not isinstance(group, Iterable) else group)]
        if len(names) > 2:
            raise ModelError(f"a contact has two geoms, got {len(names)}")
        yield names


def add_missing_pairs(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bool:
    """Give geoms added after a `contact` call for one geom its softness; return True if there are any.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Gets explicit pairs for them.
    model : mujoco.MjModel
        The compiled specification.

    Raises
    ------
    ModelError
        For a geom that was removed, and contacts with friction unless ``frictionless`` was given.
    """
    added = False
    friction_numbers = {prefix + name: model.numeric(f"{prefix}{_GEOM_FRICTION}{name}").data
            for _, prefix, name in marked_names(model, mujoco.mjtObj.mjOBJ_NUMERIC, _GEOM_FRICTION)}  # fmt: skip
    for geom, requested, frictionless, uncovered in uncovered_contacts(model):
        for pair in uncovered:
            _require_frictionless(model, pair, None, frictionless, set())
        if uncovered:
            friction = friction_numbers.get(model.geom(geom).name)
            _set_pairs(spec, model, uncovered, requested, None if friction is None else tuple(map(float, friction)))
            added = True
    return added


def uncovered_contacts(model: mujoco.MjModel) -> Iterator[tuple[int, Softness, bool, list[frozenset[int]]]]:
    """Yield each geom with a softness for all its contacts: geom, softness, frictionless, and pairs that lack it.

    Pairs are those that it can touch and that have no explicit softness.
    """
    pairs = pairs_of(model)
    for kind, name, data in texts(model):
        if kind in ONE_GEOM:
            geom = find(model, "geom", name)
            uncovered = [pair for pair in colliding_pairs(model, geom) if pair not in pairs]
            yield geom, read_softness(data), kind == ONE_GEOM[True], uncovered


def colliding_pairs(model: mujoco.MjModel, geom: int) -> list[frozenset[int]]:
    """Return the pairs of a geom that MuJoCo lets collide (documentation, Computation: Collision detection)."""
    weld, types, affinity = model.body_weldid[model.geom_bodyid], model.geom_contype, model.geom_conaffinity
    above = model.body_weldid[model.body_parentid[weld]]
    independent = weld != weld[geom]
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT and weld[geom]:
        independent &= (weld == 0) | ((weld != above[geom]) & (above != weld[geom]))
    collide = ((types[geom] & affinity) | (types & affinity[geom])) != 0
    plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
    others = np.flatnonzero(independent & collide & ~(plane & plane[geom])).tolist()
    excluded = {frozenset((int(s) >> 16, int(s) & 0xFFFF)) for s in model.exclude_signature}
    bodies = model.geom_bodyid.tolist()
    return [frozenset((geom, other)) for other in others if frozenset((bodies[geom], bodies[other])) not in excluded]


def _require_frictionless(
    model: mujoco.MjModel, geoms: frozenset[int], pair: int | None, frictionless: bool, with_bristles: set[str]
) -> None:  # fmt: skip
    """Raise ModelError for MuJoCo's friction, unless it is to be left out or bristles replace it."""
    a, b = sorted(geoms)
    if pair is not None:
        condim = 1 if model.pair(pair).name in with_bristles else model.pair_dim[pair]
    elif model.geom_priority[a] != model.geom_priority[b]:
        condim = model.geom_condim[a if model.geom_priority[a] > model.geom_priority[b] else b]
    else:
        condim = max(model.geom_condim[a], model.geom_condim[b])
    if condim > 1 and not frictionless:
        elliptic = model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
        why = "an elliptic cone changes the normal force while it slides" if elliptic else (
            "a pyramidal cone multiplies the normal stiffness"
        )  # fmt: skip
        names = " - ".join(_geom_name(model, g) for g in (a, b))
        raise ModelError(
            f"contact {names} has friction (condim {condim}), and {why}: give frictionless=True to leave friction out"
        )


def _geom_name(model: mujoco.MjModel, geom: int) -> str:
    return model.geom(geom).name or f"{model.body(model.geom_bodyid[geom]).name} geom {geom}"


def _pair_name(model: mujoco.MjModel, pair: int) -> str:
    if not (name := model.pair(pair).name):
        geoms = " - ".join(_geom_name(model, g) for g in (model.pair_geom1[pair], model.pair_geom2[pair]))
        raise ModelError(f"the pair {geoms} has no name; give it one, or use the MjSpec")
    return name


def _set_pairs(
    spec: mujoco.MjSpec, model: mujoco.MjModel, geom_pairs: list[frozenset[int]], softness: Softness,
    bristles: tuple[float, ...] | None,
) -> None:  # fmt: skip
    """Set softness and friction of pairs of geoms; explicit pairs are added where needed.

    The specification compiles to the model.
    """
    names = [" - ".join(_geom_name(model, g) for g in sorted(pair)) for pair in geom_pairs]
    inverse_masses = [float(model.body_invweight0[model.geom_bodyid[[*pair]], 0].sum()) for pair in geom_pairs]
    parameters = solver_parameters("pair", names, softness, inverse_masses, model.opt.timestep)
    pairs = _explicit_pairs(spec, model, geom_pairs)
    write_elements(spec, "pair", pairs, softness, parameters)
    if bristles:
        tangential = Softness(bristles[1], bristles[2], ratio=softness.ratio)
        if softness.law and not softness.c:
            tangential = tangential._replace(ratio=_BRISTLE_RATIO)
        for pair, inverse in zip(pairs, inverse_masses):
            give_friction(spec, [pair.name], (*bristles[:2], tangential.damping(inverse), *bristles[3:]))


def _explicit_pairs(spec: mujoco.MjSpec, model: mujoco.MjModel, geom_pairs: list[frozenset[int]]) -> list[Any]:
    """Return the specification's pairs of these geoms; missing ones are added and named."""
    geoms = {geom.id: geom for geom in spec.geoms}
    existing = {frozenset((p.geomname1, p.geomname2)): p for p in spec.pairs}
    pairs, with_bristles = [], pairs_with_bristles(model)
    for ids in geom_pairs:
        for i in ids:
            geoms[i].name = geoms[i].name or _geom_name(model, i)
        a, b = (geoms[i].name for i in sorted(ids))
        pair = existing.get(frozenset((a, b))) or spec.add_pair(geomname1=a, geomname2=b)
        pair.name = pair.name or f"{a} - {b}"
        pair.condim = pair.condim if pair.name in with_bristles else 1
        pairs.append(pair)
    return pairs
