"""Robots as users have them: feet, friction, play, servos, sensors and saved files, each against its closed form.

Six small models of the usual kinds are made here. Those of Menagerie, as MuJoCo Playground has them, come with the
package ``playground``, of which only the files are read (``make test-models``); their meshes are left out.
"""

import importlib.util
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.physical.drives import drives
from clearance_mj.physical.elements import pairs_of
from clearance_mj.physical.limits import colliding_pairs

pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")

K, C, MU = 2e4, 20.0, 0.7  # N/m, N s/m
GAP, TEETH, TEETH_C = 4e-3, 150.0, 0.05  # rad (m), N m/rad (N/m), N m s/rad (N s/m)
LEG = """
<body name="{name} thigh" pos="{at}"><joint name="{name} hip" axis="0 1 0" range="-90 90" armature=".01" damping=".2"/>
  <geom type="capsule" fromto="0 0 0 0 0 -.2" size=".02" mass=".5"/>
  <body name="{name} shin" pos="0 0 -.2"><joint name="{name} knee" axis="0 1 0" range="-120 120" armature=".01"
    damping=".2"/><geom type="capsule" fromto="0 0 0 0 0 -.18" size=".015" mass=".3"/>{foot}</body></body>"""
BALL = '<geom name="{name} foot" pos="0 0 -.18" size=".025" mass=".1"/>'
SOLE = '<geom name="{name} foot" type="box" pos=".02 0 -.19" size=".06 .03 .01" mass=".2"/>'
BASE = """<mujoco><option timestep="2e-4" integrator="implicitfast"/><worldbody>
  <geom name="floor" type="plane" size="5 5 1"/><body name="trunk" pos="0 0 {height}"><freejoint/>
  <geom type="box" size=".2 .1 .05" mass="4"/>{legs}</body></worldbody>
  <actuator>{servos}</actuator><sensor>{sensors}</sensor></mujoco>"""
SERVO = '<position name="{0}" joint="{0}" kp="120" kv="2" {1}/>'


def legged(places, foot, height, ranges):
    legs = "".join(LEG.format(name=name, at=at, foot=foot.format(name=name)) for name, at in places.items())
    joints = [f"{name} {joint}" for name in places for joint in ("hip", "knee")]
    servos = "".join(SERVO.format(joint, ranges) for joint in joints)
    sensors = "".join(f'<jointpos joint="{joint}"/><jointvel joint="{joint}"/>' for joint in joints)
    text = BASE.format(height=height, legs=legs, servos=servos, sensors=sensors)
    return mujoco.MjSpec.from_string(text), [f"{name} foot" for name in places]


def quadruped():
    corners = {f"{x}{y}": f"{0.18 * x} {0.1 * y} 0" for x in (-1, 1) for y in (-1, 1)}
    return legged(corners, BALL, 0.404, 'forcerange="-25 25" ctrlrange="-2 2"')


def biped():
    return legged({"left": "0 .08 0", "right": "0 -.08 0"}, SOLE, 0.399, 'inheritrange="1"')


def wheels():
    wheel = """<body name="wheel {0}" pos="{1} {2} -.05"><joint name="wheel {0}" axis="0 1 0" armature=".004"/>
      <geom name="tyre {0}" type="ellipsoid" size=".06 .03 .06" mass=".4"/></body>"""
    legs = "".join(wheel.format(i, *at) for i, at in enumerate([(x, y) for x in (-0.15, 0.15) for y in (-0.12, 0.12)]))
    servos = "".join(f'<velocity name="{i}" joint="wheel {i}" kv=".5" ctrlrange="-20 20"/>' for i in range(4))
    xml = BASE.format(height=0.109, legs=legs, servos=servos, sensors="")
    return mujoco.MjSpec.from_string(xml), [f"tyre {i}" for i in range(4)]


FIXED = """<mujoco><option timestep="2e-4" integrator="implicitfast"/><worldbody>{bodies}</worldbody>{rest}</mujoco>"""
LINK = """<body pos="{0} 0 0"><joint name="{1}" axis="0 1 0" range="-60 60" armature=".01" damping=".1"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass=".4" contype="0" conaffinity="0"/>"""


def arm():
    bodies = "".join(LINK.format(0.2 * (i > 0), f"joint {i}") for i in range(3)) + "</body>" * 3
    servo = '<position joint="joint {0}" name="{0}" kp="80" dampratio="1" inheritrange=".9"/>'
    rest = f"<actuator>{''.join(map(servo.format, range(3)))}</actuator>"
    return mujoco.MjSpec.from_string(FIXED.format(bodies=bodies, rest=rest)), []


