"""Friction and drives in MJX against the same model with a Softener, and gradients against differences."""

import dataclasses
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.clearance import AmplitudeLaw, ContactLaw, HuntCrossley, TimeLaw
from clearance_mj.core.errors import ModelError
from clearance_mj.rig import Grease

from .accelerated import STEPS, controls, feet, leg, machines, on_cpu, refused

pytest.importorskip("mujoco.mjx", reason="MJX is not installed; make test-mjx installs it")
jax = pytest.importorskip("jax")
jp = jax.numpy
pmjx = pytest.importorskip("clearance_mj.physical.mjx")
pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")


def in_mjx(mx, parameters, dx, state, wanted):
    """The same in MJX, and the last data and state."""

    def one(carry, control):
        dx, state = pmjx.step(mx, parameters, carry[0].replace(ctrl=control), carry[1])
        return (dx, state), jp.concatenate((dx.qpos, dx.qvel))

    carry, first = one((dx, state), wanted[0])  # MJX changes types of integers in the first step in double precision
    carry, states_after = jax.lax.scan(one, carry, wanted[1:])
    return jp.concatenate((first[None], states_after)), carry


@pytest.mark.parametrize("double", [False, True], ids=["single", "double"])
@pytest.mark.parametrize("make, speeds", [(machines, [-3] + 9 * [0]), (feet, 2 * [0.3, 0.1, 0, 0, 0, 8])])
def test_everything_moves_as_with_a_softener(make, speeds, double):
    model = make()
    data = mujoco.MjData(model)
    data.qvel[:] = speeds
    with jax.enable_x64(double):
        mx, parameters = pmjx.put_model(model)
        dx, state = pmjx.init(model, data)
        states_after, (dx, state) = jax.jit(in_mjx)(mx, parameters, dx, state, jp.array(controls(model, STEPS)))
    assert states_after.dtype == (np.float64 if double else np.float32)
    expected = on_cpu(model, data)
    np.testing.assert_allclose(states_after[:, : model.nq], expected[:, : model.nq], atol=2e-6)
    np.testing.assert_allclose(states_after[:, model.nq :], expected[:, model.nq :], atol=2e-4)
    for name in parameters.drives.names:
        np.testing.assert_allclose(
            pmjx.drive_state(mx, parameters, state, name), physical.drive_state(model, data.act, name), rtol=1e-3
        )


LIMITS = """<mujoco><option timestep="5e-4" integrator="implicitfast"/>
  <default><geom size=".05" mass="1" contype="0" conaffinity="0"/><joint axis="0 1 0" stiffness="20"/></default>
  <worldbody><body pos="-1 0 0"><joint type="ball" range="0 40" stiffness="0"/><geom pos="0 0 -.1"/></body>
    <body><joint name="constant" range="-10 10"/><geom pos=".2 0 0"/></body>
    <body pos="0 1 0"><joint name="envelope" range="-4 10"/><geom pos=".2 0 0"/></body>
    <body pos="0 2 0"><joint name="play" armature=".02"/><geom pos=".2 0 0"/></body>
    <body pos="0 3 0"><joint name="coupled"/><geom pos=".2 0 0"/></body>
    <body pos="0 4 0"><joint name="hangs" type="slide" axis="0 0 1"/><geom/><site name="end" pos="0 0 -.2"/></body>
    <site name="hook" pos="0 4 0"/></worldbody><tendon>
    <fixed name="coupled" range="-.05 .02"><joint joint="coupled" coef=".5"/></fixed>
    <spatial name="rope" range="0 .25"><site site="hook"/><site site="end"/></spatial></tendon>
  <actuator><motor joint="envelope"/><motor joint="play"/><motor joint="coupled" gear="10"/></actuator></mujoco>"""
ENVELOPE = AmplitudeLaw([0.1, 0.25, 0.4], [300.0, 900.0, 2000.0], [1.0, 4.0, 6.0], release=0.05)
IN_TIME = TimeLaw([0.0, 0.03, 0.06], [5e3, 2e3, 9e3], [5.0, 20.0, 2.0])


def limits():
    """A law over amplitude and time on each kind of limit, beside limits without one."""
    spec = mujoco.MjSpec.from_string(LIMITS)
    physical.joint_limit(spec, "constant", k=500, c=5)
    physical.joint_limit(spec, "envelope", law=ENVELOPE)
    physical.add_backlash(spec, "play", gap=0.01, law=AmplitudeLaw([0.005, 0.02], [200.0, 900.0], [1.0, 4.0]))
    physical.tendon_limit(spec, "coupled", law=IN_TIME)
    physical.tendon_limit(spec, "rope", law=AmplitudeLaw([0.2, 0.3], [1e3, 4e3], [5.0, 10.0]))
    return physical.compile(spec)


