"""The clearances of a rig's MuJoCo model of rigid links.

That of a shaft and the base in one plane is explicit pairs of a collar (a sphere of the shaft's half depth, one at each
bushing end) and the bushing's plates. A round one is a spatial tendon at each end between a site on the shaft's axis
and one on the bushing's, with the gap as its largest length. Any other slot, between two points that both move, along
y, or of a twist, is a fixed tendon at each end, whose length is the motion and whose limits are the walls.
"""

from __future__ import annotations

import mujoco
import numpy as np

from ..rig import Bushing
from .linkage import Linkage
from .links_model import add_site, add_tendon, aside, carrier
from .plant import NO_WALL, soften

__all__ = ["add_clearances", "contact_names"]

NO_DIRECTION = 1e-9
"""m, by which a bushing's site is off the axis of a centred shaft along y and along z

A tendon without length has no direction, so that MuJoCo would find no inertia behind it; with this it is that of both
planes, and the gap changes by less than digits of a file show.
"""
STAVES = 24  # number of boxes that draw a round bushing
SITE = {"objtype": mujoco.mjtObj.mjOBJ_SITE}
TENDON = {"objtype": mujoco.mjtObj.mjOBJ_TENDON}


def add_clearances(spec: mujoco.MjSpec, whole: Linkage) -> None:
    """Add every clearance of a rig to its model, with its datasheet softness, and a sensor of its displacement."""
    add = {"plates": _add_plates, "limits": _add_limits, "annulus": _add_annulus}
    for j, bushing in enumerate(whole.rig.bushings):
        add_site(spec, whole, f"bushing{j}", bushing.position, size=0.003)
        add[whole.contact(bushing)](spec, whole, j)


def contact_names(whole: Linkage) -> tuple[list[str], list[str]]:
    """Return the names of collar and tendon at every bushing end; "" for none, as where nothing moves."""
    rig, collars, tendons = whole.rig, list[str](), list[str]()
    for j, (bushing, rows) in enumerate(zip(rig.bushings, rig.clearance_rows)):
        has_plates = whole.contact(bushing) == "plates"
        for end, moves in zip("ab", whole.at_points[rig.n_rows + rig.end_rows[rows]].any(axis=(0, 2))):
            collars.append(f"collar{j}{end}" if moves and has_plates else "")
            tendons.append(f"clearance{j}{end}" if moves and not has_plates else "")
    return collars, tendons


def _add_plates(spec: mujoco.MjSpec, whole: Linkage, j: int) -> None:
    """Add two plates, a gap away from the shaft and longer than the bushing, so that collars meet their faces."""
    bushing = whole.rig.bushings[j]
    i, x = whole.rig.linear.place(bushing.position)
    depth = whole.rig.linear.shafts[i].half_depth(x)
    looks = {"contype": 0, "conaffinity": 0}
    for side, sign in _sides(bushing).items():
        spec.worldbody.add_geom(
            name=f"bushing{j}_{side}", type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[x, aside(whole, i), sign * (depth + bushing.gap + depth) - bushing.offset],
            size=[bushing.length / 2 + depth, 2 * depth, depth], rgba=[0.8, 0.5, 0.2, 0.5], **looks,
        )  # fmt: skip
    spec.add_sensor(name=f"displacement{j}", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objname=f"bushing{j}", **SITE)
    for point, collar in zip(bushing.ends, contact_names(whole)[0][2 * j :]):
        if not collar:
            continue
        body, at = carrier(spec, whole, point)
        shape = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [depth, 0, 0], "rgba": [0.35, 0.4, 0.46, 1]}
        body.add_geom(name=collar, pos=at, **shape, **looks)
        for side in _sides(bushing):
            spec.add_pair(name=f"{collar}_{side}", geomname1=f"bushing{j}_{side}", geomname2=collar, condim=1)
            soften(spec, "pair", f"{collar}_{side}", bushing)


def _sides(bushing: Bushing) -> dict[str, int]:
    """Return the walls of a bushing and the sign of the displacement towards each."""
    return {side: sign for side, sign in (("lower", -1), ("upper", 1)) if bushing.stops in ("both", side)}


def _add_limits(spec: mujoco.MjSpec, whole: Linkage, j: int) -> None:
    """Add limits of a motion, or of the relative motion of two points, at both ends."""
    bushing, rig = whole.rig.bushings[j], whole.rig
    ends = rig.n_rows + rig.end_rows[rig.clearance_rows[j].start]
    for row, name in zip(whole.at_points[ends], contact_names(whole)[1][2 * j :]):
        if name:
            tendon = add_tendon(spec, whole, name, row)
            tendon.limited, tendon.range = 1, np.clip(bushing.walls, -NO_WALL, NO_WALL)
            spec.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_TENDONPOS, objname=name, **TENDON)
            soften(spec, "tendon", name, bushing)


def _add_annulus(spec: mujoco.MjSpec, whole: Linkage, j: int) -> None:
    """Add the annular clearances at both ends, a sensor of the displacement in the middle, and the tube."""
    bushing = whole.rig.bushings[j]
    spec.add_sensor(name=f"displacement{j}", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objname=f"bushing{j}", **SITE)
    centred = not bushing.offset and not bushing.offset_y
    middle = (NO_DIRECTION, NO_DIRECTION) if centred else (-bushing.offset_y, -bushing.offset)
    for points, name in zip(bushing.joined_ends, contact_names(whole)[1][2 * j :]):
        if not name:
            continue
        add_site(spec, whole, f"{name} shaft", points[0], size=0.001)
        body, at = carrier(spec, whole, points[-1])
        if bushing.to is None:
            body, at = spec.worldbody, [whole.rig.linear.place(points[0])[1]]
        body.add_site(name=f"{name} middle", pos=[at[0], *middle], size=[0.001, 0, 0])
        tendon = spec.add_tendon(name=name, limited=1, range=[0, bushing.gap], margin=0)
        tendon.wrap_site(f"{name} shaft")
        tendon.wrap_site(f"{name} middle")
        soften(spec, "tendon", name, bushing)
    if bushing.to is None:
        _add_tube(spec, whole, j)


def _add_tube(spec: mujoco.MjSpec, whole: Linkage, j: int) -> None:
    """Add the bushing's visual: boxes all around, whose inner faces are where the shaft's surface stops."""
    bushing = whole.rig.bushings[j]
    i, x = whole.rig.linear.place(bushing.position)
    depth = whole.rig.linear.shafts[i].half_depth(x)
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
