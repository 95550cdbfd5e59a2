"""Implicit contacts, limits and teeth: backward Euler, whose step is written out here for each case."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import LawError, ModelError

from .stepping import with_data

STEP = 4e-3  # s


def mass_on_floor(**options):
    spec = mujoco.MjSpec.from_string(f"""
    <mujoco><option timestep="{STEP}"/><worldbody><geom name="floor" type="plane" size="1 1 1" condim="1"/>
      <body pos="0 0 0.05"><joint type="slide" axis="0 0 1"/><geom name="ball" size="0.05" mass="2" condim="1"/></body>
    </worldbody></mujoco>""")
    physical.contact(spec, ("ball", "floor"), **options)
    return physical.compile(spec)


@pytest.mark.parametrize("k", [2e3, 15e3, 1e6, 1e8])  # N/m; explicit the step would have to be below 2/ω: 0.3 ms at 1e8
def test_a_contact_is_backward_eulers(k):
    c, mass, gravity = 40.0, 2.0, 9.81
    model = mass_on_floor(k=k, c=c, implicit=True)
    data, positions = mujoco.MjData(model), []
    data.qpos[0], data.qvel[0] = -5 * mass * gravity / k, 0.0
    z, v, expected = data.qpos[0], 0.0, []
    for _ in range(200):
        mujoco.mj_step(model, data)
        positions.append(data.qpos[0])
        # m (v₊ - v) = h f - h m g, f = max(-k (z + h v₊) - c v₊, 0), and the surfaces touch where z < 0
        v_free = v - STEP * gravity
        pressed = (mass * v_free - STEP * k * z) / (mass + STEP * c + STEP**2 * k)
        v = max(v_free, pressed) if z < 0 else v_free
        z += STEP * v
        expected.append(z)
    np.testing.assert_allclose(positions, expected, rtol=0, atol=3e-6 * abs(expected[-1]) + 1e-15)
    mujoco.mj_step(model, data, 3000)
    np.testing.assert_allclose(data.qpos[0], -mass * gravity / k, rtol=1e-5)


def two_inertias(k, c, gap, rotor=0.005, load=0.002, step=STEP):
    spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody>
      <body><joint name="j" axis="0 0 1" armature="{rotor}"/>
        <geom type="sphere" size="0.01" mass="0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 {load}"/></body>
    </worldbody><actuator><motor name="m" joint="j"/></actuator></mujoco>""")
    physical.add_backlash(spec, "j", gap=gap, k=k, c=c, implicit=True)
    return physical.compile(spec)


@pytest.mark.parametrize("k", [120.0, 1e4, 1e5])  # N m/rad
def test_teeth_with_rotor_and_load_are_backward_eulers(k):
    c, gap, rotor, load = 0.08, 5e-3, 0.005, 0.002
    model = two_inertias(k, c, gap)
    assert not physical.check(model)
    data, positions = mujoco.MjData(model), []
    q, v, expected = np.zeros(2), np.zeros(2), []  # load, rotor
    inertias, towards = np.array([load, rotor]), np.array([1.0, -1.0])
    for i in range(300):
        torque = 0.3 * np.sin(0.05 * i)
        data.ctrl[0] = torque
        mujoco.mj_step(model, data)
        positions.append((data.joint("j").qpos[0], data.joint("j drive").qpos[0]))
        free = v + STEP * np.array([0.0, torque]) / inertias
        apart = towards @ q
        side = np.sign(apart) if abs(apart) > gap else 0.0
        softer = 1 + (STEP * c + STEP**2 * k) * np.sum(1 / inertias)
        force = -(side * k * (abs(apart) - gap) + (c + STEP * k) * (towards @ free)) / softer
        force = side * min(side * force, 0.0) if side else 0.0
        v = free + STEP * force * towards / inertias
        q = q + STEP * v
        expected.append(q)
    assert np.ptp(np.diff(expected, axis=1)) > 1.5 * gap, "the teeth have not met on both sides"
    np.testing.assert_allclose(positions, expected, rtol=0, atol=2e-5 * np.abs(expected).max())


