"""The links engine: shafts as chains of rigid links in MuJoCo (see chain.py), their bushings as geoms with a gap.

Supports at the left end of a shaft are the joints of its first link; other rigid supports are equality constraints on
fixed tendons, whose lengths are the shaft's deflection or slope there; springs are tendons with stiffness. A clearance
between two points that both move is a pair of tendons with limits. Of rigs in space links_space.py is the model.
"""

from __future__ import annotations

import functools
from typing import Annotated, ClassVar

import mujoco
import numpy as np
import scipy.linalg
from pydantic import Field

from ..clearance.law import Law
from ..core.validation import Positive, Whole
from ..linear import linear_model
from ..physical import apply, set_inverse_inertia
from ..rig import Bushing, Rig
from ..rig.instruments import Kinds
from .base import Engine, Run, register
from .linkage import Linkage, linkage
from .links_parts import add_fixed_tendon, add_spring, add_support, armature, finish_supports, set_inertia, visual
from .links_plant import largest_spatial_step, spatial_plant
from .links_space import build_spatial
from .modal_space import driven
from .mujoco_loop import MujocoRun
from .mujoco_space import SpatialMujocoRun
from .plant import ITERATIONS, NO_WALL, Maps, Plant, Statics, set_solver, soften, stable_step

__all__ = ["Links", "build_links"]

SHAFT_SPACING = 20.0  # distance between several shafts in the picture, in half depths of the deepest


@register
class Links(Engine):
    """MuJoCo flexible links."""

    name: ClassVar[str] = "links"
    links: Annotated[Whole, Field(ge=3)] = 16
    """number of links of each shaft"""
    safety: Positive = 0.6
    """time step as a share of its stability limit, contacts at their hardest"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """``safety`` times the stability limit of the chain with every contact and film at its hardest."""
        if rig.moves_across:
            return self.safety * largest_spatial_step(rig, law, self.links)
        whole, points = linkage(rig, self.links), _plant(rig, self.links).maps.at_points
        return self.safety * stable_step(whole.mass, whole.stiffness, points, rig, law, armature(whole), *whole.beside)

    def start(self, rig: Rig, law: Law, kind: Kinds, step: float) -> Run:
        """Begin a simulation at rest; see `Engine.start`."""
        driven(linear_model(rig), kind)  # refuses what cannot be excited so
        if rig.moves_across:
            return SpatialMujocoRun(self, rig, law, kind, step, spatial_plant(rig, self.links))
        return MujocoRun(self, rig, law, kind, step, _plant(rig, self.links))


def build_links(rig: Rig, links: int = 16) -> mujoco.MjSpec:
    """Describe the rig as a MuJoCo model of rigid links, with the softness of the datasheet.

    Hinges are about -y, so that positive angles lift the shaft along z. A contact of shaft and base is an explicit pair
    of a collar (a sphere of the shaft's half depth, one at each bushing end) and one of the bushing's two plates.
    For a spatial rig see `links_space.build_spatial`.

    Parameters
    ----------
    rig : Rig
        A rig of shafts.
    links : int
        Number of links of each shaft.
    """
    if rig.moves_across:
        return build_spatial(rig, links)
    whole = linkage(rig, links)
    spec = mujoco.MjSpec()
    spec.modelname = rig.name
    free = whole.free
    fastest = scipy.linalg.eigvalsh(free.T @ whole.whole_stiffness @ free, free.T @ whole.mass @ free)[-1]
    spec.option.timestep = 0.5 * 2 / np.sqrt(fastest)  # leaves room for contacts; engines set their own
    set_solver(spec)
    spec.compiler.degree = False
    for i in range(len(whole.chains)):
        _add_chain(spec, whole, i)
    _add_supports(spec, whole)
    for j, bushing in enumerate(rig.bushings):
        _add_site(spec, whole, f"bushing{j}", bushing.position, size=0.003)
        if bushing.to is None:
            _add_bushing(spec, whole, j)
        else:
            _add_clearance(spec, whole, j)
    apply(spec)
    return spec


def _add_chain(spec: mujoco.MjSpec, whole: Linkage, i: int) -> None:
    """One shaft: its links, joints and sensors."""
    chain, names, aside = whole.chains[i], _names(whole, i), _aside(whole, i)
    shaft, prefix = chain.shaft, _prefix(whole, i)
    if chain.starts[0] > shaft.start:
        at = shaft.start, aside, chain.starts[0] - shaft.start
        visual(spec.worldbody, f"{prefix}clamped", *at, shaft.half_depth(shaft.start))
    joints = iter(zip(_joints(whole, i), chain.stiffness, whole.damping[whole.slices[i]]))
    body, origin = spec.worldbody, (0.0, 0.0)
    for n, (name, link) in enumerate(zip(names, chain.links)):
        body, origin = body.add_body(name=name, pos=[link.start - origin[0], aside - origin[1], 0]), (link.start, aside)
        set_inertia(body, link)
        for _ in range(chain.slides + chain.turns if name.endswith("root") else 1):
            _add_joint(body, *next(joints))
        visual(body, name, 0.0, 0.0, link.end - link.start, shaft.half_depth((link.start + link.end) / 2))
        _add_sensors(spec, whole, i, n)
    _add_sensors(spec, whole, i, -1)


def _prefix(whole: Linkage, i: int) -> str:
    return f"{whole.chains[i].shaft.name}_" if len(whole.chains) > 1 else ""


def _names(whole: Linkage, i: int) -> list[str]:
    """Of a shaft's links; the first one is the root if it can only slide or turn."""
    chain, prefix = whole.chains[i], _prefix(whole, i)
    return [f"{prefix}root"] * (chain.slides or chain.turns) + [f"{prefix}link{n}" for n in range(chain.hinges.size)]


def _joints(whole: Linkage, i: int) -> list[str]:
    chain, prefix = whole.chains[i], _prefix(whole, i)
    root = [f"{prefix}slide"] * chain.slides + [f"{prefix}turn"] * chain.turns
    return root + [f"{prefix}hinge{n}" for n in range(chain.hinges.size)]


def _aside(whole: Linkage, i: int) -> float:
    """Where a shaft is along y, m: each beside the others."""
    return i * SHAFT_SPACING * max(c.shaft.half_depth(x) for c in whole.chains for x in c.shaft.edges)


def _add_joint(body: mujoco.MjsBody, name: str, stiffness: float, damping: float) -> None:
    kind, axis = mujoco.mjtJoint.mjJNT_HINGE, [0, -1, 0]
    if name.endswith("slide"):
        kind, axis = mujoco.mjtJoint.mjJNT_SLIDE, [0, 0, 1]
    body.add_joint(type=kind, axis=axis, name=name, stiffness=[stiffness, 0, 0], damping=[damping, 0, 0])


def _add_sensors(spec: mujoco.MjSpec, whole: Linkage, i: int, n: int) -> None:
    """Accelerometers on link n of shaft i; -1 for its clamped start."""
    for sensor in (s for s in whole.rig.sensors if s.quantity == "acceleration"):
        if _link(whole, sensor.position) != (i, n):
            continue
        name = f"sensor{sensor.node}"
        _add_site(spec, whole, name, sensor.position, size=0.004, rgba=[0.9, 0.6, 0, 1])
        site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": name}
        spec.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_ACCELEROMETER, **site)


