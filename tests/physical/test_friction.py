"""Bristle friction: what sticks rests by force over stiffness, what slides is slowed by the coefficient alone."""

import contextlib

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.clearance import ConstantLaw, ContactLaw, HuntCrossley
from clearance_mj.core.errors import LawError, ModelError

from .stepping import settled, with_data

pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")

GRAVITY, MASS, MU, BRISTLE = 9.81, 2.0, 0.5, 1e5
BODY = """<mujoco><option timestep="1e-4" cone="{cone}"/><worldbody>
    <geom name="floor" type="plane" size="5 5 1" condim="{condim}"/><body pos="0 0 0.1"><freejoint/>{geom}</body>
  </worldbody></mujoco>"""
BALL = '<geom name="body" size="0.1" mass="2" condim="{condim}"/>'
BOX = '<geom name="body" type="box" size="0.2 0.2 0.1" mass="2" condim="{condim}"/>'
FREE_BALL = BODY.format(geom=BALL.format(condim=1), condim=1, cone="pyramidal")
SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1" damping="200"/>'
SOFT = {"k": 1e5, "c": 200.0}


def rest(geom, angle, seconds, condim=1, friction=True, speed=0.0, cone="pyramidal", law=None, **more):
    """A body on a floor, gravity leaning by an angle: its path and speeds along the floor, m and m/s."""
    spec = mujoco.MjSpec.from_string(BODY.format(geom=geom.format(condim=condim), condim=condim, cone=cone))
    spec.option.gravity = [GRAVITY * np.sin(angle), 0, -GRAVITY * np.cos(angle)]
    if friction:
        physical.contact(spec, ("body", "floor"), **({"law": law} if law else SOFT))
        physical.friction(spec, ("body", "floor"), MU, BRISTLE, 50.0, **more)
    model = physical.compile(spec)
    data, speeds = mujoco.MjData(model), []
    data.qvel[0] = speed
    with physical.Softener(model) if friction else contextlib.nullcontext():
        for _ in range(round(seconds / model.opt.timestep)):
            mujoco.mj_step(model, data)
            speeds.append(data.qvel[0])
    return data, np.array(speeds)


@pytest.mark.parametrize("law", [None, *(ContactLaw(HuntCrossley(1e7, restitution=e)) for e in (0.7, 0.3, 0.1))])
def test_what_sticks_rests(law):
    """Leaning slowly to less than the angle of friction, 0.46, bends the bristles by m g sin/k; nothing creeps."""
    spec = mujoco.MjSpec.from_string(FREE_BALL.replace("<freejoint/>", SLIDES))
    physical.contact(spec, ("body", "floor"), **({"law": law} if law else SOFT))
    physical.friction(spec, ("body", "floor"), MU, BRISTLE, 50.0)
    model, data = with_data(physical.compile(spec))
    with physical.Softener(model):
        for angle in np.append(np.zeros(100), np.linspace(0, 0.4, 200)):
            model.opt.gravity[:] = GRAVITY * np.sin(angle), 0, -GRAVITY * np.cos(angle)
            mujoco.mj_step(model, data, 20)
        mujoco.mj_step(model, data, 20000)
    assert data.qpos[0] == pytest.approx(MASS * GRAVITY * np.sin(0.4) / BRISTLE, rel=1e-6)
    assert np.abs(data.qvel).max() < 1e-10


@pytest.mark.parametrize("law", [None, *(ContactLaw(HuntCrossley(1e8, restitution=e)) for e in (0.5, 0.2))])
def test_a_box_stays_on_a_slope(law):
    """Four corners, one bristle: all is at rest, where MuJoCo's own friction creeps."""
    data, _ = rest(BOX, 0.4, 2.5, law=law)
    assert np.abs(data.qvel).max() < 1e-8
    creeping, _ = rest(BOX, 0.4, 2.5, condim=3, friction=False)
    assert creeping.qvel[0] > 1e-6


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_what_slides_is_slowed_by_the_coefficient(cone):
    """Above the angle of friction: a = g (sin - μ cos)."""
    _, speeds = rest(BOX, 0.7, 0.6, cone=cone)
    slope = np.polyfit(np.arange(2000) * 1e-4, speeds[-2000:], 1)[0]
    assert slope == pytest.approx(GRAVITY * (np.sin(0.7) - MU * np.cos(0.7)), rel=1e-4)


