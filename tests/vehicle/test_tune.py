"""Tuning is the same when repeated, the same for all, and not on what is reported."""

import tomllib

import pytest

from clearance_mj.errors import ManoeuvreError
from clearance_mj.vehicle import tune as module
from clearance_mj.vehicle.controllers.registry import CONTROLLERS, TUNED, get_controller
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.experiment import LENGTH_FACTORS
from clearance_mj.vehicle.tune import MANOEUVRES, cost, tune

BOUNDS = {name: known.bounds for name, known in CONTROLLERS.items() if known.bounds}
FOUND = tomllib.loads(TUNED.read_text(encoding="utf-8"))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The balance properties of Sobol")
def test_repeated_on_any_number_of_processes(monkeypatch):
    monkeypatch.setattr(module, "MANOEUVRES", ((20.0, 1.2),))
    one, two = (tune("smc", generations=1, population=5, workers=n) for n in (1, 2))
    assert one == two
    assert one["evaluations"] == 10
    assert cost(SlidingMode(**one["settings"])) == pytest.approx(one["cost"], abs=1e-6)
    assert one["cost"] < cost(SlidingMode(look_ahead=1.0, convergence=1.0, reaching=0.5, switching=0.05, layer=2.0))


def test_same_budget_for_all():
    assert set(FOUND) <= set(BOUNDS)
    assert len({(found["evaluations"], found["seed"]) for found in FOUND.values()}) == 1


@pytest.mark.parametrize("name", BOUNDS)
def test_stored_settings_are_within_bounds(name):
    for setting, (low, high) in BOUNDS[name].items():
        assert low <= getattr(get_controller(name).tuned_controller(), setting) <= high


@pytest.mark.slow
@pytest.mark.parametrize("name", FOUND)
def test_stored_cost_is_that_of_the_stored_settings(name):
    assert cost(get_controller(name).tuned_controller()) == pytest.approx(FOUND[name]["cost"], rel=1e-3)


def test_no_manoeuvre_is_tuned_on_and_reported():
    reported = {(round(speed / 3.6, 6), factor) for speed, factor in LENGTH_FACTORS.items()}
    assert not reported & {(round(speed, 6), factor) for speed, factor in MANOEUVRES}


def test_leaving_the_path_costs_most():
    assert cost(SlidingMode(look_ahead=0.1, convergence=60.0, reaching=200.0)) == module.FAILED


def test_what_cannot_be_tuned():
    with pytest.raises(ManoeuvreError, match='"pid" is unknown; known: smc, smc-cm, mpc'):
        tune("pid")
    with pytest.raises(ManoeuvreError, match='"smc-cm" has no bounds'):
        tune("smc-cm")
