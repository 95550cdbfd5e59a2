"""Disturbances against closed forms: spectra, wind forces, and what they do to the plants."""

import numpy as np
import pytest
import scipy.linalg

from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle.disturbances import Crosswind, CrownedRoad
from clearance_mj.vehicle.plant import SingleTrackDrift

from .test_controller import VEHICLE, right_hand_side
from .test_plant import every_plant

SPEED = 25.0
PERIOD = 1 << 16  # steps after which noise repeats


def rows(steps, force=0.0, moment=0.0, gravity=0.0):
    return np.tile([force, moment, gravity], (steps, 1))


@every_plant
def test_no_load_changes_no_bit(plant):
    angles, state = 0.03 * np.sin(2 * np.pi * np.arange(500) / 500), plant.start(SPEED)
    np.testing.assert_array_equal(plant.advance(state, angles, rows(500)), plant.advance(state, angles))


@every_plant
@pytest.mark.parametrize(("force", "moment", "gravity"), [(1500.0, 0.0, 0.0), (0.0, 800.0, 0.0), (0.0, 0.0, -1.2)])
def test_first_motion_is_that_of_the_linear_single_track(plant, force, moment, gravity):
    """Wheels straight: dv/dt = F/m + g_y and dr/dt = M/I at first, then the tyres answer.

    v and r after 1, 20 and, where no body rolls, 60 ms from the matrix exponential of the linear single track
    (Rajamani, Vehicle Dynamics and Control, 2012, section 2.3), written from the forces.
    """
    rates = np.zeros((3, 3))
    rates[:2, :2] = np.transpose([right_hand_side(x, 0.0, 0.0, SPEED)[2:4] for x in np.eye(6)[2:4]])
    rates[:2, 2] = force / VEHICLE.mass + gravity, moment / VEHICLE.yaw_inertia
    for steps in (1, 20) if plant.name == "multi-body" else (1, 20, 60):
        after = plant.measure(plant.advance(plant.start(SPEED), np.zeros(steps), rows(steps, force, moment, gravity)))
        expected = scipy.linalg.expm(1e-3 * steps * rates)[:2, 2]
        motion, atol = (after.lateral_speed, after.yaw_rate), 0.02 * np.abs(expected).max()
        np.testing.assert_allclose(motion, expected, rtol=0.03, atol=atol)


@every_plant
def test_steady_hold_off_on_a_crown(plant):
    """Straight on against gravity's lateral component g_y: statics of the axles, whatever their tyres.

    The front axle carries -m g_y l_r/L, so that the aligning moment is trail times that; the rear one -m g_y l_f/L, so
    that the vehicle drives at the sideslip m g_y l_f/(L C_r).
    """
    p, gravity = VEHICLE, -0.025 * 9.81
    state = plant.start(SPEED)
    for _ in range(1200):
        seen = plant.measure(state)
        state = plant.advance(state, np.full(10, -0.01 * seen.y - 0.2 * seen.heading), rows(10, gravity=gravity))
    seen = plant.measure(state)
    assert abs(seen.yaw_rate) < 1e-4
    assert seen.aligning_moment == pytest.approx(-plant.trail * p.mass * gravity * p.lr / p.wheelbase, rel=1e-3)
    sideslip = p.mass * gravity * p.lf / (p.wheelbase * p.cornering_rear)
    assert seen.sideslip == pytest.approx(sideslip, rel=0.02 if plant.name == "single-track" else 0.25)


@every_plant
def test_accelerometers_feel_wind_but_not_gravity(plant):
    """At the first instant the tyres are idle; in the steady state on a crown they carry what gravity pulls."""
    state = plant.start(SPEED)
    assert plant.measure(state, side_force=1000.0).lateral_acceleration == pytest.approx(1000 / plant.parameters.m)
    state = plant.advance(state, np.zeros(1), rows(1, gravity=-2.0))
    assert plant.measure(state).lateral_acceleration == pytest.approx(0.0, abs=0.05)


def test_load_of_another_length():
    plant = SingleTrackDrift()
    with pytest.raises(ManoeuvreError, match=r"load must have shape \(10, 3\).*got \(9, 3\)"):
        plant.advance(plant.start(SPEED), np.zeros(10), rows(9))


@pytest.mark.parametrize("speed", [15.0, 30.0])
def test_gusts_have_drydens_correlation(speed):
    """R(x) = σ² e^(-x/L) (1 - x/(2L)) over the distance x, the transform of the lateral Dryden spectrum."""
    wind, seeds = Crosswind(turbulence=2.5, length_scale=30.0), range(150)
    lags = np.round(np.array([0.0, 0.5, 1.0, 2.0, 3.0]) * wind.length_scale / speed * 1000).astype(int)
    gusts = [wind.gusts(speed, PERIOD, seed) for seed in seeds]
    correlation = np.mean([[np.mean(g * np.roll(g, lag)) for lag in lags] for g in gusts], axis=0)
    x = lags * speed / 1000 / wind.length_scale
    np.testing.assert_allclose(correlation, 2.5**2 * np.exp(-x) * (1 - x / 2), atol=0.03 * 2.5**2)


def test_side_force_of_a_light_wind():
    """½ ϱ A c V w to the left, of wind from the right, ahead of the centre of gravity by the centre of pressure."""
    load = Crosswind(mean=0.5, turbulence=0.0, begin=0.0, rise=1.0).load(SPEED, 200, 0)[-1]
    np.testing.assert_allclose(load, np.array([1.0, 0.5, 0.0]) * 0.5 * 1.2 * 1.9 * 2.3 * SPEED * 0.5, rtol=1e-3)


def test_wind_and_crown_begin_where_they_should():
    """Nothing before, half of it in the middle of the rise, all of it after."""
    steps = np.round(np.array([29.0, 40.0, 50.0, 80.0]) / SPEED * 1000).astype(int)
    crown = CrownedRoad(crown=0.02, roughness=0.0).load(SPEED, steps.max() + 1, 0)[steps]
    np.testing.assert_allclose(crown[:, 2], -9.81 * 0.02 * np.array([0, 0.5, 1, 1]), atol=1e-3)
    np.testing.assert_array_equal(crown[:, :2], 0)
    wind = Crosswind(turbulence=0.0, begin=30.0, rise=20.0)
    force = wind.load(SPEED, steps.max() + 1, 0)[steps, 0]
    np.testing.assert_allclose(force, wind.side_force(np.array([0.0, 5.0, 10.0, 10.0]), SPEED), atol=1.0)


@pytest.mark.parametrize("speed", [15.0, 30.0])
def test_unevenness_has_the_rms_of_an_isotropic_surface(speed):
    """0.1 π √(2 G₀/B): the integral of 2 G (1 - x K₁(x))/B² over all wavenumbers, ∫ (1 - x K₁)/x² dx being π/2."""
    road = CrownedRoad(roughness=256e-6, track=1.5)
    rms_height = np.sqrt(np.mean([np.var(road.unevenness(speed, PERIOD, seed)) for seed in range(60)]))
    assert rms_height == pytest.approx(0.1 * np.pi * np.sqrt(2 * 256e-6 / 1.5), rel=0.02)


def test_same_seed_same_load():
    for disturbance in (Crosswind(), CrownedRoad()):
        first, again, other = (disturbance.load(SPEED, 3000, seed) for seed in (1, 1, 2))
        np.testing.assert_array_equal(first, again)
        assert np.abs(first - other).max() > 0
