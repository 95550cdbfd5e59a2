"""Friction of drives that grows with the torque carried, of worms, cables and servos: closed forms."""

import math

import mujoco
import numpy as np
import pytest
import scipy.optimize

from clearance_mj import physical
from clearance_mj.core.errors import LawError
from clearance_mj.physical import DriveFriction, Efficiency, drive_state

from .arm import AXLE
from .stepping import settled

K = 2000.0  # N m/rad


def axle(friction, actuator="motor", more="", gap=0.0, k=K, **options):
    spec = mujoco.MjSpec.from_string(AXLE.format(actuator=actuator, more=more))
    physical.add_drive(spec, "motor", gap, k, 1.0, 0.05, friction=friction, **options)
    return physical.compile(spec)


def run(model, control, load, seconds=1.0):
    """State of the drive, and the load's angle and speed, after a constant torque on the load has acted."""
    data = settled(model, round(seconds / model.opt.timestep), ctrl=control, qfrc_applied=load)
    return drive_state(model, data.act, "motor"), data.qpos[0], data.qvel[0]


@pytest.mark.parametrize("lead, friction", [(5.0, 0.05), (12.0, 0.1), (5.0, 0.15)])
def test_a_worm_lifts_and_lowers_with_its_efficiencies(lead, friction):
    """Motor's torque over that on the load at a steady speed: 1/η lifting, η' lowering, which drives where η' < 0."""
    angle, rho = math.radians(lead), math.atan(friction)
    eta = Efficiency.screw(angle, friction)
    model = axle(DriveFriction(1e4, 5.0, efficiency=eta), "velocity", 'kv="50"')
    for speed, sum_of_angles in ((0.5, angle + rho), (-0.5, angle - rho)):
        state, _, turned = run(model, speed, -2.0, 2.0)
        assert turned == pytest.approx(state.speed, rel=1e-6) and speed * turned > 0
        torques = state.motor_torque / state.load_torque
        assert torques == pytest.approx(math.tan(sum_of_angles) / math.tan(angle), rel=1e-5)
    assert (eta.backward < 0) == (friction > math.tan(angle))


def test_a_worm_locks_itself_where_its_friction_is_larger_than_its_lead():
    """Without any torque of the motor the load falls at μ < tan λ, and stays where it is at μ > tan λ."""
    for friction, falls in ((0.08, True), (0.1, False)):  # tan 5° = 0.0875
        model = axle(DriveFriction(1e4, 5.0, efficiency=Efficiency.screw(math.radians(5), friction)))
        _, angle, speed = run(model, 0.0, -2.0, 2.0)
        assert (angle < -0.05) == falls
        if not falls:
            assert abs(speed) < 1e-12


def test_a_cable_holds_between_its_capstans():
    """T e^{-μφ} to T e^{μφ} of the motor's torque hold a load T; a hundredth beyond either end it goes."""
    wrap, load = 0.3, 2.0
    model = axle(DriveFriction(1e4, 5.0, efficiency=Efficiency.capstan(wrap)))
    for angle, fraction, moves in ((-wrap, 0.99, -1), (-wrap, 1.01, 0), (wrap, 0.99, 0), (wrap, 1.01, 1)):
        torque = fraction * load * math.exp(angle)
        state, _, speed = run(model, torque, -load, 6.0)
        assert np.sign(np.round(speed, 6)) == moves
        assert state.motor_torque == pytest.approx(torque)


BASE = {
    "friction_base": 0.05, "friction_viscous": 0.1, "friction_stribeck": 0.04, "dtheta_stribeck": 0.4, "alpha": 1.35,
    "load_friction_base": 0.12, "load_friction_motor": 0.08, "load_friction_external": 0.11,
    "load_friction_stribeck": 0.06, "load_friction_motor_stribeck": 0.05, "load_friction_external_stribeck": 0.07,
    "load_friction_motor_quad": 0.009, "load_friction_external_quad": 0.006,
}  # fmt: skip


