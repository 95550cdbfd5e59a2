"""Friction and drives in MJX against the same model with a Softener, and gradients against differences."""

import dataclasses
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import ModelError

pytest.importorskip("mujoco.mjx", reason="MJX is not installed; make test-mjx installs it")
jax = pytest.importorskip("jax")
jp = jax.numpy
pmjx = pytest.importorskip("clearance_mj.physical.mjx")
pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")

MACHINES = """
<mujoco>
  <option timestep="5e-4" integrator="implicitfast"/>
  <default>
    <default class="link">
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass="1" contype="0" conaffinity="0"/>
    </default>
  </default>
  <worldbody>
    <geom name="slope" type="plane" size="5 5 1" euler="0 10 0"/>
    <body pos="-1 0 0"><joint name="limited" axis="0 1 0" range="-40 8" armature=".02"/><geom class="link"/></body>
    <body pos="-2 0 0"><joint name="play" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body pos="-3 0 0"><joint name="worm" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body pos="-4 0 0"><joint name="filtered" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body pos="-5 0 0"><joint name="other" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body euler="0 10 0" pos="0 0 .0507">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><geom name="rests" size=".05" mass="2"/>
    </body>
    <body euler="0 10 0" pos="0 1 .0507">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><geom name="slides" size=".05" mass="2"/>
    </body>
  </worldbody>
  <actuator>
    <position name="play" joint="play" kp="200" kv="5"/>
    <position name="worm" joint="worm" kp="200" kv="5" forcerange="-10 10" gear="1.5" ctrlrange="-.4 .4"/>
    <general name="filtered" joint="filtered" dyntype="filterexact" dynprm=".02" gainprm="100" biastype="affine"
      biasprm="0 -100 -3" actlimited="true" actrange="-.3 .3"/>
    <intvelocity name="other" joint="other" kp="100" actrange="-1 1"/>
  </actuator>
</mujoco>"""
FEET = """
<mujoco>
  <option timestep="5e-4" integrator="implicitfast"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 1"/>
    <body pos="0 0 .05"><freejoint/><geom name="foot" type="box" size=".1 .06 .05" mass="2"/></body>
    <body pos="1 0 .05"><freejoint/><geom name="ball" size=".05" mass="2"/></body>
  </worldbody>
</mujoco>"""
LEG = """
<mujoco>
  <option timestep="1e-3" integrator="implicitfast"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 1"/>
    <body pos="0 0 .349">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><geom size=".02" mass="3"/>
      <body>
        <joint name="hip" axis="0 1 0" armature=".02"/>
        <geom type="capsule" fromto="0 0 0 0 0 -.15" size=".02" mass=".3"/>
        <body pos="0 0 -.15">
          <joint name="knee" axis="0 1 0" armature=".02"/>
          <geom type="capsule" fromto="0 0 0 0 0 -.15" size=".02" mass=".3"/>
          <geom name="foot" size=".05" pos="0 0 -.15" mass=".2"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="hip" joint="hip" kp="150" kv="3"/><position name="knee" joint="knee" kp="150" kv="3"/>
  </actuator>
</mujoco>"""
FRICTION = physical.DriveFriction(
    5000.0, 2.0, 0.1, 0.05, physical.Efficiency.screw(0.17, 0.1), 0.02, 0.05, 0.1, 0.01, 0.02, 0.5, 1.5, 0.01, 0.02
)
STEPS = 300


def machines():
    spec = mujoco.MjSpec.from_string(MACHINES)
    physical.joint_limit(spec, "limited", k=500, c=5)
    physical.joint_friction(spec, "limited", 0.5, 500, 1)
    physical.add_backlash(spec, "play", gap=0.01, k=500, c=2)
    physical.tendon_friction(spec, "play backlash", 0.2, 500, 1)
    physical.add_drive(spec, "worm", 0.01, 500, 2, friction=FRICTION, hysteresis=[(200, 0.2), (100, 0.3)])
    physical.add_drive(spec, "filtered", 0.0, 500, 2, encoder="load")
    for ball, coefficient in (("rests", 0.5), ("slides", 0.1)):
        physical.contact(spec, (ball, "slope"), k=1e4, c=200, frictionless=True)
        physical.friction(spec, (ball, "slope"), coefficient, k=1e4, c=50)
    return physical.compile(spec)


