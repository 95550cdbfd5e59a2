"""Dry friction without creep: bristles that deflect elastically and slip at the largest force.

It is stored in the model as ``<custom><numeric name="physical:friction:joint:elbow" data="1.5 1e5 10"/>``: force, k and
c (of a pair coefficient, k, c and, if given, the arms of torsion and rolling). It is read there at every step: a
compiled model's ``numeric("...").data`` may be changed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from ..core.errors import LawError, ModelError
from .elements import compile_target, find, joint_kind, name_of, pairs_of, requested_softness, require_spec
from .records import MARK, marked_names, write_numbers

__all__ = [
    "BristleSettings", "bristles_of", "friction", "give_friction", "joint_friction", "pair_friction",
    "pairs_with_bristles", "tendon_friction",
]  # fmt: skip

_CONE = 10.0  # MuJoCo's cone over the coefficient: wide enough for friction and spin of every contact point


class BristleSettings(NamedTuple):
    """Bristles of an element, stored as a custom numeric of the model."""

    kind: str  # "joint", "tendon" or "pair"
    name: str
    numeric: int  # address in numeric_data: largest force (of a pair its ratio to the normal force), k and c
    size: int  # number of parameters; the fourth and fifth of a pair are its arms of torsion and rolling


def friction(
    spec: mujoco.MjSpec, geoms: Any, coefficient: float, k: float, c: float = 0.0, torsion: float = 0.0,
    rolling: float = 0.0,
) -> None:  # fmt: skip
    """Give a contact dry friction: sticking is a spring and damper, sliding a force in proportion to the normal force.

    Elastic Coulomb friction: bristles between the surfaces bend by the distance slid, up to coefficient times normal
    force over stiffness. A body that sticks rests; MuJoCo's own friction creeps, for its rows have no stiffness.
    Several points of contact between two geoms have one bristle at the centre of their pressure, and one that resists
    spin about their normal there: it slips at coefficient times normal force times the mean arm of the points. Surfaces
    that move themselves (``surfacevel`` of MuJoCo 4) carry along.

    The pair gets MuJoCo's rows of friction, in a cone ten times as wide as the coefficient; a `Softener` gives them the
    bristles' force, so that sensors of force, torque and contact and ``mj_contactForce`` show it.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place; a `Softener` makes the friction act.
    geoms : tuple of two str or mujoco.MjsGeom, or a list of such tuples
        Their contact has been given a softness with `contact`.
    coefficient : float
        μ, > 0.
    k : float
        Tangential stiffness, N/m, > 0.
    c : float
        Damping while it sticks, N s/m, >= 0.
    torsion : float
        Arm of friction against spin of a single point, such as of a ball: the mean one of its patch, m, >= 0.
    rolling : float
        Arm of rolling resistance, m, >= 0: what rolls is braked by the torque of the normal force at this arm. Its
        bristles have the stiffness k (rolling/coefficient)², N m/rad.

    Raises
    ------
    ModelError
        For geoms that the model does not have, or without a contact in physical units.
    LawError
        For values out of range.
    """
    parameters = pair_friction(coefficient, k, c, torsion, rolling)
    model, contacts = compile_target(require_spec(spec)), geoms if isinstance(geoms, list) else [geoms]
    pairs, pair_names, with_bristles = pairs_of(model), [], pairs_with_bristles(model)
    implicit = {name for kind, name, softness in requested_softness(model) if kind == "pair" and softness.implicit}
    for contact_geoms in contacts:
        names = [name_of(geom) for geom in contact_geoms]
        if len(names) != 2:
            raise ModelError(f"a contact has two geoms, got {len(names)}")
        pair = pairs.get(frozenset(find(model, "geom", name) for name in names))
        name = model.pair(pair).name if pair is not None else ""
        if not name or (model.pair_dim[pair] != 1 and name not in with_bristles):
            raise ModelError(
                f'geoms "{names[0]}" and "{names[1]}" have no contact without MuJoCo\'s friction; '
                "give it a softness first: contact(..., frictionless=True)"
            )
        if name in implicit:
            raise ModelError(f'contact "{name}" is implicit, but a Softener\'s friction is explicit; leave one away')
        pair_names.append(name)
    give_friction(spec, pair_names, parameters)


def pair_friction(coefficient: float, k: float, c: float, torsion: float, rolling: float) -> tuple[float, ...]:
    """Return the numbers that a model stores for the friction of a pair.

    Raises
    ------
    LawError
        For values out of range.
    """
    _check_parameters("coefficient", coefficient, k, c)
    for label, value in (("torsion", torsion), ("rolling", rolling)):
        if not 0 <= value < np.inf:
            raise LawError(f"{label} = {value:g} of friction must be finite and >= 0")
    return (coefficient, k, c, *((torsion, rolling) if rolling else (torsion,) if torsion else ()))


def give_friction(spec: mujoco.MjSpec, pairs: list[str], wanted: tuple[float, ...]) -> None:
    """Give pairs of a specification bristles of these numbers, and MuJoCo's friction rows to carry their force."""
    coefficient, torsion, rolling = wanted[0], *(*wanted[3:], 0.0, 0.0)[:2]
    sliding = _CONE * coefficient
    for name in pairs:
        write_numbers(spec, f"{MARK}friction:pair:{name}", wanted)
        spec.pair(name).condim = (3, 4, 6)[len(wanted) - 3]
        spec.pair(name).friction = sliding, sliding, sliding * torsion, _CONE * rolling, _CONE * rolling


