"""Sensors: noise, offsets, quantisation, rates and delays against what they are said to be."""

import math

import numpy as np
import pytest
import scipy.stats

from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle.controllers import Observation
from clearance_mj.vehicle.experiment import Case
from clearance_mj.vehicle.manoeuvres import straight
from clearance_mj.vehicle.plant import Measurement, MultiBody
from clearance_mj.vehicle.run import follow_path, nominal_task
from clearance_mj.vehicle.sensors import SENSORS, CarSensors, IdealSensors, Sensors, get_sensors
from clearance_mj.vehicle.sensors.bus import Message, age

from ..refusals import assert_refused

SPEED, PERIOD = 20.0, 0.01
TASK = nominal_task(straight(1000.0), SPEED)


def still(k):
    """Truth and measurement of a vehicle that drives along the x axis, at sample k."""
    x = SPEED * PERIOD * k
    return Observation(x, 0.0, 0.0, 0.0, 0.0, SPEED), Measurement(x, 0.0, 0.0, SPEED, 0.0, 0.0, 0.0, 0.0, 0.0)


def signals(sensors, samples, seed=0, servo=lambda k: 0.0):
    """Signals of a vehicle that drives straight while its servo turns."""
    run = sensors.start(TASK, seed)
    return [run.observe(*still(k), servo(k), 0.0).signals for k in range(samples)]


def test_ideal_sensors_add_white_noise_to_the_truth():
    """Four normal draws of the stream [seed, 1] at each sample: lateral position, heading, lateral speed, yaw rate."""
    run, noise = IdealSensors.inertial().start(TASK, 7), np.random.default_rng([7, 1])
    deviations = (0.01, np.radians(0.05), 0.02, np.radians(0.1))
    for k in range(20):
        true = Observation(0.2 * k, 0.03, -0.02, 0.3, 0.1, SPEED)
        seen = run.observe(true, Measurement(1.0, 2.0, 0.7, SPEED, 0.3, 0.1, 2.0, 0.0, 0.0), 0.05, 0.04)
        draws = [v + d * n for v, d, n in zip(true[1:5], deviations, noise.standard_normal(4))]
        assert seen[:6] == (true.s, *draws, SPEED) and seen.signals[1:5] == (0.05, seen.yaw_rate, 2.0, SPEED)
        # The position is off across the path, whose heading is 0.72, by what the lateral error is.
        off = np.subtract(seen.signals.position, (1.0, 2.0))
        np.testing.assert_allclose(off, (seen.e_y - 0.03) * np.array([-np.sin(0.72), np.cos(0.72)]), atol=1e-15)


def test_without_noise_ideal_sensors_tell_the_truth():
    true, now = still(5)
    assert IdealSensors().start(TASK).observe(true, now, 0.0, 0.0)[:6] == true[:6]


def test_steering_angle_is_quantised():
    """A ramp without delay: multiples of 0.1°/16, off by at most half of it and by q²/12 in the mean square."""
    step, ramp = math.radians(0.1) / 16, 3.1e-6
    seen_signals = signals(CarSensors(delay=(0.0, 0.0)), 2000, servo=lambda k: ramp * k)
    seen, true = np.array([s.steering_angle for s in seen_signals]), ramp * np.arange(2000)
    np.testing.assert_allclose(seen / step, np.round(seen / step), atol=1e-9)
    assert np.abs(seen - true).max() <= step / 2 * (1 + 1e-9)
    assert np.mean((seen - true) ** 2) == pytest.approx(step**2 / 12, rel=0.02)


def ages_of(delay, seed, n):
    """Ages, in periods, of the newest value of a message that is sent and read n times; values keep their order."""
    message, newest, ages = Message(delay, np.random.default_rng(seed)), -1, []
    for k in range(n):
        message.send(k * PERIOD, k)
        arrived = message.read(k * PERIOD)
        assert arrived is None or arrived > newest
        newest = newest if arrived is None else arrived
        ages.append(k - newest)
    return ages[10:]


def test_messages_keep_their_order_and_ages():
    """Delays of 10 to 30 ms read each 10 ms: a value is 20 or 30 ms old, each with the probability 1/2."""
    n = 20000
    shares = np.bincount(ages_of((0.01, 0.03), 0, n)) / (n - 10)
    assert shares.size == 4 and shares[:2].sum() == 0
    assert shares[2] == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(n))
    assert age((0.01, 0.03), PERIOD) == pytest.approx((0.025, 0.005))


