"""Inverse inertias behind contacts and limits: one that is known, and those that MuJoCo's estimate misses."""

import re

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.physical.rows import softness_of

from .arm import C, K, arm
from .stepping import ringing


def test_known_inverse_inertia():
    """k and c stay; a limit that is passed at a speed then has k r + c ṙ without μ α, which was 1e-4 of its inertia."""
    spec = arm()
    physical.joint_limit(spec, "elbow", K, C)
    physical.tendon_limit(spec, "sum", K, C)
    physical.contact(spec, ("ball", "ground"), K, C)
    model = spec.compile()
    physical.set_inverse_inertia(model)
    for row in (("joint", 1), ("tendon", 0), ("pair", 0)):
        assert physical.inverse_inertia(model, *row) == physical.INVERSE_INERTIA
        assert softness_of(model, *row) == pytest.approx((K, C), rel=1e-14)
    np.testing.assert_allclose(model.jnt_solref[1], physical.SOLREF_PER_UNIT * np.array([K, C]), rtol=1e-14)
    data = mujoco.MjData(model)
    data.qpos[1], data.qvel[1] = np.deg2rad(90) + 0.01, 0.3
    mujoco.mj_forward(model, data)
    assert data.qfrc_constraint[1] == pytest.approx(-(K * 0.01 + C * 0.3), rel=1e-6)
    mass = 1e-4 / (1 - 1e-4) / physical.INVERSE_INERTIA
    assert data.qfrc_constraint[1] == pytest.approx(-(K * 0.01 + C * 0.3) - mass * data.qacc[1], rel=1e-12)


NEARLY_DEAD = """<mujoco><compiler angle="radian"/><option timestep="5e-5" gravity="0 0 0"/>
  <worldbody><site name="wall" pos="1.5 0 0.05"/>
    <body><joint name="swing" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .5 0 0" size=".02"/>
      <site name="tip" pos=".5 0 0"/></body></worldbody>
  <tendon><spatial name="rope" range="0 1"><site site="tip"/><site site="wall"/></spatial></tendon></mujoco>"""


def frequency(model, angle):
    """Of a pendulum on its rope, Hz, stretched by 1e-4 m in a pose."""
    data = mujoco.MjData(model)
    data.qpos[0] = angle
    mujoco.mj_forward(model, data)
    model.tendon_range[0, 1] = data.ten_length[0] - 1e-4
    mujoco.mj_forward(model, data)
    data.qfrc_applied[:], data.qvel[:] = -data.qfrc_constraint, 1e-3
    moved = []
    for _ in range(8000):
        mujoco.mj_step(model, data)
        moved.append(data.qpos[0] - angle)
    return ringing(moved, model.opt.timestep)


def test_slow_ringing_is_named():
    """A rope that hardly moves the pendulum where MuJoCo computes Â: by the share that `check` says, and the cure."""
    spec = mujoco.MjSpec.from_string(NEARLY_DEAD)
    physical.tendon_limit(spec, "rope", 1e4, 0.0)
    model = physical.compile(spec)
    assert physical.check(model) == ()
    (line,) = physical.check(model, poses=[(0.0,), (1.2,)])
    words = r'tendon limit "rope" rings ([\d.]+) % too slow in pose 1, where the inertia behind it is \d+ ti'
    percent = float(re.match(words, line)[1])
    slow = frequency(model, 1.2)
    model.tendon_invweight0[0] *= 1e4
    physical.apply(model)
    assert physical.check(model, poses=[(0.0,), (1.2,)]) == ()
    assert 100 * (1 - slow / frequency(model, 1.2)) == pytest.approx(percent, rel=0.05)
    assert percent > 1