def joint_friction(
    spec: mujoco.MjSpec, joint: Any, force: float, k: float, c: float = 0.0, *, native: bool = False
) -> None:  # fmt: skip
    """Give a joint dry friction: sticking is a spring and damper, sliding a constant torque.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place; a `Softener` makes the friction act.
    joint : str or mujoco.MjsJoint
        Hinge or slide.
    force : float
        Torque, N m (force, N, of a slide), at which it slips, > 0.
    k : float
        Stiffness while it sticks, N m/rad (N/m), > 0.
    c : float
        Damping while it sticks, N m s/rad (N s/m), >= 0.
    native : bool
        Let the joint's spring yield at the force (``springyield`` of MuJoCo 4) instead: it needs no
        `Softener`, but its damping acts while it slides, too, and ``discrete`` increases sliding friction.

    Raises
    ------
    ModelError
        For a joint that the model does not have, or of another type; of native friction, for a joint that has a spring
        already, and MuJoCo 3.
    LawError
        For values out of range.
    """
    _check_parameters("force", force, k, c)
    name = name_of(joint)
    kind = joint_kind(compile_target(require_spec(spec)), name, "friction")
    if native:
        in_degrees = spec.compiler.degree and kind == mujoco.mjtJoint.mjJNT_HINGE
        _set_yielding_spring(spec.joint(name), f'joint "{name}"', (force, k, c), np.rad2deg(1.0) if in_degrees else 1.0)
        return
    write_numbers(spec, f"{MARK}friction:joint:{name}", (force, k, c))


def tendon_friction(spec: mujoco.MjSpec, tendon: Any, force: float, k: float, c: float = 0.0) -> None:
    """Give a tendon dry friction: sticking is a spring and damper, sliding a constant force.

    Between the teeth of `add_backlash`, whose tendon is "NAME backlash", it is the friction of the gear's two sides
    against each other.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place; a `Softener` makes the friction act.
    tendon : str or mujoco.MjsTendon
        Fixed or spatial.
    force : float
        At which it slips, N (N m for a tendon of hinges), > 0.
    k : float
        Stiffness while it sticks, N/m (N m/rad), > 0.
    c : float
        Damping while it sticks, N s/m (N m s/rad), >= 0.

    Raises
    ------
    ModelError
        For a tendon that the model does not have.
    LawError
        For values out of range.
    """
    _check_parameters("force", force, k, c)
    name = name_of(tendon)
    find(compile_target(require_spec(spec)), "tendon", name)
    write_numbers(spec, f"{MARK}friction:tendon:{name}", (force, k, c))


def _set_yielding_spring(element: Any, where: str, numbers: tuple[float, float, float], unit: float) -> None:
    """Set the yield point of an element's spring; ``unit`` is that of its displacement in the specification."""
    force, k, c = numbers
    if not hasattr(element, "springyield"):
        raise ModelError(f"{where}: springs yield from MuJoCo 4 on; leave native=True away")
    if np.any(element.stiffness):
        raise ModelError(f"{where} has a spring already, which cannot yield beside friction; leave native=True away")
    element.stiffness[0], element.springyield = k, force / k * unit
    element.damping[0] += c


def pairs_with_bristles(model: mujoco.MjModel) -> set[str]:
    """Return the names of the pairs with bristles, which MuJoCo's friction rows carry."""
    return {bristle.name for bristle in bristles_of(model) if bristle.kind == "pair"}


def bristles_of(model: mujoco.MjModel) -> Iterator[BristleSettings]:
    """Yield the bristles of a model's elements."""
    for i, prefix, suffix in marked_names(model, mujoco.mjtObj.mjOBJ_NUMERIC, f"{MARK}friction:"):
        kind, _, name = suffix.partition(":")
        size, largest = int(model.numeric_size[i]), 5 if kind == "pair" else 3
        if not 3 <= size <= largest:
            needs = "coefficient k c, and may have torsion and rolling" if kind == "pair" else "force k c"
            raise ModelError(f'numeric "{model.numeric(i).name}" has {size} numbers, needs 3: {needs}')
        yield BristleSettings(kind, prefix + name, int(model.numeric_adr[i]), size)


def _check_parameters(label: str, largest: float, k: float, c: float) -> None:
    for name, value, ok in ((label, largest, largest > 0), ("k", k, k > 0), ("c", c, c >= 0)):
        if not (ok and np.isfinite(value)):
            raise LawError(f"{name} = {value:g} of friction must be finite and {'>=' if name == 'c' else '>'} 0")
