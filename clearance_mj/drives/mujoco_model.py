"""An identified drive inside an actuator of a MuJoCo model."""

from __future__ import annotations

import math
from typing import Any

import mujoco

from ..core.errors import ClearanceError, ModelError
from ..physical import DriveFriction, Efficiency, add_drive
from .drive import Drive

__all__ = ["add_found_drive"]

SLIPS_WITHIN = 0.1  # of the width of the motor's friction, since friction from the load reverses at once


def add_found_drive(
    spec: mujoco.MjSpec, actuator: Any, drive: Drive, largest_torque: float, inertia: float | None = None,
    c: float = 0.0,
) -> tuple[str, ...]:  # fmt: skip
    """Put a drive into an actuator whose joint is the load; see `clearance_mj.physical.add_drive`.

    The actuator's force becomes the motor's torque: its gear is set to one over the drive's ratio. What is lost as
    the torque turns its sign and in reversals is play, elasticity of the whole length is that of the teeth, friction of
    the motor and of the transmission is one at the motor, which slips within a tenth of the width of the motor's
    friction even under the largest torque. A spring at the motor becomes the joint's.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place.
    actuator : str or mujoco.MjsActuator
        Of the load's hinge.
    drive : Drive
        Such as `DriveFit.drive`, of one strand: find it with ``parts`` without "second strand".
    largest_torque : float
        Of the load, N m, such as `DriveFit.largest_torque`.
    inertia : float, optional
        Of the motor at the motor, kg m², where logs were too slow to tell it; else the joint's armature.
    c : float
        Damping of the teeth at the load, N m s/rad, which slow logs do not tell.

    Returns
    -------
    tuple of str
        Features of the drive that the model lacks, one line each.

    Raises
    ------
    ModelError
        For a drive without elasticity or inertia, or of two strands, and whatever `add_drive` refuses.
    """
    n, compliance = abs(drive.ratio), drive.compliance + drive.entrance_compliance
    if not compliance > 0:
        raise ModelError("the drive has no compliance, so its teeth would be rigid; give it a compliance > 0")
    if len(drive.strands) > 1:
        raise ModelError(
            "the drive has two strands, which are no sum of teeth and friction; find it without: "
            'fit_drive(runs, parts=("backlash", "damping", "inertia"))'
        )
    motor_inertia = drive.inertia or inertia
    dry, capstan = drive.friction.torque + drive.strands[0].coulomb, math.exp(-drive.capstan)
    eta = Efficiency(min(1.0, drive.efficiency * capstan), min(1.0, capstan / drive.efficiency))
    peak = dry / n + largest_torque * max(1 / eta.forward - 1, 1 - eta.backward)
    friction = DriveFriction(
        peak / (SLIPS_WITHIN * drive.friction.width * n), coulomb=dry / n, viscous=drive.damping / n**2, efficiency=eta
    )
    if (motor := spec.actuator(actuator if isinstance(actuator, str) else actuator.name)) is None:
        raise ModelError(f'the specification has no actuator "{actuator}"')
    gear, motor.gear[0] = motor.gear[0], 1 / drive.ratio  # before, since limits of the joint become the motor's by it
    try:
        add_drive(
            spec, motor, n * (drive.backlash + drive.friction.lost_motion), drive.efficiency / (n**2 * compliance), c,
            None if motor_inertia is None else motor_inertia / n**2, friction=friction,
        )  # fmt: skip
    except ClearanceError:
        motor.gear[0] = gear
        raise
    joint = spec.joint(motor.target)
    if joint and drive.stiffness > 0:
        joint_stiffness, added = joint.stiffness[0], drive.stiffness / n**2
        zero = math.degrees(drive.zero) if spec.compiler.degree else drive.zero
        joint.springref = (joint_stiffness * joint.springref + added * zero) / (joint_stiffness + added)
        joint.stiffness[0] = joint_stiffness + added
    return _omissions(drive)


def _omissions(drive: Drive) -> tuple[str, ...]:
    zero = f"the load's angle {drive.zero:.4g} rad at angle 0 of the motor: motor's angles count from the load's 0"
    omissions = (
        (drive.stiffness < 0, "the spring at the motor, which is negative"),
        (drive.zero, zero),
        (drive.torque_zero, f"the {drive.torque_zero:.4g} N m that the motor's sensor shows besides"),
        (drive.entrance_compliance, "where along its length it is elastic"),
        (drive.compliance_growth, "the growth of its compliance with the angle"),
        (drive.curvature, "the change of its ratio with the angle"),
    )
    return tuple(words for applies, words in omissions if applies)
