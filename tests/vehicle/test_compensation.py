"""Compensation of the lost motion against the wheel's statics."""

import numpy as np
import pytest

from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle.controllers import ClearanceModel, Observation, Task
from clearance_mj.vehicle.controllers.backlash_inverse import BacklashInverse
from clearance_mj.vehicle.controllers.compensation import Compensated, Direction
from clearance_mj.vehicle.controllers.mpc import ModelPredictive
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.manoeuvres import clothoid_arc, straight

from ..refusals import assert_refused
from .test_controller import VEHICLE

TASK = Task(VEHICLE, straight(200.0), 30.0)
H = np.radians(0.2)


def at(lateral_speed=0.0, yaw_rate=0.0, servo=0.0):
    return np.array([0.0, 0.0, lateral_speed, yaw_rate, servo, 0.0])


def test_side_follows_the_aligning_moment():
    """T = t C_f (δ - (v_y + l_f r)/v): the wheel is h + T c behind on the side of T."""
    estimate = ClearanceModel(H, compliance=1e-5).start(TASK)
    for angle, lateral_speed, yaw_rate in ((0.01, 0.0, 0.0), (0.01, 0.5, 0.2), (-0.004, 0.1, 0.0)):
        moment = VEHICLE.trail * VEHICLE.cornering_front * (angle - (lateral_speed + VEHICLE.lf * yaw_rate) / 30.0)
        assert estimate(angle, at(lateral_speed, yaw_rate)) == pytest.approx(-H * np.sign(moment) - 1e-5 * moment)


def test_frozen_while_the_side_is_not_known():
    estimate = ClearanceModel(H, threshold=20.0).start(TASK)
    assert estimate(1e-4, at()) == 0.0  # 0.6 N m: not known yet
    assert [estimate(angle, at()) for angle in (0.01, -1e-4, -0.01)] == [-H, -H, H]


def test_side_follows_the_motion_where_friction_prevails():
    estimate = ClearanceModel(H, friction=1e3, slack=1e-6).start(TASK)
    angles = 0.01 * np.sin(np.linspace(0, 4 * np.pi, 400))
    lost = np.array([estimate(angle, at(servo=angle)) for angle in angles])
    np.testing.assert_array_equal(lost[1:], np.where(np.diff(angles, prepend=0.0) < 0, H, -H)[1:])


def test_moment_is_limited_by_friction_of_the_road():
    """A slip far beyond the tyre's: the force is at most μ times the front axle's load."""
    largest = VEHICLE.tyre.friction * VEHICLE.mass * 9.81 * VEHICLE.lr / VEHICLE.wheelbase
    assert ClearanceModel(0.0, compliance=1e-5).start(TASK)(0.5, at()) == pytest.approx(-1e-5 * VEHICLE.trail * largest)


WITHOUT_GAP = [ClearanceModel(0.0), ClearanceModel(0.0, friction=100.0), BacklashInverse(0.0)]


@pytest.mark.parametrize("law", [SlidingMode(), ModelPredictive()], ids=repr)
@pytest.mark.parametrize("lost_motion", WITHOUT_GAP)
def test_without_a_gap_nothing_is_compensated(law, lost_motion):
    task = Task(VEHICLE, clothoid_arc(), 30.0)
    plain, compensated = law.start(task), Compensated(law, lost_motion).start(task)
    rng = np.random.default_rng(0)
    for k in range(100):
        seen = Observation(0.3 * k, *rng.normal(scale=0.02, size=4), 30.0)
        assert compensated.command(seen) == plain.command(seen)


def test_direction_is_deaf_to_noise():
    """A ramp with noise of half the slack turns once."""
    rng = np.random.default_rng(3)
    ramp = np.concatenate((np.linspace(0, 1, 200), np.linspace(1, -1, 400)))
    direction = Direction(0.1)
    signs = np.array([direction.advance(value) for value in ramp + rng.uniform(-0.04, 0.04, ramp.size)])
    assert np.count_nonzero(np.diff(signs[signs != 0])) == 1 and signs[-1] == -1


@pytest.mark.parametrize("settings", [{"half_gap": -0.1}, {"half_gap": 0.1, "friction": -1.0}])
def test_impossible_settings(settings):
    assert_refused(ManoeuvreError, r"ClearanceModel\.\w+ must be", ClearanceModel, **settings)