def test_a_sliding_box_stops_after_its_way():
    """v²/(2 μ g)."""
    data, _ = rest(BOX, 0.0, 0.6, speed=1.0)
    assert np.abs(data.qvel).max() < 1e-3
    assert data.qpos[0] == pytest.approx(1 / (2 * MU * GRAVITY), rel=0.01)


def test_a_sliding_ball_rolls_at_five_sevenths():
    """Without rolling resistance, of any friction: v → 5/7 v (I = 2/5 m r²)."""
    _, speeds = rest(BALL, 0.0, 0.6, speed=1.0)
    assert speeds[-1000:].mean() == pytest.approx(5 / 7, rel=1e-3)


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_a_rolling_ball_is_braked_by_the_arm(cone):
    """(m + I/r²) dv/dt = -ρ m g/r, with I = 2/5 m r²; and it rolls to rest."""
    data, speeds = rest(BALL, 0.0, 1.0, speed=0.1, cone=cone, rolling=0.002)
    rolls = np.flatnonzero(np.isclose(speeds, 5 / 7 * 0.1, rtol=0.02))[0] + 500
    slope = np.polyfit(np.arange(1000) * 1e-4, speeds[rolls : rolls + 1000], 1)[0]
    assert slope == pytest.approx(-0.002 * GRAVITY / 0.1 / 1.4, rel=0.01)
    rolling, _ = rest(BALL, 0.0, 1.0, speed=0.1, cone=cone)
    assert abs(data.qvel[0]) < 0.02 < 0.07 < rolling.qvel[0]


FOOT = """<mujoco><option timestep="2e-4" cone="{cone}" impratio="{impratio}"/><worldbody>
  <geom name="slope" type="plane" size="5 5 1"/>
  <body pos="0 0 .1"><freejoint/><geom type="box" size=".1 .1 .03" mass="2" pos="0 0 .03" contype="0" conaffinity="0"/>
    <body name="foot" pos="0 0 -.05"><site name="ankle" type="box" size=".2 .2 .1"/>
      <geom name="sole" type="box" size=".1 .1 .05" mass=".001"/></body></body></worldbody>
  <sensor><force site="ankle"/><touch site="ankle"/></sensor></mujoco>"""


@pytest.mark.parametrize("law", [False, True])
@pytest.mark.parametrize(("cone", "impratio"), [("pyramidal", 1), ("elliptic", 1), ("elliptic", 10)])
def test_sensors_of_force_show_friction(cone, impratio, law):
    """A foot at rest on a slope of 20°: its ankle bears m g sin and m g cos of the 2 kg above; contacts, of all."""
    spec, angle = mujoco.MjSpec.from_string(FOOT.format(cone=cone, impratio=impratio)), np.deg2rad(20)
    spec.option.gravity = GRAVITY * np.array([np.sin(angle), 0, -np.cos(angle)])
    softness = {"law": ConstantLaw(1e5, 300)} if law else {"k": 1e5, "c": 300}
    physical.contact(spec, ("sole", "slope"), frictionless=True, **softness)
    physical.friction(spec, ("sole", "slope"), 0.8, k=1e5, c=100)
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE if impratio == 10 else mujoco.mjtJacobian.mjJAC_AUTO
    model = physical.compile(spec)
    data, total, force = mujoco.MjData(model), np.zeros(3), np.zeros(6)
    with physical.Softener(model):
        mujoco.mj_step(model, data, 5000)
        mujoco.mj_forward(model, data)
    weight = GRAVITY * np.array([-np.sin(angle), 0, np.cos(angle)])
    np.testing.assert_allclose(data.sensordata[:3], -2.0 * weight, atol=0.03)  # bars tilt by what the sole sinks
    assert data.sensordata[3] == pytest.approx(2.001 * weight[2], rel=1e-4)
    for i in range(data.ncon):
        mujoco.mj_contactForce(model, data, i, force)
        total += data.contact[i].frame.reshape(3, 3).T @ force[:3]
    np.testing.assert_allclose(total, 2.001 * weight, atol=1e-4)
    assert np.abs(data.qvel).max() < 1e-6


