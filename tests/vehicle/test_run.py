"""Runs on the plants: identities, stillness, and metrics with known values."""

import numpy as np
import pytest

from clearance_mj.core.errors import SimulationError
from clearance_mj.vehicle.controllers import ClearanceModel
from clearance_mj.vehicle.controllers.compensation import Compensated
from clearance_mj.vehicle.controllers.mpc import ModelPredictive
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.manoeuvres import clothoid_arc, double_lane_change, straight
from clearance_mj.vehicle.plant import MultiBody
from clearance_mj.vehicle.run import Run, follow_path, nominal_task
from clearance_mj.vehicle.sensors import IdealSensors
from clearance_mj.vehicle.steering import Steering

GAP = np.radians(0.2)
LANE_CHANGE = nominal_task(double_lane_change(1.75), 20.0)


def same(one, other):
    names = vars(one).keys() - {"controller_time"}
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in names)


@pytest.mark.parametrize("controller", [SlidingMode(), ModelPredictive()], ids=repr)
def test_nothing_moves_on_a_straight(controller):
    """No limit cycle: with clearance, compensated, exactly still."""
    task = nominal_task(straight(150.0), 120 / 3.6)
    run = follow_path(MultiBody(), Steering(half_gap=GAP), Compensated(controller, ClearanceModel(GAP)), task)
    for name in ("e_y", "e_psi", "yaw_rate", "wheel_angle", "command"):
        assert np.abs(getattr(run, name)).max() < 1e-9


def test_clearance_model_takes_out_most_of_the_gap():
    """RMS e_y with the gap compensated is nearer to that without gap than to that with it."""
    law = SlidingMode()
    cases = ((0.0, law), (GAP, law), (GAP, Compensated(law, ClearanceModel(GAP))))
    runs = (follow_path(MultiBody(), Steering(half_gap=h), controller, LANE_CHANGE) for h, controller in cases)
    none, gap, model = (run.metrics()["rms_e_y"] for run in runs)
    assert gap > 2 * none and model < (none + gap) / 2


def test_same_seed_same_run():
    parts = MultiBody(), Steering(half_gap=GAP, road_moment=5.0), SlidingMode(), LANE_CHANGE, IdealSensors.inertial()
    first, again, other = (follow_path(*parts, seed=seed) for seed in (3, 3, 4))
    assert same(first, again) and not same(first, other)


def test_steady_turn():
    """On an arc of 200 m at 20 m/s the yaw rate is 0.1 rad/s and the lateral acceleration 2 m/s²."""
    run = follow_path(MultiBody(), Steering(), SlidingMode(), nominal_task(clothoid_arc(), 20.0))
    middle = np.argmin(np.abs(run.s - 140.0))
    assert (run.yaw_rate[middle], run.lateral_acceleration[middle]) == pytest.approx((0.1, 2.0), rel=0.02)


def test_metrics_of_known_histories():
    t, zero = np.arange(5) * 0.01, np.zeros(5)
    e_y, wheel = np.array([[0.0, 0.03, -0.04, 0.0, 0.0], [0.0, 0.01, 0.03, 0.02, 0.02]])
    contact, depth = np.array([0, 1, 0, -1, 1]), np.array([0.2, 1.5, 0.9, 3.0, 1.0])
    metrics = Run(t, np.zeros((5, 2)), zero, e_y, -e_y, *[zero] * 5, 2 * wheel, wheel, contact, depth, zero).metrics()
    known = {
        "peak_e_y": 0.04, "rms_e_psi": 0.05 / np.sqrt(5), "peak_steer_rate": 2.0, "steer_variation": 0.04,
        "contact_reversals": 2, "servo_rms_rate": 2 * np.sqrt((1 + 4 + 1) / 4), "servo_reversals": 1,
        "outside_layer": 2 / 5,
    }  # fmt: skip
    assert {name: metrics[name] for name in known} == pytest.approx(known)


def test_lost_vehicle():
    """A controller that steers away is stopped, and it is said where."""

    class Away(SlidingMode):
        def start(self, task):
            run = super().start(task)
            run.wheel_angle = lambda seen: 0.05
            return run

    with pytest.raises(SimulationError, match="left the path at s ="):
        follow_path(MultiBody(), Steering(), Away(), nominal_task(straight(200.0), 20.0))
