"""Contacts and limits that follow laws: statics and impacts of closed form, integrated elsewhere, and told engines."""

import mujoco
import mujoco.batch
import mujoco.rollout
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import clearance_mj as cm
from clearance_mj import physical
from clearance_mj.clearance import (
    AmplitudeLaw,
    ConstantLaw,
    ContactLaw,
    HuntCrossley,
    KelvinVoigt,
    MaxwellSlip,
    TimeLaw,
)  # fmt: skip
from clearance_mj.core.errors import LawError, ModelError
from clearance_mj.engines import Modal
from clearance_mj.rig import Bushing, Contact, Grease, Sensor, Shaker
from clearance_mj.structure import Matrices

from .arm import arm
from .stepping import settled, step_by_hand, with_data

GRAVITY, MASS, GAP = 9.81, 2.0, 0.01
HERTZ = ContactLaw(HuntCrossley(stiffness=1e7, restitution=0.5))
SLIDE = """<mujoco><option timestep="{step}" integrator="{integrator}" gravity="0 0 {gravity}"/><worldbody><body>
    <joint name="slide" type="slide" axis="0 0 1" range="{range}" damping="{damping}"/>
    <geom size="0.1" mass="2" contype="0" conaffinity="0"/></body></worldbody></mujoco>"""
ALL = """<mujoco><option timestep="1e-4"/>
  <default><joint type="slide" axis="0 0 1" damping="200"/><geom size="0.1" mass="2"/></default><worldbody>
    <geom name="floor" type="plane" size="1 1 1" condim="1"/><site name="ring" pos="3 0 1"/>
    <body pos="0 0 0.1"><joint/><geom name="ball" condim="1"/></body>
    <body pos="1 0 1"><joint name="joint" range="-0.01 0.01"/><geom/></body>
    <body pos="2 0 1"><joint name="of tendon"/><geom/></body>
    <body pos="3 0 1"><joint/><joint axis="1 0 0"/><geom/><site name="pin"/></body>
    <body pos="4 0 1"><joint name="ball joint" type="ball" range="0 0.1" damping="20"/><geom pos="0.5 0 0"/></body>
  </worldbody><tendon><fixed name="tendon" range="-0.01 0.01"><joint joint="of tendon" coef="2"/></fixed></tendon>
</mujoco>"""


def slide_of(law, step=1e-4, integrator="Euler", gravity=0.0, damping=0.0):
    xml = SLIDE.format(step=step, integrator=integrator, gravity=-gravity, damping=damping, range=f"-{GAP} {GAP}")
    spec = mujoco.MjSpec.from_string(xml)
    physical.joint_limit(spec, "slide", law=law)
    return spec


def slide(law, *given, **options):
    return physical.compile(slide_of(law, *given, **options))


def run(model, steps, position=0.0, speed=0.0):
    return settled(model, steps, qpos=position, qvel=speed)


def test_every_kind_follows_a_law():
    """At rest K δ^1.5 is the weight: of a contact, a joint, a tendon of twice the motion, a bushing, a ball joint."""
    spec = mujoco.MjSpec.from_string(ALL)
    physical.contact(spec, ("ball", "floor"), law=HERTZ)
    physical.joint_limit(spec, ["joint", "ball joint"], law=HERTZ)
    physical.tendon_limit(spec, "tendon", law=HERTZ)
    physical.add_annular_clearance(spec, "pin", "ring", GAP, law=HERTZ)
    data = settled(physical.compile(spec), 40000)
    assert np.abs(data.qvel).max() < 1e-9
    depth = (MASS * GRAVITY / 1e7) ** (2 / 3)
    expected = [-depth, -GAP - depth, -(GAP + (MASS * GRAVITY / 2 / 1e7) ** (2 / 3)) / 2, -GAP - depth, 0]
    np.testing.assert_allclose(data.qpos[:5], expected, rtol=1e-7, atol=1e-12)
    angle = 2 * np.arccos(data.qpos[5])
    assert angle == pytest.approx(np.deg2rad(0.1) + (0.5 * MASS * GRAVITY * np.cos(angle) / 1e7) ** (2 / 3), rel=1e-7)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_impact_of_hunt_and_crossley(integrator):
    """δ̈ = -K δ^1.5 (1 + κ δ̇/v)/m by DOP853 from first touch to last, in either direction; it rebounds at e."""
    speed, kappa = 0.5, HERTZ.contact[0].kappa

    def fall(_, state):
        return state[1], -1e7 * max(state[0], 0.0) ** 1.5 * max(1 + kappa * state[1] / speed, 0.0) / MASS

    def leaves(_, state):
        return state[0]

    leaves.terminal, leaves.direction = True, -1
    out = solve_ivp(fall, (0, 1), (1e-15, speed), "DOP853", events=leaves, rtol=1e-11, atol=1e-14)
    assert abs(out.y_events[0][0, 1]) == pytest.approx(0.5 * speed, rel=1e-6)
    model = slide(HERTZ, 2e-6, integrator)
    for side in (1, -1):
        data = run(model, 6000, side * (GAP - 1e-6), side * speed)
        assert data.qvel[0] == pytest.approx(-side * abs(out.y_events[0][0, 1]), rel=2e-4)


