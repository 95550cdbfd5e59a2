"""Actuators of a model: number, addresses, and the ranges and damping that the compiler derives."""

from __future__ import annotations

from typing import Any

import mujoco

__all__ = ["actuator_count", "control_of", "drives_joint", "fix_damping", "fix_ranges", "output_of"]

ON_JOINT = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT


def actuator_count(model: mujoco.MjModel) -> int:
    """Return the number of actuators, which from MuJoCo 4 on may have several controls each or none."""
    return len(model.actuator_trntype)


def control_of(model: mujoco.MjModel, index: int) -> int:
    """Return the index of an actuator's (first) control; MuJoCo 3 has one for each."""
    return int(model.actuator_ctrladr[index]) if hasattr(model, "actuator_ctrladr") else index


def output_of(model: mujoco.MjModel, index: int) -> int:
    """Return the index of an actuator's force, length and gear; MuJoCo 3 has one for each."""
    return int(model.actuator_outadr[index]) if hasattr(model, "actuator_outadr") else index


def drives_joint(motor: Any, joint: str) -> bool:
    """Return True if an actuator of a specification acts on a joint directly."""
    return motor.target == joint and motor.trntype in ON_JOINT


def fix_ranges(motor: Any, model: mujoco.MjModel) -> None:
    """Write into an actuator of a specification the ranges that its compiler derives from its joint.

    ``inheritrange`` takes the joint's range, which must not change when a rotor is put between actuator and joint.

    Parameters
    ----------
    motor : mujoco.MjsActuator
        Changed in place.
    model : mujoco.MjModel
        The compiled specification.
    """
    if not motor.inheritrange:
        return
    index = _index_of(motor, model)
    motor.inheritrange, control, limited = 0.0, control_of(model, index), mujoco.mjtLimited.mjLIMITED_TRUE
    if model.actuator_ctrllimited[control]:
        motor.ctrllimited, motor.ctrlrange = limited, model.actuator_ctrlrange[control]
    if model.actuator_actlimited[index]:
        motor.actlimited, motor.actrange = limited, model.actuator_actrange[index]


def fix_damping(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Replace the damping ratios of a specification's servos by the damping of its compiled model.

    ``dampratio`` depends on the inertia behind the joint, which includes the armature of other joints.
    """
    for motor in spec.actuators:
        if motor.biastype == mujoco.mjtBias.mjBIAS_AFFINE and motor.biasprm[2] > 0:  # a ratio until it is compiled
            motor.biasprm[:] = model.actuator_biasprm[_index_of(motor, model)]


def _index_of(motor: Any, model: mujoco.MjModel) -> int:
    return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, motor.name) if motor.name else int(motor.id)
