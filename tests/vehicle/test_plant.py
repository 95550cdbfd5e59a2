"""Plants against the library's own right-hand sides, closed forms of the linear single track, and each other."""

import dataclasses
import functools

import numpy as np
import pytest
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
from vehiclemodels.vehicle_dynamics_std import vehicle_dynamics_std
from vehiclemodels.vehicle_parameters import setup_vehicle_parameters

from clearance_mj.core.errors import ManoeuvreError, SimulationError
from clearance_mj.vehicle import commonroad
from clearance_mj.vehicle.commonroad import compiled_parameters, multi_body, parameters, single_track_drift
from clearance_mj.vehicle.nominal import Vehicle
from clearance_mj.vehicle.plant import STEP, MultiBody, SingleTrackDrift, Spread

from ..refusals import assert_refused

PLANTS = {plant.name: plant for plant in (MultiBody(), SingleTrackDrift())}
every_plant = pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS)
RIGHT_HAND_SIDES = {
    "multi-body": (MultiBody(), multi_body, vehicle_dynamics_mb),
    "single-track": (SingleTrackDrift(), single_track_drift, vehicle_dynamics_std),
}


def drive(plant, wheel_angle, speed=20.0, every=10):
    """States at every so many milliseconds."""
    states = [plant.start(speed)]
    for start in range(0, len(wheel_angle), every):
        states.append(plant.advance(states[-1], wheel_angle[start : start + every]))
    return states


def measured(plant, states, name):
    return np.array([getattr(plant.measure(state), name) for state in states])


@pytest.mark.parametrize("shifted", [False, True], ids=["shifts zeroed", "as shipped"])
@pytest.mark.parametrize("name", RIGHT_HAND_SIDES)
def test_right_hand_side_is_the_librarys(name, shifted):
    """Random states about driving, among them some with locked wheels and one at rest, and inputs beyond the limits."""
    plant, compiled, original = RIGHT_HAND_SIDES[name]
    values = setup_vehicle_parameters(2) if shifted else parameters()
    numbers, generator = compiled_parameters(values)[0], np.random.default_rng(0)
    for i in range(200):
        state = plant.start(generator.uniform(3, 50))[:-1]
        state += generator.normal(0, 0.02, state.size) * np.where(np.abs(state) > 1, state, 1)
        state[3] = 0.05 if i == 0 else state[3]
        state[-2] = -1.0 if i % 10 == 1 else state[-2]
        u = generator.normal(0, (0.4, 8.0))
        ours = compiled(state.copy(), u, numbers)
        np.testing.assert_allclose(ours, original(state.tolist(), u.tolist(), values), rtol=1e-12, atol=1e-12)


@every_plant
def test_runge_kutta_with_the_librarys_right_hand_side(plant):
    """The same steps in Python: wheel angle set, cruise control of 2 1/s, no steering speed."""
    original, values = RIGHT_HAND_SIDES[plant.name][2], plant.parameters
    angles, state = 0.03 * np.sin(2 * np.pi * np.arange(20) / 20), plant.start(25.0)
    state[3] -= 1.0
    x = state[:-1].copy()

    def rate(x):
        return np.array(original(x.tolist(), [0.0, 2.0 * (25.0 - x[3])], values))

    for angle in angles:
        x[2] = angle
        slopes = [rate(x)]
        for weight in (0.5, 0.5, 1.0):
            slopes.append(rate(x + weight * STEP * slopes[-1]))
        x += STEP / 6 * np.dot([1, 2, 2, 1], slopes)
    np.testing.assert_allclose(plant.advance(state, angles)[:-1], x, rtol=1e-11, atol=1e-12)


@every_plant
@pytest.mark.parametrize("speed", [72 / 3.6, 120 / 3.6])
def test_straight_stays_straight(plant, speed):
    states = drive(plant, np.zeros(10_000), speed, 1000)
    assert max(abs(state[1]) for state in states) < 1e-12 and np.ptp([state[3] for state in states]) < 1e-2
    assert np.all(measured(plant, states, "aligning_moment") < 1e-9)


def test_why_the_shifts_are_zeroed():
    """As shipped the multi-body model weaves by centimetres with its wheels straight."""

    class Shipped(MultiBody):
        @functools.cached_property
        def parameters(self):
            return setup_vehicle_parameters(2)

    assert np.ptp([state[1] for state in drive(Shipped(), np.zeros(10_000), 120 / 3.6)]) > 0.01
    assert any(getattr(setup_vehicle_parameters(2).tire, name) for name in commonroad.SHIFT_PARAMETERS)