def test_a_law_over_time():
    """A weight rests k(t) deep; k rises tenfold, linear between the law's instants."""
    model = slide(TimeLaw([0.0, 1.0], [1e4, 1e5], [100.0, 100.0]), gravity=GRAVITY, damping=500.0)
    for end in (4000, 8000):
        data = run(model, end, -GAP - MASS * GRAVITY / 1e4)
        k = np.interp(end * 1e-4, (0, 1), (1e4, 1e5))
        assert -GAP - data.qpos[0] == pytest.approx(MASS * GRAVITY / k, rel=0.05)


def test_a_law_over_amplitude():
    """A weight rests where k(|x|) δ is its weight."""
    data = run(slide(AmplitudeLaw([GAP, 2 * GAP], [1e3, 1e5], [10.0, 10.0]), gravity=GRAVITY, damping=100.0), 20000)
    place = brentq(lambda x: np.interp(x, (GAP, 2 * GAP), (1e3, 1e5)) * (x - GAP) - MASS * GRAVITY, GAP, 2 * GAP)
    assert data.qpos[0] == pytest.approx(-place, rel=1e-6)


def test_grease_holds_what_does_not_slide():
    """Springs in series with sliders, loaded slowly: of 9 N the one that slides at 2 N carries 2 N, the other 7 N."""
    grease = MaxwellSlip(springs=(2e4, 1e4), forces=(10.0, 2.0))
    data = run(slide(ConstantLaw(1e5, 10.0, grease=grease), gravity=9.0 / MASS, damping=1000.0), 20000)
    assert data.qpos[0] == pytest.approx(-7 / 2e4, rel=1e-6)


@pytest.mark.parametrize("law", [
    ContactLaw(HuntCrossley(stiffness=1e7, restitution=0.6), grease=MaxwellSlip(springs=(3e3,), forces=(4.0,))),
    AmplitudeLaw([GAP, 2 * GAP], [1e4, 1e5], [5.0, 20.0]),
    ConstantLaw(4e4, 10.0, grease=Grease(2e3, 3.0, 0.2, 1.0, 1e5, 3e4)),
    TimeLaw([0.0, 0.3], [1e4, 6e4], [5.0, 20.0]),
])  # fmt: skip
def test_the_modal_engine_moves_so(law):
    """An oscillator with stops under a sine: an engine that is not MuJoCo comes to the same motion, over 0.24 s."""
    step, steps = 1e-5, 24000
    force = 150.0 * np.sin(2 * np.pi * 9.0 * step * (np.arange(steps) + 0.5))
    structure = Matrices("m-kg-s", mass=[[MASS]], stiffness=[[5e3]], damping=[[4.0]], dofs=("1:Z",))
    bushing = Bushing("1:Z", GAP, 0.0, Grease(0.0), Contact(1e4))
    rig = cm.Rig("mass", None, (bushing,), (Sensor(1, "1:Z"),), structure=structure, shaker=Shaker("force", "1:Z"))
    expected = Modal(modes=1).start(rig, law, "force", step).advance(force)[:, 1]
    model = slide(law, step, damping=4.0)
    model.jnt_stiffness[0] = 5e3
    data, positions = mujoco.MjData(model), np.zeros(steps)
    with physical.Softener(model):
        for i in range(steps):
            positions[i], data.qfrc_applied[0] = data.qpos[0], force[i]
            mujoco.mj_step(model, data)
    assert np.abs(expected).max() > 1.1 * GAP
    assert np.abs(positions - expected).max() < 2e-3 * np.abs(expected).max()


