"""Friction and drives in MuJoCo Warp against the same model with a Softener."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import ModelError

from .accelerated import FEET, STEPS, controls, feet, leg, machines, on_cpu, refused
from .stepping import with_data

mjw = pytest.importorskip("mujoco_warp", reason="MuJoCo Warp is not installed; make test-warp installs it")
pwarp = pytest.importorskip("clearance_mj.physical.warp")
pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")


def in_warp(m, d, wanted):
    """States (steps, nworld, nq + nv) of all worlds with the same controls (steps, nu)."""
    states_after = []
    for control in wanted:
        d.ctrl.assign(np.tile(control, (d.nworld, 1)).astype(np.float32))
        mjw.step(m, d)
        states_after.append(np.concatenate((d.qpos.numpy(), d.qvel.numpy()), axis=1))
    return np.array(states_after)


def assert_alike(model, states_after, expected):
    """Compare states with those of the CPU, m and rad, m/s and rad/s."""
    np.testing.assert_allclose(states_after[:, : model.nq], expected[:, : model.nq], atol=2e-6)
    np.testing.assert_allclose(states_after[:, model.nq :], expected[:, model.nq :], atol=2e-4)


@pytest.mark.parametrize("make, speeds", [(machines, [-3] + 9 * [0]), (feet, 2 * [0.3, 0.1, 0, 0, 0, 8])])
def test_everything_moves_as_with_a_softener(make, speeds):
    model, data = with_data(make())
    data.qvel[:] = speeds
    m, parameters = pwarp.put_model(model)
    d = mjw.put_data(model, data, nworld=2)
    states_after = in_warp(m, d, controls(model, STEPS))
    expected = on_cpu(model, data)
    np.testing.assert_array_equal(states_after[:, 0], states_after[:, 1])
    assert_alike(model, states_after[:, 1], expected)
    for name in parameters.drive_names:
        np.testing.assert_allclose(
            physical.drive_state(model, d.act.numpy()[1], name), physical.drive_state(model, data.act, name), rtol=1e-3
        )


def test_numbers_differ_between_worlds():
    count, steps = 64, 200
    rng = np.random.default_rng(1)
    k, teeth, mu = rng.uniform(1e4, 3e4, count), rng.uniform(400, 800, count), rng.uniform(0.1, 0.8, count)
    model = leg()
    m, parameters = pwarp.put_model(model, count, batch_sizes={"pair_solref": count})
    solref, _ = physical.solref_solimp(k, 150.0, physical.inverse_inertia(model, "pair", 0))
    m.pair_solref.assign(solref[:, None].astype(np.float32))
    solimp = m.pair_solimp.numpy()
    solimp[..., :2] = physical.IMPEDANCE
    m.pair_solimp.assign(solimp)
    for array, name, values in ((parameters.drives, "k", teeth), (parameters.frictions, "largest", mu)):
        numbers = array.numpy()
        numbers[name] = values[:, None]
        array.assign(numbers)
    states_after = in_warp(m, mjw.make_data(model, nworld=count), controls(model, steps))
    assert np.ptp(states_after[-1, :, 0]) > 1e-3
    for i in range(0, count, 9):
        varied = leg(k=k[i], teeth=teeth[i], mu=mu[i])
        expected = on_cpu(varied, mujoco.MjData(varied), steps)
        np.testing.assert_allclose(states_after[:, i, : model.nq], expected[:, : model.nq], atol=1e-5)


def test_worlds_begin_anew_and_steps_may_be_asked_for_again():
    import warp as wp

    model = leg()
    wanted = controls(model, 60)
    m, _ = pwarp.put_model(model)
    once = in_warp(m, mjw.make_data(model, nworld=2), wanted)
    d = mjw.make_data(model, nworld=2)
    positions = []
    for control in wanted:
        d.ctrl.assign(np.tile(control, (2, 1)).astype(np.float32))
        for _ in range(3):
            mjw.forward(m, d)
        mjw.step(m, d)
        positions.append(d.qpos.numpy().copy())
    np.testing.assert_array_equal(np.array(positions), once[..., : model.nq])
    mjw.reset_data(m, d, wp.array([True, False], dtype=bool))
    again = in_warp(m, d, wanted)
    np.testing.assert_array_equal(again[:, 0], once[:, 0])
    assert np.abs(again[-1, 1] - once[-1, 1]).max() > 1e-3


def test_a_motion_goes_on_from_the_cpu():
    model, data = with_data(feet())
    data.qvel[:] = 2 * [0.3, 0.1, 0, 0, 0, 8]
    on_cpu(model, data, 100)
    m, _ = pwarp.put_model(model)
    assert_alike(model, in_warp(m, mjw.put_data(model, data), np.zeros((100, 0)))[:, 0], on_cpu(model, data, 100))


@pytest.mark.parametrize("cone", [mujoco.mjtCone.mjCONE_PYRAMIDAL, mujoco.mjtCone.mjCONE_ELLIPTIC])
def test_conveyors_and_sparse_rows_in_any_cone(cone):
    def conveyor(spec):
        spec.geom("floor").surfacevel = [0.2, 0.1, 0, 0, 0, 0.5]
        spec.option.cone, spec.option.jacobian = cone, mujoco.mjtJacobian.mjJAC_SPARSE

    model = feet(conveyor)
    m, _ = pwarp.put_model(model)
    data = mujoco.MjData(model)
    states_after = in_warp(m, mjw.put_data(model, data), np.zeros((STEPS, 0)))[:, 0]
    assert np.abs(states_after[-1, model.nq]) > 0.1  # it has been carried along
    model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL  # the elliptic one's rows of friction differ by 4e-6 on the CPU
    assert_alike(model, states_after, on_cpu(model, data))


def test_what_cannot_be_in_warp_is_refused():
    for model, says in refused("MuJoCo Warp"):
        with pytest.raises(ModelError, match=says):
            pwarp.put_model(model)
    model = leg()
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    with pytest.raises(ModelError, match="discrete changes the rows of contacts"):
        pwarp.put_model(model)
    model = leg()
    model.opt.disableactuator = 1
    with pytest.raises(ModelError, match="no disabled groups of actuators"):
        pwarp.put_model(model)
    with pytest.raises(ModelError, match="no room in its userdata"):
        pwarp.put_model(feet(lambda spec: None, mujoco.MjSpec.compile))
    m, _ = pwarp.put_model(feet())
    with pytest.raises(ModelError, match="data have no room for bristles"):
        mjw.step(m, mjw.make_data(mujoco.MjModel.from_xml_string(FEET)))


def test_the_page(capsys):
    page = (Path(__file__).parents[2] / "docs" / "physical.md").read_text(encoding="utf-8")
    exec(re.search(r"^```py\n(import mujoco\n.*?)^```$", page, re.DOTALL | re.MULTILINE)[1], {})
    printed_value, expected = re.search(r" (-?[\d.]+) m/s, expected (-?[\d.]+)", capsys.readouterr().out).groups()
    assert float(printed_value) == pytest.approx(float(expected), rel=1e-3)
