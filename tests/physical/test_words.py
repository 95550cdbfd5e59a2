"""Contacts, play and robots in the words that users have: restitution, damping ratio, friction, degrees of backlash."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.clearance import ContactLaw, HuntCrossley
from clearance_mj.core.errors import LawError, ModelError
from clearance_mj.physical.damping import damping_ratio_of, restitution_of

from .stepping import settled, with_data

pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")

BALLS = """<mujoco><option timestep="2e-5" gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="5 5 1"/>
  <body pos="0 0 .101"><freejoint/><geom name="light" size=".1" mass="1"/></body>
  <body pos="1 0 .101"><freejoint/><geom name="heavy" size=".1" mass="10"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(("ratio", "out"), [(0.1, 0.744079), (0.3, 0.450975), (0.5, 0.298436), (1.0, np.exp(-2))])
def test_restitution_of_a_damping_ratio(ratio, out):
    """The values are those of tests/verification/test_impact.py, by an ODE solver."""
    assert restitution_of(ratio) == pytest.approx(out, abs=1e-6)
    assert damping_ratio_of(None, None, restitution_of(ratio)) == pytest.approx(ratio, rel=1e-6)
    assert damping_ratio_of(None, None, restitution_of(20 * ratio)) == pytest.approx(20 * ratio, rel=1e-6)


@pytest.mark.parametrize("restitution", [1.0, 0.6, 0.1])
def test_balls_rebound_as_asked(restitution):
    """Whatever their mass, and after it has changed."""
    spec = mujoco.MjSpec.from_string(BALLS)
    physical.contact(spec, "floor", k=1e5, restitution=restitution, frictionless=True)
    for mass in (10, 3):
        spec.geom("heavy").mass = mass
        model, data = with_data(physical.compile(spec))
        data.qvel[[2, 8]] = -0.5
        mujoco.mj_step(model, data, 3000)
        np.testing.assert_allclose(data.qvel[[2, 8]], 0.5 * restitution, rtol=4e-3)
        assert not [line for line in physical.check(model) if "was asked" in line]
    np.testing.assert_allclose(data.qvel[[0, 1, 3, 4, 5]], 0, atol=1e-9)


@pytest.mark.parametrize(("given", "says"), [
    ({"c": 1.0, "restitution": 0.5}, "give one of c, damping_ratio and restitution, got c and restitution"),
    ({"restitution": 1.2}, "restitution 1.2 must be > 0 and <= 1"),
    ({"damping_ratio": -1.0}, "damping_ratio -1.0 must be finite and >= 0"),
    ({}, "give a stiffness k and a damping c, or a law; damping_ratio or restitution may"),
])  # fmt: skip
def test_damping_that_cannot_be(given, says):
    with pytest.raises(LawError, match=says):
        physical.contact(mujoco.MjSpec.from_string(BALLS), ("light", "floor"), k=1e5, frictionless=True, **given)


def numbers_of_frictions(model):
    return [(f.name, *model.numeric_data[f.numeric :][: f.size]) for f in physical.bristles.bristles_of(model)]


def test_friction_in_the_same_call():
    """As by `friction` with the contact's numbers; contacts of a geom also rub on what comes later."""
    specs = [mujoco.MjSpec.from_string(BALLS) for _ in range(2)]
    physical.contact(specs[0], "floor", k=1e5, c=30.0, friction=0.5, torsion=0.01)
    physical.contact(specs[1], "floor", k=1e5, c=30.0, frictionless=True)
    physical.friction(specs[1], [("floor", "light"), ("floor", "heavy")], 0.5, 1e5, 30.0, 0.01)
    one, other = (physical.compile(spec) for spec in specs)
    np.testing.assert_array_equal(one.pair_friction, other.pair_friction)
    assert numbers_of_frictions(one) == numbers_of_frictions(other)
    specs[0].worldbody.add_body(name="late", pos=[2, 0, 0.1]).add_freejoint()
    specs[0].body("late").add_geom(name="late", size=[0.1, 0, 0], mass=1)
    model = physical.compile(specs[0])
    assert model.pair("floor - late").dim == 4
    np.testing.assert_array_equal(model.numeric("physical:friction:pair:floor - late").data, (0.5, 1e5, 30.0, 0.01))


