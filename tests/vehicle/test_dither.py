"""Dither is a sine of the amplitude and frequency that are asked for."""

import numpy as np
import pytest

from clearance_mj.vehicle.controllers import Observation, Task
from clearance_mj.vehicle.controllers.dither import SlidingWithDither
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.manoeuvres import straight

from .test_controller import SPEED, VEHICLE


def test_sine_on_the_command():
    task = Task(VEHICLE, straight(200.0), SPEED)
    plain, dithered = SlidingMode().start(task), SlidingWithDither(amplitude=0.002, frequency=5.0).start(task)
    seen = [Observation(SPEED * k * task.period, 0.01, 0.0, 0.0, 0.0, SPEED) for k in range(100)]
    added = np.array([dithered.command(one) - plain.command(one) for one in seen])
    np.testing.assert_allclose(added, 0.002 * np.sin(2 * np.pi * 5.0 * 0.01 * np.arange(1, 101)), atol=1e-12)


def test_servo_limits_the_dither():
    """20 mrad at 10 Hz would need 1.3 rad/s: the command is a triangle at the rate limit, 0.4 rad/s."""
    run = SlidingWithDither(amplitude=0.02, frequency=10.0).start(Task(VEHICLE, straight(200.0), SPEED))
    commands = np.array([run.command(Observation(0.0, 0.0, 0.0, 0.0, 0.0, SPEED)) for _ in range(200)])
    assert np.abs(np.diff(commands)).max() == pytest.approx(0.4 * 0.01)
    assert np.ptp(commands[100:]) == pytest.approx(0.4 * 0.05, rel=0.2)  # half a period of rising
