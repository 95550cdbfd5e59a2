"""The rig in space as a MuJoCo model: a chain of rigid links that bends about -y and about z, in round bushings.

A joint is two hinges at one place, or one hinge each at two places where a tapered rectangle bends differently along y
and z; positive angles lift the shaft along z and along y. The annular clearance at each end of a bushing is a spatial
tendon between a site on the shaft's axis and one on the bushing's, with the gap as its largest length.
"""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np
import scipy.linalg

from ..physical import apply
from ..rig import Rig
from ..structure import Shaft
from .chain import Chain
from .linkage_space import SpatialLinkage, spatial_linkage
from .links_parts import add_spring, add_support, finish_supports, set_inertia, visual
from .plant import set_solver, soften

__all__ = ["build_spatial", "joint_names", "spatial_spec", "tendon_names"]

NO_DIRECTION = 1e-9
"""m, by which a bushing's site is off the axis of a centred shaft along y and along z

A tendon without length has no direction, so that MuJoCo would find no inertia behind it; with this it is that of both
planes, and the gap changes by less than digits of a file show.
"""
SAME_PLACE = 1e-9  # of a shaft's length: hinges of both planes that are this close are one joint
LEAST_INERTIA = 1e-13  # kg m², of a short link between the hinges of both planes: MuJoCo wants some
DIGITS = 6  # that MuJoCo writes of a number
STAVES = 24  # boxes that a bushing is drawn of
AXES = "yz"


def build_spatial(rig: Rig, links: int = 16) -> mujoco.MjSpec:
    """Describe a spatial rig as a MuJoCo model of rigid links, with the softness of the datasheet.

    It does not know the turning of the shaft and friction, which MuJoCo has no elements for. Places along the shaft are
    those that a file of six digits holds.

    Parameters
    ----------
    rig : Rig
        One that moves in space.
    links : int
        Number of links of each shaft.
    """
    spec = spatial_spec(rig, links)
    _round_places(spec)
    apply(spec)
    return spec


def spatial_spec(rig: Rig, links: int) -> mujoco.MjSpec:
    """Return the same with exact places, without softness."""
    whole = spatial_linkage(rig, links)
    spec = mujoco.MjSpec()
    spec.modelname = rig.name
    free = [(p.free.T @ p.whole_stiffness @ p.free, p.free.T @ p.mass @ p.free) for p in whole.planes]
    fastest = max(scipy.linalg.eigvalsh(*matrices)[-1] for matrices in free)
    spec.option.timestep = 0.5 * 2 / np.sqrt(fastest)  # leaves room for contacts; engines set their own
    set_solver(spec)
    spec.option.gravity = rig.gravity or [0, 0, 0]
    spec.compiler.degree = False
    for i in range(len(whole.planes[0].chains)):
        _add_shaft(spec, whole, i)
    _add_supports(spec, whole)
    for j in range(len(rig.bushings)):
        _add_bushing(spec, whole, j)
    return spec


def _round_places(spec: mujoco.MjSpec) -> None:
    """Round places along the shaft to decimals of which six digits lose nothing.

    Sites of a clearance then stay at the same place however many links are between them. Otherwise their tendon would
    be along the shaft, where MuJoCo finds no inertia.
    """
    exact = {"world": 0.0}
    for body in spec.bodies[1:]:
        exact[body.name] = exact[body.parent.name] + body.pos[0]
    decimals = DIGITS - 1 - int(np.floor(np.log10(max(abs(x) for x in exact.values()))))
    rounded = {name: round(x, decimals) for name, x in exact.items()}
    for body in spec.bodies[1:]:
        body.pos[0] = round(rounded[body.name] - rounded[body.parent.name], decimals)
    for site in spec.sites:
        carrier = site.parent.name
        site.pos[0] = round(round(exact[carrier] + site.pos[0], decimals) - rounded[carrier], decimals)


def joint_names(whole: SpatialLinkage) -> list[str]:
    """Return the names of the joints in the order of the coordinates."""
    return [name for d in range(2) for i in range(len(whole.planes[d].chains)) for name in _joints(whole, d, i)]