SLIDE = """<mujoco><option timestep="1e-4" gravity="0 0 0"/><worldbody><body>
    <joint name="slide" type="slide" axis="0 0 1"/><geom size="0.1" mass="2" contype="0" conaffinity="0"/>
  </body></worldbody><tendon><fixed name="tendon"><joint joint="slide" coef="3"/></fixed></tendon></mujoco>"""


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_what_parts_faster_than_it_is_pressed_does_not_rub(cone):
    spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="1e-4" gravity="0 0 0" cone="{cone}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 0.0499">
          <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><geom name="ball" size="0.05" mass="2"/>
        </body></worldbody></mujoco>""")
    physical.contact(spec, ("ball", "floor"), k=1e4, c=200, frictionless=True)  # 1 N of the spring, -20 N of the damper
    physical.friction(spec, ("ball", "floor"), 0.5, k=1e5, c=50)
    data = settled(physical.compile(spec), 5, qvel=(1.0, 0.1))
    assert data.ncon and data.contact.dist[0] < 0
    np.testing.assert_allclose(data.qvel, [1.0, 0.1], rtol=1e-9)


@pytest.mark.parametrize(("kind", "name", "lever"), [("joint", "slide", 1.0), ("tendon", "tendon", 3.0)])
def test_a_joint_or_tendon_sticks_and_slips(kind, name, lever):
    """Pulled with less than its force it rests by force/k, with more it gains speed by what is left."""
    spec = mujoco.MjSpec.from_string(SLIDE)
    getattr(physical, f"{kind}_friction")(spec, name, 12.0 / lever, 1e4 / lever**2, 100.0 / lever**2)
    model = physical.compile(spec)
    rests = settled(model, 10000, qfrc_applied=5.0)
    assert rests.qpos[0] == pytest.approx(5.0 / 1e4, rel=1e-9) and abs(rests.qvel[0]) < 1e-12
    early, late = (settled(model, steps, qfrc_applied=15.0).qvel[0] for steps in (10000, 11000))
    assert late - early == pytest.approx((15.0 - 12) / MASS * 0.1, rel=1e-9)


def test_friction_shortens_the_stable_step():
    """Bristles are springs: h < 2/√(k/m), with what else there is."""
    spec = mujoco.MjSpec.from_string(SLIDE)
    physical.joint_friction(spec, "slide", 1.0, 1e6)
    assert physical.largest_step(physical.compile(spec)) == pytest.approx(2 / np.sqrt(1e6 / MASS), rel=1e-9)
    spec.option.timestep = 3e-3
    with pytest.raises(ModelError, match=r'timestep 0\.003 s is too long: friction of joint "slide"'):
        physical.compile(spec)


@pytest.mark.parametrize(("wrong", "error", "says"), [
    (lambda spec: physical.friction(spec, ("body", "floor"), 0.5, 1e5), ModelError, "give it a softness first"),
    (lambda spec: physical.friction(spec, ("body",), 0.5, 1e5), ModelError, "a contact has two geoms, got 1"),
    (lambda spec: physical.friction(spec, ("bdy", "floor"), 0.5, 1e5), ModelError, 'did you mean "body"'),
    (lambda spec: physical.friction(spec, ("body", "floor"), -0.5, 1e5), LawError, "coefficient = -0.5 of friction"),
    (lambda spec: physical.friction(spec, ("body", "floor"), 0.5, 0.0), LawError, "k = 0 of friction"),
    (lambda spec: physical.friction(spec, ("body", "floor"), 0.5, 1e5, rolling=-1), LawError, "rolling = -1 of"),
    (lambda spec: physical.joint_friction(spec, spec.joints[0], 1.0, 1.0), ModelError, "has no name"),
    (lambda spec: physical.tendon_friction(spec, "rope", 1.0, 1.0), ModelError, 'no tendon "rope"'),
    (lambda spec: physical.joint_friction(spec.compile(), "a", 1.0, 1.0), ModelError, "needs a mujoco.MjSpec"),
])  # fmt: skip
def test_friction_that_cannot_be(wrong, error, says):
    with pytest.raises(error, match=says):
        wrong(mujoco.MjSpec.from_string(FREE_BALL))


def test_friction_beside_laws_is_told_by_name():
    spec = mujoco.MjSpec.from_string(FREE_BALL)
    physical.contact(spec, ("body", "floor"), law=ConstantLaw(1e4, 1.0))
    physical.friction(spec, ("body", "floor"), MU, BRISTLE)
    numbers = physical.compile(spec).numeric("physical:friction:pair:floor - body").data
    np.testing.assert_array_equal(numbers, (MU, BRISTLE, 0))


def test_without_a_softener_it_is_said():
    """Friction and a law that is stepped alone: nothing would rub, in silence; check and the model's own text tell."""
    spec = mujoco.MjSpec.from_string(FREE_BALL)
    physical.contact(spec, ("body", "floor"), law=ContactLaw(HuntCrossley(stiffness=1e7, restitution=0.3)))
    physical.friction(spec, ("body", "floor"), MU, BRISTLE, 50.0)
    model = physical.compile(spec)
    rubs, follows = physical.check(model)
    assert rubs.startswith('friction of pair "floor - body" does not act until a Softener(model) is in use')
    assert follows.startswith('contact "floor - body" keeps one stiffness and follows no law until')
    with physical.Softener(model):
        assert physical.check(model) == ()
    assert "act only while clearance_mj.physical.Softener(model) is in use" in spec.to_xml()


