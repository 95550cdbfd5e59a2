"""A rig as a MuJoCo model of rigid links: shafts and their supports.

Hinges are about -y and, where shafts bend across too, about z, so that positive angles lift a shaft along z and along
y. Both are at one position, or at two where a tapered rectangle bends differently along y and z. Twist has separate
bodies, so that it turns no bending plane and a short link may have any polar inertia. Supports at the
left end of a shaft are the joints of its first link; other rigid supports are equality constraints on fixed tendons,
whose lengths are motions of the shaft there; springs are tendons with stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import mujoco
import numpy as np
import scipy.linalg

from ..rig import Rig
from ..structure.base import is_rotation
from .bending_chain import BendingChain
from .linkage import Linkage, Member, linkage
from .plant import set_solver, settling
from .twist_chain import TwistChain

__all__ = ["add_site", "add_tendon", "aside", "carrier", "joint_names", "links_spec", "round_places"]

SAME_PLACE = 1e-9  # of a shaft's length: hinges of both planes that are this close are one joint
LEAST_INERTIA = 1e-13  # kg m², of a short link between the hinges of both planes: MuJoCo requires some
SHAFT_SPACING = 20.0  # distance between several shafts in the picture, in half depths of the deepest
DIGITS = 6  # of numbers in MuJoCo's files
TWIST_MASS = 1e-6  # kg, of a body that only twists: MuJoCo requires some, and nothing moves it
JOINTS = {
    "slide": (mujoco.mjtJoint.mjJNT_SLIDE, {"y": [0, 1, 0], "z": [0, 0, 1]}),
    "hinge": (mujoco.mjtJoint.mjJNT_HINGE, {"x": [1, 0, 0], "y": [0, 0, 1], "z": [0, -1, 0]}),
}


def links_spec(rig: Rig, links: int) -> tuple[mujoco.MjSpec, Linkage]:
    """Return a rig's shafts and supports with exact positions, without clearances, and their linkage."""
    whole = linkage(rig, links)
    spec = mujoco.MjSpec()
    spec.modelname = rig.name
    free = whole.free
    fastest = scipy.linalg.eigvalsh(free.T @ whole.whole_stiffness @ free, free.T @ whole.mass @ free)[-1]
    spec.option.timestep = 0.5 * 2 / np.sqrt(fastest)  # leaves room for contacts; engines set their own
    set_solver(spec)
    if whole.bends_across:
        spec.option.gravity = rig.gravity or [0, 0, 0]
    spec.compiler.degree = False
    for i in range(len(rig.linear.shafts)):
        _add_shaft(spec, whole, i)
    for member in whole.along("x"):
        _add_twist(spec, whole, member)
    for axis in "yzx":
        for i, row in enumerate(row for own, row in zip(*whole.fixed) if own == axis):
            _add_support(spec, whole, f"support{i}{_suffix(whole, axis)}", row)
        for i, (_, row, stiffness, damping) in enumerate(each for each in zip(*whole.springs) if each[0] == axis):
            spring = add_tendon(spec, whole, f"spring{i}{_suffix(whole, axis)}", row)
            spring.stiffness, spring.damping = [stiffness, 0, 0], [damping, 0, 0]
    _finish_supports(spec)
    return spec, whole


def round_places(spec: mujoco.MjSpec) -> None:
    """Round positions along the shaft to decimals that six digits preserve.

    Sites of a round clearance then stay at the same position however many links are between them. Otherwise their
    tendon would be along the shaft, where it has no inertia in MuJoCo.
    """
    exact = {"world": 0.0}
    for body in spec.bodies[1:]:
        exact[body.name] = exact[body.parent.name] + body.pos[0]
    decimals = DIGITS - 1 - int(np.floor(np.log10(max(abs(x) for x in exact.values()))))
    rounded = {name: round(x, decimals) for name, x in exact.items()}
    for body in spec.bodies[1:]:
        body.pos[0] = round(rounded[body.name] - rounded[body.parent.name], decimals)
    for site in spec.sites:
        carried_by = site.parent.name
        site.pos[0] = round(round(exact[carried_by] + site.pos[0], decimals) - rounded[carried_by], decimals)


def joint_names(whole: Linkage) -> list[str]:
    """Return the names of the joints in the order of the coordinates."""
    return [name for member in whole.members for name in _joint_names(whole, member)]


