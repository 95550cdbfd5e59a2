"""Roads of ISO 8608 and the quarter-car that runs over them."""

import numpy as np
import pytest
import scipy.signal

import clearance_mj as cm
from clearance_mj.signals.psd import PSD
from clearance_mj.signals.road import ROAD_CLASSES, QuarterCar, Road, road_psd

from ..refusals import assert_refused


def test_classes_are_those_of_iso_8608():
    """ISO 8608:1995, table C.1: G_d(n0) in 1e-6 m³ at n0 = 0.1 cycles/m: geometric mean, and upper limit up to G."""
    means = dict(zip("ABCDEFGH", (16, 64, 256, 1024, 4096, 16384, 65536, 262144)))
    limits = dict(zip("ABCDEFG", (32, 128, 512, 2048, 8192, 32768, 131072)))
    assert {n: c[1] * 1e6 for n, c in ROAD_CLASSES.items()} == pytest.approx(means, rel=1e-12)
    assert {n: c[2] * 1e6 for n, c in ROAD_CLASSES.items() if n != "H"} == pytest.approx(limits, rel=1e-12)
    assert all(ROAD_CLASSES[b][0] == ROAD_CLASSES[a][2] for a, b in zip("ABCDEFG", "BCDEFGH"))


def test_profile_falls_by_its_waviness():
    assert Road.of_class("C").displacement([0.1, 1.0, 0.05]) == pytest.approx([256e-6, 2.56e-6, 1024e-6])


def state_space(car):
    """Return the system from the road's height to heights of hub and body: Newton's equations in first order.

    The tyre's damper acts on the rate of the road, so the road's height itself is a state: its input is the rate.
    """
    mu, ms, ks, cs = car.unsprung_mass, car.sprung_mass, car.suspension_stiffness, car.suspension_damping
    kt, ct = car.tyre_stiffness, car.tyre_damping
    a = np.zeros((5, 5))  # hub, body, their velocities, road
    a[0, 2] = a[1, 3] = 1.0
    a[2] = np.array([-(ks + kt), ks, -(cs + ct), cs, kt]) / mu
    a[3] = np.array([ks, -ks, cs, -cs, 0.0]) / ms
    return a, np.array([0.0, 0.0, ct / mu, 0.0, 1.0])


@pytest.mark.parametrize("car", [QuarterCar(), QuarterCar(350.0, 45.0, 25e3, 1800.0, 220e3, 150.0)])
def test_transfer_is_that_of_newtons_equations_marched(car):
    """Sines over the road, marched by the exact discretisation of the linear system until they are steady."""
    a, b = state_space(car)
    for frequency in (1.3, 4.0, 11.0):
        fs = 400 * frequency
        time = np.arange(round(20 * fs)) / fs
        system = (a, b[:, None], np.eye(5)[:2], np.zeros((2, 1)))
        rate = 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * time)
        _, heights, _ = scipy.signal.lsim(system, rate, time, interp=True)
        last = slice(-400 * 4, None)
        turning = np.exp(-2j * np.pi * frequency * time[last])
        ratio = (heights[last].T @ turning) / (np.sin(2 * np.pi * frequency * time[last]) @ turning)
        transfers = [car.transfer(frequency, at) for at in ("hub", "body")]
        assert transfers == pytest.approx(ratio.tolist(), rel=1e-4)  # the rate's straight pieces: (2π/400)²/12 = 2e-5


def test_acceleration_is_that_of_the_car_over_a_road_of_random_height():
    """Noise of the road's own spectrum, marched through Newton's equations, and Welch's estimate of the hub."""
    speed, fs, car = 20.0, 512.0, QuarterCar()
    psd = road_psd("C", speed, car, "hub", band=(1.0, 40.0))
    frequency = np.geomspace(1.0, 40.0, 300)
    rates = (2 * np.pi * frequency) ** 2 * Road.of_class("C").displacement(frequency / speed) / speed
    rate = cm.excitation.from_psd(PSD(frequency, rates), 400.0, fs, seed=1)
    a, b = state_space(car)
    _, acceleration, _ = scipy.signal.lsim((a, b[:, None], a[2:3], b[2:3, None]), rate.value, rate.time)
    lines, density = scipy.signal.welch(acceleration, fs, nperseg=2048)
    inner = (lines > 2.0) & (lines < 35.0)
    assert np.mean(density[inner] / psd.at(lines[inner])) == pytest.approx(1.0, abs=0.03)
    assert acceleration.std() == pytest.approx(psd.rms, rel=0.03)


def test_default_band_is_that_of_iso_8608_at_the_speed():
    assert road_psd("A", 10.0).band == pytest.approx((0.11, 28.3))
    assert road_psd("B", 10.0).rms == pytest.approx(2 * road_psd("A", 10.0).rms)


@pytest.mark.parametrize(("arguments", "words"), [
    (("I", 10.0), 'road class "I" is unknown; use A, B, C, D, E, F, G, H'),
    (("A", 0.0), "speed 0.0: must be > 0 m/s"),
    (("A", 10.0, None, "seat"), 'at \'seat\': must be "hub" or "body"'),
    (("A", 10.0, None, "hub", (0.0, 5.0)), "must be two rising frequencies above 0 Hz"),
])  # fmt: skip
def test_refuses(arguments, words):
    assert words in assert_refused(cm.ExcitationError, None, road_psd, *arguments)


def test_refuses_a_car_that_cannot_be():
    assert_refused(cm.ExcitationError, "sprung_mass", QuarterCar, sprung_mass=-1.0)
