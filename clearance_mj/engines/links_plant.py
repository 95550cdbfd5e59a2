"""The chains of a spatial rig as the links engine runs them: the MuJoCo model, and linear maps to the rig's points."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from ..clearance.law import Law
from ..clearance.round_kernel import fillings_of
from ..physical import INVERSE_INERTIA, set_inverse_inertia
from ..rig import Rig
from .linkage_space import SpatialLinkage, spatial_linkage
from .links_parts import armature
from .links_space import joint_names, spatial_spec, tendon_names
from .modal_space import stiffest_contacts
from .plant import ITERATIONS, stable_step_with

__all__ = ["ChainMaps", "SpatialPlant", "largest_spatial_step", "spatial_plant"]


class ChainMaps(NamedTuple):
    """Linear maps between the chains' coordinates, those along y before those along z, and the rig's points."""

    order: np.ndarray  # (nv,) MuJoCo's number of each coordinate
    spans: np.ndarray  # (2, 2) first coordinate that moves along y and z, and the one after the last
    at_points: np.ndarray  # (3 n_bushings, 2, nv) along y and z: the bushings' middles, then both ends of each
    at_sensors: np.ndarray  # (n_sensors, nv) of accelerometers; zeros of others
    influence: np.ndarray  # (nv, 2) force of a unit gravity along y and z
    unbalance: np.ndarray  # (2, nv) force of Ω² cos φ and Ω² sin φ
    viscous: np.ndarray  # (nv, nv) damping that joints and springs do not have; (0, 0) where they have all
    circulatory: np.ndarray  # (nv, nv) H; (0, 0) if there is none
    limits: np.ndarray  # (2 n_bushings,) tendon whose length the gap limits at each bushing end; -1 where nothing moves
    readings: np.ndarray  # (n_sensors, 2, nv) what others read per coordinate and velocity; (0, 2, nv) without others


@dataclass(frozen=True, eq=False)
class SpatialPlant:
    """A spatial rig as a MuJoCo model. Shared by simulations, which copy the model."""

    model: mujoco.MjModel
    """compiled, not to be changed"""
    whole: SpatialLinkage
    maps: ChainMaps
    explicit: bool
    """whether dampers of joints are explicit, as beside rigid supports and springs"""
    armature: np.ndarray
    """(nv,) of joints, in the order of the coordinates: inertia over stiffness times the step squared"""


def largest_spatial_step(rig: Rig, law: Law, links: int) -> float:
    """Return the longest stable step, s, with every contact, bristle and filling at its hardest in either plane.

    Gyroscopic moments and oil films are taken at the velocity in the middle of their kick, which limits no step.
    """
    whole = spatial_linkage(rig, links)
    points = whole.rows.at_points.reshape(-1, 2, whole.size)
    grease = [(0.0, 0.0) if g.turned else g.largest() for g in fillings_of(rig, law)]
    contacts = np.transpose((stiffest_contacts(rig, law), law.largest([b.gap for b in rig.bushings])[1]))
    return min(
        stable_step_with(p.mass, p.stiffness, points[:, d, part], grease, contacts, armature(p), *p.beside)
        for d, (p, part) in enumerate(zip(whole.planes, whole.spans))
    )


@functools.lru_cache(maxsize=32)
def spatial_plant(rig: Rig, links: int) -> SpatialPlant:
    """Compile a spatial rig's chains for the engine."""
    whole, spec = spatial_linkage(rig, links), spatial_spec(rig, links)
    # What only takes time: shapes, sensors, which sit on straight links, and looking for contacts of bodies.
    spec.compiler.discardvisual = True
    off = mujoco.mjtDisableBit
    explicit = bool(spec.option.disableflags & off.mjDSBL_EULERDAMP)
    spec.option.disableflags |= int(off.mjDSBL_SENSOR | off.mjDSBL_CONTACT | off.mjDSBL_EULERDAMP)
    spec.option.iterations = ITERATIONS
    for j, bushing in enumerate(rig.bushings):
        for end in "ab":
            if site := spec.site(f"clearance{j}{end} middle"):
                site.pos[1:] = -bushing.offset_y, -bushing.offset
    model = spec.compile()
    set_inverse_inertia(model)
    model.tendon_invweight0[:] = INVERSE_INERTIA  # also between two bodies that both move
    order = np.array([model.joint(name).dofadr[0] for name in joint_names(whole)], dtype=int)
    limits = [-1 if name is None else model.tendon(name).id for name in tendon_names(whole)]
    viscous, rows = whole.diagonal(lambda plane: plane.viscous), whole.rows
    maps = ChainMaps(
        order=order,
        spans=np.array([(part.start, part.stop) for part in whole.spans]),
        at_points=rows.at_points.reshape(-1, 2, whole.size),
        at_sensors=rows.sensor_rows.accelerations,
        influence=whole.influence,
        unbalance=rows.unbalance,
        viscous=viscous if viscous.any() else np.zeros((0, 0)),
        circulatory=whole.circulatory,
        limits=np.array(limits, dtype=int),
        readings=rows.sensor_rows.readings,
    )
    return SpatialPlant(model, whole, maps, explicit, np.concatenate([armature(p) for p in whole.planes]))