def _link(whole: Linkage, point: float | str) -> tuple[int, int]:
    """Number of the shaft and of the link that carry a point; link -1 before the first one of a clamped shaft."""
    i, x = whole.rig.linear.place(point)
    return i, int(np.searchsorted(whole.chains[i].starts, x, side="right")) - 1


def _carrier(spec: mujoco.MjSpec, whole: Linkage, point: float | str) -> tuple[mujoco.MjsBody, list[float]]:
    """Body that carries a point, and its place there."""
    i, n = _link(whole, point)
    x = whole.rig.linear.place(point)[1]
    if n < 0:
        return spec.worldbody, [x, _aside(whole, i), 0]
    return spec.body(_names(whole, i)[n]), [x - whole.chains[i].starts[n], 0, 0]


def _add_site(
    spec: mujoco.MjSpec, whole: Linkage, name: str, point: float | str, size: float, rgba: list[float] | None = None
) -> None:
    body, at = _carrier(spec, whole, point)
    body.add_site(name=name, pos=at, size=[size, 0, 0], **({"rgba": rgba} if rgba else {}))


def _over(whole: Linkage, row: np.ndarray) -> list[tuple[list[str], np.ndarray]]:
    """A row of the coordinates as the joints of each shaft and their shares."""
    return [(_joints(whole, i), row[part]) for i, part in enumerate(whole.slices)]


def _add_supports(spec: mujoco.MjSpec, whole: Linkage) -> None:
    """Rigid supports that are no joints, as equality constraints, and springs."""
    for i, row in enumerate(whole.fixed):
        add_support(spec, f"support{i}", _over(whole, row))
    for i, (row, stiffness, damping) in enumerate(zip(*whole.springs)):
        add_spring(spec, f"spring{i}", _over(whole, row), stiffness, damping)
    finish_supports(spec)


