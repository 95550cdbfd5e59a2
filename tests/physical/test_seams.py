"""What MuJoCo's compiler derives, and what else of a model meets softness and play: ranges, gears, terrain, poses."""

import contextlib
import copy
import math
import pickle

import mujoco
import numpy as np
import pytest

from clearance_mj import ContactLaw, physical
from clearance_mj.clearance import KelvinVoigt
from clearance_mj.core.errors import ModelError
from clearance_mj.physical.rows import poses_of

from ..processes import run
from .stepping import settled, step_by_hand, with_data

pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")

ACTUATORS = """<mujoco><option timestep="2e-4"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
    <body><joint name="j" axis="0 1 0" armature=".1" range="-90 90"/>
      <geom name="hand" type="capsule" fromto="0 0 .1 .2 0 .1" size=".02"/></body></worldbody>
  <actuator>{actuator}</actuator></mujoco>"""
SERVO = '<position name="a" joint="j" kp="35" inheritrange="1" dampratio="1"/>'


def one_joint(actuator):
    return mujoco.MjSpec.from_string(ACTUATORS.format(actuator=actuator))


@pytest.mark.parametrize("inputs", ['input="pos"', 'input="pos vel"', 'ki="3"'])
def test_actuators_of_several_inputs(inputs):
    """From MuJoCo 4 on an actuator may have several controls: there are fewer actuators than ``nu``."""
    try:
        spec = one_joint(f'<pid name="a" joint="j" kp="100" kv="5" {inputs}/>')
    except ValueError:
        pytest.skip("this MuJoCo has no such actuator")
    specs = spec, one_joint('<position name="a" joint="j" kp="100" kv="5"/>')
    for each in specs:
        physical.contact(each, ("hand", "floor"), k=1e4, c=10, frictionless=True)
    pid, position = (physical.largest_step(physical.compile(each)) for each in specs)
    assert pid == pytest.approx(position, rel=1e-9)


@pytest.mark.parametrize("inertia", [None, 0.1])
@pytest.mark.parametrize("play", ["joint", "actuator"])
def test_ranges_and_damping_are_those_of_before(play, inertia):
    """``inheritrange`` is that of the joint, and the servo's damping 2 ζ √(k I) with the joint's whole inertia."""
    plain = one_joint(SERVO).compile()
    assert -plain.actuator_biasprm[0, 2] == pytest.approx(2 * math.sqrt(35 * (1 / plain.dof_invweight0[0])), rel=1e-9)
    spec = one_joint(SERVO)
    add, name = {"joint": (physical.add_backlash, "j"), "actuator": (physical.add_drive, "a")}[play]
    add(spec, name, 0.01, 100.0, 0.1, inertia)
    model = spec.compile()
    assert model.actuator_ctrllimited[0]
    for field in ("actuator_ctrlrange", "actuator_biasprm"):
        np.testing.assert_array_equal(getattr(model, field), getattr(plain, field))
    assert model.dof_armature[model.joint("j").dofadr[0]] == 0  # it was the rotor's


COUPLED = """<mujoco><worldbody><body><joint name="a" axis="0 0 1" armature=".01"/><geom size=".1"/></body>
    <body pos="1 0 0"><joint name="b" axis="0 0 1" armature=".01"/><geom size=".1"/></body></worldbody>
  <tendon><fixed name="both"><joint joint="a" coef=".5"/><joint joint="b" coef=".5"/></fixed></tendon>
  <equality>{equality}</equality><actuator>{actuator}</actuator></mujoco>"""
MIMIC = '<joint name="mimic" joint1="b" joint2="a"/>'


@pytest.mark.parametrize("equality, actuator, joint, says", [
    ("", '<motor name="m" tendon="both"/>', "a", 'driven by actuator "m" through tendon "both".*add_drive'),
    (MIMIC, '<motor name="m" joint="a"/>', "b", 'driven by equality "mimic".*tendon_limit'),
    ('<tendon name="t" tendon1="both"/>', "", "a", 'driven by equality "t"'),
])  # fmt: skip
def test_joints_that_something_else_drives(equality, actuator, joint, says):
    spec = mujoco.MjSpec.from_string(COUPLED.format(equality=equality, actuator=actuator))
    before = spec.to_xml()
    with pytest.raises(ModelError, match=says):
        physical.add_backlash(spec, joint, 0.01, 100.0, 0.1)
    assert spec.to_xml() == before


