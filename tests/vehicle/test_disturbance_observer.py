"""The disturbance observer against the transfer function that its poles are placed for."""

import numpy as np
import pytest

from clearance_mj.vehicle.controllers import DesignModel, Observation, Task, disturbance_observer
from clearance_mj.vehicle.experiment import Case, run_case
from clearance_mj.vehicle.manoeuvres import straight
from clearance_mj.vehicle.nominal import Servo

from .test_controller import SPEED, VEHICLE


def observed(model, bandwidth, disturbance, seconds):
    """Estimates while the single track drives with held wheels and an unknown steering angle, rad, on top."""
    A, B, _ = model.discrete
    wheel = 0.01 + disturbance
    observer, x, moments = disturbance_observer.YawObserver(model, bandwidth), np.array([0, 0, 0, 0, wheel, 0.0]), []
    for _ in range(round(seconds / model.period)):
        moments.append(observer.advance(x[3], x[2], 0.01))
        x = A @ x + B * wheel
    return np.array(moments)


def test_constant_disturbance_is_found():
    """0.2°, exactly, once the motion has settled."""
    model = DesignModel(VEHICLE, Servo(), SPEED, 0.01)
    assert observed(model, 16.0, np.radians(0.2), 5.0)[-1] == pytest.approx(np.radians(0.2), rel=1e-9)


@pytest.mark.parametrize("bandwidth", [4.0, 16.0])
def test_step_response(bandwidth):
    """Of ω²/(s + ω)²: 1 - (1 + ω t) exp(-ω t), sampled finely."""
    model, t = DesignModel(VEHICLE, Servo(), SPEED, 2e-4), np.arange(5000) * 2e-4
    expected = 1 - (1 + bandwidth * t) * np.exp(-bandwidth * t)
    np.testing.assert_allclose(observed(model, bandwidth, 1e-3, 1.0) / 1e-3, expected, atol=5e-3)


CONTROLLERS = [disturbance_observer.SlidingWithObserver(), disturbance_observer.PredictiveWithObserver()]


@pytest.mark.parametrize("controller", CONTROLLERS, ids=repr)
def test_offset_of_the_wheels_is_taken_out(controller):
    """The linear model with wheels that stand 0.3° off: the command ends at -0.3° and the vehicle on its path."""
    task = Task(VEHICLE, straight(600.0), SPEED)
    run, offset = controller.start(task), np.radians(0.3)
    A, B, _ = DesignModel(VEHICLE, Servo(), SPEED, task.period).discrete
    x = np.zeros(6)
    x[4] = offset
    for k in range(1500):
        command = run.command(Observation(SPEED * k * task.period, *x[:4], SPEED))
        x = A @ x + B * (command + offset)
    assert command == pytest.approx(-offset, rel=1e-3) and abs(x[0]) < 1e-3


def test_under_the_sensors_of_a_car():
    """On a lane change behind a friction-driven clearance: RMS e_y of two vehicles below SMC's in the mean."""

    def mean(name):
        cases = (Case(name, 72.0, regime="friction", sensors="car", spread=True, seed=seed) for seed in range(2))
        return np.mean([run_case(case).run.metrics()["rms_e_y"] for case in cases])

    assert mean("smc-dob") < 0.9 * mean("smc")