def _joint_names(whole: Linkage, member: Member) -> list[str]:
    suffix = _suffix(whole, member.axis)
    return [f"{_prefix(whole, member.shaft)}{joint}{suffix}" for joint in member.chain.joints]


def _suffix(whole: Linkage, axis: str) -> str:
    return f"_{axis}" if whole.bends_across or axis == "x" else ""


def _prefix(whole: Linkage, i: int) -> str:
    return f"{whole.rig.linear.shafts[i].name}_" if len(whole.rig.linear.shafts) > 1 else ""


def aside(whole: Linkage, i: int) -> float:
    """Return a shaft's position along y, m: side by side if none bends there."""
    if whole.bends_across:
        return 0.0
    return i * SHAFT_SPACING * max(shaft.half_depth(x) for shaft in whole.rig.linear.shafts for x in shaft.edges)


def _bending_members(whole: Linkage, i: int) -> list[Member]:
    """Return the bending members of a shaft, along z first."""
    return [member for member in (*whole.along("z"), *whole.along("y")) if member.shaft == i]


def _link_starts(whole: Linkage, i: int) -> np.ndarray:
    """Return the left ends (n,) of shaft i's links, m: at the hinges of both planes, which mostly coincide."""
    places = np.sort(np.concatenate([member.chain.starts for member in _bending_members(whole, i)]))
    return places[np.diff(places, prepend=-np.inf) > SAME_PLACE * whole.rig.linear.shafts[i].length]


def _names(whole: Linkage, i: int) -> list[str]:
    """Return names of a shaft's links; in one plane the first one is the root if the shaft's left end moves."""
    prefix, count = _prefix(whole, i), len(_link_starts(whole, i))
    roots = not whole.bends_across and bool(_bending_members(whole, i)[0].chain.roots)
    return [f"{prefix}root"] * roots + [f"{prefix}link{n}" for n in range(count - roots)]


def _add_shaft(spec: mujoco.MjSpec, whole: Linkage, i: int) -> None:
    """Add one shaft: its links, joints and sensors."""
    starts, y, members = _link_starts(whole, i), aside(whole, i), _bending_members(whole, i)
    shaft, chain = whole.rig.linear.shafts[i], members[0].chain
    assert isinstance(chain, BendingChain)
    if starts[0] > shaft.start:
        at = shaft.start, y, starts[0] - shaft.start
        _add_visual(spec.worldbody, f"{_prefix(whole, i)}clamped", *at, shaft.half_depth(shaft.start))
    body, origin = spec.worldbody, (0.0, 0.0)
    for name, (start, end) in zip(_names(whole, i), pairwise((*starts, shaft.end))):
        body, origin = body.add_body(name=name, pos=[start - origin[0], y - origin[1], 0]), (start, y)
        link = chain.link(start, end)
        inertia = np.maximum(np.array([1e-6, 1, 1]) * link.inertia, LEAST_INERTIA * whole.bends_across)
        _set_inertia(body, link.mass, link.centre - start, inertia)
        joints = [
            (n, member) for member in members for n, x in enumerate(member.chain.places)
            if abs(x - start) <= SAME_PLACE * shaft.length
        ]  # fmt: skip
        for n, member in sorted(joints, key=lambda joint: joint[0]):
            _add_joint(body, whole, member, n)
        _add_visual(body, name, 0.0, 0.0, end - start, shaft.half_depth((start + end) / 2))
    across = [s for s in whole.rig.sensors if s.quantity == "acceleration" and not is_rotation(s.position)]
    places = [(s, whole.rig.linear.place(s.position)) for s in across]
    links = [(s, np.searchsorted(starts, x, side="right") or np.inf) for s, (number, x) in places if number == i]
    for sensor, _ in sorted(links, key=lambda each: each[1]):  # along the shaft, clamped ones last
        name = f"sensor{sensor.node}"
        add_site(spec, whole, name, sensor.position, size=0.004, rgba=[0.9, 0.6, 0, 1])
        site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": name}
        spec.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_ACCELEROMETER, **site)