def test_the_leader_of_a_mimic_joint_can_have_play():
    spec = mujoco.MjSpec.from_string(COUPLED.format(equality=MIMIC, actuator='<motor name="m" joint="a"/>'))
    spec.option.gravity, spec.option.timestep = (0, 0, 0), 2e-4
    physical.add_backlash(spec, "a", 0.01, 100.0, 0.1)
    model, data = with_data(physical.compile(spec))
    data.qfrc_applied[model.joint("b").dofadr[0]] = -1.0  # held by the motor through the teeth and the equality
    data.ctrl[0] = 1.0
    for _ in range(20000):
        data.qvel[:] *= 0.999
        mujoco.mj_step(model, data)
    assert data.joint("a drive").qpos[0] - data.joint("a").qpos[0] == pytest.approx(0.01 + 1 / 100, rel=1e-3)


def test_a_change_that_fails_changes_nothing():
    """Here there is a body of the name that the added one would get."""
    spec = one_joint(SERVO)
    spec.worldbody.add_body(name="j drive").add_geom(name="tooth", size=[0.1, 0, 0])
    before = spec.to_xml()
    with pytest.raises(ModelError, match=r"cannot be changed.*repeated name"):
        physical.add_backlash(spec, "j", 0.01, 100.0, 0.1)
    assert spec.to_xml() == before


LEG = """<mujoco><option timestep="5e-4"/><worldbody>
  <body name="leg" pos="0 0 .06"><joint type="slide" axis="0 0 1"/><geom name="foot" size="0.05" mass="2"/></body>
  <geom name="floor" type="plane" size="5 5 1" pos="0 0 -1"/></worldbody></mujoco>"""


def test_ground_that_comes_later_is_as_soft():
    robot = mujoco.MjSpec.from_string(LEG)
    physical.contact(robot, "foot", k=1e4, c=100, frictionless=True)
    robot.worldbody.add_geom(name="ramp", type=mujoco.mjtGeom.mjGEOM_BOX, size=[1, 1, 0.1], pos=[0, 0, -0.1])
    late = robot.copy().compile()
    assert any('geom "foot" touches "ramp" with MuJoCo\'s softness' in line for line in physical.check(late))
    scene = mujoco.MjSpec()
    scene.option.timestep = 5e-4
    scene.worldbody.add_geom(name="rock", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1, 0, 0], pos=[0, 0, -0.9])
    scene.attach(robot, prefix="robot/", frame=scene.worldbody.add_frame())
    model = physical.compile(scene)
    assert physical.check(model) == ()
    assert -2 * 9.81 / sum(settled(model, 6000, softened=False).contact.dist) == pytest.approx(1e4, rel=1e-6)


def test_friction_that_comes_later_is_refused():
    smooth = LEG.replace('size="0.05"', 'size="0.05" condim="1"').replace("plane", 'plane" condim="1')
    robot = mujoco.MjSpec.from_string(smooth)
    physical.contact(robot, "foot", k=1e4, c=100)
    robot.worldbody.add_geom(name="ramp", type=mujoco.mjtGeom.mjGEOM_BOX, size=[1, 1, 0.1], pos=[0, 0, -0.1])
    with pytest.raises(ModelError, match="contact ramp - foot has friction"):
        physical.compile(robot)


def test_compiling_warns_of_what_spoils():
    spec = mujoco.MjSpec.from_string(LEG)
    physical.contact(spec, ("foot", "floor"), k=1e4, c=100, frictionless=True)
    physical.friction(spec, ("foot", "floor"), 0.5, k=1e4, c=10)
    with pytest.warns(physical.ModelWarning, match='friction of pair "floor - foot" does not act until a Softener'):
        physical.compile(spec)
    spec.option.integrator = getattr(mujoco.mjtIntegrator, "mjINT_DISCRETE", spec.option.integrator)
    if hasattr(mujoco.mjtIntegrator, "mjINT_DISCRETE"):
        with pytest.warns(physical.ModelWarning, match="integrator discrete"):
            physical.compile(spec)


BENT = """<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody>
  <body><joint name="shoulder" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 1 0 0" size=".02" mass="1"/>
    <body pos="1 0 0"><joint name="elbow" axis="0 1 0" range="-90 90"/>
      <geom type="capsule" fromto="0 0 0 0 0 1" size=".02" mass="1"/></body></body></worldbody></mujoco>"""


