"""Repetitions of the tuning: rankings against hand-made ones, and what is at a bound."""

import math
import tomllib

import pytest

from clearance_mj.vehicle.controllers import CONTROLLERS
from experiments.steering.repeated_tuning import REPEATS, at_bounds, rank_correlations, repeat, table

NAMES = ["smc", "mpc", "stanley"]


def middle(name):
    return {key: math.sqrt(low * high) for key, (low, high) in CONTROLLERS[name].bounds.items()}


def tunings_of(costs):
    return {name: {"cost": cost, "settings": middle(name)} for name, cost in zip(NAMES, costs)}


def test_rank_correlation():
    """Kendall's τ of three ranks: 1 for the same order, 1/3 with one of three pairs turned round, -1 reversed."""
    costs = {"a": tunings_of([1.0, 2.0, 3.0]), "b": tunings_of([2.0, 1.0, 3.0]), "c": tunings_of([9.0, 5.0, 1.0])}
    tau = rank_correlations({**costs, "d": tunings_of([10.0, 20.0, 30.0])})
    assert tau["a", "d"] == pytest.approx(1.0) and tau["a", "b"] == pytest.approx(1 / 3)
    assert tau["a", "c"] == pytest.approx(-1.0)


def test_settings_at_a_bound():
    low, high = CONTROLLERS["mpc"].bounds["effort"]
    settings = middle("mpc")
    assert at_bounds("mpc", settings) == [] and at_bounds("mpc", settings | {"effort": 1.01 * low}) == ["effort"]
    both = {"effort": high, "yaw": CONTROLLERS["mpc"].bounds["yaw"][1]}
    assert at_bounds("mpc", settings | both) == ["yaw", "effort"]


def test_goes_on_where_it_was_stopped(tmp_path):
    """What the folder holds is not searched for again; the table is written with every rank and mark."""
    asked = []

    def search(name, again):
        asked.append((name, again.label))
        if len(asked) == 5:
            raise KeyboardInterrupt
        edge = {key: high for key, (_, high) in CONTROLLERS[name].bounds.items()}
        return {"cost": float(NAMES.index(name) + again.seed), "settings": edge}

    with pytest.raises(KeyboardInterrupt):
        repeat(tmp_path, NAMES, search)
    repeat(tmp_path, NAMES, search)
    assert len(asked) == len(NAMES) * len(REPEATS) + 1
    assert set(tomllib.loads((tmp_path / "tuning.toml").read_text())) == {again.label for again in REPEATS}
    page = (tmp_path / "tuning.md").read_text()
    assert "| SMC | 0.000 (1) | 1.000 (1) | 2.000 (1) |" in page and "effort 1e+05*" in page


def test_table_says_how_far_costs_spread():
    """Costs 1, 1.5 and 2: (2 - 1)/1.5."""
    page = table({"a": tunings_of([1.0, 5.0, 9.0]), "b": tunings_of([1.5, 5.0, 9.0]), "c": tunings_of([2.0, 5.0, 9.0])})
    assert "| SMC | 1.000 (1) | 1.500 (1) | 2.000 (1) | 67 % |" in page
