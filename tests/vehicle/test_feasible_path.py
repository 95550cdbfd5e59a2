"""The averaged path against its integrals."""

import numpy as np
import pytest
import scipy.integrate

from clearance_mj.vehicle.controllers import DesignModel, Observation, Task
from clearance_mj.vehicle.controllers.feasible_path import FeasiblePath
from clearance_mj.vehicle.manoeuvres import clothoid_arc, double_lane_change
from clearance_mj.vehicle.nominal import Servo, Vehicle

CAR, SPEED = Vehicle.bmw320i(), 12.0


def ahead(path, s, **settings):
    task = Task(CAR, path, SPEED, **settings)
    model = DesignModel(CAR, Servo(), SPEED, task.period)
    return FeasiblePath(task, model).ahead(Observation(s, 0.0, 0.0, 0.0, 0.0, SPEED)), task


def test_easy_path_is_left_alone():
    """Over two periods: curvature and its derivatives are the path's, 40 ms ahead."""
    path = clothoid_arc()
    previewed, task = ahead(path, 60.0)
    at, reach = 60.0 + SPEED * task.lead * task.period, SPEED * task.period
    assert previewed.curvature == pytest.approx(float(path.curvature(at)), rel=1e-6)
    slope = float(np.diff(path.curvature([at - reach, at + reach]))[0]) / (2 * task.period)
    assert previewed.turning == pytest.approx(slope, rel=1e-6) and abs(previewed.offset) < 1e-4


@pytest.mark.parametrize("s", [52.0, 60.0, 71.0])
def test_hard_path_is_averaged_over_the_preview(s):
    """At 12 m/s a lane change asks for much more than 0.02 rad/s: averages over ± 0.16 s by quadrature of the path."""
    path = double_lane_change(1.0)
    previewed, task = ahead(path, s, largest_rate=0.02)
    at, reach = s + SPEED * task.lead * task.period, SPEED * (task.preview - task.lead * task.period)
    heading = float(path.heading(at))
    across = np.array([-np.sin(heading), np.cos(heading)])

    def mean(function):
        return scipy.integrate.quad(function, at - reach, at + reach)[0] / (2 * reach)

    offset = mean(lambda u: float(across @ (path.position(u) - path.position(at))))
    assert previewed.offset == pytest.approx(offset, rel=0.02, abs=1e-4)
    assert previewed.heading == pytest.approx(mean(lambda u: float(path.heading(u)) - heading), rel=0.02, abs=1e-4)
    assert previewed.curvature == pytest.approx(mean(lambda u: float(path.curvature(u))), rel=0.01)
    turning = float(np.diff(path.curvature([at - reach, at + reach]))[0]) / (2 * reach) * SPEED
    assert previewed.turning == pytest.approx(turning, rel=0.01)