def test_a_step_that_is_too_long_in_another_pose():
    """The inertia behind the shoulder's teeth is least with the arm straight, 0.58 kg m² instead of 1.33 kg m²."""
    limit = []
    for qpos in ((0.0, 0.0, 0.0), (0.0, math.radians(90), 0.0)):
        spec = mujoco.MjSpec.from_string(BENT.format(step=1e-5))
        physical.add_backlash(spec, "shoulder", 0.01, 5000.0, 5.0, 1.0)
        model = physical.compile(spec)
        limit.append(physical.largest_step(model, [qpos]))
    bent, straight = limit
    assert straight < 0.9 * bent
    spec.option.timestep = (straight + bent) / 2
    with pytest.warns(physical.ModelWarning, match="timestep .* is too long.*which the joints' ranges allow"):
        model = physical.compile(spec)
    assert any("is too long" in line for line in physical.check(model))
    assert not any("is too long" in line for line in physical.check(model, [(0.0, 0.0, 0.0)]))


BALLS_AND_CHAIN = """<mujoco><option timestep="1e-5"/><worldbody><geom name="floor" type="plane" size="9 9 1"/>{balls}
  <body pos="9 0 5"><joint name="j" axis="0 1 0" stiffness="100" damping="1"/><geom size=".1"/>
    <body pos="0 0 -1"><joint axis="0 1 0" stiffness="900"/><geom size=".2"/></body></body></worldbody></mujoco>"""


def test_steps_of_parts_are_those_of_the_whole():
    """Independent balls and a chain: the longest step of all velocities at once, without the cut into parts."""
    ball = '<body pos="{0} 0 0.0999"><freejoint/><geom name="b{0}" size=".1" mass="{1}"/></body>'
    spec = mujoco.MjSpec.from_string(BALLS_AND_CHAIN.format(balls="".join(ball.format(i, 1 + i) for i in range(4))))
    physical.contact(spec, [(f"b{i}", "floor") for i in range(4)], k=1e6, c=20, frictionless=True)
    model = physical.compile(spec)
    (pose,) = poses_of(model, None)
    rows = [row for row in pose.together if row.kind == "constraint" or row.k]
    direction = np.array([row.direction for row in rows])
    mass, k = (direction.T @ np.diag([getattr(row, name) for row in rows]) @ direction for name in ("mass", "k"))
    c = direction.T @ np.diag([row.c * (row.kind == "constraint") for row in rows]) @ direction
    damped = np.diag(model.dof_damping)  # implicit in Euler

    def grows(h):
        """The step's matrix, v₊ = v + h (M + h D)⁻¹ M M'⁻¹ (-K q - (C + D) v), q₊ = q + h v₊, has a radius over 1."""
        late = np.linalg.solve(pose.mass + h * damped, pose.mass @ np.linalg.inv(pose.mass + mass))
        faster = np.hstack((-h * late @ k, np.eye(len(k)) - h * late @ (c + damped)))
        whole = np.vstack((np.hstack((np.eye(len(k)), np.zeros_like(k))) + h * faster, faster))
        return np.abs(np.linalg.eigvals(whole)).max() > 1 + 1e-7

    step = physical.largest_step(model)
    assert not grows(0.999 * step)
    assert grows(1.001 * step)


def test_identification_is_there_at_first_use():
    script = "from clearance_mj import physical; print(physical.identification.__name__)"
    assert run("-c", script).stdout.strip() == "clearance_mj.physical.identification"


def test_a_missing_package_is_named():
    script = """import sys; sys.modules['numba'] = None
from clearance_mj import physical
try: physical.Softener
except Exception as error: print(type(error).__name__, error)"""
    words = run("-c", script).stdout
    assert "ModelError" in words and "numba" in words


def slipping(force=1.0):
    spec = mujoco.MjSpec.from_string(LEG.replace('axis="0 0 1"/>', 'axis="0 0 1"/><joint type="slide" axis="1 0 0"/>'))
    spec.option.gravity = (force, 0, -9.81)
    spec.geom("floor").pos = (0, 0, 0.01)
    physical.contact(spec, ("foot", "floor"), k=1e4, c=200, frictionless=True)
    physical.friction(spec, ("foot", "floor"), 0.5, k=1e4, c=50)
    return spec


