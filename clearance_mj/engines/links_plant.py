"""A rig's chains as the links engine runs them: the MuJoCo model, and linear maps to the rig's points."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from ..physical import INVERSE_INERTIA, set_inverse_inertia
from ..rig import Rig
from .linkage import Linkage
from .links_clearances import add_clearances, contact_names
from .links_model import joint_names, links_spec
from .plant import ARMATURE, ITERATIONS, STIFF_ROOT, Maps, Plant, Statics

__all__ = ["ChainMaps", "LinksPlant", "SpaceMaps", "links_plant"]


class ChainMaps(NamedTuple):
    """Linear maps between the chains' coordinates, those of `Linkage`, and the rig's points."""

    order: np.ndarray  # (nv,) MuJoCo's number of each coordinate; their own where shafts bend in one plane
    spans: np.ndarray  # (2, 2) first coordinate along y, and along z or of twist, and the one after the last
    at_points: np.ndarray  # (3 n_rows, nv) the bushings' middles, then both ends of each
    at_sensors: np.ndarray  # (n_sensors, nv) of accelerometers; zeros of others
    readings: np.ndarray  # (n_sensors, 2, nv) what others read per coordinate and velocity; (0, 2, nv) without others
    influence: np.ndarray  # (nv, 2) force of a unit gravity along y and z
    unbalance: np.ndarray  # (2, nv) force of Ω² cos φ and Ω² sin φ
    viscous: np.ndarray  # (nv, nv) damping that joints and springs do not have; (0, 0) where they have all
    circulatory: np.ndarray  # (nv, nv) H; (0, 0) if there is none
    gyroscopic: np.ndarray  # (nv, nv) G; (0, 0) if there is none
    pairs: np.ndarray  # (2 n_bushings, 2) pairs of geoms that touch at each bushing end; -1 for none
    limits: np.ndarray  # (2 n_bushings,) tendon whose length the walls limit at each bushing end; -1 for none


class SpaceMaps(NamedTuple):
    """What the loop in space takes of `ChainMaps`."""

    order: np.ndarray
    spans: np.ndarray
    at_points: np.ndarray  # (3 n_bushings, 2, nv)
    at_sensors: np.ndarray
    influence: np.ndarray
    unbalance: np.ndarray
    viscous: np.ndarray
    circulatory: np.ndarray
    limits: np.ndarray
    readings: np.ndarray


@dataclass(frozen=True, eq=False)
class LinksPlant:
    """A rig's chains as a MuJoCo model. Shared by simulations, which copy the model."""

    model: mujoco.MjModel
    """compiled, not to be changed"""
    whole: Linkage
    maps: ChainMaps
    explicit: bool
    """whether dampers of joints are explicit, as beside rigid supports and springs"""

    @functools.cached_property
    def armature(self) -> np.ndarray:
        """(nv,) of joints, in the order of the coordinates: inertia over stiffness times the step squared."""
        stiff = np.concatenate([member.chain.stiff_roots for member in self.whole.members])
        return np.where(stiff, STIFF_ROOT, ARMATURE)

    @functools.cached_property
    def statics(self) -> Statics:
        """Matrices at rest."""
        whole = self.whole
        return Statics(whole.mass, whole.whole_stiffness, whole.free, whole.circulatory, whole.at_points)

    @property
    def in_plane(self) -> Plant:
        """What the loop of one plane takes of it."""
        _, _, points, sensors, readings, _, _, viscous, _, _, pairs, limits = self.maps
        maps = Maps(points, viscous, sensors, pairs, limits, readings)
        return Plant(self.model, maps, self.whole.rows, self.statics, self.whole.rayleigh[0], self.armature)

    @property
    def in_space(self) -> SpaceMaps:
        """The maps that the loop in space takes."""
        known = self.maps._asdict()
        points = self.maps.at_points.reshape(-1, 2, self.whole.size)
        return SpaceMaps(**{name: known[name] for name in SpaceMaps._fields} | {"at_points": points})


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
    # What only takes time: shapes, all of a plate but its face, sensors, which sit on straight links, and looking for
    # contacts of bodies.
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
    model = spec.compile()
    set_inverse_inertia(model)
    limits = np.array([model.tendon(name).id if name else -1 for name in tendons], dtype=int)
    model.tendon_invweight0[limits[limits >= 0]] = INVERSE_INERTIA  # also between two bodies that both move
    numbers = {model.pair(i).name: i for i in range(model.npair)}  # MuJoCo sorts them
    sides = [[numbers.get(f"{collar}_{side}", -1) for side in ("lower", "upper")] for collar in collars]
    rows = whole.rows
    maps = ChainMaps(
        order=np.array([model.joint(name).dofadr[0] for name in joint_names(whole)], dtype=int),
        spans=np.array([(part.start, part.stop) for part in whole.spans]),
        at_points=whole.at_points,
        at_sensors=rows.sensor_rows.accelerations,
        readings=rows.sensor_rows.readings,
        influence=whole.influence,
        unbalance=rows.unbalance,
        viscous=whole.viscous,
        circulatory=whole.circulatory,
        gyroscopic=whole.gyroscopic,
        pairs=np.array(sides, dtype=int).reshape(-1, 2),
        limits=limits,
    )
    return LinksPlant(model, whole, maps, explicit)


def _reduce_to_face(plate: mujoco.MjsGeom) -> None:
    """Make a plate a plane that looks towards the shaft."""
    side = np.sign(plate.pos[2])
    plate.type = mujoco.mjtGeom.mjGEOM_PLANE
    plate.pos[2] -= side * plate.size[2]
    plate.quat = [0, 1, 0, 0] if side > 0 else [1, 0, 0, 0]
