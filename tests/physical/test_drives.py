"""Drives inside actuators: the same motion as with two joints, in all of MuJoCo's ways to step, and closed forms."""

import contextlib

import mujoco
import mujoco.batch
import numpy as np
import pytest
from mujoco import rollout

from clearance_mj import physical
from clearance_mj.clearance import ConstantLaw
from clearance_mj.core.errors import ModelError
from clearance_mj.physical import DriveFriction, drive_state
from clearance_mj.physical.drives import DRIVE

from ..conftest import ROOT
from .arm import arm
from .stepping import settled, step_by_hand, with_data

GAP, K, C = np.deg2rad(0.5), 2000.0, 0.5  # rad, N m/rad, N m s/rad
LINK = """<mujoco><option timestep="1e-4"/><worldbody><body>
      <joint name="elbow" axis="0 1 0" armature="0.01" damping="0.02" {joint}/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02"/></body></worldbody><actuator>{actuator}</actuator>
  <keyframe><key name="bent" qpos="0.7" {key}/></keyframe></mujoco>"""
SERVO = '<position name="motor" joint="elbow" kp="60" kv="1.5" forcerange="-8 8"/>'
MOTOR = '<motor name="motor" joint="elbow"/>'
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS


def link(actuator=SERVO, joint="", key=""):
    return mujoco.MjSpec.from_string(LINK.format(actuator=actuator, joint=joint, key=key))


def driven(actuator=SERVO, gap=GAP, k=K, c=C, step=1e-4, joint="", **options):
    """The link with a drive inside its actuator."""
    spec = link(actuator, joint)
    spec.option.timestep = step
    physical.add_drive(spec, "motor", gap, k, c, **options)
    return physical.compile(spec)


def march(model, controls, data=None):
    """Time, coordinates, speeds and activations after each step."""
    data, out = data or mujoco.MjData(model), []
    for control in controls:
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        out.append([data.time, *data.qpos, *data.qvel, *data.act])
    return np.array(out)


def rolled(model, controls):
    """The same, in one call of MuJoCo's."""
    begin = np.zeros((1, mujoco.mj_stateSize(model, STATE)))
    mujoco.mj_getState(model, mujoco.MjData(model), begin[0], STATE)
    out, _ = rollout.rollout(model, [mujoco.MjData(model)], begin, controls.reshape(1, -1, model.nu))
    return out[0]


def wave(n, step):
    t = step * np.arange(n)
    return 0.5 * np.sin(2 * np.pi * 1.3 * t) + 0.3 * np.sin(2 * np.pi * 0.31 * t)


@pytest.mark.parametrize("actuator", [
    SERVO,
    '<position name="motor" joint="elbow" kp="60" kv="1.5" timeconst="0.02"/>',
    '<general name="motor" joint="elbow" gear="-3" gainprm="20" biastype="affine" biasprm="0.1 -20 -0.4"/>',
    '<intvelocity name="motor" joint="elbow" kp="60" kv="1.5" actrange="-0.3 0.3"/>',
], ids=["servo", "filtered", "geared", "integrating"])  # fmt: skip
def test_the_motion_is_that_of_two_joints(actuator):
    """Load, motor, and the play between them, RMS over 2 s in which the teeth change sides and the motor saturates."""
    step, n = 2e-5, 100_000
    spec = link(actuator)
    spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = (0, 0, -2)
    inside = spec.copy()
    physical.add_backlash(spec, "elbow", GAP, K, C)
    physical.add_drive(inside, "motor", GAP, K, C)
    two, one = physical.compile(spec), physical.compile(inside)
    controls = wave(n, step) * (4 if "intvelocity" in actuator else 1)
    joints = rolled(two, controls)
    load, motor = (joints[:, 1 + two.joint(name).qposadr[0]] for name in ("elbow", "elbow drive"))
    with physical.Softener(one):
        rolled_path = rolled(one, controls)
    state = drive_state(one, rolled_path[:, -one.na :], "motor")
    assert np.ptp(np.sign(np.round(motor - load, 4))) == 2, "the teeth change sides"
    for ours, theirs in ((rolled_path[:, 1], load), (state.angle, motor)):
        assert np.sqrt(np.mean((ours - theirs) ** 2) / np.mean(theirs**2)) < 1e-3
    play, expected = state.angle - rolled_path[:, 1], motor - load
    assert np.sqrt(np.mean((play - expected) ** 2) / np.mean(expected**2)) < 3e-3