def test_at_rest_the_step_does_not_matter():
    k, torque = 120.0, 0.4
    for step in (1e-4, 4e-3, 2e-2):
        spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody>
          <body><joint name="j" axis="0 0 1" armature="0.005" range="-10 5"/>
            <geom type="capsule" size="0.02" fromto="0 0 0 0.2 0 0" mass="0.3"/></body>
        </worldbody><actuator><motor joint="j"/></actuator></mujoco>""")
        physical.joint_limit(spec, "j", k=50, damping_ratio=0.3, implicit=True)
        physical.add_backlash(spec, "j", gap=5e-3, k=k, damping_ratio=0.1, implicit=True)
        model, data = with_data(physical.compile(spec))
        data.ctrl[0] = torque
        mujoco.mj_step(model, data, round(4 / step))
        load, rotor = data.joint("j").qpos[0], data.joint("j drive").qpos[0]
        np.testing.assert_allclose(load - np.deg2rad(5), torque / 50, rtol=1e-5)
        np.testing.assert_allclose(rotor - load, 5e-3 + torque / k, rtol=1e-5)


def test_what_was_asked_is_kept_in_the_file_and_follows_the_step():
    model = two_inertias(120.0, 0.08, 5e-3)
    model.opt.timestep = 1e-3
    assert any("use compile() or apply()" in line for line in physical.check(model))
    physical.apply(model)
    assert not physical.check(model)
    expected = two_inertias(120.0, 0.08, 5e-3, step=1e-3)
    np.testing.assert_allclose(model.tendon_solimp_lim[0, 0], expected.tendon_solimp_lim[0, 0], rtol=1e-5)


def test_what_cannot_be_implicit_is_refused():
    from clearance_mj.clearance import ContactLaw, KelvinVoigt

    with pytest.raises(LawError, match="implicit=True needs a stiffness k and a damping, not a law"):
        mass_on_floor(law=ContactLaw(KelvinVoigt(1e4, 10.0)), implicit=True)
    with pytest.raises(ModelError, match="an implicit contact has neither friction nor shared points"):
        mass_on_floor(k=1e4, c=1, friction=0.5, implicit=True)
    with pytest.raises(ModelError, match=r"rigid at the time step 0.004 s; up to k = 1.25e\+09 can be implicit"):
        mass_on_floor(k=1e12, c=1, implicit=True)
    # just touching in the initial pose; 2/√(k/m) = 0.2828 ms
    with pytest.raises(ModelError, match=r"stable below 0.000283 s .*implicit=True makes it stable at any step"):
        mass_on_floor(k=1e8, c=1e-3)


def test_a_quadruped_with_soft_gears_stands_at_a_step_of_4_ms():
    spec = mujoco.MjSpec.from_file("models/quadruped.xml")
    spec.option.timestep = STEP
    feet = ["FL_foot", "FR_foot", "RL_foot", "RR_foot"]
    given = {"k": 15e3, "damping_ratio": 0.1, "friction": 0.8, "backlash": 0.5, "teeth": 120.0}  # N/m, degrees, N m/rad
    with pytest.raises(ModelError, match=r"timestep 0\.004 s is too long"):
        physical.robot(spec, feet, **given)
    model, data = with_data(physical.robot(spec, feet, **given, implicit=True))
    mujoco.mj_resetDataKeyframe(model, data, 0)
    with physical.Softener(model):
        mujoco.mj_step(model, data, 4000)  # 16 s, in which it comes to rest, as with short steps
    assert np.abs(data.qvel).max() < 1e-3
    radius = model.geom("FL_foot").size[0]
    depths = np.array([radius - data.geom(foot).xpos[2] for foot in feet])
    np.testing.assert_allclose(depths.sum(), 9.81 * model.body_mass.sum() / 15e3, rtol=1e-4)
    pressed = 0
    for joint in (model.joint(i).name for i in range(model.njnt) if model.joint(i).name.endswith(" drive")):
        joint = joint.removesuffix(" drive")
        apart = data.joint(f"{joint} drive").qpos[0] - data.joint(joint).qpos[0]
        torque = data.joint(f"{joint} drive").qfrc_actuator[0]
        if abs(apart) > np.deg2rad(0.25):
            pressed += 1
            expected = np.sign(torque) * np.deg2rad(0.25) + torque / 120
            np.testing.assert_allclose(apart, expected, rtol=1e-3, atol=1e-5, err_msg=joint)
    assert pressed >= 8, "thighs and knees bear the weight"