def _add_twist(spec: mujoco.MjSpec, whole: Linkage, member: Member) -> None:
    """Add the links of a shaft once more, as bodies that rotate about its axis alone."""
    chain, body, origin = member.chain, spec.worldbody, (0.0, 0.0)
    assert isinstance(chain, TwistChain)
    for n, (start, inertia) in enumerate(zip(chain.starts, chain.inertias)):
        at = start, aside(whole, member.shaft)
        body, origin = body.add_body(pos=[at[0] - origin[0], at[1] - origin[1], 0]), at
        body.name = f"{_prefix(whole, member.shaft)}twist{n}"
        _set_inertia(body, TWIST_MASS, 0.0, np.full(3, inertia))
        _add_joint(body, whole, member, n)


def _add_joint(body: mujoco.MjsBody, whole: Linkage, member: Member, n: int) -> None:
    """Add the joint of a member's coordinate n."""
    kind, axes = JOINTS["slide" if member.chain.joints[n] == "slide" else "hinge"]
    stiffness, damping = (float(values[member.part][n]) for values in (whole.stiffness, whole.damping))
    body.add_joint(
        type=kind, axis=axes[member.axis], name=_joint_names(whole, member)[n], stiffness=[stiffness, 0, 0],
        damping=[damping, 0, 0],
    )  # fmt: skip


def carrier(spec: mujoco.MjSpec, whole: Linkage, point: float | str) -> tuple[mujoco.MjsBody, list[float]]:
    """Return the body that carries a point, and its position there; the world where nothing moves."""
    i, x = whole.rig.linear.place(point)
    starts = _link_starts(whole, i)
    n = int(np.searchsorted(starts, x, side="right")) - 1
    return (
        (spec.worldbody, [x, aside(whole, i), 0]) if n < 0 else (spec.body(_names(whole, i)[n]), [x - starts[n], 0, 0])
    )


def add_site(
    spec: mujoco.MjSpec, whole: Linkage, name: str, point: float | str, size: float, rgba: Sequence[float] | None = None
) -> None:
    """Add a site on a shaft's axis."""
    body, at = carrier(spec, whole, point)
    body.add_site(name=name, pos=at, size=[size, 0, 0], **({"rgba": rgba} if rgba else {}))


def add_tendon(spec: mujoco.MjSpec, whole: Linkage, name: str, row: np.ndarray) -> mujoco.MjsTendon:
    """Add a fixed tendon whose length is a combination (nv,) of the coordinates."""
    tendon = spec.add_tendon(name=name, springlength=[0, 0])
    for member in whole.members:
        if row[member.part].any():
            for joint, coefficient in zip(_joint_names(whole, member), row[member.part]):
                tendon.wrap_joint(joint, coefficient)
    return tendon


def _set_inertia(body: mujoco.MjsBody, mass: float, centre: float, inertia: np.ndarray) -> None:
    body.mass, body.ipos, body.inertia, body.explicitinertial = mass, [centre, 0, 0], inertia, True


def _add_visual(body: mujoco.MjsBody, name: str, x: float, y: float, length: float, depth: float) -> None:
    """Add a visual piece of a shaft, without contact."""
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[x, y, 0, x + length, y, 0], size=[depth, 0, 0],
        contype=0, conaffinity=0, rgba=[0.55, 0.6, 0.66, 1],
    )  # fmt: skip


def _add_support(spec: mujoco.MjSpec, whole: Linkage, name: str, row: np.ndarray) -> None:
    """Constrain a motion of a shaft to zero."""
    add_tendon(spec, whole, name, row)
    tendon = {"type": mujoco.mjtEq.mjEQ_TENDON, "objtype": mujoco.mjtObj.mjOBJ_TENDON, "name1": name}
    solref = settling(spec.option.timestep)
    spec.add_equality(name=name, solref=solref, solimp=[0.9999, 0.9999, 1, 0.5, 1], **tendon)


def _finish_supports(spec: mujoco.MjSpec) -> None:
    """Set the options that supports and springs require, once all of them, and no other tendons, exist."""
    if spec.equalities or spec.tendons:  # MuJoCo's implicit damping of joints alone would not hold supports still
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        for joint in spec.joints:  # explicit dampers act half a step late: this inertia compensates for it
            joint.armature = spec.option.timestep / 2 * joint.damping[0]
    if spec.equalities:
        spec.option.iterations = 100  # rows as they are; engines make them orthogonal