@every_plant
@pytest.mark.parametrize("speed", [20.0, 33.3])
def test_steady_state_cornering(plant, speed):
    """r = v δ/(L + K v²) and what follows from it (Rajamani, Vehicle Dynamics and Control, 2012, section 3.3).

    The single track's K is that of its tyres. The multi-body model has roll steer and camber too: its K, found at 27
    m/s, must hold at the other speeds.
    """
    vehicle, angle = Vehicle.bmw320i(), 0.002

    def steady(speed):
        return plant.measure(drive(plant, np.full(6000, angle), speed)[-1])

    axles = vehicle.lr / vehicle.cornering_front - vehicle.lf / vehicle.cornering_rear
    gradient = vehicle.mass / vehicle.wheelbase * axles
    if plant.name == "multi-body":
        gradient = (27.0 * angle / steady(27.0).yaw_rate - vehicle.wheelbase) / 27.0**2
        assert 0 < gradient * 9.81 < np.radians(0.1)
    seen = steady(speed)
    assert seen.yaw_rate == pytest.approx(speed * angle / (vehicle.wheelbase + gradient * speed**2), rel=0.003)
    assert seen.lateral_acceleration == pytest.approx(seen.speed * seen.yaw_rate, rel=1e-4)
    front_force = vehicle.mass * vehicle.lr / vehicle.wheelbase * seen.lateral_acceleration
    assert seen.aligning_moment == pytest.approx(plant.trail * front_force, rel=1e-3)
    if plant.name == "single-track":
        slip = vehicle.mass * vehicle.lf / (vehicle.wheelbase * vehicle.cornering_rear) * seen.lateral_acceleration
        assert seen.sideslip == pytest.approx(vehicle.lr * seen.yaw_rate / speed - slip, rel=0.01)


def test_aligning_moment_from_the_tyres():
    """Single track in a quick turn: the moment is trail times what the library's tyre gives at the front axle."""
    from vehiclemodels.utils import tire_model

    plant = SingleTrackDrift()
    state = drive(plant, 0.05 * np.sin(2 * np.pi * 0.7 * STEP * np.arange(400)))[-1]
    p, v, beta, r = plant.parameters, state[3], state[6], state[5]
    slip = np.arctan((v * np.sin(beta) + r * p.a) / (v * np.cos(beta))) - state[2]
    force = tire_model.formula_lateral(slip, 0, p.m * 9.81 * p.b / (p.a + p.b), p.tire)[0]
    assert abs(force) > 500
    # The drive torque's load transfer, combined slip and the steering angle's cosine are left out here.
    assert plant.measure(state).aligning_moment == pytest.approx(plant.trail * force, rel=0.02)


def test_plants_agree():
    """One period of sine steering at 72 km/h, 5 m/s²: peaks within 10 % of each other."""
    angles = 0.04 * np.sin(2 * np.pi * 0.4 * STEP * np.arange(2500))
    for name in ("yaw_rate", "lateral_acceleration", "aligning_moment"):
        peaks = [np.abs(measured(p, drive(p, angles), name)).max() for p in PLANTS.values()]
        assert peaks[0] == pytest.approx(peaks[1], rel=0.1)
    assert peaks[0] > 50


@every_plant
def test_speed_is_held(plant):
    angles = 0.05 * np.sin(2 * np.pi * 0.5 * STEP * np.arange(4000))
    assert measured(plant, drive(plant, angles), "speed") == pytest.approx(20.0, abs=0.4)


@every_plant
@pytest.mark.parametrize(("mass", "stiffness"), [(1.2, 1.0), (1.0, 0.7)])
def test_spread_of_mass_and_stiffness(plant, mass, stiffness):
    """Steady state: the aligning moment is as the mass, the rear axle's slip per acceleration as 1 / stiffness."""

    def observe(plant):
        seen = plant.measure(drive(plant, np.full(4000, 0.003))[-1])
        slip = plant.parameters.b * seen.yaw_rate / seen.speed - seen.sideslip
        return np.array([seen.aligning_moment, slip]) / seen.lateral_acceleration

    changed = dataclasses.replace(plant, spread=Spread(mass, stiffness))
    p = plant.parameters
    expected = (p.m + (mass - 1) * p.m_s) / p.m, 1 / stiffness
    np.testing.assert_allclose(observe(changed) / observe(plant), expected, rtol=0.03)


@every_plant
def test_spread_of_friction(plant):
    """Wheels far beyond the tyres' largest force: the lateral acceleration reached is as the friction."""
    plants = [dataclasses.replace(plant, spread=Spread(friction=friction)) for friction in (0.8, 0.4)]
    ramp = 0.1 * np.minimum(np.arange(4000) / 2000, 1)
    dry, wet = (measured(p, drive(p, ramp), "lateral_acceleration").max() for p in plants)
    assert wet / dry == pytest.approx(0.5, abs=0.02)


def test_spread_is_seeded():
    assert Spread.random(3) == Spread.random(3)
    drawn = [Spread.random(seed) for seed in range(200)]
    assert len(set(drawn)) == 200
    for name, low, high in (("mass", 0.9, 1.1), ("stiffness", 0.85, 1.15), ("friction", 0.8, 1.0)):
        values = [getattr(spread, name) for spread in drawn]
        assert low <= min(values) < low + 0.02 and high - 0.02 < max(values) <= high


def test_impossible_spread():
    assert_refused(ManoeuvreError, r"spread\.friction is a factor in 0\.2\.\.2, got 0", Spread, friction=0.0)


def test_roll_over():
    """Beyond the acceleration at which a wheel lifts off the library's tyres divide by their load."""
    assert_refused(SimulationError, "a wheel left the ground", drive, MultiBody(), np.full(4000, 0.2))


@every_plant
def test_motion_that_is_not_finite(plant):
    assert_refused(SimulationError, "no longer finite", plant.advance, plant.start(20.0), [0.0, np.nan])


@every_plant
def test_state_is_not_changed(plant):
    state = plant.start(20.0, (1.0, 2.0, 0.5))
    before = state.copy()
    plant.advance(state, np.full(10, 0.1))
    plant.measure(state)
    np.testing.assert_array_equal(state, before)
    assert plant.measure(state)[:4] == (1.0, 2.0, 0.5, 20.0)