def gripper():
    jaw = """<body pos="0 {0} 0"><joint name="{1}" type="slide" axis="0 {2} 0" range="-.02 .04" armature=".2"
      damping="5"/><geom size=".02" mass=".1" contype="0" conaffinity="0"/></body>"""
    rest = """<equality><joint joint1="right" joint2="left" polycoef="0 1 0 0 0"/></equality>
      <tendon><fixed name="both"><joint joint="left" coef=".5"/><joint joint="right" coef=".5"/></fixed></tendon>
      <actuator><position name="fingers" tendon="both" kp="400" kv="20" ctrlrange="0 .04"/></actuator>"""
    bodies = jaw.format(0.05, "left", 1) + jaw.format(-0.05, "right", -1)
    return mujoco.MjSpec.from_string(FIXED.format(bodies=bodies, rest=rest)), []


def hand():
    bodies = "".join(LINK.format(0, f"{f} 0") + LINK.format(0.2, f"{f} 1") + "</body></body>" for f in "ab")
    tendon = '<fixed name="{0}"><joint joint="{0} 0" coef="1"/><joint joint="{0} 1" coef=".7"/></fixed>'
    servo = '<position name="{0}" tendon="{0}" kp="40" kv="1" ctrlrange="-1 1"/>'
    tendons, servos = ("".join(map(part.format, "ab")) for part in (tendon, servo))
    rest = f"<tendon>{tendons}</tendon><actuator>{servos}</actuator>"
    return mujoco.MjSpec.from_string(FIXED.format(bodies=bodies, rest=rest)), []


def servos_with_play(spec):
    """Names of the actuators that a drive can be in, and their rotors' inertia where the joint has no armature."""
    model = spec.compile()

    def has_armature(actuator):
        on_joint = actuator.trntype != mujoco.mjtTrn.mjTRN_TENDON
        return on_joint and model.dof_armature[model.joint(actuator.target).dofadr[0]] != 0

    return {actuator.name: None if has_armature(actuator) else 0.02 for actuator in spec.actuators}


def built(spec, feet):
    """Return a specification with soft feet and drives."""
    if feet:
        ground = next(geom.name for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_PLANE)
        physical.contact(spec, [(foot, ground) for foot in feet], K, C, True, friction=MU, points="share")
    for name, inertia in servos_with_play(spec).items():
        physical.add_drive(spec, name, GAP, TEETH, TEETH_C, inertia)
    return spec


def teeth_torque(ahead, closing):
    up = np.maximum(TEETH * (ahead - GAP) + TEETH_C * closing, 0) * (ahead > GAP)
    return up + np.minimum(TEETH * (ahead + GAP) + TEETH_C * closing, 0) * (ahead < -GAP)


