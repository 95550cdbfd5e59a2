"""The design model against the equations of motion, and what every controller holds to."""

import dataclasses

import numpy as np
import pytest
import scipy.integrate

from clearance_mj.vehicle.controllers import ClearanceModel, DesignModel, Observation, Task
from clearance_mj.vehicle.controllers.backlash_inverse import BacklashInverse
from clearance_mj.vehicle.controllers.compensation import Compensated
from clearance_mj.vehicle.controllers.mpc import ModelPredictive
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.controllers.super_twisting import SuperTwisting
from clearance_mj.vehicle.manoeuvres import clothoid_arc, double_lane_change, straight
from clearance_mj.vehicle.nominal import Servo, Vehicle

SPEED = 30.0
VEHICLE = Vehicle.bmw320i()
LINEAR = dataclasses.replace(VEHICLE, tyre=VEHICLE.tyre._replace(friction=1e6))
"""Its tyres never slip away: controllers are those of the linear model"""
MODEL = DesignModel(VEHICLE, Servo(), SPEED, 0.01)
CONTROLLERS = (
    SlidingMode(), SuperTwisting(), ModelPredictive(), Compensated(SlidingMode(), ClearanceModel(np.radians(0.4))),
    Compensated(ModelPredictive(), BacklashInverse(np.radians(0.4))),
)  # fmt: skip


def right_hand_side(x, command, curvature, speed=SPEED, unknown=(0.0, 0.0)):
    """Single track in path coordinates with a servo, written from the forces (Rajamani, 2012, sections 2.3 and 2.5).

    Unknown forces, N, act at the front and the rear axle.
    """
    _, e_psi, lateral_speed, yaw_rate, angle, turning = x
    p, natural = VEHICLE, 2 * np.pi * 6.0
    front = p.cornering_front * (angle - (lateral_speed + p.lf * yaw_rate) / speed) + unknown[0]
    rear = -p.cornering_rear * (lateral_speed - p.lr * yaw_rate) / speed + unknown[1]
    across, yaw = (front + rear) / p.mass - speed * yaw_rate, (p.lf * front - p.lr * rear) / p.yaw_inertia
    servo = natural**2 * (command - angle) - 2 * 0.7 * natural * turning
    return [speed * e_psi + lateral_speed, yaw_rate - speed * curvature, across, yaw, turning, servo]


def solved(x, command, curvature, duration):
    rates = lambda _, x: right_hand_side(x, command, curvature)  # noqa: E731
    return scipy.integrate.solve_ivp(rates, (0, duration), x, rtol=1e-10, atol=1e-12).y[:, -1]


STATE = np.array([0.1, 0.02, -0.3, 0.1, 0.01, -0.2])


def test_design_model_is_the_single_track():
    A, B, E = MODEL.discrete
    np.testing.assert_allclose(A @ STATE + 0.03 * B + 0.004 * E, solved(STATE, 0.03, 0.004, 0.01), atol=1e-9)


def test_prediction_is_the_model_stepped():
    """Over 40 ms with one command and a curvature that steps every 10 ms."""
    curvature, expected = np.array([0.004, 0.003, 0.001, -0.002]), STATE
    for value in curvature:
        expected = solved(expected, 0.03, value, 0.01)
    P, Q, R = MODEL.prediction(4)
    np.testing.assert_allclose(P @ STATE + 0.03 * Q + R @ curvature, expected, atol=1e-9)


def test_steady_sideslip():
    """Against the steady state of the equations of motion on an arc of 200 m."""
    A, B, E = MODEL.continuous
    steady = np.linalg.solve(np.column_stack((A[:, 1:], B)), -E / 200)
    np.testing.assert_allclose([-steady[0], steady[1] / SPEED], MODEL.steady_sideslip / 200, rtol=1e-9)


def test_nominal_vehicle_holds_the_compliance():
    """Force of an axle whose wheels the aligning moment turns back: F = C (α - F t/k), solved for F."""
    soft = VEHICLE.with_steering(4e4)
    force = VEHICLE.cornering_front * 0.02 / (1 + VEHICLE.cornering_front * VEHICLE.trail / 4e4)
    assert soft.cornering_front * 0.02 == pytest.approx(force) and VEHICLE.with_steering(np.inf) == VEHICLE


def test_preview_ends():
    """Beyond the preview the curvature stays as it was last seen."""
    path = double_lane_change(2.5)
    task = Task(VEHICLE, path, SPEED, preview=0.1)
    far = task.curvature(Observation(80.0, 0.0, 0.0, 0.0, 0.0, SPEED), np.array([0.0, 0.05, 0.1, 0.3]))
    np.testing.assert_array_equal(far, path.curvature(80.0 + SPEED * np.array([0.0, 0.05, 0.1, 0.1])))


@pytest.mark.parametrize("controller", CONTROLLERS, ids=repr)
def test_limits_are_never_exceeded(controller):
    """Wild observations for 3 s: every command within 3°, every change within 0.2 rad/s."""
    task = Task(VEHICLE, clothoid_arc(), SPEED, largest_angle=np.radians(3.0), largest_rate=0.2)
    run, noise = controller.start(task), np.random.default_rng(1).normal(scale=(2.0, 0.2, 1.0, 0.3), size=(300, 4))
    commands = [run.command(Observation(SPEED * k * task.period, *each, SPEED)) for k, each in enumerate(noise)]
    changes = np.abs(np.diff(commands, prepend=0.0))
    assert np.abs(commands).max() <= np.radians(3.0) and max(changes) <= 0.2 * task.period + 1e-12
    assert max(changes) > 0.19 * task.period  # the limit was met


@pytest.mark.parametrize("controller", CONTROLLERS, ids=repr)
def test_nothing_moves_on_a_straight(controller):
    run = controller.start(Task(VEHICLE, straight(200.0), SPEED))
    assert all(run.command(Observation(0.3 * k, 0.0, 0.0, 0.0, 0.0, SPEED)) == 0.0 for k in range(200))