def feet():
    spec = mujoco.MjSpec.from_string(FEET)
    for geom, arms in (("foot", (0.0, 0.0)), ("ball", (0.01, 0.0005))):
        physical.contact(spec, (geom, "floor"), k=1e4, c=100, frictionless=True)
        physical.friction(spec, (geom, "floor"), 0.5, 1e4, 50, *arms)
    return physical.compile(spec)


def leg(k=2e4, gap=0.01, teeth=600.0, mu=0.6, iterations=50):
    spec = mujoco.MjSpec.from_string(LEG)
    spec.option.iterations, spec.option.ls_iterations = iterations, 8
    physical.contact(spec, ("foot", "floor"), k=k, c=150, frictionless=True)
    physical.friction(spec, ("foot", "floor"), mu, 2e4, 60)
    for servo in ("hip", "knee"):
        physical.add_drive(spec, servo, gap=gap, k=teeth, c=1)
    return physical.compile(spec)


def controls(model, steps):
    """Controls (steps, nu) that move everything."""
    time = model.opt.timestep * np.arange(steps)[:, None]
    return 0.35 * np.sin(12 * time + 0.4 * np.arange(model.nu) + 0.3)


def on_cpu(model, data, steps=STEPS):
    """States (steps, nq + na) with a Softener."""
    found = []
    with physical.Softener(model):
        for control in controls(model, steps):
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
            found.append(np.concatenate((data.qpos, data.qvel)))
    return np.array(found)


def in_mjx(mx, parameters, dx, state, wanted):
    """The same in MJX, and the last data and state."""

    def one(carry, control):
        dx, state = pmjx.step(mx, parameters, carry[0].replace(ctrl=control), carry[1])
        return (dx, state), jp.concatenate((dx.qpos, dx.qvel))

    carry, first = one((dx, state), wanted[0])  # MJX changes types of integers in the first step in double precision
    carry, found = jax.lax.scan(one, carry, wanted[1:])
    return jp.concatenate((first[None], found)), carry


@pytest.mark.parametrize("double", [False, True], ids=["single", "double"])
@pytest.mark.parametrize("make, speeds", [(machines, [-3] + 9 * [0]), (feet, 2 * [0.3, 0.1, 0, 0, 0, 8])])
def test_everything_moves_as_with_a_softener(make, speeds, double):
    model = make()
    data = mujoco.MjData(model)
    data.qvel[:] = speeds
    with jax.enable_x64(double):
        mx, parameters = pmjx.put_model(model)
        dx, state = pmjx.init(model, data)
        found, (dx, state) = jax.jit(in_mjx)(mx, parameters, dx, state, jp.array(controls(model, STEPS)))
    assert found.dtype == (np.float64 if double else np.float32)
    expected = on_cpu(model, data)
    np.testing.assert_allclose(found[:, : model.nq], expected[:, : model.nq], atol=2e-6)
    np.testing.assert_allclose(found[:, model.nq :], expected[:, model.nq :], atol=2e-4)
    for name in parameters.drives.names:
        np.testing.assert_allclose(
            pmjx.drive_state(mx, parameters, state, name), physical.drive_state(model, data.act, name), rtol=1e-3
        )