LEG = """<mujoco><option timestep="5e-4" integrator="implicitfast"/><worldbody>
  <body name="hip"><joint name="hip" axis="0 1 0" armature="0.01"/>
    <geom type="capsule" fromto="0 0 0 0 0 -.2" size=".02" mass=".5" contype="0" conaffinity="0"/>
    <body name="knee" pos="0 0 -.2"><joint name="knee" axis="0 1 0" armature="0.02"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.2" size=".02" mass=".3" contype="0" conaffinity="0"/></body></body>
</worldbody>
<actuator><position name="a" joint="hip" kp="50" kv="1"/><position name="b" joint="knee" kp="50" kv="1"/></actuator>
<keyframe><key qpos="0.3 -0.5" ctrl="0.3 -0.5"/></keyframe></mujoco>"""


def test_backlash_of_several_joints_at_once():
    """In degrees from side to side, as catalogues have it: the same model as by one call each with half of it."""
    one, other = (mujoco.MjSpec.from_string(LEG) for _ in range(2))
    drives = physical.add_backlash(one, ["hip", "knee"], backlash=1.0, k=500.0, damping_ratio=0.1)
    for joint in ("hip", "knee"):
        physical.add_backlash(other, joint, np.deg2rad(0.5), 500.0, damping_ratio=0.1)
    assert [drive.name for drive in drives] == ["hip drive", "knee drive"]
    first, second = physical.compile(one), physical.compile(other)
    places = {first.joint(i).name: first.key_qpos[0, i] for i in range(4)}
    assert places == {"hip": 0.3, "hip drive": 0.3, "knee": -0.5, "knee drive": -0.5}
    for name in ("tendon_range", "tendon_solref_lim", "key_qpos", "actuator_trnid", "dof_armature"):
        np.testing.assert_allclose(getattr(first, name), getattr(second, name), rtol=1e-12)
    # c = 2 ζ √(k m) of the drive and the load, whose inertias MuJoCo knows in the initial pose
    k, c = physical.stiffness_damping(first.tendon_solref_lim[0], 1e-4, first.tendon_invweight0[0])
    assert c == pytest.approx(0.2 * np.sqrt(k / first.tendon_invweight0[0]), rel=1e-6)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "discrete"])
def test_native_backlash_needs_no_row_of_the_solver(integrator):
    """Under a torque the motor is by gap + τ/k ahead, in every integrator at 2 ms, with MuJoCo's own spring."""
    try:
        spec = mujoco.MjSpec.from_string(LEG.replace('"implicitfast"', f'"{integrator}"').replace("5e-4", "2e-3"))
    except ValueError:
        pytest.skip("this MuJoCo has no such integrator")
    spec.option.gravity = [0, 0, 0]
    spec.joint("knee").stiffness, spec.joint("knee").damping = [50, 0, 0], [0.2, 0, 0]
    physical.add_backlash(spec, "knee", backlash=2.0, k=200.0, c=0.3, native=True)
    model = physical.compile(spec)
    assert not model.tendon_limited.any() and model.nuserdata == 0
    data = settled(model, 5000, softened=False, ctrl=(0.0, 0.5))
    assert data.nefc == 0
    ahead = data.joint("knee drive").qpos[0] - data.joint("knee").qpos[0]
    assert ahead == pytest.approx(np.deg2rad(1.0) + 50 * data.joint("knee").qpos[0] / 200.0, rel=1e-6)
    with pytest.raises(ModelError, match="give k and c"):
        physical.add_backlash(spec, "hip", backlash=2.0, k=200.0, damping_ratio=0.1, native=True)


