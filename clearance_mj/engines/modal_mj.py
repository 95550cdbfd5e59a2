"""The modal-mj engine: the Ritz modes of the shaft as slide joints in MuJoCo, its bushing ends as limited tendons.

Every mode is a body of the rig's total mass m on a slide joint; the joint's coordinate is the modal one divided by
√m. Its axis leans so that gravity drives the mode by its participation Γ: the vertical part of the axis is Γ/√m,
which is at most 1 because the effective masses Γ² add up to the mass of the whole rig. A *fixed* tendon with the mode
shapes as coefficients is the displacement of a bushing end; its limits are the gap.
"""

from __future__ import annotations

import functools
from typing import Annotated, ClassVar

import mujoco
import numpy as np
from pydantic import Field

from ..clearance.law import Law
from ..core.errors import ClearanceError
from ..core.validation import Positive, Whole
from ..linear import MAX_MODES, PlaneRows, RigRows, linear_model
from ..physical import apply, set_inverse_inertia
from ..rig import Rig
from ..rig.instruments import Kinds, each_kind
from .base import Engine, Run, register
from .modal_space import driven
from .mujoco_loop import MujocoRun
from .plant import NO_WALL, Maps, Plant, set_solver, soften, stable_step

__all__ = ["ModalMujoco", "build_modes"]

STEP_SHARE = 0.6
"""Of the step without dashpots: those that shorten it further are refused, their damping would be wrong by percents."""


@register
class ModalMujoco(Engine):
    """MuJoCo modes."""

    name: ClassVar[str] = "modal-mj"
    modes: Annotated[Whole, Field(ge=1, le=MAX_MODES)] = 8
    """modes in the Ritz basis, to which the static shapes are added"""
    safety: Positive = 0.5
    """time step as a share of its stability limit, contacts at their hardest"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """``safety`` times the stability limit of the modes with every contact, film and dashpot at its hardest."""
        _check_planar(rig)
        ritz, mass, maps = linear_model(rig, self.modes), _mass(rig, self.modes), _plant(rig, self.modes).maps
        if ritz.springs.size or np.any(ritz.coupling != ritz.coupling.T):
            raise ClearanceError(f"rig {rig.name!r}: modal-mj knows symmetric stiffness and damping alone; use modal")
        inertia, joints = mass * np.eye(ritz.size), mass * ritz.omega**2
        step = stable_step(inertia, joints, maps.at_points, rig, law)
        if maps.viscous.size:  # explicit in the loop
            viscous = np.zeros_like(maps.viscous), maps.viscous + mass * np.diag(ritz.damping)
            damped = stable_step(inertia, joints, maps.at_points, rig, law, other=viscous)
            if damped < STEP_SHARE * step:
                raise ClearanceError(
                    f"rig {rig.name!r}: its dashpots couple the modes too strongly for the modal-mj engine, which "
                    "takes them explicitly; use modal"
                )
            step = damped
        return self.safety * step

    def start(self, rig: Rig, law: Law, kind: Kinds, step: float) -> Run:
        """Begin a simulation at rest; see `Engine.start`."""
        if len(each_kind(kind)) > 1 or rig.gravity or rig.loads:
            raise ClearanceError(f"rig {rig.name!r}: modal-mj knows one input and no loads; use links or modal")
        driven(linear_model(rig, self.modes), kind)  # refuses what cannot be excited so
        run = MujocoRun(self, rig, law, kind, step, _plant(rig, self.modes))
        run.driving.lift[0, 1] = -float(each_kind(kind)[0] == "base")  # the joints lean as the base moves
        return run


def build_modes(rig: Rig, modes: int = 8) -> mujoco.MjSpec:
    """Describe the rig as a MuJoCo model of its modes, with the softness of the datasheet."""
    _check_planar(rig)
    ritz, mass = linear_model(rig, modes), _mass(rig, modes)
    spec = mujoco.MjSpec()
    spec.modelname = f"{rig.name} modes"
    spec.option.timestep = 0.5 * 2 / ritz.omega[-1]  # leaves room for contacts; engines set their own
    set_solver(spec)
    for i, (omega, damping, share) in enumerate(zip(ritz.omega, ritz.damping, ritz.participation / np.sqrt(mass))):
        body = spec.worldbody.add_body(name=f"mode{i}", pos=[0.1 * i, 0, 0])
        body.mass, body.ipos, body.inertia, body.explicitinertial = mass, [0, 0, 0], [1e-3 * mass] * 3, True
        size = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [0.03, 0, 0], "contype": 0, "conaffinity": 0}
        body.add_geom(name=f"mode{i}", **size)
        axis = [np.sqrt(max(1 - share**2, 0.0)), 0, share]
        slide = {"type": mujoco.mjtJoint.mjJNT_SLIDE, "axis": axis, "name": f"mode{i}"}
        body.add_joint(**slide, stiffness=[mass * omega**2, 0, 0], damping=[mass * damping, 0, 0])
    for j, bushing in enumerate(rig.bushings):
        for end, row in zip("ab", ritz.at_ends[2 * j :]):
            tendon = spec.add_tendon(
                name=f"bushing{j}{end}", limited=1, range=np.clip(bushing.walls, -NO_WALL, NO_WALL)
            )
            for i, y in enumerate(row):
                tendon.wrap_joint(f"mode{i}", np.sqrt(mass) * y)
            name = {"objtype": mujoco.mjtObj.mjOBJ_TENDON, "objname": tendon.name}
            spec.add_sensor(name=tendon.name, type=mujoco.mjtSensor.mjSENS_TENDONPOS, **name)
            soften(spec, "tendon", tendon.name, bushing)
    apply(spec)
    return spec


def _check_planar(rig: Rig) -> None:
    if rig.moves_across:
        raise ClearanceError(f"rig {rig.name!r}: modal-mj knows motion along z alone; use links or modal in space")


@functools.lru_cache(maxsize=32)
def _plant(rig: Rig, modes: int) -> Plant:
    spec = build_modes(rig, modes)
    spec.compiler.discardvisual = True  # the modes' shapes only take time, and so does looking for their contacts
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model = spec.compile()
    ritz, mass = linear_model(rig, modes), _mass(rig, modes)
    root = np.sqrt(mass)
    set_inverse_inertia(model)
    rows, transform, span = ritz.planes[1]
    viscous = mass * ritz.coupling  # the joints have the rest of the damping
    limits = np.arange(2 * len(rig.bushings))
    pairs = np.zeros((limits.size, 0), dtype=int)
    sensors = ritz.sensor_rows
    maps = Maps(root * ritz.at_points, viscous, root * sensors.accelerations, pairs, limits, root * sensors.readings)
    return Plant(model, maps, RigRows(rig, (None, PlaneRows(rows, root * transform, span))))


def _mass(rig: Rig, modes: int) -> float:
    """Mass of every mode's body, kg: at least the sum of the effective masses, which is the rig's where it is known."""
    shares = linear_model(rig, modes).participation ** 2
    return max(rig.total_mass or float(np.sum(shares)) or 1.0, float(shares.max(initial=0.0)))
