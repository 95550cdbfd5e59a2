"""Backlash and annular clearances: play, stiffness and forces that are known."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import LawError, ModelError

from .arm import C, K, arm
from .stepping import mass_matrix

GAP = 0.0123


def geared(scale=1.0, gap=GAP, **options):
    """The arm with play in its elbow, masses scaled."""
    spec = arm()
    for geom in spec.geoms:
        geom.density *= scale
    physical.add_backlash(spec, "elbow", gap, K, C, **options)
    spec.option.timestep = 1e-5
    return physical.compile(spec)


def turned(model, angle, shoulder=0.3):
    """Data of a load that is turned so far against its drive."""
    data = mujoco.MjData(model)
    data.joint("shoulder").qpos, data.joint("elbow").qpos = shoulder, 0.5 + angle
    data.joint("elbow drive").qpos = 0.5
    mujoco.mj_fwdPosition(model, data)
    return data


@pytest.mark.parametrize("scale", [0.1, 1.0, 30.0])
@pytest.mark.parametrize("shoulder", [-0.9, 0.4])
def test_backlash_does_not_depend_on_inertia(scale, shoulder):
    """Teeth whose load and drive are held: k r, and from two depths the play, both sides."""
    model = geared(scale)
    for side in (1, -1):
        forces = []
        for beyond in (1e-3, 2e-3):
            data = turned(model, side * (GAP + beyond), shoulder)
            mujoco.mj_inverse(model, data)
            assert data.joint("elbow").qfrc_constraint[0] == -data.joint("elbow drive").qfrc_constraint[0]
            forces.append(-side * data.joint("elbow").qfrc_constraint[0])
        stiffness = (forces[1] - forces[0]) / 1e-3
        assert (stiffness, GAP + 1e-3 - forces[0] / stiffness) == pytest.approx((K, GAP), rel=1e-6)


def test_backlash_is_free_between_the_teeth():
    model = geared()
    for angle in (-0.999 * GAP, 0.0, 0.999 * GAP):
        data = turned(model, angle)
        mujoco.mj_forward(model, data)
        assert not data.qfrc_constraint.any()


def test_who_has_what_after_backlash():
    """The drive has motor and armature; the load all else; keyframes put the drive at the load."""
    model, before = geared(), arm().compile()
    assert (model.nv, model.nq) == (before.nv + 1, before.nq + 1)
    drive, load = model.joint("elbow drive"), model.joint("elbow")
    assert model.actuator("motor").trnid[0] == drive.id
    assert (model.dof_armature[drive.dofadr[0]], model.dof_armature[load.dofadr[0]]) == (0.02, 0)
    np.testing.assert_allclose(load.range, np.deg2rad([-30, 90]))
    assert not model.jnt_limited[drive.id]
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("bent").id)
    assert data.joint("elbow drive").qpos[0] == data.joint("elbow").qpos[0] == 0.7
    assert data.joint("shoulder").qpos[0] == 0.1
    mass = mass_matrix(model, data)
    np.testing.assert_allclose(data.body("ball").xpos, (0, 3, -1))
    assert mass[drive.dofadr[0], drive.dofadr[0]] == pytest.approx(0.02, rel=1e-6)


def test_teeth_without_play_are_the_joint_itself():
    """A motor behind a tiny gap turns the load as before, with its armature: two accelerations within their ringing."""
    speeds = []
    for model in (arm().compile(), geared(gap=1e-9)):
        model.opt.timestep, data = 1e-4, mujoco.MjData(model)
        data.ctrl[0] = 1.0
        mujoco.mj_step(model, data, 2000)
        speeds.append(data.joint("elbow").qvel[0])
    assert speeds[1] == pytest.approx(speeds[0], rel=5e-3)


def test_inertia_that_is_given():
    """It is in the place of the joint's armature, which was the rotor's: it does not count twice."""
    model = geared(inertia=0.5)
    drive, load = (model.dof_armature[model.joint(name).dofadr[0]] for name in ("elbow drive", "elbow"))
    assert (drive, load) == (0.5, 0)


TUBE = """<mujoco><option timestep="1e-4" gravity="0 0 0"/><worldbody><site name="bushing"/>
    <body name="shaft"><inertial pos="0 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>
      <joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/><site name="axis"/></body></worldbody>