def tendon_names(whole: SpatialLinkage) -> list[str | None]:
    """Return the name of the tendon at each bushing end; None where nothing moves."""
    ends = [f"clearance{j}{end}" for j in range(len(whole.rig.bushings)) for end in "ab"]
    moves = np.abs(whole.rows.at_ends).reshape(len(ends), 2 * whole.size).max(axis=1, initial=0.0) > 0
    return [name if moving else None for name, moving in zip(ends, moves)]


def _joints(whole: SpatialLinkage, d: int, i: int) -> list[str]:
    """Joints of shaft i along y (0) or z (1)."""
    chain = whole.planes[d].chains[i]
    kinds = ["slide"] * chain.slides + ["turn"] * chain.turns + [f"hinge{n}" for n in range(chain.hinges.size)]
    return [f"{_prefix(chain.shaft, whole)}{kind}_{AXES[d]}" for kind in kinds]


def _prefix(shaft: Shaft, whole: SpatialLinkage) -> str:
    return f"{shaft.name}_" if len(whole.planes[0].chains) > 1 else ""


def _starts(whole: SpatialLinkage, i: int) -> np.ndarray:
    """(n,) where the links of shaft i begin, m: at the hinges of both planes, which mostly are at the same places."""
    places = np.sort(np.concatenate([plane.chains[i].starts for plane in whole.planes]))
    return places[np.diff(places, prepend=-np.inf) > SAME_PLACE * whole.planes[1].chains[i].shaft.length]


def _add_shaft(spec: mujoco.MjSpec, whole: SpatialLinkage, i: int) -> None:
    """One shaft: its links, joints and sensors."""
    chain, starts = whole.planes[1].chains[i], _starts(whole, i)
    shaft, prefix = chain.shaft, _prefix(chain.shaft, whole)
    if starts[0] > shaft.start:
        length = starts[0] - shaft.start
        visual(spec.worldbody, f"{prefix}clamped", shaft.start, 0.0, length, shaft.half_depth(shaft.start))
    body, origin = spec.worldbody, 0.0
    for n, (start, end) in enumerate(pairwise((*starts, shaft.end))):
        name = f"{prefix}link{n}"
        body, origin = body.add_body(name=name, pos=[start - origin, 0, 0]), start
        set_inertia(body, chain.link(start, end))
        body.inertia = np.maximum(body.inertia, LEAST_INERTIA)
        _add_joints(body, whole, i, start)
        visual(body, name, 0.0, 0.0, end - start, shaft.half_depth((start + end) / 2))
    for sensor in (s for s in whole.rig.sensors if s.quantity == "acceleration"):
        if whole.rig.linear.place(sensor.position)[0] == i:
            name = f"sensor{sensor.node}"
            _add_site(spec, whole, name, sensor.position, size=0.004, rgba=[0.9, 0.6, 0, 1])
            site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": name}
            spec.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_ACCELEROMETER, **site)


def _add_joints(body: mujoco.MjsBody, whole: SpatialLinkage, i: int, start: float) -> None:
    """The joints of both planes at the start of a link; slides before turns, along z before y."""
    planes = [(d, plane, plane.chains[i]) for d, plane in enumerate(whole.planes)]
    here = [
        (n, d) for d, _, chain in reversed(planes) for n, x in enumerate(_places(chain))
        if abs(x - start) <= SAME_PLACE * chain.shaft.length
    ]  # fmt: skip
    for n, d in sorted(here, key=lambda joint: joint[0]):
        _, plane, chain = planes[d]
        kind, axis = mujoco.mjtJoint.mjJNT_HINGE, ([0, 0, 1], [0, -1, 0])[d]
        if chain.slides and n == 0:
            kind, axis = mujoco.mjtJoint.mjJNT_SLIDE, ([0, 1, 0], [0, 0, 1])[d]
        stiffness, damping = chain.stiffness[n], plane.damping[plane.slices[i]][n]
        name = _joints(whole, d, i)[n]
        body.add_joint(type=kind, axis=axis, name=name, stiffness=[stiffness, 0, 0], damping=[damping, 0, 0])


def _places(chain: Chain) -> np.ndarray:
    """(nv,) where the joints of a chain are, m."""
    return np.concatenate(([chain.shaft.start] * (chain.slides + chain.turns), chain.hinges))


