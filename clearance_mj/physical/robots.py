"""A robot with soft feet and play in its gears, in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco

from ..core.errors import ModelError
from .checks import compile, points_of
from .clearances import add_backlash
from .damping import damping_ratio_of
from .drives import add_drive
from .elements import compile_target, find, name_of, pairs_of, require_spec
from .limits import colliding_pairs, contact
from .softness import softness

__all__ = ["robot"]


def robot(
    spec: mujoco.MjSpec, feet: Sequence[Any] = (), k: float | None = None, *, c: float | None = None,
    damping_ratio: float | None = None, friction: float | None = None, torsion: float = 0.0,
    backlash: float | Mapping[str, float] | None = None, teeth: float | None = None, teeth_damping_ratio: float = 0.1,
    inertia: float | None = None, implicit: bool = False,
) -> mujoco.MjModel:  # fmt: skip
    """Give a robot's feet a stiffness and friction and its gears play, and compile it.

    ``nq``, ``nv``, ``nu`` and the observations of joints do not change, so that policies and controllers can be reused;
    drives have activations (``na``), and explicit pairs replace the feet's contacts. Friction and drives act within a
    `Softener`.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Not changed; `contact` and `add_drive` change one in place.
    feet : sequence of str or mujoco.MjsGeom
        Geoms whose contacts with all that is fixed to the world get k, damping and friction.
    k : float
        Stiffness of each foot's contact, N/m; the points of a foot that touches in several, such as a box, share it.
    c : float, optional
        Damping, N s/m.
    damping_ratio : float, optional
        Instead of c, of the mass behind each foot; see `contact`.
    friction : float, optional
        Coefficient of dry friction.
    torsion : float
        Arm of friction against spin of feet that touch in one point, m.
    backlash : float or mapping of str to float, optional
        From side to side, degrees, of the gears of all actuators of hinges, or of each actuator by its name.
    teeth : float
        Stiffness of gears at their joints, N m/rad.
    teeth_damping_ratio : float
        Of rotor and load against each other.
    inertia : float, optional
        Of each rotor at its joint, kg m²; without it the joints' armatures.
    implicit : bool
        Model gears as separate joints with implicit teeth, `add_backlash`, instead of drives: stable at any time
        step, without a `Softener`; ``nq`` and ``nv`` grow by one each.

    Returns
    -------
    mujoco.MjModel
        The model; see `compile`.

    Raises
    ------
    ModelError
        For elements that the model does not have, backlash without ``teeth``, and what `compile` refuses.
    LawError
        For a stiffness or damping out of range.
    """
    if backlash is not None and teeth is None:
        raise ModelError("backlash needs the stiffness of the gears: give teeth, N m/rad at the joint")
    spec = require_spec(spec).copy()
    if backlash is not None:  # first, since it changes the inertia behind the feet
        plays = backlash if isinstance(backlash, Mapping) else dict.fromkeys(_hinge_actuators(spec), backlash)
        for play in sorted(set(plays.values())):
            names = [name for name, angle in plays.items() if angle == play]
            options: dict[str, Any] = {"k": teeth, "damping_ratio": teeth_damping_ratio, "inertia": inertia}
            if implicit:
                joints = [spec.actuator(name).target for name in names]
                add_backlash(spec, joints, backlash=play, **options, implicit=True)
            else:
                add_drive(spec, names, backlash=play, **options)
    if feet:
        model = compile_target(spec)
        foot_softness = softness(k, c, None, 0.0, damping_ratio_of(c, damping_ratio, None))
        single_points, shared = _ground_contacts(model, [name_of(foot) for foot in feet])
        if single_points:
            contact(spec, single_points, k, c, True, damping_ratio=damping_ratio, friction=friction, torsion=torsion)
        for foot, ground in shared:
            value = foot_softness.damping(float(model.body_invweight0[model.geom(foot).bodyid[0], 0]))
            contact(spec, (foot, ground), k, value, True, friction=friction, torsion=torsion, points="share")
    return compile(spec)


def _ground_contacts(
    model: mujoco.MjModel, feet: list[str]
) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:  # fmt: skip
    """Return the possible contacts of feet and the ground: those with one point, and those with several."""
    single, shared = list[tuple[str, str]](), list[tuple[str, str]]()
    for foot in feet:
        geom = find(model, "geom", foot)
        pairs = {*colliding_pairs(model, geom), *(pair for pair in pairs_of(model) if geom in pair)}
        others = sorted(other for pair in pairs for other in pair - {geom})
        ground = [other for other in others if model.body_weldid[model.geom_bodyid[other]] == 0]
        if not ground:
            raise ModelError(f'foot "{foot}" can touch nothing that is fixed to the world')
        for other in ground:
            if not model.geom(other).name:
                body = model.body(model.geom_bodyid[other]).name
                raise ModelError(f'the geom of body "{body}" that foot "{foot}" stands on has no name; give it one')
            kinds = points_of(model, geom, other)
            (shared if kinds[2] > 1 or "hfield" in kinds else single).append((foot, model.geom(other).name))
    return single, shared


def _hinge_actuators(spec: mujoco.MjSpec) -> list[str]:
    """Return the names of the actuators of hinges."""
    hinges = {joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE}
    names = [motor.name for motor in spec.actuators if motor.target in hinges]
    if not names or not all(names):
        raise ModelError("backlash of all gears needs actuators of hinges that have names")
    return names
