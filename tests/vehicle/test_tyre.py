"""The nominal tyre against the plant, and the angle that the tyres need beyond the linear model's."""

import dataclasses

import numpy as np
import pytest
import scipy.optimize
from vehiclemodels.utils.tire_model import formula_lateral

from clearance_mj.vehicle.commonroad import GRAVITY, parameters
from clearance_mj.vehicle.controllers import Observation, Predictor, Task
from clearance_mj.vehicle.controllers.mpc import ModelPredictive
from clearance_mj.vehicle.manoeuvres import clothoid_arc, straight
from clearance_mj.vehicle.nominal import Vehicle
from clearance_mj.vehicle.plant import SingleTrackDrift
from clearance_mj.vehicle.run import follow_path, nominal_task
from clearance_mj.vehicle.steering import Steering

CAR = Vehicle.bmw320i()


def test_force_is_that_of_the_plants_tyre():
    """commonroad-vehicle-models' lateral force at pure slip, without camber; its curvature factor makes 0.3 %."""
    for slip in np.radians([0.5, 2.0, 5.0, 9.0]):
        force, _ = formula_lateral(slip, 0.0, 3000.0, parameters().tire)
        assert CAR.tyre.force(slip) == pytest.approx(-force / 3000.0, rel=3e-3)


def test_slip_has_the_force():
    for force in (-0.9, -0.3, 0.0, 0.5, 0.98):
        assert CAR.tyre.force(CAR.tyre.slip(force)) == pytest.approx(force, abs=1e-12)


def test_slip_ends_short_of_the_largest_force():
    assert CAR.tyre.slip(5.0) == CAR.tyre.slip(0.95 * CAR.tyre.friction)
    assert CAR.tyre.excess(5.0) == CAR.tyre.excess(0.95 * CAR.tyre.friction)


@pytest.mark.parametrize("stiffness", [np.inf, 4e4], ids=["rigid steering", "compliant steering"])
def test_excess_makes_the_force_the_linear_models(stiffness):
    """Statics of the front axle, F = F_z μ sin(C atan(B (δ - F t/k - α_k))), solved for F: that is C_f (δ' - α_k)."""
    car, speed, angle = CAR.with_steering(stiffness), 30.0, 0.03
    seen = Observation(10.0, 0.0, 0.0, -0.3, -0.1, speed)
    predictor = Predictor(Task(car, straight(200.0), speed))
    direction = (predictor.predicted(seen)[2] + car.lf * predictor.predicted(seen)[3]) / speed
    steered = angle + predictor.excess(angle, seen)

    def unbalanced(force):
        return force - car.front_load * car.tyre.force(steered - direction - force * car.trail / stiffness)

    force = scipy.optimize.brentq(unbalanced, -2e4, 2e4, xtol=1e-9)
    assert force == pytest.approx(car.cornering_front * (angle - direction), rel=1e-9) and steered > 1.05 * angle


def test_linear_tyres_need_nothing():
    car = dataclasses.replace(CAR, tyre=CAR.tyre._replace(friction=1e6))
    predictor = Predictor(Task(car, straight(200.0), 30.0))
    assert predictor.excess(0.1, Observation(10.0, 0.1, 0.02, 0.3, 0.2, 30.0)) == pytest.approx(0.0, abs=1e-12)


def test_steady_turn():
    """Arc of 200 m at 120 km/h, 5.5 m/s²: sideslip l_r/R - α_r and angle L/R + α_f - α_r + t F_f/k, of the tyre's law.

    The single track has the nominal tyres, but for their combined slip. A design model with linear tyres does not ask
    for enough: its lateral error is many times larger.
    """
    task, steering = nominal_task(clothoid_arc(arc=200.0), 120 / 3.6), Steering()
    run = follow_path(SingleTrackDrift(), steering, ModelPredictive(), task)
    middle = np.argmin(np.abs(run.s - 230.0))
    used_friction = run.lateral_acceleration[middle] / GRAVITY
    assert run.sideslip[middle] == pytest.approx(CAR.lr / 200 - CAR.tyre.slip(used_friction), rel=0.02)
    twist = CAR.trail * used_friction * CAR.front_load / steering.lost_motion.stiffness
    assert run.command[middle] == pytest.approx(CAR.wheelbase / 200 + twist, rel=0.05)
    linear = dataclasses.replace(task.vehicle, tyre=CAR.tyre._replace(friction=1e6))
    other = follow_path(SingleTrackDrift(), steering, ModelPredictive(), dataclasses.replace(task, vehicle=linear))
    assert abs(run.e_y[middle]) < 1e-3 and abs(other.e_y[middle]) > 5e-3