def _carrier(spec: mujoco.MjSpec, whole: SpatialLinkage, point: float | str) -> tuple[mujoco.MjsBody, float]:
    """Body that carries a point, and where along x the point is on it, m."""
    i, x = whole.rig.linear.place(point)
    starts, chain = _starts(whole, i), whole.planes[1].chains[i]
    n = int(np.searchsorted(starts, x, side="right")) - 1
    if n < 0:
        return spec.worldbody, x
    return spec.body(f"{_prefix(chain.shaft, whole)}link{n}"), x - starts[n]


def _add_site(
    spec: mujoco.MjSpec, whole: SpatialLinkage, name: str, point: float | str, size: float,
    rgba: list[float] | None = None, across: tuple[float, float] = (0.0, 0.0), on_base: bool = False,
) -> None:  # fmt: skip
    """A site at a point of a shaft's axis, or off it; or at the same place on the base."""
    body, x = _carrier(spec, whole, point)
    if on_base:
        body, x = spec.worldbody, whole.rig.linear.place(point)[1]
    body.add_site(name=name, pos=[x, *across], size=[size, 0, 0], **({"rgba": rgba} if rgba else {}))


def _add_supports(spec: mujoco.MjSpec, whole: SpatialLinkage) -> None:
    """Rigid supports that are no joints, as equality constraints, and springs, of both planes."""
    for d, plane in enumerate(whole.planes):
        for i, row in enumerate(plane.fixed):
            add_support(spec, f"support{i}_{AXES[d]}", _over(whole, d, row))
        for i, (row, stiffness, damping) in enumerate(zip(*plane.springs)):
            add_spring(spec, f"spring{i}_{AXES[d]}", _over(whole, d, row), stiffness, damping)
    finish_supports(spec)


def _over(whole: SpatialLinkage, d: int, row: np.ndarray) -> list[tuple[list[str], np.ndarray]]:
    """A row of the coordinates of a plane as the joints of each shaft and their shares."""
    return [(_joints(whole, d, i), row[part]) for i, part in enumerate(whole.planes[d].slices)]


def _add_bushing(spec: mujoco.MjSpec, whole: SpatialLinkage, j: int) -> None:
    """The annular clearances at both ends, a sensor of the displacement in the middle, and the tube."""
    bushing = whole.rig.bushings[j]
    _add_site(spec, whole, f"bushing{j}", bushing.position, size=0.003)
    site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": f"bushing{j}"}
    spec.add_sensor(name=f"displacement{j}", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, **site)
    centred = not bushing.offset and not bushing.offset_y
    middle = (NO_DIRECTION, NO_DIRECTION) if centred else (-bushing.offset_y, -bushing.offset)
    for end, name in enumerate(tendon_names(whole)[2 * j : 2 * j + 2]):
        if name is None:
            continue  # in the clamped half cell nothing moves
        points = bushing.joined_ends[end]
        _add_site(spec, whole, f"{name} shaft", points[0], size=0.001)
        _add_site(spec, whole, f"{name} middle", points[-1], 0.001, None, middle, bushing.to is None)
        tendon = spec.add_tendon(name=name, limited=1, range=[0, bushing.gap], margin=0)
        tendon.wrap_site(f"{name} shaft")
        tendon.wrap_site(f"{name} middle")
        soften(spec, "tendon", name, bushing)
    if bushing.to is None:
        _add_tube(spec, whole, j)


def _add_tube(spec: mujoco.MjSpec, whole: SpatialLinkage, j: int) -> None:
    """The bushing to look at: boxes all around, whose inner faces are where the shaft's surface stops."""
    bushing = whole.rig.bushings[j]
    i, x = whole.rig.linear.place(bushing.position)
    depth = whole.planes[1].chains[i].shaft.half_depth(x)
    inner, wall = depth + bushing.gap, 0.4 * depth
    for stave in range(STAVES):
        angle = 2 * np.pi * stave / STAVES
        out, half = inner + wall / 2, (inner + wall) * np.tan(np.pi / STAVES)
        spec.worldbody.add_geom(
            name=f"bushing{j}_{stave}", type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[x, out * np.cos(angle) - bushing.offset_y, out * np.sin(angle) - bushing.offset],
            quat=[np.cos(angle / 2), np.sin(angle / 2), 0, 0],
            size=[max(bushing.length, depth / 4) / 2, wall / 2, half],
            contype=0, conaffinity=0, rgba=[0.8, 0.5, 0.2, 0.35],
        )  # fmt: skip
