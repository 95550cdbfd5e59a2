"""An engine beside the package's: Ritz modes as slide joints in MuJoCo, the ends of bushings as limited tendons.

It checks the compiled modal engine with contacts that MuJoCo solves. Every mode is a body of the rig's total mass m on
a slide joint; the joint's coordinate is the modal one divided by √m. Its axis leans so that gravity drives the mode by
its participation Γ: the vertical part of the axis is Γ/√m, which is at most 1 because the effective masses Γ² add up to
the mass of the whole rig. A *fixed* tendon with the mode shapes as coefficients is the displacement of a bushing end;
its limits are the gap. Importing this file registers the engine, as `docs/extending.md` shows.
"""

import functools
from types import SimpleNamespace
from typing import ClassVar

import mujoco
import numpy as np

from clearance_mj import physical
from clearance_mj.engines.base import Engine, register
from clearance_mj.engines.links_loop import Maps
from clearance_mj.engines.links_run import LinksRun
from clearance_mj.engines.plant import ARMATURE, NO_WALL, set_solver, stable_step
from clearance_mj.engines.scheme import moving, places_of
from clearance_mj.linear import PlaneRows, RigRows, linear_model
from clearance_mj.rig.instruments import input_kinds


@register
class ModalMujoco(Engine):
    """Modes in MuJoCo, of rigs in a plane without loads whose dampers leave the modes uncoupled."""

    name: ClassVar[str] = "modal-mj"
    modes: int = 8
    safety: float = 0.5

    def largest_step(self, rig, law):
        """``safety`` times the stability limit of the modes with every contact and film at its hardest."""
        plant = _plant(rig, self.modes)
        return self.safety * stable_step(plant.whole.mass, plant.model.jnt_stiffness, plant.maps.at_rows, rig, law)

    def start(self, rig, law, kind, step):
        """Begin at rest."""
        run = LinksRun(self, rig, law, kind, step, _plant(rig, self.modes))
        run.driving.lift[0, 1] = -float(input_kinds(kind) == ("base",))  # the joints lean as the base moves
        return run


@functools.lru_cache(maxsize=32)
def _plant(rig, modes):
    ritz = linear_model(rig, modes)
    assert not (rig.moves_across or rig.loads or rig.gravity or ritz.coupling.size or ritz.springs.size)
    root = np.sqrt(rig.total_mass or np.sum(ritz.participation**2))
    spec = mujoco.MjSpec()
    set_solver(spec)
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    for i, (omega, damping, part) in enumerate(zip(ritz.omega, ritz.damping, ritz.participation / root)):
        body = spec.worldbody.add_body(mass=root**2, inertia=[1, 1, 1], explicitinertial=True)
        slide = {"type": mujoco.mjtJoint.mjJNT_SLIDE, "axis": [np.sqrt(max(1 - part**2, 0.0)), 0, part]}
        body.add_joint(name=f"{i}", **slide, stiffness=[(root * omega) ** 2, 0, 0], damping=[root**2 * damping, 0, 0])
    ends = [f"{j}{end}" for j in range(len(rig.bushings)) for end in "ab"]
    for end, row in zip(ends, ritz.at_ends):
        walls = np.clip(rig.bushings[int(end[:-1])].walls, -NO_WALL, NO_WALL)
        tendon = spec.add_tendon(name=end, limited=1, range=walls)
        for i, y in enumerate(row):
            tendon.wrap_joint(f"{i}", root * y)
    if ends:
        physical.tendon_limit(spec, ends, 1.0, 0.0)  # the loop writes those of the law
    model = spec.compile()
    physical.set_inverse_inertia(model)
    rows, transform, span = ritz.planes[1]
    sensors, none, n = ritz.sensor_rows, np.zeros((0, 0)), ritz.size
    points, damping = root * ritz.at_points, root**2 * ritz.damping
    maps = Maps(
        order=np.arange(n), at_rows=points, spans=moving(points), places=places_of(rig),
        at_sensors=root * sensors.accelerations, influence=np.column_stack((np.zeros(n), root * ritz.participation)),
        turning=np.zeros((0, n)), orders=np.zeros(0), viscous=none, circulatory=none,
        pairs=np.zeros((len(ends), 0), int), limits=np.arange(len(ends)), readings=root * sensors.readings,
    )  # fmt: skip
    whole = SimpleNamespace(
        rows=RigRows(rig, (None, PlaneRows(rows, root * transform, span))), rayleigh=(0.0, 0.0), gyroscopic=none,
        free=np.eye(n), whole_stiffness=np.diag(model.jnt_stiffness), dampers=np.diag(damping), damping=damping,
        bends_across=False, mass=root**2 * np.eye(n), size=n,
    )  # fmt: skip
    return SimpleNamespace(model=model, maps=maps, whole=whole, explicit=False, armature=ARMATURE)
