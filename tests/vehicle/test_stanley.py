"""Stanley's law at values worked out by hand."""

import math

import pytest

from clearance_mj.vehicle.controllers import Observation, Task
from clearance_mj.vehicle.controllers.stanley import Stanley
from clearance_mj.vehicle.manoeuvres import clothoid_arc, straight
from clearance_mj.vehicle.nominal import Tyre, Vehicle

AXLES = {"lf": 1.2, "lr": 1.8, "cornering_front": 9e4, "cornering_rear": 9e4}
CAR = Vehicle(mass=1500.0, yaw_inertia=2500.0, tyre=Tyre(20.0, 1e6, 1.35), **AXLES)
LAW = Stanley(gain=5.0, softening=2.0, yaw=0.2, steer=0.5)


class AnswersAtOnce(Task):
    """A task in which errors are those of the sample itself."""

    lead = 0


def first(seen, path):
    """First command of a run."""
    return LAW.start(AnswersAtOnce(CAR, path, seen.speed, largest_rate=1e3)).command(seen)


def test_lateral_error_heading_error_and_yaw_rate():
    """1 m left of a straight at 18 m/s: -atan(5 · 1/(2 + 18)) = -atan(0.25).

    0.1 rad to the left and turning at 0.3 rad/s: -0.1 - atan(0.25 · 1.2 sin 0.1) - 0.2 · 0.3.
    """
    turned = -0.1 - math.atan(0.25 * 1.2 * math.sin(0.1)) - 0.06
    for errors, expected in (((1.0, 0.0, 0.0, 0.0), -math.atan(0.25)), ((0.0, 0.1, 0.0, 0.3), turned)):
        assert first(Observation(50.0, *errors, 18.0), straight(200.0)) == pytest.approx(expected, rel=1e-9)


def test_steady_turn():
    """On an arc of 200 m at 18 m/s, where front axle and yaw rate follow it: l_f κ + 1500 · 1.8 · 18² κ/(3 · 9e4)."""
    seen, expected = Observation(140.0, 0.0, 0.0, 0.0, 0.09, 18.0), (1.2 + 1500 * 1.8 * 18**2 / (3 * 9e4)) / 200
    assert first(seen, clothoid_arc()) == pytest.approx(expected, rel=1e-3)


def test_change_of_the_servo_is_damped():
    """From one sample to the next the servo turns by Δ: half of it is taken back."""
    seen = Observation(50.0, 0.01, 0.0, 0.0, 0.0, 18.0)
    damped, free = (law.start(Task(CAR, straight(200.0), 18.0)) for law in (LAW, Stanley(5.0, 2.0, 0.2, 1e-12)))
    first, second = ([run.command(seen) for _ in range(2)] for run in (damped, free))
    assert first[0] == pytest.approx(second[0])
    turned = damped.model.discrete[1][4] * first[0]  # by the servo's model, from rest
    assert second[1] - first[1] == pytest.approx(0.5 * turned)
