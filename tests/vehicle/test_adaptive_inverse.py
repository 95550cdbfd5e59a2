"""The adaptive inverse on the linear single track behind a play."""

import numpy as np
import pytest

from clearance_mj.vehicle.controllers import DesignModel, Observation, Task
from clearance_mj.vehicle.controllers.adaptive_inverse import LARGEST, SlidingWithAdaptiveInverse
from clearance_mj.vehicle.manoeuvres import straight
from clearance_mj.vehicle.nominal import Servo

from .test_controller import SPEED, VEHICLE

LAW = SlidingWithAdaptiveInverse(convergence=3.0, reaching=4.0, adaptation=2.0, bandwidth=20.0)


def adapted(half_gap, seconds=20.0):
    """The law's run after a slalom of 1 m behind a play operator."""
    task = Task(VEHICLE, straight(1000.0), SPEED)
    run, (A, B, _) = LAW.start(task), DesignModel(VEHICLE, Servo(), SPEED, task.period).discrete
    x, wheel = np.zeros(6), 0.0
    for k in range(round(seconds / task.period)):
        reference = 0.5 * np.sin(2 * np.pi * 0.4 * k * task.period)
        command = run.command(Observation(0.3 * k, x[0] - reference, *x[1:4], SPEED))
        # The wheel stays until the servo has crossed the play.
        wheel = min(max(wheel, x[4] - half_gap), x[4] + half_gap)
        moved = A @ np.append(x[:4], (wheel, 0.0)) + B * wheel
        x = np.append(moved[:4], A[4:, 4:] @ x[4:] + B[4:] * command)
    return run


@pytest.mark.parametrize("half_gap", np.radians([0.1, 0.2, 0.4]))
def test_finds_the_gap(half_gap):
    assert adapted(half_gap).half_gap == pytest.approx(half_gap, rel=0.1)


def test_stays_at_zero_without_a_gap():
    assert adapted(0.0).half_gap < np.radians(0.02)


def test_estimate_is_kept_within_its_range():
    """Yaw rates that no play explains."""
    run, rng = LAW.start(Task(VEHICLE, straight(1000.0), SPEED)), np.random.default_rng(0)
    for k in range(500):
        run.command(Observation(0.3 * k, *rng.normal(scale=(2.0, 0.2, 1.0, 1.0)), SPEED))
        assert 0.0 <= run.half_gap <= LARGEST
