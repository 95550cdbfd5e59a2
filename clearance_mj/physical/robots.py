"""A robot that stands on its feet and has play in its gears, in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from ..core.errors import ModelError
from .checks import compile
from .drives import add_drive
from .elements import compiled, find, name_of, specification
from .limits import contact, touching

__all__ = ["robot"]


def robot(
    spec: mujoco.MjSpec, feet: Sequence[Any] = (), k: float | None = None, *, c: float | None = None,
    damping_ratio: float | None = None, friction: float | None = None, torsion: float = 0.0,
    backlash: float | Mapping[str, float] | None = None, teeth: float | None = None, teeth_damping_ratio: float = 0.1,
) -> mujoco.MjModel:  # fmt: skip
    """Give a robot's feet a stiffness and friction and its gears play, and compile it.

    What this changes: nothing in ``nq``, ``nv``, ``nu`` and the observations of joints, so policies and controllers
    stay what they are; drives have activations (``na``), explicit pairs take the place of the feet's contacts. Friction
    and drives act within a `Softener`.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Not changed; `contact` and `add_drive` change one in the same way.
    feet : sequence of str or mujoco.MjsGeom
        Geoms whose contacts with all that is fixed to the world get k, damping and friction.
    k : float
        Stiffness of each foot's contact, N/m, for all points of the foot together.
    c : float, optional
        Damping, N s/m.
    damping_ratio : float, optional
        Instead of c, of each foot's contact; see `contact`. It leaves k to each point of contact.
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
    spec = spec.copy()
    if feet:
        geoms = _on_the_ground(compiled(specification(spec)), [name_of(foot) for foot in feet])
        points = "each" if damping_ratio is not None else "share"
        contact(spec, geoms, k, c, True, damping_ratio=damping_ratio, friction=friction, torsion=torsion, points=points)
    if backlash is not None:
        plays = backlash if isinstance(backlash, Mapping) else dict.fromkeys(_turning(spec), backlash)
        for play in sorted(set(plays.values())):
            names = [name for name, own in plays.items() if own == play]
            add_drive(spec, names, backlash=play, k=teeth, damping_ratio=teeth_damping_ratio)
    return compile(spec)


def _on_the_ground(model: mujoco.MjModel, feet: list[str]) -> list[tuple[str, str]]:
    """Pairs of each foot and what is fixed to the world, as far as they can touch."""
    found = []
    for foot in feet:
        geom = find(model, mujoco.mjtObj.mjOBJ_GEOM, foot)
        others = [other for pair in touching(model, geom) for other in pair - {geom}]
        ground = [other for other in others if model.body_weldid[model.geom_bodyid[other]] == 0]
        if not ground:
            raise ModelError(f'foot "{foot}" can touch nothing that is fixed to the world')
        for other in ground:
            if not model.geom(other).name:
                body = model.body(model.geom_bodyid[other]).name
                raise ModelError(f'the geom of body "{body}" that foot "{foot}" stands on has no name; give it one')
            found.append((foot, model.geom(other).name))
    return found


def _turning(spec: mujoco.MjSpec) -> list[str]:
    """Names of the actuators of hinges."""
    hinges = {joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE}
    names = [motor.name for motor in spec.actuators if motor.target in hinges]
    if not names or not np.all([bool(name) for name in names]):
        raise ModelError("backlash of all gears needs actuators of hinges that have names")
    return names