@pytest.mark.parametrize("delay", [(0.0, 0.0), (0.02, 0.02), (0.025, 0.025), (0.0, 0.01), (0.03, 0.09)])
def test_age_of_the_newest_value(delay):
    """Closed form against reading a message whose delays are drawn."""
    ages = PERIOD * np.array(ages_of(delay, 1, 20000))
    assert (ages.mean(), ages.std()) == pytest.approx(age(delay, PERIOD), abs=2e-4)


def test_position_fixes():
    """20 Hz of fixes on the track, each told once; white noise of 20 mm within the chi-square's 99.9 %."""
    fixes = [(s.time, s.position) for s in signals(CarSensors(), 4010) if s.position is not None]
    assert len(fixes) == pytest.approx(20 * 40.1, abs=2)
    times, y = np.array([t for t, _ in fixes]), np.array([p[1] for _, p in fixes])
    assert set(np.round(np.diff(times), 6)) <= {0.04, 0.05, 0.06}  # taken each 50 ms, 20 or 30 ms old
    low, high = scipy.stats.chi2.ppf([5e-4, 0.9995], y.size)
    assert low < np.sum(y**2) / 0.02**2 < high
    assert np.array([p[0] for _, p in fixes]) == pytest.approx(SPEED * (times - 0.025), abs=SPEED * 0.005 + 0.1)


def test_offsets_stay_and_differ_between_runs():
    """Means over a run of 100 samples, over 150 seeds: 0.2 °/s and 0.1 m/s², the chi-square's 99.9 % each."""
    runs = [signals(CarSensors(), 105, seed)[5:] for seed in range(150)]
    low, high = scipy.stats.chi2.ppf([5e-4, 0.9995], len(runs))
    for values, offset, noise in (
        ([[s.yaw_rate for s in run] for run in runs], np.radians(0.2), np.radians(0.1)),
        ([[s.lateral_acceleration for s in run] for run in runs], 0.1, 0.05),
    ):
        assert low < np.sum(np.mean(values, axis=1) ** 2) / (offset**2 + noise**2 / 75) < high
        # A quarter of the samples shows an older value once more.
        assert np.std(values, axis=1).mean() == pytest.approx(noise, rel=0.03)


def test_old_signals_under_a_delay():
    """40 ms at least and at most: the steering angle is that of 4 samples ago."""
    seen_signals = signals(CarSensors(delay=(0.04, 0.04), steering_resolution=0.0), 50, servo=lambda k: 1e-3 * k)
    assert [s.steering_angle for s in seen_signals[4:]] == pytest.approx(1e-3 * np.arange(46))
    assert seen_signals[0].delay == pytest.approx(0.04)


def test_same_seed_same_signals():
    one, same, other = (signals(CarSensors(), 100, seed) for seed in (3, 3, 4))
    assert one == same and one != other


def test_observer_sees_better_than_a_fix():
    """A lane change with clearance: RMS of the lateral error seen below 14 mm, 20 mm of a fix each 50 ms."""
    errors = []

    class Recorded(Sensors):
        def start(self, task, seed=0):
            run = CarSensors().start(task, seed)
            observe = run.observe

            def recorded(true, *others):
                seen = observe(true, *others)
                errors.append(np.subtract(seen[:6], true[:6]))
                return seen

            run.observe = recorded
            return run

    case = Case("smc-cm", 72.0, sensors=Recorded(), seed=100)
    follow_path(MultiBody(), case.steering, case.tuned_controller, case.task, case.sensors, case.seed)
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert np.all(rms[[1, 2, 4]] < (0.014, np.radians(0.12), np.radians(0.3)))


def test_names_of_sensors():
    assert get_sensors("car") is SENSORS["car"] and get_sensors(SENSORS["ideal"]) is SENSORS["ideal"]


@pytest.mark.parametrize(("make", "words"), [
    (lambda: get_sensors("lidar"), 'sensors "lidar" are unknown; known: ideal, car'),
    (lambda: CarSensors(position=-1.0), "CarSensors.position must be finite and >= 0"),
    (lambda: CarSensors(delay=(0.03, 0.01)), "CarSensors.delay must be two delays in order"),
    (lambda: CarSensors(position_rate=0.0), "CarSensors.position_rate must be > 0 Hz"),
    (lambda: CarSensors(position_rate=200.0).start(TASK), "at most 100 Hz"),
])  # fmt: skip
def test_impossible_sensors(make, words):
    assert_refused(ManoeuvreError, words, make)