@pytest.mark.skipif(not hasattr(mujoco.MjModel, "jnt_springyield"), reason="springs yield from MuJoCo 4 on")
def test_native_friction_of_a_joint():
    """Sticks by τ/k below the force and is braked by it above, without a Softener: terminal speed (τ - force)/c."""
    spec = mujoco.MjSpec.from_string(LEG)
    spec.option.gravity = [0, 0, 0]
    spec.delete(spec.keys[0])
    spec.delete(spec.actuator("b"))
    physical.joint_friction(spec, "knee", 1.0, k=200.0, c=0.5, native=True)
    spec.add_actuator(name="m", target="knee", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    model, data = with_data(physical.compile(spec))
    for torque in (0.4, 0.8, 1.4):
        before = data.ctrl[1]
        for fraction in np.linspace(0, 1, 100):
            data.ctrl[1] = before + fraction * (torque - before)
            mujoco.mj_step(model, data, 10)
        mujoco.mj_step(model, data, 4000)
        if torque < 1:
            assert data.joint("knee").qpos[0] == pytest.approx(torque / 200, rel=1e-3)
    assert data.joint("knee").qvel[0] > 0.1
    with pytest.raises(ModelError, match='joint "knee" has a spring already'):
        physical.joint_friction(spec, "knee", 1.0, k=200.0, native=True)


def test_a_step_that_is_too_long_says_what_it_allows():
    """A mass on a limit: h < 2/(δ + √(δ² + ω²)); with the k and c that are named the model compiles."""
    spec = mujoco.MjSpec.from_string(BALLS)
    spec.option.timestep = 0.01
    physical.contact(spec, ("light", "floor"), k=1e5, c=30, frictionless=True)
    with pytest.raises(ModelError, match=r"at this step up to k = (\S+) and c = (\S+);") as refused:
        physical.compile(spec)
    words = str(refused.value).replace(";", "").split()
    k, c = (float(words[words.index(name) + 2]) for name in ("k", "c"))
    physical.contact(spec, ("light", "floor"), k=0.99 * k, c=0.99 * c, frictionless=True)
    assert 0.01 < physical.largest_step(physical.compile(spec)) < 0.0102


def test_drives_of_several_actuators_at_once():
    one, other = (mujoco.MjSpec.from_string(LEG) for _ in range(2))
    physical.add_drive(one, ["a", "b"], backlash=1.0, k=500.0, c=1.0)
    for actuator in ("a", "b"):
        physical.add_drive(other, actuator, np.deg2rad(0.5), 500.0, 1.0)
    first, second = physical.compile(one), physical.compile(other)
    np.testing.assert_array_equal(first.numeric_data, second.numeric_data)
    np.testing.assert_array_equal(first.key_qpos, second.key_qpos)
    assert (first.nq, first.nu) == (2, 2)


def test_damping_ratio_of_a_drive():
    """c = 2 ζ √(k m), m of the rotor and of the load without it against each other."""
    spec = mujoco.MjSpec.from_string(LEG)
    load = 1 / spec.compile().dof_invweight0[1] - 0.02
    physical.add_drive(spec, "b", gap=0.0, k=2000.0, damping_ratio=0.05)
    numbers = next(physical.drives.drives(physical.compile(spec))).numbers(spec.compile())
    assert float(numbers["c"]) == pytest.approx(0.1 * np.sqrt(2000.0 / (1 / 0.02 + 1 / load)), rel=1e-6)


@pytest.mark.parametrize(("wrong", "says"), [
    (lambda spec: physical.add_backlash(spec, "hip", k=1.0, c=1.0), "give gap, to either side"),
    (lambda spec: physical.add_backlash(spec, "hip", 0.1, 1.0, 1.0, backlash=1.0), "give gap, to either side"),
    (lambda spec: physical.add_backlash(spec, "hip", k=1.0, c=1.0, backlash="1°"), "must be a number of degrees"),
    (lambda spec: physical.robot(spec, backlash=1.0), "give teeth"),
    (lambda spec: physical.contact(spec.compile(), "x", k=1.0, c=1.0, friction=1.0), "must be given to the MjSpec"),
])  # fmt: skip
def test_words_that_cannot_be(wrong, says):
    spec = mujoco.MjSpec.from_string(LEG)
    before = spec.to_xml()
    with pytest.raises(ModelError, match=says):
        wrong(spec)
    assert spec.to_xml() == before


QUADRUPED = """<mujoco><option timestep="5e-4" integrator="implicitfast"/><worldbody>
  <geom name="floor" type="plane" size="5 5 1"/><body name="trunk" pos="0 0 .32"><freejoint/>
    <geom type="box" size=".2 .1 .05" mass="12" contype="0" conaffinity="0"/>{legs}</body>
</worldbody><actuator>{servos}</actuator></mujoco>"""
ONE_LEG = """<body pos="{x} {y} 0"><joint name="{n} hip" axis="0 1 0" ref="0" armature=".01"/>
  <geom type="capsule" fromto="0 0 0 0 0 -.15" size=".02" mass=".5" contype="0" conaffinity="0"/>
  <body pos="0 0 -.15"><joint name="{n} knee" axis="0 1 0" armature=".01"/>
    <geom type="capsule" fromto="0 0 0 0 0 -.15" size=".015" mass=".2" contype="0" conaffinity="0"/>
    <geom name="{n}" size=".02" pos="0 0 -.15" mass=".05"/></body></body>"""


def quadruped():
    places = {"fl": (0.15, 0.1), "fr": (0.15, -0.1), "rl": (-0.15, 0.1), "rr": (-0.15, -0.1)}
    legs = "".join(ONE_LEG.format(n=n, x=x, y=y) for n, (x, y) in places.items())
    servo = '<position name="{0}" joint="{0}" kp="400" kv="5"/>'
    servos = "".join(servo.format(f"{n} {joint}") for n in places for joint in ("hip", "knee"))
    return mujoco.MjSpec.from_string(QUADRUPED.format(legs=legs, servos=servos)), list(places)


def test_a_robot_stands_as_deep_as_its_feet_are_stiff():
    """At rest each foot of k is in the ground by a quarter of the weight over k; policies see the same coordinates."""
    spec, feet = quadruped()
    plain = spec.compile()
    model = physical.robot(spec, feet, k=2e4, damping_ratio=0.5, friction=0.8, backlash=0.4, teeth=2000.0)
    assert (model.nq, model.nv, model.nu) == (plain.nq, plain.nv, plain.nu)
    data = settled(model, 4000)
    depth = [0.02 - data.geom(foot).xpos[2] for foot in feet]
    assert np.mean(depth) == pytest.approx(9.81 * model.body_subtreemass[1] / 4 / 2e4, rel=2e-3)


def test_feet_of_several_points_share_their_stiffness():
    """A block on a plane stands m g/k deep by its four corners together, whether c is given or a damping ratio."""
    xml = BALLS.replace('<geom name="light" size=".1"', '<geom name="light" type="box" size=".1 .1 .1"')
    for damping in ({"c": 200.0}, {"damping_ratio": 0.5}):
        spec = mujoco.MjSpec.from_string(xml)
        spec.option.gravity, spec.option.timestep = [0, 0, -9.81], 2e-4
        model = physical.robot(spec, ["light"], k=2e4, friction=0.5, **damping)
        assert 0.1 - settled(model, 5000).geom("light").xpos[2] == pytest.approx(9.81 / 2e4, rel=1e-4)


def test_friction_without_damping_has_none():
    """With c = 0 of a contact the bristles have none; beside a law of impacts they have a tenth of the critical one."""
    spec = mujoco.MjSpec.from_string(BALLS)
    physical.contact(spec, ("light", "floor"), k=1e4, c=0.0, friction=0.5)
    physical.contact(spec, ("heavy", "floor"), law=ContactLaw(HuntCrossley(1e6, 0.5)), friction=0.5)
    model = physical.compile(spec)
    light, heavy = (model.numeric(f"physical:friction:pair:floor - {name}").data for name in ("light", "heavy"))
    assert light[2] == 0.0
    assert heavy[2] == pytest.approx(0.2 * np.sqrt(heavy[1] * 10.0), rel=1e-6)
