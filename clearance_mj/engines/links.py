"""The links engine: the shaft as a chain of rigid links in MuJoCo (see chain.py), its bushings as geoms with a gap."""

from __future__ import annotations

import functools
from typing import Annotated, ClassVar

import mujoco
import numpy as np
import scipy.linalg
from pydantic import Field

from ..clearance.law import Law
from ..rig import Bushing, Rig
from ..validation import Positive, Whole
from .base import Engine, Run, register
from .chain import chain
from .mujoco_loop import MujocoRun
from .plant import Maps, Plant, set_solver, stable_step
from .softness import INVERSE_INERTIA, solref_solimp

__all__ = ["Links", "build_links"]


@register
class Links(Engine):
    """MuJoCo flexible links."""

    name: ClassVar[str] = "links"
    links: Annotated[Whole, Field(ge=3)] = 16
    """number of links"""
    safety: Positive = 0.6
    """time step as a share of its stability limit, contacts at their hardest"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """``safety`` times the stability limit of the chain with every contact and film at its hardest."""
        shaft, points = chain(rig, self.links), _plant(rig, self.links).maps.at_points
        return self.safety * stable_step(shaft.mass, shaft.stiffness, points, rig, law)

    def start(self, rig: Rig, law: Law, kind: str, step: float) -> Run:
        """Begin a simulation at rest; see `Engine.start`."""
        return MujocoRun(self, rig, law, kind, step, _plant(rig, self.links))


def build_links(rig: Rig, links: int = 16) -> mujoco.MjSpec:
    """Describe the rig as a MuJoCo model of rigid links, with the softness of the datasheet.

    Hinges are about -y, so that positive angles lift the shaft along z. Every contact is an explicit pair of a collar
    (a sphere of the shaft's half depth, one at each bushing end) and one of the bushing's two plates.
    """
    beam, shaft = rig.beam, chain(rig, links)
    depth = (beam.diameter or beam.height or 0.0) / 2
    spec = mujoco.MjSpec()
    spec.modelname = rig.name
    fastest = scipy.linalg.eigvalsh(np.diag(shaft.stiffness), shaft.mass)[-1]
    spec.option.timestep = 0.5 * 2 / np.sqrt(fastest)  # leaves room for contacts; engines set their own
    set_solver(spec)
    spec.compiler.degree = False
    _visual(spec.worldbody, "clamped", shaft.hinges[0], depth)
    body, origin = spec.worldbody, 0.0
    for i, (start, end, stiffness) in enumerate(zip(shaft.hinges, shaft.ends, shaft.stiffness)):
        body, origin = body.add_body(name=f"link{i}", pos=[start - origin, 0, 0]), start
        _set_inertia(body, rig, start, end, last=i == links - 1)
        hinge = {"type": mujoco.mjtJoint.mjJNT_HINGE, "axis": [0, -1, 0], "name": f"hinge{i}"}
        body.add_joint(**hinge, stiffness=[stiffness, 0, 0], damping=[beam.rayleigh[1] * stiffness, 0, 0])
        _visual(body, f"link{i}", end - start, depth)
        _add_sensors(spec, rig, body, start, end, last=i == links - 1)
    _add_sensors(spec, rig, spec.worldbody, 0.0, shaft.hinges[0], last=False)
    _add_bushings(spec, rig, shaft.hinges, depth)
    _set_softness(spec, rig)
    return spec


def _set_softness(spec: mujoco.MjSpec, rig: Rig) -> None:
    """Give every pair the datasheet stiffness and damping, with the inverse inertia that MuJoCo computes."""
    model = spec.compile()
    for pair in spec.pairs:
        bushing = rig.bushings[int(pair.geomname1.removeprefix("bushing").partition("_")[0])]
        inverse_inertia = model.body_invweight0[model.geom(pair.geomname2).bodyid[0], 0]
        k, c = bushing.contact.stiffness / 2, bushing.contact.damping / 2  # two ends share them
        pair.solref, pair.solimp = solref_solimp(k, c, inverse_inertia)


def _visual(body: mujoco.MjsBody, name: str, length: float, depth: float) -> None:
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0, 0, 0, length, 0, 0], size=[depth, 0, 0],
        contype=0, conaffinity=0, rgba=[0.55, 0.6, 0.66, 1],
    )  # fmt: skip


def _set_inertia(body: mujoco.MjsBody, rig: Rig, start: float, end: float, last: bool) -> None:
    """Uniform rod plus the point masses it carries, about their common centre."""
    length = end - start
    mass = rig.beam.mass_per_length * length
    parts = [(mass, length / 2, mass * length**2 / 12)]
    parts += [(p.mass, p.position - start, 0.0) for p in rig.point_masses if _on(p.position, start, end, last)]
    total = sum(m for m, _, _ in parts)
    centre = sum(m * x for m, x, _ in parts) / total
    inertia = sum(i + m * (x - centre) ** 2 for m, x, i in parts)
    body.mass, body.ipos = total, [centre, 0, 0]
    body.inertia = [1e-6 * inertia, inertia, inertia]
    body.explicitinertial = True


def _on(position: float, start: float, end: float, last: bool) -> bool:
    return start <= position < end or (last and position >= end)


def _add_sensors(spec: mujoco.MjSpec, rig: Rig, body: mujoco.MjsBody, start: float, end: float, last: bool) -> None:
    for sensor in rig.sensors:
        if not _on(sensor.position, start, end, last):
            continue
        name = f"sensor{sensor.node}"
        body.add_site(name=name, pos=[sensor.position - start, 0, 0], size=[0.004, 0, 0], rgba=[0.9, 0.6, 0, 1])
        site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": name}
        spec.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_ACCELEROMETER, **site)


def _add_bushings(spec: mujoco.MjSpec, rig: Rig, starts: np.ndarray, depth: float) -> None:
    for j, bushing in enumerate(rig.bushings):
        _add_plates(spec, j, bushing, depth)
        _add_site(spec, starts, f"bushing{j}", bushing.position)
        site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": f"bushing{j}"}
        spec.add_sensor(name=f"displacement{j}", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, **site)
        for e, x in enumerate(bushing.ends):
            body, at = _carrier(spec, starts, x)
            if body is None:
                continue  # in the clamped half cell nothing moves
            collar = f"collar{j}{'ab'[e]}"
            body.add_geom(
                name=collar, type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=[at, 0, 0], size=[depth, 0, 0],
                contype=0, conaffinity=0, rgba=[0.35, 0.4, 0.46, 1],
            )  # fmt: skip
            for side in _sides(bushing):
                pair = {"geomname1": f"bushing{j}_{side}", "geomname2": collar, "condim": 1}
                spec.add_pair(name=f"{collar}_{side}", **pair)


def _add_plates(spec: mujoco.MjSpec, j: int, bushing: Bushing, depth: float) -> None:
    """Two plates, a gap away from the shaft; longer than the bushing, so that collars meet only their faces."""
    thickness = depth
    for side, sign in _sides(bushing).items():
        spec.worldbody.add_geom(
            name=f"bushing{j}_{side}", type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[bushing.position, 0, sign * (depth + bushing.gap + thickness) - bushing.offset],
            size=[bushing.length / 2 + depth, 2 * depth, thickness],
            contype=0, conaffinity=0, rgba=[0.8, 0.5, 0.2, 0.5],
        )  # fmt: skip


def _sides(bushing: Bushing) -> dict[str, int]:
    """Walls of a bushing and the sign of the displacement that meets them."""
    return {side: sign for side, sign in (("lower", -1), ("upper", 1)) if bushing.stops in ("both", side)}


def _carrier(spec: mujoco.MjSpec, starts: np.ndarray, x: float) -> tuple[mujoco.MjsBody | None, float]:
    """Link that carries position x of the shaft (None before the first hinge), and x in its frame."""
    i = np.searchsorted(starts, x, side="right") - 1
    if i < 0:
        return None, x
    return spec.body(f"link{i}"), x - starts[i]


def _add_site(spec: mujoco.MjSpec, starts: np.ndarray, name: str, x: float) -> None:
    body, at = _carrier(spec, starts, x)
    (body or spec.worldbody).add_site(name=name, pos=[at, 0, 0], size=[0.003, 0, 0])


def _reduce_to_face(plate: mujoco.MjsGeom) -> None:
    """Make a plate a plane that looks towards the shaft."""
    side = np.sign(plate.pos[2])
    plate.type = mujoco.mjtGeom.mjGEOM_PLANE
    plate.pos[2] -= side * plate.size[2]
    plate.quat = [0, 1, 0, 0] if side > 0 else [1, 0, 0, 0]


@functools.lru_cache(maxsize=32)
def _plant(rig: Rig, links: int) -> Plant:
    shaft, spec = chain(rig, links), build_links(rig, links)
    # What only takes time: the links' shapes, all of a plate but its face, and sensors, which sit on straight links.
    spec.compiler.discardvisual = True
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    for plate in (geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_BOX):
        _reduce_to_face(plate)
    model = spec.compile()
    n_bushings = len(rig.bushings)
    model.body_invweight0[1:] = INVERSE_INERTIA  # Â of every contact is then known; see softness.py
    pairs = {model.pair(i).name: i for i in range(model.npair)}  # MuJoCo sorts them
    middles = shaft.deflection([b.position for b in rig.bushings])
    at_points = np.vstack((middles, shaft.lever([end for b in rig.bushings for end in b.ends])))
    at_shaker = np.zeros(links)
    if rig.shaker.position is not None:
        at_shaker = shaft.deflection([rig.shaker.position])[0]
    eta1 = rig.beam.rayleigh[0]
    viscous = eta1 * shaft.mass if eta1 else np.zeros((0, 0))
    rows = [
        [pairs.get(f"collar{j}{end}_{side}", -1) for side in ("lower", "upper")]
        for j in range(n_bushings)
        for end in "ab"
    ]
    of_ends = np.array(rows, dtype=int).reshape(2 * n_bushings, 2)
    output = np.ascontiguousarray(shaft.deflection([s.position for s in rig.sensors]))
    points = np.ascontiguousarray(at_points.reshape(3 * n_bushings, links))
    return Plant(model, Maps(points, at_shaker, viscous, output, np.ones(len(output)), of_ends), "pair_solref")