def test_a_robot_of_six_axes_moves_as_with_two_joints_in_its_wrist():
    """The gallery's arm, play in three of its joints, all six servos at work: each joint within 0.1 % over a second."""
    wrist, paths_of_models = ("roll", "pitch", "spin"), []
    rates, steps = 2 * np.pi * np.array([0.7, 0.9, 1.1, 1.3, 0.8, 1.7]), 10_000
    for inside in (False, True):
        spec = mujoco.MjSpec.from_file(str(ROOT / "models" / "robot_arm.xml"))
        spec.option.timestep = 1e-4
        for joint in wrist:
            if inside:
                physical.add_drive(spec, joint, np.deg2rad(0.1), 3000.0, 0.5)  # its servos have its joints' names
            else:
                physical.add_backlash(spec, joint, np.deg2rad(0.1), 3000.0, 0.5)
        model = physical.compile(spec)
        assert model.nv == (6 if inside else 9)
        controls = 0.5 * np.sin(np.arange(steps)[:, None] * 1e-4 * rates)
        with physical.Softener(model) if inside else contextlib.nullcontext():
            path = rolled(model, controls)
        paths_of_models.append(
            path[:, 1:][:, [model.joint(name).qposadr[0] for name in ("base", "shoulder", "elbow", *wrist)]]
        )
    two, one = paths_of_models
    assert np.all(np.sqrt(np.mean((one - two) ** 2, axis=0) / np.mean(two**2, axis=0)) < 1e-3)


def test_every_way_to_step_gives_the_same_numbers():
    """mj_step, a loop of one's own, rollout in two calls, and a batch on two threads, to the last bit."""
    model = driven(friction=DriveFriction(500.0, 0.5, coulomb=0.2), hysteresis=[(300.0, 0.1)])
    controls, softener = wave(3000, 1e-3), physical.Softener(model)
    data, by_hand = mujoco.MjData(model), []
    for control in controls:
        data.ctrl[0] = control
        step_by_hand(model, data, softener)
        by_hand.append([data.time, *data.qpos, *data.qvel, *data.act])
    begin = np.zeros((1, mujoco.mj_stateSize(model, STATE)))
    mujoco.mj_getState(model, mujoco.MjData(model), begin[0], STATE)
    with softener:
        stepped = march(model, controls)
        first, _ = rollout.rollout(model, [mujoco.MjData(model)], begin, controls[None, :1000, None])
        second, _ = rollout.rollout(model, [mujoco.MjData(model)], first[:, -1], controls[None, 1000:, None])
        batch = mujoco.batch.Batch(model, 4, 2)
        for control in controls:
            batch.ctrl[:] = control
            batch.step()
    np.testing.assert_array_equal(by_hand, stepped)
    np.testing.assert_array_equal(np.concatenate((first[0], second[0])), stepped)
    np.testing.assert_array_equal(batch.act, np.tile(stepped[-1, -model.na :], (4, 1)))


def test_saved_and_restored_and_reset_with_the_data():
    model, controls = driven(), wave(2000, 1e-3)
    with physical.Softener(model):
        whole = march(model, controls)
        data = mujoco.MjData(model)
        march(model, controls[:900], data)
        saved, other = np.zeros(mujoco.mj_stateSize(model, STATE)), mujoco.MjData(model)
        mujoco.mj_getState(model, data, saved, STATE)
        mujoco.mj_setState(model, other, saved, STATE)
        np.testing.assert_array_equal(march(model, controls[900:], other), whole[900:])
        before = data.act.copy()
        mujoco.mj_forward(model, data)
        mujoco.mj_forward(model, data)
        np.testing.assert_array_equal(data.act, before)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_step(model, data)
        assert drive_state(model, data.act, "motor").angle == pytest.approx(0.7, abs=1e-4)


def test_a_model_that_was_written_and_read_again_and_one_that_is_attached(tmp_path):
    spec = link(key='act=""')
    physical.add_drive(spec, "motor", GAP, K, C, friction=DriveFriction(500.0, coulomb=0.25))
    model, controls = physical.compile(spec), wave(500, 1e-3)
    (tmp_path / "model.xml").write_text(spec.to_xml())
    read = mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml"))
    parent = mujoco.MjSpec()
    parent.option.timestep = 1e-4
    parent.attach(spec.copy(), prefix="left ", frame=parent.worldbody.add_frame())
    attached = physical.compile(parent)
    ends = []
    for each in (model, read, attached):
        with physical.Softener(each):
            ends.append(march(each, controls)[-1])
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-4)  # a file has six digits
    np.testing.assert_allclose(ends[2], ends[0], rtol=1e-12)
    assert "left physical:drive:motor" in {attached.numeric(i).name for i in range(attached.nnumeric)}


