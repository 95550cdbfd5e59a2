"""The observer of a car's states against the linear model that it is made for, written down here once more."""

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.stats

from clearance_mj.vehicle.controllers import Task
from clearance_mj.vehicle.manoeuvres import straight
from clearance_mj.vehicle.nominal import Servo
from clearance_mj.vehicle.sensors.observer import Deviations, RunObserver, observer_model

from .test_controller import VEHICLE, right_hand_side

SPEED, PERIOD = 25.0, 0.01
TASK = Task(VEHICLE, straight(1000.0), SPEED)
KNOWN = Deviations(2e-5, 2e-3, 0.05, 0.02, 4e-3, 0.2)


def linear_model():
    """A, B, G of the single track with servo, offsets and Gauss-Markov forces, from the equations of motion."""

    def rates(x, command, w):
        *motion, servo = right_hand_side(x[:6], command, 0.0, SPEED, x[8:])
        forces = -x[8:] / KNOWN.force_time + KNOWN.force * np.sqrt(2 / KNOWN.force_time) * w[:2]
        return np.array([*motion, servo + KNOWN.servo * w[2], 0.0, KNOWN.offset_drift * w[3], *forces])

    A = np.column_stack([rates(e, 0.0, np.zeros(4)) for e in np.eye(10)])
    G = np.column_stack([rates(np.zeros(10), 0.0, w) for w in np.eye(4)])
    return A, rates(np.zeros(10), 1.0, np.zeros(4)), G


A, B, G = linear_model()
LATERAL = np.array([A[2] + SPEED * np.eye(10)[3] + np.eye(10)[7]])[0]
"""Row of the lateral acceleration: dv_y/dt + v r, and the sensor's offset"""
FLOW = scipy.linalg.expm(A * PERIOD)


def held(duration):
    """Effect of a command that is held."""
    return scipy.integrate.quad_vec(lambda t: scipy.linalg.expm(A * t) @ B, 0, duration)[0]


def noise_covariance():
    """∫ exp(A t) G Gᵀ exp(Aᵀ t) dt over a period, by quadrature."""
    growth = lambda t: scipy.linalg.expm(A * t)  # noqa: E731
    return scipy.integrate.quad_vec(lambda t: growth(t) @ G @ G.T @ growth(t).T, 0, PERIOD)[0]


def test_model_is_that_of_the_equations_of_motion():
    model = observer_model(VEHICLE, Servo(), SPEED, PERIOD, 0.0, KNOWN)
    np.testing.assert_allclose(model.flow, FLOW, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(model.inputs[:, 1], held(PERIOD), atol=1e-12)
    np.testing.assert_allclose(model.noise, noise_covariance(), rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(model.rows[2], LATERAL, rtol=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.025, 0.037])
def test_delay_is_compensated(delay):
    """Exact measurements of the linear model, as old as the observer takes them to be: its present is the truth.

    Commands change each 10 ms; the truth is stepped by 1 ms.
    """
    observer = RunObserver(TASK, delay, KNOWN)
    small, push = scipy.linalg.expm(A * 1e-3), held(1e-3)
    x, truth, rng, command = np.zeros(10), [np.zeros(10)], np.random.default_rng(2), 0.0
    old = round(delay / 1e-3)
    for k in range(150):
        if k:
            observer.advance(command, SPEED)
        past = truth[10 * k - old] if 10 * k >= old else np.zeros(10)
        s = SPEED * (k * PERIOD - delay)
        observer.measure(past[4], (past[3] + past[6], LATERAL @ past), (s, past[0]) if k % 5 == 0 else None)
        found_s, present = observer.present(SPEED)
        np.testing.assert_allclose(present, x, atol=1e-10)
        assert found_s == pytest.approx(SPEED * k * PERIOD, abs=1e-9)
        command = 0.05 * rng.standard_normal()
        for _ in range(10):
            x = small @ x + push * command
            truth.append(x)
    assert np.abs(x[:2]).max() > 1e-3  # it has moved


@pytest.mark.parametrize("driven", [0.0, 2.0])
def test_covariance_is_that_of_the_errors(driven):
    """Normalised squared error of the estimate after 1 s, over 150 runs of the linear model: the chi-square's 99 %.

    Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4.
    """
    spread = np.linalg.cholesky(noise_covariance() + 1e-20 * np.eye(10))
    force, runs, total = held(PERIOD), 150, 0.0
    for seed in range(runs):
        rng, observer = np.random.default_rng(seed), RunObserver(TASK, 0.0, KNOWN, driven)
        x = np.zeros(10)
        x[6:] = rng.standard_normal(4) * (KNOWN.yaw_rate_offset, KNOWN.acceleration_offset, KNOWN.force, KNOWN.force)
        if driven:
            observer.state[:] = x + np.linalg.cholesky(observer.covariance) @ rng.standard_normal(10)
        for k in range(100):
            if k:
                command = 0.03 * np.sin(0.1 * k)
                x = FLOW @ x + force * command + spread @ rng.standard_normal(10)
                observer.advance(command, SPEED)
            angle, rate, acceleration, lateral = rng.standard_normal(4) * KNOWN[:4]
            fix = (SPEED * k * PERIOD, x[0] + lateral) if k % 5 == 0 else None
            observer.measure(x[4] + angle, (x[3] + x[6] + rate, LATERAL @ x + acceleration), fix)
        error = observer.state - x
        total += error @ np.linalg.solve(observer.covariance, error)
    low, high = scipy.stats.chi2.ppf([0.005, 0.995], 10 * runs)
    assert low < total < high


def test_uncertain_age_makes_changing_measurements_uncertain():
    """With ages that scatter by 5 ms a position that moves by 1 m/s counts 5 mm more, one that stands does not."""
    errors = []
    for rate in (0.0, 1.0):
        observer = RunObserver(TASK, 0.0, KNOWN._replace(age=0.005))
        observer._rate[0], observer.covariance[0, 0] = rate, 1.0
        observer.measure(None, None, (0.0, 0.0))
        errors.append(observer.covariance[0, 0])
    np.testing.assert_allclose(errors, [v / (1 + v) for v in (0.02**2, 0.02**2 + 0.005**2)], rtol=1e-9)
