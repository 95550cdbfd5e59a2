"""A rig's chains for the links engine: the MuJoCo model, and linear maps to the rig's points."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import mujoco
import numpy as np

from ..clearance.walls.round import Round
from ..clearance.walls.slot import Slot
from ..clearance.walls.stop import Stop
from ..physical import INVERSE_INERTIA, set_inverse_inertia
from ..rig import Rig
from ..rig.loads import order_forces
from .linkage import Linkage
from .links_clearances import add_clearances, contact_names
from .links_loop import Maps
from .links_model import joint_names, links_spec
from .plant import ARMATURE, ITERATIONS, STIFF_ROOT, Statics
from .scheme import moving, places_of, slide_rows

__all__ = ["IN_MUJOCO", "LinksPlant", "links_plant"]

IN_MUJOCO = Slot, Stop, Round  # walls whose normal force MuJoCo computes


@dataclass(frozen=True, eq=False)
class LinksPlant:
    """A rig's chains as a MuJoCo model. Shared by simulations, which copy the model."""

    model: mujoco.MjModel
    """compiled; must not be changed"""
    whole: Linkage
    maps: Maps
    explicit: bool
    """True if dampers of joints are explicit, as with rigid supports and springs"""

    @functools.cached_property
    def armature(self) -> np.ndarray:
        """(nv,) armature of joints, in the order of the coordinates: inertia over stiffness times the step squared."""
        stiff = np.concatenate([member.chain.stiff_roots for member in self.whole.members])
        return np.where(stiff, STIFF_ROOT, ARMATURE)

    @functools.cached_property
    def statics(self) -> Statics:
        """Matrices at rest."""
        whole = self.whole
        return Statics(whole.mass, whole.whole_stiffness, whole.free, whole.circulatory, self.maps.at_rows)


@functools.lru_cache(maxsize=32)
def links_plant(rig: Rig, links: int) -> LinksPlant:
    """Compile a rig's chains for the engine.

    Parameters
    ----------
    rig : Rig
        The rig.
    links : int
        Number of links of each shaft.

    Raises
    ------
    RigError
        As `linkage`.
    """
    spec, whole = links_spec(rig, links)
    add_clearances(spec, whole)
    off = mujoco.mjtDisableBit
    explicit = bool(spec.option.disableflags & off.mjDSBL_EULERDAMP)
    # Leave out what only costs time: shapes, all of a plate but its face, sensors, which are on straight links, and
    # collision detection of bodies.
    spec.compiler.discardvisual = True
    spec.option.disableflags |= int(off.mjDSBL_SENSOR | (off.mjDSBL_CONTACT if not spec.pairs else 0))
    spec.option.disableflags |= int(off.mjDSBL_EULERDAMP) * whole.bends_across  # its loop knows all dampers
    spec.option.iterations = ITERATIONS
    for plate in {pair.geomname1 for pair in spec.pairs}:
        _reduce_to_face(spec.geom(plate))
    collars, tendons = contact_names(whole)
    for bushing, name in zip((b for b in rig.bushings for _ in "ab"), tendons):
        if bushing.is_round and name:
            spec.site(f"{name} middle").pos[1:] = -bushing.offset_y, -bushing.offset
            spec.tendon(name).limited = type(bushing.wall_model) in IN_MUJOCO  # else the loop pushes
    model = spec.compile()
    set_inverse_inertia(model)
    limits = np.array([model.tendon(name).id if name else -1 for name in tendons], dtype=int)
    model.tendon_invweight0[limits[limits >= 0]] = INVERSE_INERTIA  # also between two bodies that both move
    numbers = {model.pair(i).name: i for i in range(model.npair)}  # MuJoCo sorts them
    sides = [[numbers.get(f"{collar}_{side}", -1) for side in ("lower", "upper")] for collar in collars]
    rows = whole.rows
    points = np.vstack((whole.at_points, *(rows.sliding(j) for j in slide_rows(rig))))
    turning = np.zeros((0, whole.size))
    if rig.unbalances or rig.orders:
        turning = np.vstack((rows.unbalance, order_forces(rig.orders, rows.directed, whole.size)))
    maps = Maps(
        order=np.array([model.joint(name).dofadr[0] for name in joint_names(whole)], dtype=int),
        at_rows=np.ascontiguousarray(points), spans=moving(points), places=places_of(rig),
        at_sensors=rows.sensor_rows.accelerations, influence=whole.influence, turning=turning,
        orders=np.array([each.order for each in rig.orders], dtype=float), viscous=whole.viscous,
        circulatory=whole.circulatory, pairs=np.array(sides, dtype=int).reshape(-1, 2), limits=limits,
        readings=rows.sensor_rows.readings,
    )  # fmt: skip
    return LinksPlant(model, whole, maps, explicit)


def _reduce_to_face(plate: mujoco.MjsGeom) -> None:
    """Turn a plate into a plane that faces the shaft."""
    side = np.sign(plate.pos[2])
    plate.type = mujoco.mjtGeom.mjGEOM_PLANE
    plate.pos[2] -= side * plate.size[2]
    plate.quat = [0, 1, 0, 0] if side > 0 else [1, 0, 0, 0]
