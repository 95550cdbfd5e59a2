"""Contacts and limits that are springs and dampers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import mujoco

from ..core.errors import ModelError
from .elements import KINDS, Target, compiled, find, give, name_of, softness

if TYPE_CHECKING:
    from ..clearance.law import Law

__all__ = ["contact", "joint_limit", "tendon_limit"]


def joint_limit(
    target: Target, joint: Any, k: float | None = None, c: float | None = None, *, law: Law | None = None
) -> None:
    """Make a joint's limits springs and dampers: torque k r + c ṙ, never pulling, r beyond the range.

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place. A specification keeps what was asked; see `compile`.
    joint : str, mujoco.MjsJoint, or several of them in a list
        With a range; hinge, slide or ball. The limit's margin is set to zero.
    k : float
        Stiffness, N m/rad (N/m for a slide), > 0, whichever unit the range is in.
    c : float
        Damping, N m s/rad (N s/m), >= 0.
    law : Law, optional
        Instead of k and c, such as ``ContactLaw(HuntCrossley(...))``; a `Softener` makes the limit follow it. Its
        amplitude and its grease are those of the motion about the middle of the range.

    Raises
    ------
    ModelError
        For a joint that the model does not have, or one without limits.
    LawError
        For a stiffness or damping out of range, or a law that cannot be a limit's.
    """
    _limits(target, "joint", joint, k, c, law)


def tendon_limit(
    target: Target, tendon: Any, k: float | None = None, c: float | None = None, *, law: Law | None = None
) -> None:
    """Make a tendon's limits springs and dampers: force k r + c ṙ, never pulling, r beyond the range.

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place. A specification keeps what was asked; see `compile`.
    tendon : str, mujoco.MjsTendon, or several of them in a list
        With a range. The limit's margin is set to zero.
    k : float
        Stiffness, N/m (of a fixed tendon: force per its length, which has the unit of coefficient times joint), > 0.
    c : float
        Damping, N s/m, >= 0.
    law : Law, optional
        Instead of k and c; see `joint_limit`. Lengths of a spatial tendon whose range begins at 0 count from there.

    Raises
    ------
    ModelError
        For a tendon that the model does not have, or one without limits.
    LawError
        For a stiffness or damping out of range, or a law that cannot be a limit's.
    """
    _limits(target, "tendon", tendon, k, c, law)


def _limits(target: Target, kind: str, elements: Any, k: float | None, c: float | None, law: Law | None) -> None:
    model, fields = compiled(target), "jnt" if kind == "joint" else kind
    names = [name_of(e) for e in (elements if isinstance(elements, list | tuple) else [elements])]
    ids = [find(model, KINDS[kind].object, name) for name in names]
    for name, i in zip(names, ids):
        if not getattr(model, f"{fields}_limited")[i]:
            raise ModelError(f'{kind} "{name}" has no limits; give it a range (and limited="true")')
    widths = getattr(model, f"{fields}_range")[ids] @ (-0.5, 0.5)
    wanted = [softness(k, c, law, float(width)) for width in (widths if law else widths[:1])]
    for some, softest in zip([[name] for name in names] if law else [names], wanted):
        give(target, kind, some, softest)


def contact(
    target: Target, geoms: Any, k: float | None = None, c: float | None = None, frictionless: bool = False, *,
    law: Law | None = None, depth: float = 1e-3,
) -> None:  # fmt: skip
    """Make contacts springs and dampers: normal force k r + c ṙ, never pulling, r the depth; no friction.

    In a specification each contact becomes an explicit pair, which begins where the surfaces touch. Geoms that meet
    in several points, such as a box on a plane, have k and c at each: `check` names them.

    Parameters
    ----------
    target : mujoco.MjSpec or mujoco.MjModel
        Changed in place. A specification keeps what was asked; see `compile`. A model must have the pair already.
    geoms : str, mujoco.MjsGeom, or two of them in a tuple
        One geom: its contacts with all that it can touch; two: the contact between them.
    k : float
        Stiffness, N/m, > 0.
    c : float
        Damping, N s/m, >= 0.
    frictionless : bool
        Must be True if the model has friction at such a contact (``condim`` above 1, MuJoCo's default): it is then
        left out, since MuJoCo's rows of friction change the normal stiffness. `friction` gives bristles instead.
    law : Law, optional
        Instead of k and c; a `Softener` makes the contact follow it. Without grease and not over amplitude, which
        only a clearance has.
    depth : float
        Penetration, m, up to which a law that hardens is to be stable.

    Raises
    ------
    ModelError
        For a geom that the model does not have, geoms that cannot touch, and friction.
    LawError
        For a stiffness or damping out of range, or a law that cannot be a contact's.
    """
    wanted_softness = softness(k, c, law, depth)
    model = compiled(target)
    one = isinstance(geoms, str) or not isinstance(geoms, Iterable)
    names = [name_of(g) for g in ([geoms] if one else geoms)]
    if len(names) > 2:
        raise ModelError(f"a contact has two geoms, got {len(names)}")
    ids = [find(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in names]
    pairs = {frozenset(p): i for i, p in enumerate(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist()))}
    if one:
        wanted = [p for p in pairs if ids[0] in p]
        if isinstance(target, mujoco.MjSpec):
            wanted = [*wanted, *(p for p in _touching(model, ids[0]) if p not in pairs)]
    else:
        wanted = [frozenset(ids)] if len(set(ids)) == 2 else []
    if not wanted:
        raise ModelError(
            f'geom "{names[0]}" touches '
            + ("itself" if not one else "nothing: see contype, conaffinity, exclude; or name two geoms")
        )
    for pair in wanted:
        _refuse_friction(model, pair, pairs.get(pair), frictionless)
    if isinstance(target, mujoco.MjModel):
        if not set(wanted) <= pairs.keys():
            raise ModelError(f'the model has no pair of geoms "{names[0]}" and "{names[1]}"; give it to the MjSpec')
        model.pair_dim[[pairs[pair] for pair in wanted]] = 1
        give(model, "pair", [_pair_name(model, pairs[pair]) for pair in wanted], wanted_softness)
    else:
        give(target, "pair", _explicit(target, model, wanted), wanted_softness)


def _touching(model: mujoco.MjModel, geom: int) -> list[frozenset[int]]:
    """Pairs of a geom and others that MuJoCo lets collide (documentation, Computation: Collision detection)."""
    weld, types, affinity = model.body_weldid[model.geom_bodyid], model.geom_contype, model.geom_conaffinity
    above = model.body_weldid[model.body_parentid[weld]]
    excluded = {frozenset((int(s) >> 16, int(s) & 0xFFFF)) for s in model.exclude_signature}
    no_parents = not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    found = []
    for other in range(model.ngeom):
        a, b = sorted((geom, other))
        related = weld[a] == weld[b] or (
            no_parents and weld[a] and weld[b] and (weld[a] == above[b] or weld[b] == above[a])
        )
        collide = types[a] & affinity[b] or types[b] & affinity[a]
        out = frozenset((int(model.geom_bodyid[a]), int(model.geom_bodyid[b]))) in excluded
        flat = model.geom_type[a] == plane and model.geom_type[b] == plane
        if collide and not (related or out or flat):
            found.append(frozenset((a, b)))
    return found


def _refuse_friction(model: mujoco.MjModel, geoms: frozenset[int], pair: int | None, frictionless: bool) -> None:
    a, b = sorted(geoms)
    if pair is not None:
        condim = model.pair_dim[pair]
    elif model.geom_priority[a] != model.geom_priority[b]:
        condim = model.geom_condim[a if model.geom_priority[a] > model.geom_priority[b] else b]
    else:
        condim = max(model.geom_condim[a], model.geom_condim[b])
    if condim > 1 and not frictionless:
        elliptic = model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
        why = "an elliptic cone changes the normal force while it slides" if elliptic else (
            "a pyramidal cone multiplies the normal stiffness"
        )  # fmt: skip
        named = " - ".join(_geom_name(model, g) for g in (a, b))
        raise ModelError(
            f"contact {named} has friction (condim {condim}), and {why}: give frictionless=True to leave friction out"
        )


def _geom_name(model: mujoco.MjModel, geom: int) -> str:
    return model.geom(geom).name or f"{model.body(model.geom_bodyid[geom]).name} geom {geom}"


def _pair_name(model: mujoco.MjModel, pair: int) -> str:
    if not (name := model.pair(pair).name):
        geoms = " - ".join(_geom_name(model, g) for g in (model.pair_geom1[pair], model.pair_geom2[pair]))
        raise ModelError(f"the pair {geoms} has no name; give it one, or use the MjSpec")
    return name


def _explicit(spec: mujoco.MjSpec, model: mujoco.MjModel, wanted: list[frozenset[int]]) -> list[str]:
    """Names of the specification's pairs of these geoms, which are added and named where they are not."""
    geoms = {geom.id: geom for geom in spec.geoms}
    there = {frozenset((p.geomname1, p.geomname2)): p for p in spec.pairs}
    names = []
    for ids in wanted:
        for i in ids:
            geoms[i].name = geoms[i].name or _geom_name(model, i)
        a, b = (geoms[i].name for i in sorted(ids))
        pair = there.get(frozenset((a, b))) or spec.add_pair(geomname1=a, geomname2=b)
        pair.name = pair.name or f"{a} - {b}"
        pair.condim = 1
        names.append(pair.name)
    return names