def test_laws_by_table_move_as_with_a_softener():
    """To rounding in double precision, and k of the table changes the motion as that of the law does."""
    model = limits()
    with jax.enable_x64(True):
        mx, parameters = pmjx.put_model(model)
        run = jax.jit(lambda parameters: in_mjx(mx, parameters, *start, jp.array(controls(model, STEPS)))[0])
        start = pmjx.init(model, mujoco.MjData(model))
        assert len(parameters.laws.names) == 4
        expected = on_cpu(model, mujoco.MjData(model))
        np.testing.assert_allclose(run(parameters), expected, rtol=0, atol=1e-10)
        harder = tuple(2 * k for k in parameters.laws.k)
        changed = dataclasses.replace(parameters, laws=dataclasses.replace(parameters.laws, k=harder))
        assert np.abs(run(changed) - expected)[:, 5 : model.nq].max(axis=0).min() > 1e-4


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
        soft_pairs = mx.replace(pair_solref=pmjx.pair_solref(k, 150.0, behind)[None])
        drives = dataclasses.replace(parameters.drives, numbers=parameters.drives.numbers | {"k": jp.full(2, teeth)})
        pairs = dataclasses.replace(parameters.pairs, coefficient=mu[None])
        return in_mjx(soft_pairs, dataclasses.replace(parameters, drives=drives, pairs=pairs), *start, wanted)[0]

    states_after = np.array(run(*(jp.array(values) for values in (k, teeth, mu))))
    assert np.ptp(states_after[:, -1, 0]) > 1e-3
    for i in range(0, count, 9):
        varied = leg(k=k[i], teeth=teeth[i], mu=mu[i])
        expected = on_cpu(varied, mujoco.MjData(varied), steps)
        np.testing.assert_allclose(states_after[i, :, : model.nq], expected[:, : model.nq], atol=1e-5)


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
            soft_pairs = mx.replace(pair_solref=pmjx.pair_solref(k, 150.0, behind)[None])
            changed = parameters.drives.numbers | {"k": jp.full(2, teeth), "gap": jp.full(2, gap)}
            drives = dataclasses.replace(parameters.drives, numbers=changed)
            pairs = dataclasses.replace(parameters.pairs, coefficient=mu[None])
            states_after, _ = in_mjx(
                soft_pairs, dataclasses.replace(parameters, drives=drives, pairs=pairs), *start, wanted
            )
            return states_after[-1, 0]

        numbers = np.array([2e4, 600.0, 0.01, 0.3])
        _, gradient = place(jp.array(numbers))
        for i, part in enumerate(1e-5 * np.diag(numbers)):
            difference = (place(jp.array(numbers + part))[0] - place(jp.array(numbers - part))[0]) / (2 * part[i])
            assert np.isfinite(gradient[i]) and gradient[i] != 0
            assert gradient[i] == pytest.approx(float(difference), rel=1e-3)


def test_what_cannot_be_in_mjx_is_refused():
    for model, says in refused("MJX"):
        with pytest.raises(ModelError, match=says):
            pmjx.put_model(model)
    for law in (
        ContactLaw(HuntCrossley(1e3, 0.5)),
        AmplitudeLaw([0.1, 0.2], [1.0, 2.0], [1.0, 1.0], grease=Grease(5.0)),
    ):
        spec = mujoco.MjSpec.from_string(LIMITS)
        physical.joint_limit(spec, "envelope", law=law)
        with pytest.raises(ModelError, match=r'joint limit "envelope" follows a law, .* tables of k and c'):
            pmjx.put_model(physical.compile(spec))
    model = leg()
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    with pytest.raises(ModelError, match="cone pyramidal"):
        pmjx.put_model(model)


def test_the_page(capsys):
    page = (Path(__file__).parents[2] / "docs" / "physical.md").read_text(encoding="utf-8")
    exec(re.search(r"^```py\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)[1], {})
    pairs = re.findall(r" (-?[\d.]+) m/s, expected (-?[\d.]+)", capsys.readouterr().out)
    assert len(pairs) == 2
    for printed_value, expected in pairs:
        assert float(printed_value) == pytest.approx(float(expected), rel=1e-3)
