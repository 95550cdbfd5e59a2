"""The linear model of a rig: rows of its points, springs in its clearances, poles and gains at a spin."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj.linear import linear_model
from clearance_mj.rig import Spin
from tests.conftest import ROOT

PLANE = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
SPACE = PLANE.with_shape("round")
TURNING = cm.Rig.load(ROOT / "data" / "turning_rig" / "rig.toml")
OMEGA = 2 * np.pi * np.array([3.0, 40.0, 71.0, 200.0])
FILLED = [3e3, 2e3], [4.0, 9.0]


def model_of(rig, turning=None):
    return linear_model(rig, 6, turning=turning).filled(*(np.resize(each, len(rig.bushings)) for each in FILLED))


def test_rows_are_by_clearance_then_end_then_coordinate():
    slot, round_one = linear_model(PLANE, 6), linear_model(SPACE, 6)
    n = slot.size
    assert round_one.size == 2 * n and (PLANE.n_rows, SPACE.n_rows) == (2, 4)
    assert SPACE.clearance_rows == [slice(0, 2), slice(2, 4)] and SPACE.bushing_of_row.tolist() == [0, 0, 1, 1]
    for rows, of_slot in ((round_one.at_bushings, slot.at_bushings), (round_one.at_ends, slot.at_ends)):
        along = rows.reshape(len(of_slot), 2, 2, n)  # coordinate of the point, plane of the mode
        assert not along[:, 0, 1].any() and not along[:, 1, 0].any()
        assert_allclose(along[:, 1, 1], of_slot, rtol=1e-12)
        assert_allclose(along[:, 0, 0], of_slot, rtol=1e-12)
    first, second = PLANE.clearance_ends[2], PLANE.clearance_ends[3]  # of the second bushing
    y_z = round_one.moved([first[0], second[0]])
    assert_allclose(round_one.at_ends[4:8].reshape(2, 2, -1), y_z, rtol=1e-12)
    assert_allclose(round_one.ends_by_row[2:4].swapaxes(0, 1), y_z, rtol=1e-12)
    assert_allclose(round_one.at_points, np.vstack((round_one.at_bushings, round_one.at_ends)))


def test_a_slot_is_a_round_clearance_on_a_line():
    """A round shaft shaken along z moves along z alone: gains of sensors and probes are those of the plane."""
    slot, space = model_of(PLANE), model_of(SPACE)
    plane = slot.channel_gains(slot.at_probes({}), "base", OMEGA)
    gains = space.channel_gains(space.at_probes({}), "base", OMEGA)
    sensors, n = len(PLANE.sensors), len(PLANE.bushings)
    kept = [*range(sensors), *range(sensors + 1, sensors + 2 * n, 2), sensors + 2 * n]
    assert_allclose(gains[:, kept][:, :, [*range(1, 2 * n, 2), 2 * n]], plane, rtol=1e-9, atol=1e-12)
    assert np.abs(gains[:, sensors : sensors + 2 * n : 2, -1]).max() < 1e-15


@pytest.mark.parametrize("spin", [0.0, 300.0])
def test_poles_and_gains_are_those_of_the_equation_of_motion(spin):
    """(λ² + λ (C + Ω G) + K + Ω H) q = 0 for each pole, and rows (…)⁻¹ inputs at λ = iω."""
    model = model_of(TURNING)
    n = model.size
    rows = model.at_bushings
    k, c = (np.repeat(np.resize(each, len(TURNING.bushings)), 2) for each in FILLED)
    stiffness = np.diag(model.omega**2) + (rows.T * k) @ rows + spin * model.circulatory
    viscous = np.diag(model.damping) + (rows.T * c) @ rows + spin * model.gyroscopic
    assert_allclose(model.stiff(spin), stiffness, rtol=1e-12, atol=1e-9 * stiffness.max())
    assert_allclose(model.viscous(spin), viscous, rtol=1e-12, atol=1e-12 * viscous.max())
    value, motion = model.poles(spin)
    for pole, shape in zip(value, motion.T):
        terms = pole**2 * shape, pole * viscous @ shape, stiffness @ shape
        assert np.linalg.norm(sum(terms)) < 1e-9 * sum(map(np.linalg.norm, terms))
    gains = model.displacement_gains(model.at_sensors, "base", OMEGA, spin=spin)
    inputs = np.vstack((-rows, model.input("base"))).T
    for omega, computed_gains in zip(OMEGA, gains):
        dynamic = stiffness - omega**2 * np.eye(n) + 1j * omega * viscous
        known = model.at_sensors @ np.linalg.solve(dynamic, inputs)
        assert_allclose(computed_gains, known, rtol=1e-9, atol=1e-9 * np.abs(known).max())
        assert_allclose(model.dynamic(omega, spin), dynamic, rtol=1e-12, atol=1e-9 * stiffness.max())


def test_a_step_of_the_flow_is_the_sum_of_the_poles():
    """exp(A h) V = V exp(λ h)."""
    model, step = model_of(TURNING), 1e-3
    value, motion = model.poles(100.0)
    vectors = np.vstack((motion, motion * value))
    after, atol = vectors * np.exp(value * step), 1e-9 * np.abs(vectors).max()
    assert_allclose(model.flow(step, 100.0) @ vectors, after, atol=atol)


def test_springs_in_the_clearances_deflect_as_they_do_in_series():
    """Woodbury: (K + PᵀkP)⁻¹ seen by P is (D⁻¹ + k)⁻¹ with D the deflection without springs."""
    bare, filled = linear_model(PLANE, 8), model_of(PLANE)
    points = [b.position for b in PLANE.bushings]
    alone = bare.static_deflection(points, bare.at_bushings)
    known = np.linalg.inv(np.linalg.inv(alone) + np.diag(FILLED[0]))
    assert_allclose(filled.static_deflection(points, filled.at_bushings), known, rtol=1e-6)


def test_a_rig_in_space_is_driven_along_the_direction_of_the_test():
    across = dataclasses.replace(SPACE.shaker, direction=(0.0, 1.0, 0.0))
    model, spin = linear_model(SPACE, 6).driven(SPACE.replace(shaker=across, spin=Spin(100.0, 10.0, 200.0)))
    assert spin == 150.0
    assert_allclose(model.input("base"), -linear_model(SPACE, 6).influence[:, 1])
    slot, still = linear_model(PLANE, 6).driven(PLANE.replace(shaker=across))
    assert slot is linear_model(PLANE, 6) and still == 0.0


def test_a_weight_is_the_influence_of_gravity_and_what_else_is_constant():
    down = SPACE.replace(gravity=(0.0, 0.0, -9.81))
    model, load = linear_model(down, 6), np.arange(linear_model(down, 6).size)
    assert_allclose(model.weight, -9.81 * model.influence[:, 2])
    assert_allclose(dataclasses.replace(model, load=load).weight, model.weight + load)
