"""Tuning is the same when repeated, the same for all, and not on what is reported."""

import tomllib

import pytest

import experiments.steering.controllers  # noqa: F401  (their settings are held to the same)
from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle import tune as module
from clearance_mj.vehicle.controllers import CONTROLLERS, get_controller
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.experiment import LENGTH_FACTORS, Case, drive
from clearance_mj.vehicle.tune import MANOEUVRES, Course, cost, tunable, tune

from ..refusals import assert_refused

FOUND = {
    (tuned, name): settings
    for path in dict.fromkeys(known.settings_file for known in CONTROLLERS.values())
    for tuned, controllers in tomllib.loads(path.read_text(encoding="utf-8")).items()
    for name, settings in controllers.items()
}
SMC = get_controller("smc")
COURSE = (Course(72.0, 1.2, "torque"),)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The balance properties of Sobol")
def test_repeated_on_any_number_of_processes(monkeypatch):
    monkeypatch.setattr(module, "MANOEUVRES", COURSE)
    one, two = (tune("smc", generations=1, population=5, workers=n) for n in (1, 2))
    assert one == two and one["evaluations"] == 10
    assert cost(SMC, SlidingMode(**one["settings"])) == pytest.approx(one["cost"], abs=1e-6)
    assert one["cost"] < cost(SMC, SlidingMode(1.0, 1.0, 0.5, 0.05, 2.0))


def test_same_budget_for_all():
    """Every controller with bounds, in both sets."""
    assert set(FOUND) == {(tuned, name) for tuned in ("ideal", "car") for name in tunable()}
    assert len({(of_controller["evaluations"], of_controller["seed"]) for of_controller in FOUND.values()}) == 1


@pytest.mark.parametrize(("tuned", "name"), FOUND)
def test_stored_settings_are_within_bounds(tuned, name):
    for setting, (low, high) in get_controller(name).bounds.items():
        assert low <= getattr(get_controller(name).tuned_controller(tuned), setting) <= high


@pytest.mark.slow
@pytest.mark.parametrize(("tuned", "name"), FOUND)
def test_stored_cost_is_that_of_the_stored_settings(tuned, name):
    known = get_controller(name)
    assert cost(known, known.tuned_controller(tuned), tuned) == pytest.approx(FOUND[tuned, name]["cost"], rel=1e-3)


def test_cost_is_that_of_the_metrics():
    """Of one lane change, from the run's own metrics; controllers have their prior information on the clearance."""
    case = Case("smc-cm", 72.0, length_factor=1.5, regime="friction", spread=True, seed=module.FIRST_VEHICLE)
    run = drive(case, case.tuned_controller, MANOEUVRES[0].disturbance)
    metrics, law = run.metrics(), get_controller("smc-cm").tuned_controller()
    expected = metrics["peak_e_y"] / 0.05 + metrics["rms_e_y"] / 0.015 + metrics["servo_rms_rate"] / 0.03
    expected += metrics["servo_reversals"] / run.time[-1]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MANOEUVRES", MANOEUVRES[:1])
        assert cost(get_controller("smc-cm"), law) == pytest.approx(expected)


def test_settings_go_with_the_sensors():
    ideal, car = (Case("mpc", 72.0, sensors=name).tuned_controller for name in ("ideal", "car"))
    assert ideal == get_controller("mpc").tuned_controller("ideal")
    assert car == get_controller("mpc").tuned_controller("car") and ideal != car


def test_no_manoeuvre_is_tuned_on_and_reported():
    assert not set(LENGTH_FACTORS.items()) & {(course.speed, course.length_factor) for course in MANOEUVRES}


def test_leaving_the_path_costs_most():
    assert cost(SMC, SlidingMode(look_ahead=0.1, convergence=60.0, reaching=200.0)) == module.FAILED


def test_what_cannot_be_tuned():
    assert_refused(ManoeuvreError, '"pid" is unknown; use smc, smc-cm, mpc', tune, "pid")
    assert_refused(ManoeuvreError, '"smc-inverse" has no bounds', tune, "smc-inverse")
