"""What every registered controller does, whichever file it comes from."""

import pytest

import experiments.steering.controllers  # noqa: F401  (their settings are held to the same)
from clearance_mj.report.vehicle import look
from clearance_mj.vehicle import tune as tuning
from clearance_mj.vehicle.controllers import CONTROLLERS
from clearance_mj.vehicle.experiment import Case, run_case
from clearance_mj.vehicle.tune import FAILED, tune

COMBINED = ("mpc-cm", "mpc-twin", "mpc-dob", "mpc-cm-dob", "mpc-twin-dob", "smc-cm-dob", "smc-twin-dob")
"""Of parts that others have, each by itself or with the controller in sliding mode"""


DRIVEN = [pytest.param(name, marks=pytest.mark.slow if name in COMBINED else ()) for name in CONTROLLERS]


@pytest.mark.parametrize("name", DRIVEN)
def test_drives_a_lane_change(name):
    """Within 0.2 m of a lane change at 72 km/h without clearance."""
    assert run_case(Case(name, 72.0, half_gap=0.0)).run.metrics()["peak_e_y"] < 0.2


@pytest.mark.parametrize("name", CONTROLLERS)
def test_looks_like_no_other(name):
    """No other controller has both its colour and its line; colours are given, not taken from a cycle."""
    assert CONTROLLERS[name].colour
    looks = [(look(other)["color"], look(other)["ls"]) for other in CONTROLLERS if other != name]
    assert (look(name)["color"], look(name)["ls"]) not in looks


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The balance properties of Sobol")
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in ("smc", "mpc", "stanley") else pytest.mark.release)
     for name, known in CONTROLLERS.items() if known.bounds],
)  # fmt: skip
def test_can_be_tuned(name, monkeypatch):
    """Ten evaluations on one lane change leave settings within the bounds that stay on the road."""
    monkeypatch.setattr(tuning, "MANOEUVRES", (tuning.Course(72.0, 1.5, "torque"),))
    tuned = tune(name, generations=1, population=5, workers=1)
    assert tuned["cost"] < FAILED
    for setting, (low, high) in CONTROLLERS[name].bounds.items():
        assert low * 0.999 <= tuned["settings"][setting] <= high * 1.001