def threefold():
    """The arm with laws on contact, joint and tendon, and a softener of it."""
    spec = arm()
    physical.contact(spec, ("ball", "ground"), law=HERTZ)
    physical.joint_limit(spec, "shoulder", law=ContactLaw(HuntCrossley(stiffness=500.0, restitution=0.6, exponent=1.0)))
    physical.add_backlash(spec, "elbow", 0.01, law=ConstantLaw(800.0, 0.5, grease=MaxwellSlip((300.0,), (0.2,))))
    model = physical.compile(spec)
    model.opt.gravity[2] = -5.0
    return model


def test_loops_callbacks_batches_and_threads_are_one_simulation():
    """Bit for bit: update() between mj_step1 and mj_step2, mj_step, rollout and Batch on one and two threads."""
    model, n, steps = threefold(), 6, 400
    softener, state = physical.Softener(model), mujoco.mjtState.mjSTATE_FULLPHYSICS
    starts, ends = [], []
    for i in range(n):
        data = mujoco.MjData(model)
        data.qpos[:2], data.qvel[:2], data.ctrl[0] = (0.1 * i, 0.2), (3.0, -2.0 + i), 0.5
        start = np.zeros(mujoco.mj_stateSize(model, state))
        mujoco.mj_getState(model, data, start, state)
        for _ in range(steps):
            step_by_hand(model, data, softener)
        starts.append(start)
        ends.append(np.hstack((data.qpos, data.qvel, data.userdata)))
    assert np.ptp(np.array(ends)[:, model.nq + model.nv :], axis=0).max() > 0  # what is remembered
    places = np.cumsum([1, model.nq, model.nv])
    for threads in (1, 2):
        with softener:
            workers, control = [mujoco.MjData(model) for _ in range(threads)], np.full((n, steps, 1), 0.5)
            states_after, _ = mujoco.rollout.rollout(
                [model] * n, workers, np.array(starts), nstep=steps, control=control
            )
        np.testing.assert_array_equal(states_after[:, -1, 1 : places[-1]], np.array(ends)[:, : model.nq + model.nv])
    with softener:
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, starts[3], state)
        data.ctrl[0] = 0.5
        mujoco.mj_step(model, data, steps)
    np.testing.assert_array_equal(np.hstack((data.qpos, data.qvel, data.userdata)), ends[3])


def test_what_laws_remember_is_in_the_state():
    """Saved in mid-contact, restored elsewhere: the same end; reset: the same beginning."""
    model = slide(HERTZ)
    whole, half = run(model, 300, 0.0, 0.7), mujoco.MjData(model)
    state = mujoco.mjtState.mjSTATE_INTEGRATION
    saved = np.zeros(mujoco.mj_stateSize(model, state))
    with physical.Softener(model):
        half.qvel[0] = 0.7
        mujoco.mj_step(model, half, 150)
        assert half.qpos[0] > GAP
        mujoco.mj_getState(model, half, saved, state)
        mujoco.mj_resetData(model, half)
        mujoco.mj_setState(model, half, saved, state)
        mujoco.mj_step(model, half, 150)
    np.testing.assert_array_equal(half.qpos, whole.qpos)


def test_two_models_at_once():
    """Of one structure and other laws: each follows its own, as MuJoCo's one callback tells them apart."""
    models = [slide(ConstantLaw(k, 500.0), gravity=GRAVITY) for k in (1e4, 2e4)]
    with physical.Softener(models[0]), physical.Softener(models[1]):
        for model, k in zip(models, (1e4, 2e4)):
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 20000)
            assert data.qpos[0] == pytest.approx(-GAP - MASS * GRAVITY / k, rel=1e-7)
    assert mujoco.get_mjcb_control() is None


def test_a_saved_model_follows_its_laws(tmp_path):
    """The MJCF file holds them."""
    spec = slide_of(HERTZ, gravity=GRAVITY, damping=200.0)
    model = physical.compile(spec)
    (tmp_path / "model.xml").write_text(spec.to_xml())
    again = mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml"))
    np.testing.assert_array_equal(run(again, 5000).qpos, run(model, 5000).qpos)