def test_keyframes_keep_their_activations():
    """That of a filtered servo becomes the drive's input; all else is to begin."""
    spec = link('<position name="motor" joint="elbow" kp="60" timeconst="0.1"/>', key='act="0.25"')
    physical.add_drive(spec, "motor", GAP, K, C)
    assert physical.compile(spec).key_act.tolist() == [[0, 0, 0, 0, 0.25, 0, 0]]


@pytest.mark.parametrize("encoder", ["motor", "load"])
def test_a_servo_holds_what_its_encoder_sees(encoder):
    """Under a torque T the load is gap + T/k behind its motor, and the measured one T/kp from where it should be."""
    torque, kp = 3.0, 60.0 if encoder == "motor" else 5.0
    model = driven(SERVO.replace("60", str(kp)), encoder=encoder, friction=DriveFriction(1.0, viscous=2.0))
    model.opt.gravity[:] = 0
    data = settled(model, 100_000, ctrl=0.2, qfrc_applied=torque)
    state, load = drive_state(model, data.act, "motor"), data.qpos[0]
    assert load - state.angle == pytest.approx(GAP + torque / K, rel=1e-6)
    assert (state.angle if encoder == "motor" else load) - 0.2 == pytest.approx(torque / kp, rel=1e-6)
    assert (state.motor_torque, state.load_torque) == pytest.approx((-torque, -torque), rel=1e-6)
    assert data.actuator_force[0] == pytest.approx(-torque, rel=1e-6)


def test_a_drive_of_a_tendon():
    """A motor on the difference of two hinges that are held by springs: gap + T/k of the tendon between it and them."""
    spec = mujoco.MjSpec.from_string("""<mujoco><option timestep="1e-4" gravity="0 0 0"/><worldbody>
        <body><joint name="left" axis="0 1 0" damping="1" stiffness="50"/><geom size="0.1"/></body>
        <body pos="1 0 0"><joint name="right" axis="0 1 0" damping="1" stiffness="50"/><geom size="0.1"/></body>
      </worldbody>
      <tendon><fixed name="both"><joint joint="left" coef="1"/><joint joint="right" coef="-0.5"/></fixed></tendon>
      <actuator><motor name="motor" tendon="both" gear="4"/></actuator></mujoco>""")
    with pytest.raises(ModelError, match="its tendon has no armature; give inertia > 0"):
        physical.add_drive(spec, "motor", GAP, K, C)
    physical.add_drive(spec, "motor", GAP, K, C, 0.02, friction=DriveFriction(100.0, viscous=1.0))
    model = physical.compile(spec)
    data = settled(model, 100_000, ctrl=0.5)  # N m, four times that on the tendon
    assert data.qpos == pytest.approx([2 / 50, -1 / 50], rel=1e-6)
    assert drive_state(model, data.act, "motor").angle - data.ten_length[0] == pytest.approx(GAP + 2 / K, rel=1e-6)


def test_limits_are_the_motors():
    """Those of the actuator and of the joint's actuators hold for the motor, not for impacts of the teeth."""
    for limits, joint in (("-2 2", ""), ("-9 2.5", 'actuatorfrcrange="-2 2"')):
        model = driven(SERVO.replace("-8 8", limits), joint=joint)
        with physical.Softener(model):
            state = drive_state(model, march(model, wave(9000, 1e-4) * 9)[:, -model.na :], "motor")
        assert np.max(np.abs(state.motor_torque)) == 2.0
        assert np.max(np.abs(state.load_torque)) > 2.5


@pytest.mark.parametrize("actuator", [MOTOR, '<position name="motor" joint="elbow" kp="60" kv="1.5"/>'])
@pytest.mark.parametrize("integrator", ["EULER", "IMPLICITFAST", "DISCRETE"])
def test_the_longest_stable_step_is_known(actuator, integrator):
    """Rotor and load on their teeth, without play: at rest after many steps just below it, lost just above."""
    spec = link(actuator)
    spec.joint("elbow").damping = [0, 0, 0]
    spec.option.gravity, spec.option.integrator = (0, 0, 0), getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    physical.add_drive(spec, "motor", 0.0, K, C)
    model = physical.compile(spec)
    longest = physical.largest_step(model)
    for fraction, holds in ((0.999, True), (1.001, False)):
        model.opt.timestep = fraction * longest
        data = mujoco.MjData(model)
        with physical.Softener(model):
            mujoco.mj_step(model, data)
            data.qvel[0] = 1e-3
            worst = 0.0
            for _ in range(3000):
                mujoco.mj_step(model, data)
                worst = max(worst, abs(data.qvel[0]))
        assert (worst < 1e-2) == holds