def budget(model, p, motor, external, speed):
    """Friction of M1 to M6 as in section III of arXiv 2410.08650 (and, with it, of its published code)."""
    number = int(model[1])
    rest = math.exp(-(abs(speed / p["dtheta_stribeck"]) ** p["alpha"])) if number in (2, 4, 5, 6) else 0.0
    limit = p["friction_base"] + rest * p["friction_stribeck"] + p["friction_viscous"] * abs(speed)
    if number in (3, 4):
        limit += (p["load_friction_base"] + rest * p["load_friction_stribeck"]) * abs(external - motor)
    if number in (5, 6):
        limit += abs(external * p["load_friction_external"] - motor * p["load_friction_motor"])
        limit += rest * abs(external * p["load_friction_external_stribeck"] - motor * p["load_friction_motor_stribeck"])
    if number == 6 and np.sign(external) != np.sign(motor):
        if abs(external) < abs(motor):
            limit += rest * p["load_friction_external_quad"] * external**2
        elif abs(external) > abs(motor):
            limit += rest * p["load_friction_motor_quad"] * motor**2
    return limit


@pytest.mark.parametrize("name", ["m1", "m2", "m3", "m4", "m5", "m6"])
@pytest.mark.parametrize("speed, load", [(0.3, -2.0), (-0.3, -2.0), (0.5, 1.5), (-0.2, -0.1)])
def test_servos_need_the_torque_of_their_friction_models(name, speed, load):
    """At a steady speed the motor's torque is that of the budget, solved for it by another method."""
    model = axle(DriveFriction.from_bam({"model": name, **BASE}, 1e4, 5.0), "velocity", 'kv="200"')
    state, _, turned = run(model, speed, load, 3.0)
    assert turned == pytest.approx(state.speed, rel=1e-5)

    def balance(motor):
        return motor - state.load_torque - np.sign(speed) * budget(name, BASE, motor, -state.load_torque, turned)

    assert state.motor_torque == pytest.approx(scipy.optimize.brentq(balance, -20, 20), abs=1e-5)


def test_files_of_friction_models_that_are_wrong():
    with pytest.raises(LawError, match='model "m7" of a BAM file; known: m1, m2'):
        DriveFriction.from_bam({"model": "m7"}, 1e4)
    with pytest.raises(LawError, match='needs a number "friction_viscous", got None'):
        DriveFriction.from_bam({"model": "m1", "friction_base": 0.1}, 1e4)


def test_maxwell_slip_is_masings_loop():
    """Torque of a held load whose motor goes to and fro: at first k θ up to each slip, back and forth twice as wide."""
    slips, k = [(400.0, 0.4), (300.0, 0.9), (100.0, 0.6)], 50.0
    model = axle(None, "position", 'kp="4e4" kv="200"', k=k, hysteresis=slips)
    data, top, steps, loop = mujoco.MjData(model), 0.008, 4000, []

    def virgin(x):
        return k * x + sum(min(stiffness * x, force) for stiffness, force in slips)

    with physical.Softener(model):
        for way in (1, -1, 1):
            for control in way * top * np.linspace(-1 if loop else 0, 1, steps):
                data.ctrl[0], data.qpos[0], data.qvel[0] = control, 0.0, 0.0
                mujoco.mj_step(model, data)
                loop.append(drive_state(model, data.act, "motor"))
    angle, torque = (np.array([getattr(state, name) for state in loop]) for name in ("angle", "load_torque"))
    ways = [slice(steps * i + 200, steps * (i + 1) - 1) for i in range(3)]
    ends = [int(np.argmax(angle[: 2 * steps])), steps + int(np.argmin(angle[steps:]))]
    expected = (
        [virgin(x) for x in angle[ways[0]]],
        [virgin(angle[ends[0]]) - 2 * virgin((angle[ends[0]] - x) / 2) for x in angle[ways[1]]],
        [-virgin(-angle[ends[1]]) + 2 * virgin((x - angle[ends[1]]) / 2) for x in angle[ways[2]]],
    )
    for way, want in zip(ways, expected):
        np.testing.assert_allclose(torque[way], want, atol=0.012 * virgin(top))


@pytest.mark.parametrize("numbers, says", [
    (dict(k=0.0), "k = 0 of a drive's friction must be finite and > 0"),
    (dict(k=1.0, coulomb=-1.0), "coulomb = -1 of a drive's friction must be finite and >= 0"),
    (dict(k=1.0, efficiency=Efficiency(1.2, 0.5)), r"efficiency 1.2, 0.5 must be in \(0, 1\] forward"),
])  # fmt: skip
def test_friction_out_of_range(numbers, says):
    with pytest.raises(LawError, match=says):
        DriveFriction(**numbers)