@pytest.mark.parametrize("kind", ["itself", "copied", "pickled", "saved", "of a saved one"])
def test_copies_in_a_softener(kind, tmp_path):
    """They stick where the bristles are bent by m g / k; a pickled or saved copy has no signature."""
    model = physical.compile(slipping())
    mujoco.mj_saveModel(model, str(tmp_path / "model.mjb"))
    saved = mujoco.MjModel.from_binary_path(str(tmp_path / "model.mjb"))
    softened, stepped = {
        "itself": (model, model), "copied": (model, copy.copy(model)), "saved": (model, saved),
        "pickled": (model, pickle.loads(pickle.dumps(model))), "of a saved one": (saved, model),
    }[kind]  # fmt: skip
    at_once, by_hand, softener = mujoco.MjData(stepped), mujoco.MjData(stepped), physical.Softener(softened)
    with softener:
        mujoco.mj_step(stepped, at_once, 6000)
    for _ in range(6000):
        step_by_hand(stepped, by_hand, softener)
    assert (at_once.qpos[1], by_hand.qpos[1]) == pytest.approx((2 / 1e4, 2 / 1e4), rel=1e-6)


def test_hundreds_of_softeners_at_once():
    models = [physical.compile(slipping(1 + i)) for i in range(3)]
    with contextlib.ExitStack() as stack:
        for model in (copy.copy(models[i % 2]) for i in range(200)):
            stack.enter_context(physical.Softener(model))
        stack.enter_context(physical.Softener(models[2]))
        data = mujoco.MjData(models[2])
        mujoco.mj_step(models[2], data, 6000)
    assert data.qpos[1] == pytest.approx(2 * 3 / 1e4, rel=1e-6)
    assert mujoco.get_mjcb_control() is None


def test_derivatives_of_a_step_with_friction():
    """A stuck foot on bristles is a linear spring and damper across: MuJoCo's derivatives are those of that step."""
    model = physical.compile(slipping(0.0))
    data, h = mujoco.MjData(model), model.opt.timestep
    data.qvel[1] = 1e-3
    with physical.Softener(model):
        mujoco.mj_step(model, data, 400)
        twin = copy.copy(data)
        a, b = np.zeros((4, 4)), np.zeros((4, model.nu))
        mujoco.mjd_transitionFD(model, data, 1e-6, True, a, b, None, None)
        np.testing.assert_array_equal(data.qpos, twin.qpos)
        mujoco.mj_step(model, data, 50)
        mujoco.mj_step(model, twin, 50)
    np.testing.assert_array_equal(data.qpos, twin.qpos)
    np.testing.assert_array_equal(data.userdata, twin.userdata)
    # the bristles bend by h v before they press: v+ = v - h/m (k h + c) v; the place itself bends nothing
    assert a[3, 1] == pytest.approx(0.0, abs=1e-4)
    assert a[3, 3] == pytest.approx(1 - h / 2 * (1e4 * h + 50), rel=1e-6)


FIELD = """<mujoco><option timestep="2e-4"/><asset><hfield name="ground" nrow="21" ncol="21" size="1 1 .1 .1"/></asset>
  <worldbody><geom name="floor" type="hfield" hfield="ground"/>
    <body pos="0.013 0.021 .1"><joint type="slide" axis="0 0 1"/>
      <geom name="foot" type="{kind}" size=".1 .1 .1" mass="2"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("law", [False, True])
@pytest.mark.parametrize("kind", ["box", "sphere"])
def test_points_share_a_stiffness(kind, law):
    """A body on a height field stands where k times the mean depth, along normals that may lean, is its weight."""
    spec = mujoco.MjSpec.from_string(FIELD.format(kind=kind))
    softness = {"law": ContactLaw(KelvinVoigt(1e4, 100.0))} if law else {"k": 1e4, "c": 100.0}
    physical.contact(spec, ("foot", "floor"), frictionless=True, points="share", **softness)
    model = physical.compile(spec)
    with physical.Softener(model):
        assert physical.check(model) == ()
    data = settled(model, 10000)
    upwards = [-contact.dist * abs(contact.frame[2]) for contact in data.contact[: data.ncon]]
    assert len(upwards) > 1
    assert np.mean(upwards) == pytest.approx(2 * 9.81 / 1e4, rel=1e-4)


def test_points_that_each_have_it_are_named():
    spec = mujoco.MjSpec.from_string(FIELD.format(kind="sphere"))
    physical.contact(spec, ("foot", "floor"), k=1e4, c=100.0, frictionless=True)
    with pytest.warns(physical.ModelWarning, match="each prism of its height field has k and c"):
        physical.compile(spec)
    with pytest.raises(ModelError, match='points "all"'):
        physical.contact(spec, ("foot", "floor"), k=1e4, c=100.0, points="all")