SPINNING = """<mujoco><option timestep="2e-4"/><worldbody><geom name="floor" type="plane" size="5 5 1"/>
  <body pos="0 0 .05"><freejoint/><geom name="foot" {shape} mass="2"/></body></worldbody></mujoco>"""


def spun(shape, torsion=0.0, **floor):
    """A body that turns about the normal, and what it turns at after 0.05 s and half a second."""
    spec = mujoco.MjSpec.from_string(SPINNING.format(shape=shape))
    for name, value in floor.items():
        setattr(spec.geom("floor"), name, value)
    physical.contact(spec, ("foot", "floor"), k=1e5, c=200, frictionless=True)
    physical.friction(spec, [("foot", "floor")], 0.5, k=1e5, c=50, torsion=torsion)
    model, data = with_data(physical.compile(spec))
    data.qvel[5] = 0.0 if floor else 10.0
    with physical.Softener(model):
        mujoco.mj_step(model, data, 250)
        early = data.qvel.copy()
        mujoco.mj_step(model, data, 2250)
    return early, data.qvel, model


@pytest.mark.parametrize(
    "shape, torsion, arm, inertia",
    [
        ('type="box" size=".1 .1 .05"', 0.0, 0.1 * np.sqrt(2), 2 / 12 * (0.2**2 + 0.2**2)),  # corners
        ('size=".05"', 0.01, 0.01, 0.4 * 2 * 0.05**2),
    ],
)
def test_spin_about_the_normal_is_braked(shape, torsion, arm, inertia):
    """I dω/dt = -μ m g arm, until it rests: a box in 0.096 s."""
    early, late, model = spun(shape, torsion)
    braking = 0.5 * 2 * 9.81 * arm / inertia
    assert 10 / braking < 0.3
    assert early[5] == pytest.approx(10 - 0.05 * braking, rel=0.01)
    assert abs(late[5]) < 0.5 * 2 * 9.81 * arm / np.sqrt(1e5 * arm**2 * inertia)  # what may still ring on the bristles
    assert physical.largest_step(model) > 2e-4


@pytest.mark.skipif(not hasattr(mujoco.MjContact, "surfacevel"), reason="contacts have it from MuJoCo 4 on")
def test_a_conveyor_carries_along():
    """At 0.3 m/s, reached from rest at μ g after 61 ms; what rings on the bristles has decayed to e^-5 by then."""
    early, late, _ = spun('type="box" size=".1 .1 .05"', surfacevel=[0.3, 0, 0, 0, 0, 0])
    assert early[0] == pytest.approx(0.05 * 0.5 * 9.81, rel=0.03)
    np.testing.assert_allclose(late[:2], [0.3, 0], atol=5e-4)


@pytest.mark.parametrize("place", [(0.1, 0.3, 0.0), (1 / 3, -0.7, 0.0), (12.3, 4.56, 0.0)])
def test_a_single_point_slides_at_mu_n_wherever_it_is(place):
    """A ball that does not turn and slides askew is braked by μ N along its way in every step."""
    spec = mujoco.MjSpec.from_string("""
    <mujoco><option timestep="2e-4"/><worldbody><geom name="floor" type="plane" size="50 50 1"/>
      <body name="b"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
        <joint type="slide" axis="0 0 1"/><geom name="ball" size=".1" mass="2"/></body></worldbody></mujoco>""")
    physical.contact(spec, ("ball", "floor"), k=1e5, c=300, friction=0.6)
    model = physical.compile(spec)
    data, speed = mujoco.MjData(model), np.array([3.0, 2.0])
    data.qpos[:], data.qvel[:2] = (*place[:2], 0.1 - 2 * 9.81 / 1e5), speed
    with physical.Softener(model):
        mujoco.mj_step(model, data, 200)  # bristles bend within 0.1 ms
        before = data.qvel.copy()
        for _ in range(500):
            mujoco.mj_step(model, data)
            braking = (before - data.qvel)[:2] / model.opt.timestep
            np.testing.assert_allclose(braking, 0.6 * 9.81 * speed / np.hypot(*speed), rtol=2e-4)
            before = data.qvel.copy()