def test_numbers_may_change_while_the_model_runs():
    """The custom number is read at every step: half the stiffness bends twice as far."""
    model = driven(MOTOR, gap=0.0)
    model.opt.gravity[:] = 0
    stop = mujoco.MjData(model)
    stop.ctrl[0], stop.qfrc_applied[0] = 1.0, -1.0
    bent = []
    for k in (K, K / 2):
        model.numeric("physical:drive:motor").data[2] = k
        with physical.Softener(model):
            mujoco.mj_step(model, stop, 50_000)
        bent.append(drive_state(model, stop.act, "motor").angle - stop.qpos[0])
    assert bent == pytest.approx([1 / K, 2 / K], rel=1e-6)


def test_friction_that_comes_while_the_model_runs():
    """A drive made without friction holds up to the one that is written into its number, and slips beyond."""
    model = driven(MOTOR, gap=0.0)
    model.opt.gravity[:] = 0
    numbers = model.numeric("physical:drive:motor").data.view(DRIVE)[0]
    numbers["friction_k"], numbers["friction_coulomb"] = 100.0, 0.5
    for torque, holds in ((0.24, True), (0.52, False)):  # set on at once, which swings to twice its own
        assert (abs(settled(model, 50_000, ctrl=torque).qpos[0]) < 0.02) == holds


def test_own_loops_turn_drives_beside_a_softener_in_use_for_another_model():
    """`update` in a loop of one model's while another's Softener is in use; within its own context it turns once."""
    model, other, controls = driven(), driven(hysteresis=[(300.0, 0.1)]), wave(200, 1e-3)
    softener, ends = physical.Softener(model), []
    for used in (None, other, model):
        data = mujoco.MjData(model)
        with physical.Softener(used) if used else contextlib.nullcontext():
            for control in controls:
                data.ctrl[0] = control
                step_by_hand(model, data, softener)
        ends.append([*data.qpos, *data.act])
    assert ends[0] == ends[1] == ends[2] and abs(ends[0][0]) > 1e-3


def test_a_disabled_drive_begins_anew():
    spec = link(SERVO.replace("/>", ' group="3"/>'))
    physical.add_drive(spec, "motor", GAP, K, C)
    model, data = with_data(physical.compile(spec))
    with physical.Softener(model):
        march(model, wave(100, 1e-3), data)
        model.opt.disableactuator = 1 << 3
        march(model, np.zeros(2), data)
        model.opt.disableactuator = 0
        data.qpos[0] = -0.4
        mujoco.mj_step(model, data)
    assert drive_state(model, data.act, "motor").angle == pytest.approx(-0.4, abs=1e-3)


def test_without_its_softener_a_drive_is_named_and_exerts_nothing():
    model = driven()
    assert any('actuator "motor" exerts nothing' in line for line in physical.check(model))
    assert settled(model, 10, softened=False, ctrl=1.0).actuator_force[0] == 0
    assert b"actuators with drives exert nothing" in bytes(model.text_data)


def test_integrator_discrete_is_for_drives_and_friction_alone():
    """Drives and bristles move as with implicitfast; a damped joint's limit gets 1.5 % softer; laws are refused."""
    ends = []
    for name in ("IMPLICITFAST", "DISCRETE"):
        spec = link()
        physical.add_drive(spec, "motor", GAP, K, C)
        physical.joint_friction(spec, "elbow", 0.1, 500.0, 0.1)
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{name}")
        model = physical.compile(spec)
        with physical.Softener(model):
            ends.append(march(model, wave(3000, 1e-3))[-1])
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-9)
    softer = []
    for name in ("IMPLICITFAST", "DISCRETE"):
        spec = arm()
        spec.option.timestep, spec.option.integrator = 1e-3, getattr(mujoco.mjtIntegrator, f"mjINT_{name}")
        for joint in ("shoulder", "elbow"):
            spec.joint(joint).damping = [2, 0, 0]
        physical.joint_limit(spec, "elbow", 730.0, 2.0)
        model, data = with_data(physical.compile(spec))
        data.ctrl[0], data.joint("elbow").qpos = 3.0, np.deg2rad(90)
        mujoco.mj_step(model, data, 20_000)
        softer.append(730 * (data.joint("elbow").qpos[0] - np.deg2rad(90)) / 3)
    assert softer[0] == pytest.approx(1, abs=1e-9)
    assert abs(softer[1] - 1) > 0.01
    physical.joint_limit(spec, "elbow", law=ConstantLaw(730.0, 2.0))
    with pytest.raises(ModelError, match="integrator DISCRETE changes the forces of laws"):
        physical.Softener(physical.compile(spec))
