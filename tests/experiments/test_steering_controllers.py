"""Controllers that others are only compared with: dither, larger gain, adaptive inverse, and one as a plugin."""

import sys

import numpy as np
import pytest

from clearance_mj.vehicle.controllers import CONTROLLERS, DesignModel, Observation, Task, get_controller
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.experiment import GAP, Case
from clearance_mj.vehicle.manoeuvres import straight
from clearance_mj.vehicle.nominal import Servo
from experiments.steering.controllers import dither
from experiments.steering.controllers.adaptive_inverse import LARGEST_HALF_GAP, SlidingWithAdaptiveInverse
from experiments.steering.controllers.dither import SlidingWithDither
from tests.vehicle.test_controller import SPEED, VEHICLE

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
        assert 0.0 <= run.half_gap <= LARGEST_HALF_GAP


def test_larger_gain_is_that_of_the_gap():
    """k₂ + b h with b = C_f/m + L_s C_f l_f/I_z of the nominal vehicle."""
    case, law = Case("smc-high-gain", 72.0), get_controller("smc").tuned_controller()
    p = case.task.vehicle
    gain = p.cornering_front / p.mass + law.look_ahead * p.cornering_front * p.lf / p.yaw_inertia
    assert case.tuned_controller.switching == pytest.approx(law.switching + gain * GAP)
    assert case.tuned_controller.reaching == law.reaching
    assert Case("smc-high-gain", 72.0, 0.0).tuned_controller == law


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


def test_runs_as_a_plugin(tmp_path, monkeypatch, answer):
    """`--plugin` with the file of the source tree: the settings that are stored beside it hold."""
    monkeypatch.delitem(CONTROLLERS, "smc-dither")
    monkeypatch.setattr(sys, "path", list(sys.path))
    options = "--plugin", dither.__file__, "--controller", "smc-dither", "--speed", "72", "--quiet"
    assert answer("vehicle", *options, "--out", tmp_path / "out")["runs"][0]["controller"] == "smc-dither"
    assert CONTROLLERS["smc-dither"].tuned_controller().amplitude == 0.0003775