def test_stiffness_differs_between_environments():
    count, steps = 64, 200
    rng = np.random.default_rng(1)
    k, teeth, mu = rng.uniform(1e4, 3e4, count), rng.uniform(400, 800, count), rng.uniform(0.1, 0.8, count)
    model = leg()
    mx, parameters = pmjx.put_model(model)
    start = pmjx.init(model, mujoco.MjData(model))
    wanted = jp.array(controls(model, steps))
    behind = physical.inverse_inertia(model, "pair", 0)
    mx = mx.replace(pair_solimp=mx.pair_solimp.at[:, :2].set(physical.IMPEDANCE))

    @jax.jit
    @jax.vmap
    def run(k, teeth, mu):
        own = mx.replace(pair_solref=pmjx.pair_solref(k, 150.0, behind)[None])
        drives = dataclasses.replace(parameters.drives, numbers=parameters.drives.numbers | {"k": jp.full(2, teeth)})
        pairs = dataclasses.replace(parameters.pairs, coefficient=mu[None])
        return in_mjx(own, dataclasses.replace(parameters, drives=drives, pairs=pairs), *start, wanted)[0]

    found = np.array(run(*(jp.array(values) for values in (k, teeth, mu))))
    assert np.ptp(found[:, -1, 0]) > 1e-3
    for i in range(0, count, 9):
        varied = leg(k=k[i], teeth=teeth[i], mu=mu[i])
        expected = on_cpu(varied, mujoco.MjData(varied), steps)
        np.testing.assert_allclose(found[i, :, : model.nq], expected[:, : model.nq], atol=1e-5)


def test_gradients_are_those_of_differences():
    steps = 120
    model = leg(iterations=1)
    with jax.enable_x64(True):
        mx, parameters = pmjx.put_model(model)
        start = pmjx.init(model, mujoco.MjData(model))
        wanted, behind = jp.array(controls(model, steps)), physical.inverse_inertia(model, "pair", 0)

        @jax.jit
        @jax.value_and_grad
        def place(numbers):
            k, teeth, gap, mu = numbers
            own = mx.replace(pair_solref=pmjx.pair_solref(k, 150.0, behind)[None])
            changed = parameters.drives.numbers | {"k": jp.full(2, teeth), "gap": jp.full(2, gap)}
            drives = dataclasses.replace(parameters.drives, numbers=changed)
            pairs = dataclasses.replace(parameters.pairs, coefficient=mu[None])
            found, _ = in_mjx(own, dataclasses.replace(parameters, drives=drives, pairs=pairs), *start, wanted)
            return found[-1, 0]

        numbers = np.array([2e4, 600.0, 0.01, 0.3])
        _, gradient = place(jp.array(numbers))
        for i, part in enumerate(1e-5 * np.diag(numbers)):
            difference = (place(jp.array(numbers + part))[0] - place(jp.array(numbers - part))[0]) / (2 * part[i])
            assert np.isfinite(gradient[i]) and gradient[i] != 0
            assert gradient[i] == pytest.approx(float(difference), rel=1e-3)


def test_what_cannot_be_in_mjx_is_refused():
    from clearance_mj.clearance import ContactLaw, HuntCrossley

    spec = mujoco.MjSpec.from_string(FEET)
    physical.contact(spec, ("ball", "floor"), law=ContactLaw(HuntCrossley(1e6, 0.5)), frictionless=True)
    with pytest.raises(ModelError, match='contact "floor - ball" follows a law, which cannot be in MJX'):
        pmjx.put_model(physical.compile(spec))
    model = leg()
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(ModelError, match="RK4"):
        pmjx.put_model(model)
    model = leg()
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    with pytest.raises(ModelError, match="cone pyramidal"):
        pmjx.put_model(model)


def test_the_page(capsys):
    page = (Path(__file__).parents[2] / "docs" / "physical.md").read_text(encoding="utf-8")
    exec(re.search(r"^```py\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)[1], {})
    pairs = re.findall(r" (-?[\d.]+) m/s, expected (-?[\d.]+)", capsys.readouterr().out)
    assert len(pairs) == 2
    for found, expected in pairs:
        assert float(found) == pytest.approx(float(expected), rel=1e-3)
