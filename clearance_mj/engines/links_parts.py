"""Pieces of chains of rigid links as MuJoCo's specification has them."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from .bending_chain import Link
from .plant import settling

__all__ = ["add_fixed_tendon", "add_spring", "add_support", "finish_supports", "set_inertia", "visual"]

Row = Sequence[tuple[Sequence[str], np.ndarray]]  # joints of each shaft, and what a length changes by with each


def visual(body: mujoco.MjsBody, name: str, x: float, y: float, length: float, depth: float) -> None:
    """Show a piece of a shaft, which touches nothing."""
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[x, y, 0, x + length, y, 0], size=[depth, 0, 0],
        contype=0, conaffinity=0, rgba=[0.55, 0.6, 0.66, 1],
    )  # fmt: skip


def set_inertia(body: mujoco.MjsBody, link: Link) -> None:
    """Give a body the mass and inertia of a link, which does not turn about its own axis."""
    body.mass, body.ipos = link.mass, [link.centre - link.start, 0, 0]
    body.inertia = [1e-6 * link.inertia, link.inertia, link.inertia]
    body.explicitinertial = True


def add_fixed_tendon(spec: mujoco.MjSpec, name: str, row: Row) -> mujoco.MjsTendon:
    """Add a fixed tendon over all joints of the shafts that it belongs to."""
    tendon = spec.add_tendon(name=name, springlength=[0, 0])
    for joints, shares in row:
        if shares.any():
            for joint, share in zip(joints, shares):
                tendon.wrap_joint(joint, share)
    return tendon


def add_support(spec: mujoco.MjSpec, name: str, row: Row) -> None:
    """Hold a shaft's deflection or slope at zero."""
    add_fixed_tendon(spec, name, row)
    tendon = {"type": mujoco.mjtEq.mjEQ_TENDON, "objtype": mujoco.mjtObj.mjOBJ_TENDON, "name1": name}
    solref = settling(spec.option.timestep)
    spec.add_equality(name=name, solref=solref, solimp=[0.9999, 0.9999, 1, 0.5, 1], **tendon)


def add_spring(spec: mujoco.MjSpec, name: str, row: Row, stiffness: float, damping: float) -> None:
    """Add a spring, N/m or N m/rad, and its damper."""
    spring = add_fixed_tendon(spec, name, row)
    spring.stiffness, spring.damping = [stiffness, 0, 0], [damping, 0, 0]


def finish_supports(spec: mujoco.MjSpec) -> None:
    """Set the options that supports and springs ask for, once all of them, and no other tendons, are there."""
    if spec.equalities or spec.tendons:  # MuJoCo's implicit damping of joints alone would not hold supports still
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        for joint in spec.joints:  # explicit dampers act half a step late: so much more inertia makes up for it
            joint.armature = spec.option.timestep / 2 * joint.damping[0]
    if spec.equalities:
        spec.option.iterations = 100  # rows as they are; engines make them orthogonal