def march(model, feet, steps):
    """Step a robot; hold what feet and teeth exert against closed forms; return how often they did, and positions."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    ids, start = {model.geom(foot).id for foot in feet}, data.ctrl.copy()
    low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, (-9, 9)).T
    positions, acts, lengths, feet_of = [], [], [], []
    with physical.Softener(model):
        for step in range(steps):
            swing = 0.2 * np.sin(2 * np.pi * 3 * model.opt.timestep * step + np.arange(model.nu))
            data.ctrl[:] = np.clip(start + swing, low, high)
            mujoco.mj_step(model, data)
            positions.append(data.qpos.copy())
            acts.append(data.act.copy())
            lengths.append((data.actuator_length.copy(), data.actuator_velocity.copy()))
            feet_of += pressed_feet(model, data, ids)
    assert np.isfinite(positions).all()
    lengths, in_teeth = np.array(lengths), 0
    for drive in drives(model):
        state = physical.drive_state(model, np.array(acts), drive.name)
        load, speed = lengths[1:, :, drive.actuator].T / model.actuator_gear[drive.actuator, 0]
        expected = teeth_torque(state.angle[:-1] - load, state.speed[:-1] - speed)
        rounding = 1e-12 * np.abs(expected).max()
        np.testing.assert_allclose(state.load_torque[1:], expected, rtol=0, atol=rounding, err_msg=drive.name)
        in_teeth += np.count_nonzero(expected)
    normal, expected, across = np.array(feet_of).reshape(-1, 3).T
    np.testing.assert_allclose(normal, expected, rtol=0, atol=2e-6 * expected.max(initial=0.0))
    assert np.all(across <= (1 + 1e-4) * MU * normal + 1e-4 * expected.max(initial=0.0))
    return in_teeth, np.count_nonzero(normal > SMALL), np.array(positions)


SMALL = K * 1e-4  # N, force of 0.1 mm


def pressed_feet(model, data, ids):
    """Yield for each pair of a foot that touches what presses, by the solver and by the formula, and rubs, N."""
    points = {}
    for i, geoms in enumerate(data.contact.geom.tolist() if data.ncon else ()):
        if ids & set(geoms) and data.contact.efc_address[i] >= 0:
            points.setdefault(tuple(sorted(geoms)), []).append(i)
    for several in points.values():
        across, force, pressed, expected = np.zeros(3), np.zeros(6), 0.0, 0.0
        for i in several:
            contact, rows = data.contact[i], slice(data.contact[i].efc_address, None)
            speed = np.mean(data.efc_vel[rows][: 1 if model.opt.cone else 2 * (contact.dim - 1)])
            mujoco.mj_contactForce(model, data, i, force)
            expected += max(-K * contact.dist - C * speed, 0) / len(several)
            across, pressed = across + force[1:3] @ contact.frame.reshape(3, 3)[1:], pressed + force[0]
        yield pressed, expected, np.linalg.norm(across)


def shown_at_first(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data.sensordata


def right(spec, feet, steps):
    plain = spec.compile()
    made = built(spec.copy(), feet)
    model = physical.compile(made)
    assert len(list(drives(model))) == plain.nu > 0
    assert (model.nq, model.nv, model.nu, model.nsensor) == (plain.nq, plain.nv, plain.nu, plain.nsensor)
    for field in ("ctrlrange", "ctrllimited", "gainprm", "biasprm", "gear"):  # the servos are what they were
        np.testing.assert_array_equal(getattr(model, f"actuator_{field}"), getattr(plain, f"actuator_{field}"), field)
    with_play, without = (shown_at_first(each) for each in (model, plain))
    joints = np.isin(plain.sensor_type, (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtSensor.mjSENS_FRAMEPOS))
    places = np.repeat(joints, plain.sensor_dim)
    np.testing.assert_allclose(with_play[places], without[places], atol=1e-12)
    in_teeth, on_feet, positions = march(model, feet, steps)
    assert in_teeth > steps // 4 and (not feet or on_feet > steps // 4)
    made.compiler.savecompiled = made.compiler.savecanonical = False
    saved = mujoco.MjModel.from_xml_string(made.to_xml())
    physical.apply(saved)
    np.testing.assert_allclose(march(saved, feet, 100)[2], positions[:100], atol=1e-6)


@pytest.mark.parametrize("make", [quadruped, biped, wheels, arm, gripper, hand])
def test_a_small_robot(make):
    right(*make(), 1500)


FEET_ONLY = "locomotion/{}/xmls/scene_mjx_feetonly_flat_terrain.xml"
SCENES = {name: FEET_ONLY.format(name) for name in ("apollo", "berkeley_humanoid", "g1", "go1", "spot", "t1")} | {
    "go1 with all contacts": "locomotion/go1/xmls/scene_mjx_fullcollisions_flat_terrain.xml",
    "h1": "locomotion/h1/xmls/scene_mjx_feetonly.xml",
    "op3": "locomotion/op3/xmls/scene_mjx_feetonly.xml",
    "aero hand": "manipulation/aero_hand/xmls/scene_mjx_cube.xml",
    "aloha": "manipulation/aloha/xmls/mjx_single_peg_insertion.xml",
    "leap hand": "manipulation/leap_hand/xmls/scene_mjx_cube.xml",
    "panda with robotiq": "manipulation/franka_emika_panda_robotiq/xmls/scene_panda_robotiq_cube.xml",
}


def foreign(name):
    """Return a scene of MuJoCo Playground without meshes and textures, and the geoms that stand on its floor."""
    package = importlib.util.find_spec("mujoco_playground")
    if package is None:
        pytest.skip("playground is not installed; its files are enough: pip install --no-deps playground")
    path = Path(package.submodule_search_locations[0]) / "_src" / SCENES[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        spec = mujoco.MjSpec.from_file(str(path))
    for geom in [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_MESH or geom.meshname]:
        spec.delete(geom)
    for material in spec.materials:
        for i in range(len(material.textures)):
            material.textures[i] = ""
    for made in (*spec.meshes, *spec.textures):
        spec.delete(made)
    model = spec.compile()
    floors = np.flatnonzero(model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)).tolist()
    pairs = [pair for pair in pairs_of(model) if pair & set(floors)]
    pairs = pairs or [pair for floor in floors for pair in colliding_pairs(model, floor)]
    feet = [model.geom(geom).name for pair in pairs for geom in pair - set(floors)]
    return spec, [foot for foot in feet if foot and "locomotion" in SCENES[name]]


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_a_robot_of_menagerie(name):
    spec, feet = foreign(name)
    spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, 5e-5
    right(spec, feet, 1500)


@pytest.mark.slow
def test_go1_with_soft_gears_runs_at_its_own_step_of_4_ms():
    spec, feet = foreign("go1")
    # in the file's Euler dampers are explicit, and one iteration of the solver leaves feet without their force
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.iterations, spec.option.ls_iterations = 100, 50
    assert spec.option.timestep == 4e-3
    given = {"k": 15e3, "damping_ratio": 0.2, "friction": 0.8, "backlash": 0.5, "teeth": 120.0}
    model = physical.robot(spec, feet, **given, implicit=True)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    with physical.Softener(model):
        mujoco.mj_step(model, data, 2000)
    assert np.abs(data.qvel).max() < 1e-3
    radius = model.geom("FR").size[0]
    depths = np.array([radius - data.geom(foot).xpos[2] for foot in feet])
    np.testing.assert_allclose(depths.sum(), 9.81 * model.body_mass.sum() / 15e3, rtol=1e-3)