</mujoco>"""


def tube(damping=C):
    spec = mujoco.MjSpec.from_string(TUBE)
    physical.add_annular_clearance(spec, "axis", "bushing", GAP, K, damping)
    return spec


def test_annular_clearance():
    """Radial force k r in any direction, none within the gap; step 2/(δ + √(δ² + ω²)) of 2 kg + μ, apart or not."""
    model = physical.compile(tube())
    assert physical.check(model) == ()
    data = mujoco.MjData(model)
    for angle in np.linspace(0, 6, 7):
        direction = np.array([np.cos(angle), np.sin(angle)])
        data.qpos[:], data.qacc[:] = (GAP + 1e-3) * direction, 0
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(data.qfrc_inverse, K * 1e-3 * direction, rtol=1e-6, atol=1e-9)
    data.qpos[:] = 0.999 * GAP * direction
    mujoco.mj_forward(model, data)
    assert not data.qfrc_constraint.any()
    mass = 2 + 1e-4 / (1 - 1e-4) / model.tendon_invweight0[0]
    decay = C / (2 * mass)
    for pose in ((0, 0), (GAP, 0)):
        assert physical.largest_step(model, pose) == pytest.approx(2 / (decay + np.sqrt(decay**2 + K / mass)), rel=1e-9)


def test_whirl():
    """A mass that goes round in the bushing without damping: m ω² (gap + r) = k r, within 1e-4."""
    model = physical.compile(tube(0.0))
    model.opt.timestep = 2e-5
    data, radius = mujoco.MjData(model), GAP + 2e-3
    omega = np.sqrt(K * 2e-3 / (2 * radius))
    data.qpos[0], data.qvel[1] = radius, omega * radius
    angle = [0.0]
    for _ in range(20000):
        mujoco.mj_step(model, data)
        angle.append(np.arctan2(data.qpos[1], data.qpos[0]))
    assert np.unwrap(angle)[-1] / data.time == pytest.approx(omega, rel=1e-4)


def test_coinciding_sites_without_apply_are_named():
    model = tube().compile()
    (line,) = physical.check(model)
    assert 'tendon limit "axis in bushing" is rigid' in line
    physical.apply(model)
    assert physical.check(model) == ()


REFUSED = {
    "negative gap": (lambda s: physical.add_backlash(s, "elbow", -0.01, K, C), "gap -0.01 must be > 0"),
    "no armature": (lambda s: physical.add_backlash(s, "shoulder", GAP, K, C), '"shoulder" has no armature: give in'),
    "inertia": (lambda s: physical.add_backlash(s, "elbow", GAP, K, C, inertia=0.0), "inertia of the drive > 0, got 0"),
    "unknown": (lambda s: physical.add_backlash(s, "knee", GAP, K, C), 'no joint "knee"'),
    "stiffness": (lambda s: physical.add_backlash(s, "elbow", GAP, 0.0, C), "k = 0"),
    "twice": (lambda s: [physical.add_backlash(s, "elbow", GAP, K, C, 1.0) for _ in "ab"], '"elbow" has backlash al'),
    "model": (lambda s: physical.add_backlash(s.compile(), "elbow", GAP, K, C), "a compiled model cannot get new"),
    "free": (
        lambda s: physical.add_backlash(s, flying(s), GAP, K, C),
        'joint "flying" is free; backlash needs a hinge or slide',
    ),
    "site": (lambda s: physical.add_annular_clearance(s, "tip", "hole", GAP, K, C), 'no site "hole"'),
    "one body": (lambda s: physical.add_annular_clearance(s, "tip", "wrist", GAP, K, C), "are on one rigid body"),
    "no gap": (lambda s: physical.add_annular_clearance(s, "tip", "tip", np.nan, K, C), "gap nan must be > 0"),
}


def flying(spec):
    (joint,) = spec.body("ball").joints
    joint.name = "flying"
    return joint


@pytest.mark.parametrize("what", REFUSED)
def test_refusals(what):
    act, part = REFUSED[what]
    with pytest.raises((ModelError, LawError), match=part):
        act(arm())


def test_refused_backlash_leaves_the_specification_alone():
    spec = arm()
    before = spec.to_xml()
    for wrong in ({"k": 0.0}, {"c": -1.0}, {"gap": -1.0}, {"inertia": -1.0}):
        with pytest.raises((LawError, ModelError)):
            physical.add_backlash(spec, "elbow", **{"gap": GAP, "k": K, "c": C} | wrong)
    assert spec.to_xml() == before
