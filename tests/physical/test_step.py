"""The longest stable step: against closed forms, and against where simulations really diverge."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical

SLIDE = """<mujoco><compiler angle="radian"/><option gravity="0 0 0" integrator="{}"/>
  <worldbody><body><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/><joint name="z" type="slide"/></body></worldbody>
  <actuator><position name="servo" joint="z" kp="5e3" kv="{}" gear="1.5"/></actuator></mujoco>"""
ARM = """<mujoco><compiler angle="radian"/><option gravity="0 0 0" integrator="{}"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody><geom name="floor" type="plane" size="3 3 1" pos="0 0 -.4" solref="-3e4 -20" condim="1" contype="1"/>
    <body><joint name="a" axis="0 1 0" damping=".3" stiffness="3"/>
      <geom type="capsule" fromto="0 0 0 .5 0 0" size=".03"/>
      <body pos=".5 0 0"><joint name="b" axis="0 1 0" damping=".1"/>
        <geom type="capsule" fromto="0 0 0 .4 0 0" size=".03"/>
        <geom name="tip" pos=".4 0 0" size=".03" condim="1" solref="-5e4 -20" conaffinity="1"/></body>
      <body pos=".5 0 0"><joint name="c" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/></body>
    </body></worldbody><tendon><fixed name="t" damping="{tendon}" stiffness="11">
    <joint joint="b" coef="1"/><joint joint="c" coef="-2"/></fixed></tendon>
  <actuator><position name="p" joint="b" kp="{kp}" kv="{kv}" gear="1.5"/><damper joint="a" kv="1" ctrlrange="0 2"/>
    <motor tendon="t" damping=".5"/><motor joint="a" damping=".2" gear="2"/></actuator></mujoco>"""
TOUCHES = 0.29552815


def diverges(model, pose, step):
    """Whether a speed of 1e-9 grows a thousandfold about a pose in which forces hold the model."""
    model.opt.timestep = step
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = pose, np.where(model.actuator_ctrllimited, model.actuator_ctrlrange[:, 1], 0)
    mujoco.mj_forward(model, data)
    data.qacc[:] = 0
    mujoco.mj_inverse(model, data)
    data.qfrc_applied[:] = data.qfrc_inverse - data.qfrc_actuator
    data.qvel[:] = 1e-9 * np.cos(np.arange(model.nv))
    mujoco.mj_step(model, data, nstep=2000)
    return not np.abs(data.qvel).max() < 1e-6


DELTA, OMEGA = 60 * 1.5**2 / 4, np.sqrt(5e3 * 1.5**2 / 2)
EXPECTED = {
    ("Euler", 0.0): 2 / OMEGA,
    ("Euler", 60.0): 2 / (DELTA + np.hypot(DELTA, OMEGA)),
    ("implicitfast", 60.0): 2 * (DELTA + np.hypot(DELTA, OMEGA)) / OMEGA**2,
    ("implicit", 60.0): 2 * (DELTA + np.hypot(DELTA, OMEGA)) / OMEGA**2,
    ("RK4", 0.0): np.sqrt(8) / OMEGA,
}  # Eigenvalue -1 of the step; of Runge-Kutta's the limit on the imaginary axis, √8 (Hairer & Wanner, IV.2)


@pytest.mark.parametrize(("integrator", "kv"), EXPECTED)
def test_servo(integrator, kv):
    """A position servo on 2 kg: gains through the gear, its damper explicit or implicit."""
    model, expected = mujoco.MjModel.from_xml_string(SLIDE.format(integrator, kv)), EXPECTED[integrator, kv]
    assert physical.largest_step(model) == pytest.approx(expected, rel=1e-7)
    assert [diverges(model, (0.0,), fraction * expected) for fraction in (0.99, 1.01)] == [False, True]


GAINS = {0.2: (0.7, 50, 2), 0.1: (5, 1e2, 0), TOUCHES: (0.7, 5e3, 0)}
"""By the angle of the shoulder: of the tendon's damper, kp, kv"""


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize("shoulder", GAINS)
def test_arm(integrator, shoulder):
    """Servos, dampers of a tendon across two branches, geoms with a solref of their own: it diverges 3 % above."""
    gains = dict(zip(("tendon", "kp", "kv"), GAINS[shoulder]))
    model, pose = mujoco.MjModel.from_xml_string(ARM.format(integrator, **gains)), (shoulder, 0.3, 0.1)
    step = physical.largest_step(model, pose)
    assert [diverges(model, pose, fraction * step) for fraction in (0.98, 1.03)] == [False, True]


def test_what_is_disabled_does_not_count():
    """Flags actuation, spring and damper, actuator groups; discrete is implicit in all."""
    model = mujoco.MjModel.from_xml_string(SLIDE.format("Euler", 60.0))
    assert physical.largest_step(model) < np.inf
    model.opt.disableactuator = 1
    assert physical.largest_step(model) == np.inf
    model.opt.disableactuator, model.opt.disableflags = 0, int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    assert physical.largest_step(model) == np.inf
    model.opt.disableflags, model.opt.integrator = 0, int(mujoco.mjtIntegrator.mjINT_DISCRETE)
    assert physical.largest_step(model) == np.inf


def test_time_constants_without_refsafe():
    """A default limit pressed at 1.5 of its time constant; with refsafe MuJoCo makes that two steps."""
    xml = """<mujoco><option gravity="0 0 0"/><worldbody><body><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
      <joint name="z" type="slide" axis="0 0 1" range="-1 0" limited="true"/></body></worldbody></mujoco>"""
    model, pose = mujoco.MjModel.from_xml_string(xml), (1e-3,)
    assert physical.largest_step(model, pose) == np.inf
    assert not diverges(model, pose, 0.03)
    model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    step = physical.largest_step(model, pose)
    assert 0.01 < step < 0.02
    assert [diverges(model, pose, fraction * step) for fraction in (0.95, 1.05)] == [False, True]
    model.opt.timestep = 0.02
    assert 'timestep 0.02 s is too long: joint "z" is stable below 0.016' in physical.check(model)[0]
