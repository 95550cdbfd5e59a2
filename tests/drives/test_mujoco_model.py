"""A drive as logs have it, inside an actuator: what its chain says of steady motion and of a held motor."""

import math

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import ModelError
from clearance_mj.drives import Drive, PreslidingFriction, Strand, add_found_drive

from ..physical.arm import AXLE
from ..physical.stepping import settled

FOUND = Drive(
    ratio=-0.1, zero=0.0, compliance=0.05, strands=(Strand(1.0, 0.029),), capstan=0.2,
    efficiency=0.9, damping=1e-3, inertia=2e-4, friction=PreslidingFriction(0.05, 0.03, 0.02), backlash=0.03,
)  # fmt: skip


def model(kind, gains, drive=FOUND, **options):
    spec = mujoco.MjSpec.from_string(AXLE.format(actuator=kind, more=gains))
    left = add_found_drive(spec, "motor", drive, 4.0, c=1.0, **options)
    return physical.compile(spec), left


@pytest.mark.parametrize("speed", [4.0, -4.0])
def test_torque_of_the_motor_at_a_steady_speed(speed):
    """The chain's: e (T - F - C - d ω) e^{-μ} of a motor that drives its load, and the ratio's sign."""
    made, _ = model("velocity", 'kv="0.5"')
    data = settled(made, 60_000, ctrl=speed, qfrc_applied=2.0 * np.sign(speed))  # the load resists the way it is turned
    state = physical.drive_state(made, data.act, "motor")
    motor_speed, motor_torque = state.speed / FOUND.ratio, state.motor_torque * FOUND.ratio
    losses = 0.03 + 0.029 + 1e-3 * abs(motor_speed)
    out = 0.9 * (abs(motor_torque) - losses) * math.exp(-0.2) / FOUND.ratio
    assert np.sign(motor_torque) * out == pytest.approx(state.load_torque, rel=1e-5)
    assert abs(data.qvel[0]) == pytest.approx(abs(0.1 * motor_speed), rel=1e-6)


def test_stiffness_and_lost_motion_of_a_held_motor():
    """Those of `Drive.hysteresis` beyond the play: the load's angle over its torque with the motor held."""
    made, left = model("position", 'kp="50" kv="1"')
    angles = []
    for torque in (2.0, -2.0, 4.0):
        data = settled(made, 100_000, qfrc_applied=torque)
        angles.append(data.qpos[0] - physical.drive_state(made, data.act, "motor").angle)
    stiffness = 0.9 / (0.1**2 * 0.05)
    assert (angles[2] - angles[0]) == pytest.approx(2.0 / stiffness, rel=1e-6)
    assert (angles[0] - angles[1]) == pytest.approx(2 * 0.1 * (0.03 + 0.02) + 4.0 / stiffness, rel=1e-6)
    assert left == ()


def test_a_spring_at_the_motor_is_one_at_the_joint():
    """About the load's angle at angle 0 of the motor, in whichever unit the specification has angles."""
    drive = Drive(0.1, 0.2, 0.05, (Strand(1.0, 0.1),), stiffness=0.03, inertia=1e-4)
    for degree in (True, False):
        spec = mujoco.MjSpec.from_string(AXLE.format(actuator="motor", more=""))
        spec.compiler.degree = degree
        add_found_drive(spec, "motor", drive, 4.0)
        made = physical.compile(spec)
        assert (made.jnt_stiffness[0], made.qpos_spring[0]) == pytest.approx((0.03 / 0.1**2, 0.2))


def test_what_cannot_be_put_into_a_model():
    rigid = Drive(0.1, 0.0, 0.0, (Strand(1.0, 0.1),))
    with pytest.raises(ModelError, match="the drive has no compliance, so its teeth would be rigid"):
        model("motor", "", rigid)
    two = Drive(0.1, 0.0, 0.05, (Strand(0.5, 0.1), Strand(0.5, 0.3)))
    with pytest.raises(ModelError, match="two strands, which are no sum of teeth and friction; find it without"):
        model("motor", "", two)
    slow = Drive(0.1, 0.2, 0.05, (Strand(1.0, 0.1),))
    with pytest.raises(ModelError, match="its joint has no armature; give inertia > 0"):
        model("motor", "", slow)
    _, left = model("motor", "", slow, inertia=1e-4)
    assert left == ("the load's angle 0.2 rad at angle 0 of the motor: motor's angles count from the load's 0",)