def test_without_a_softener_the_hardest_of_a_law_holds():
    """Constant stiffness at the depth of one gap, which is what the longest step is for."""
    model = slide(HERTZ, gravity=GRAVITY, damping=400.0)
    data = settled(model, 20000, softened=False)
    assert data.qpos[0] == pytest.approx(-GAP - MASS * GRAVITY / (1.5e7 * GAP**0.5), rel=1e-4)
    model.dof_damping[:] = 0
    assert physical.largest_step(model) == pytest.approx(2 / np.sqrt(1.5e7 * GAP**0.5 / MASS), rel=1e-3)


ADHESIVE = ContactLaw(KelvinVoigt(1e4, 1.0, adhesion=True))


@pytest.mark.parametrize(("wrong", "error", "says"), [
    (lambda spec: physical.joint_limit(spec, "elbow", 1.0, 1.0, law=HERTZ), LawError, "or a law, not both"),
    (lambda spec: physical.joint_limit(spec, "elbow"), LawError, "or a law"),
    (lambda spec: physical.joint_limit(spec, "elbow", "1e4", 1.0), LawError, "k must be a number, got '1e4'"),
    (lambda spec: physical.joint_limit(spec, "elbow", law="hertz"), LawError, "law must be a law such as"),
    (lambda spec: physical.add_backlash(spec, "elbow", "1", 1.0, 1.0), ModelError, "gap 1 must be > 0"),
    (lambda spec: physical.Softener(spec), ModelError, "needs a mujoco.MjModel"),
    (lambda spec: physical.joint_limit(spec, "elbow", 1.0), LawError, "a damping c, or a law"),
    (lambda spec: physical.joint_limit(spec.compile(), "elbow", law=HERTZ), ModelError, "given to the MjSpec"),
    (lambda spec: physical.joint_limit(spec, "elbow", law=ADHESIVE), LawError, "never pull"),
    (lambda spec: physical.joint_limit(spec, "elbow", law=ConstantLaw([1.0, 2.0], 1.0)), LawError, "2 bushings"),
    (lambda spec: physical.Softener(spec.compile()), ModelError, "need no Softener"),
])  # fmt: skip
def test_laws_that_cannot_be(wrong, error, says):
    with pytest.raises(error, match=says):
        wrong(arm())


IN_A_GAP = AmplitudeLaw([0, 1], [1, 2], [1, 1]), ConstantLaw(1.0, 1.0, grease=MaxwellSlip((3.0,), (2.0,)))


@pytest.mark.parametrize("law", IN_A_GAP)
def test_what_has_no_place_in_its_gap(law):
    """A ball joint and a pair of geoms know how deep, not where in the gap."""
    for give, element in ((physical.contact, ("ball", "floor")), (physical.joint_limit, "ball joint")):
        spec = mujoco.MjSpec.from_string(ALL)
        give(spec, element, law=law)
        with pytest.raises(ModelError, match=r"ball.*no place in its gap"):
            physical.compile(spec)


def test_softeners_that_cannot_be():
    spec = arm()
    physical.joint_limit(spec, "elbow", law=ConstantLaw(100.0, 1.0))
    with pytest.raises(ModelError, match=r"make it with clearance_mj\.physical\.compile"):
        physical.Softener(spec.compile())
    model = physical.compile(spec)
    softener = physical.Softener(model)
    other = threefold()
    with pytest.raises(ModelError, match="made for another model"):
        softener.update(other, mujoco.MjData(other))
    mujoco.set_mjcb_control(lambda model, data: None)
    try:
        with pytest.raises(ModelError, match=r"call update\(\) in it"), softener:
            pass
    finally:
        mujoco.set_mjcb_control(None)
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_ACTUATION
    with pytest.raises(ModelError, match="flag actuation is disabled"), softener:
        pass
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(ModelError, match="integrator RK4"):
        physical.Softener(physical.compile(spec))


def test_users_have_their_own_user_data():
    """Room for laws begins behind it, also when it grows."""
    spec = arm()
    spec.nuserdata = 5
    physical.joint_limit(spec, "elbow", law=ConstantLaw(100.0, 1.0))
    first = physical.compile(spec).nuserdata
    assert first == physical.compile(spec).nuserdata > 5
    spec.nuserdata = first + 3
    model, data = with_data(physical.compile(spec))
    data.userdata[:5] = data.userdata[first : first + 3].sum() + 7.0
    with physical.Softener(model):
        mujoco.mj_step(model, data, 3)
    np.testing.assert_array_equal(data.userdata[: first + 3], [7.0] * 5 + [0.0] * (first - 2))
    assert data.userdata[first + 3] == model.opt.timestep, "it has been at work"