def _add_bushing(spec: mujoco.MjSpec, whole: Linkage, j: int) -> None:
    """Plates, and collars at both ends."""
    bushing = whole.rig.bushings[j]
    i, x = whole.rig.linear.place(bushing.position)
    depth = whole.chains[i].shaft.half_depth(x)
    _add_plates(spec, j, bushing, x, _aside(whole, i), depth)
    site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": f"bushing{j}"}
    spec.add_sensor(name=f"displacement{j}", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, **site)
    for end, point in zip("ab", bushing.ends):
        if _link(whole, point)[1] < 0:
            continue  # in the clamped half cell nothing moves
        body, at = _carrier(spec, whole, point)
        collar = f"collar{j}{end}"
        body.add_geom(
            name=collar, type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=at, size=[depth, 0, 0],
            contype=0, conaffinity=0, rgba=[0.35, 0.4, 0.46, 1],
        )  # fmt: skip
        for side in _sides(bushing):
            pair = {"geomname1": f"bushing{j}_{side}", "geomname2": collar, "condim": 1}
            spec.add_pair(name=f"{collar}_{side}", **pair)
            soften(spec, "pair", f"{collar}_{side}", bushing)


def _add_plates(spec: mujoco.MjSpec, j: int, bushing: Bushing, x: float, y: float, depth: float) -> None:
    """Two plates, a gap away from the shaft; longer than the bushing, so that collars meet only their faces."""
    thickness = depth
    for side, sign in _sides(bushing).items():
        spec.worldbody.add_geom(
            name=f"bushing{j}_{side}", type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[x, y, sign * (depth + bushing.gap + thickness) - bushing.offset],
            size=[bushing.length / 2 + depth, 2 * depth, thickness],
            contype=0, conaffinity=0, rgba=[0.8, 0.5, 0.2, 0.5],
        )  # fmt: skip


def _sides(bushing: Bushing) -> dict[str, int]:
    """Walls of a bushing and the sign of the displacement that meets them."""
    return {side: sign for side, sign in (("lower", -1), ("upper", 1)) if bushing.stops in ("both", side)}


def _add_clearance(spec: mujoco.MjSpec, whole: Linkage, j: int) -> None:
    """Limits of the relative motion of two points that both move, at both ends."""
    bushing = whole.rig.bushings[j]
    walls = np.clip(bushing.walls, -NO_WALL, NO_WALL)
    for end, row in zip("ab", whole.at_ends[2 * j :]):
        tendon = add_fixed_tendon(spec, f"clearance{j}{end}", _over(whole, row))
        tendon.limited, tendon.range = 1, walls
        name = {"objtype": mujoco.mjtObj.mjOBJ_TENDON, "objname": tendon.name}
        spec.add_sensor(name=tendon.name, type=mujoco.mjtSensor.mjSENS_TENDONPOS, **name)
        soften(spec, "tendon", tendon.name, bushing)


def _reduce_to_face(plate: mujoco.MjsGeom) -> None:
    """Make a plate a plane that looks towards the shaft."""
    side = np.sign(plate.pos[2])
    plate.type = mujoco.mjtGeom.mjGEOM_PLANE
    plate.pos[2] -= side * plate.size[2]
    plate.quat = [0, 1, 0, 0] if side > 0 else [1, 0, 0, 0]


@functools.lru_cache(maxsize=32)
def _plant(rig: Rig, links: int) -> Plant:
    whole, spec = linkage(rig, links), build_links(rig, links)
    # What only takes time: the links' shapes, all of a plate but its face, and sensors, which sit on straight links.
    spec.compiler.discardvisual = True
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    spec.option.iterations = ITERATIONS
    for plate in (geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_BOX):
        _reduce_to_face(plate)
    model = spec.compile()
    ends = [f"{j}{end}" for j in range(len(rig.bushings)) for end in "ab"]
    set_inverse_inertia(model)
    pairs = {model.pair(i).name: i for i in range(model.npair)}  # MuJoCo sorts them
    limits = {model.tendon(i).name: i for i in range(model.ntendon)}
    touching = [[pairs.get(f"collar{end}_{side}", -1) for side in ("lower", "upper")] for end in ends]
    rows = whole.rows
    maps = Maps(
        at_points=np.ascontiguousarray(np.vstack((whole.at_bushings, whole.at_ends))),
        viscous=whole.viscous,
        output=rows.sensor_rows.accelerations,
        pairs=np.array(touching, int).reshape(-1, 2),
        limits=np.array([limits.get(f"clearance{end}", -1) for end in ends], dtype=int),
        readings=rows.sensor_rows.readings,
    )
    statics = Statics(whole.mass, whole.whole_stiffness, whole.free, np.zeros((0, 0)), maps.at_points)
    return Plant(model, maps, rows, statics, whole.rayleigh[0], armature(whole))
