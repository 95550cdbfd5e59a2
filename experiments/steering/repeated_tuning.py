"""Tune the steering controllers again by other seeds and twice the budget: which ranking and settings stand.

Usage: ``python -m experiments.steering.repeated_tuning --controllers smc mpc --out results/tuning``.
"""

import math
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.stats

import experiments.steering.controllers  # noqa: F401  (registers its own)
from clearance_mj.vehicle.controllers import CONTROLLERS
from clearance_mj.vehicle.sensors import SENSORS
from clearance_mj.vehicle.tune import store, tunable, tune
from experiments.script import run
from experiments.tables import markdown_table

BOUND_MARGIN = 0.02  # share of the logarithm of a range from its end within which a setting is at its bound


class Repeat(NamedTuple):
    """A repetition of the tuning."""

    label: str
    seed: int
    generations: int


REPEATS = (
    Repeat("seed 0", 0, 7),
    Repeat("seed 1", 1, 7),
    Repeat("seed 2", 2, 7),
    Repeat("256 evaluations", 0, 15),
)  # the stored tuning and those that it is compared with
Tunings = Mapping[str, Mapping[str, Mapping[str, Any]]]  # results by label of the repetition and name of the controller


def repeat(folder: Path, names: list[str], search: Callable[[str, Repeat], dict[str, Any]]) -> Tunings:
    """Tune controllers again by each of `REPEATS`; what a folder holds already is not searched for again."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "tuning.toml"
    for each in REPEATS:
        for name in names:
            if name not in _read(path).get(each.label, {}):
                store(path, each.label, name, search(name, each))
    tunings = _read(path)
    (folder / "tuning.md").write_text(table(tunings), encoding="utf-8")
    return tunings


def _read(path: Path) -> dict[str, dict[str, Any]]:
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def at_bounds(name: str, settings: Mapping[str, float]) -> list[str]:
    """Return the settings of a controller that lie at an end of their range."""
    at_bound = []
    for key, (low, high) in CONTROLLERS[name].bounds.items():
        fraction = math.log(settings[key] / low) / math.log(high / low)
        if min(fraction, 1 - fraction) < BOUND_MARGIN:
            at_bound.append(key)
    return at_bound


def rank_correlations(tunings: Tunings) -> dict[tuple[str, str], float]:
    """Kendall's τ between the rankings by cost of each two repetitions."""
    labels = list(tunings)
    names = list(tunings[labels[0]])
    costs = {label: [tunings[label][name]["cost"] for name in names] for label in labels}
    pairs = [(one, other) for i, one in enumerate(labels) for other in labels[i + 1 :]]
    return {(one, other): float(scipy.stats.kendalltau(costs[one], costs[other]).statistic) for one, other in pairs}


def table(tunings: Tunings) -> str:
    """Return costs and ranks of each repetition, τ, and settings with those at a bound marked, as Markdown."""
    labels = list(tunings)
    names = sorted(tunings[labels[0]], key=lambda name: tunings[labels[0]][name]["cost"])
    costs = np.array([[tunings[label][name]["cost"] for label in labels] for name in names])
    ranks = scipy.stats.rankdata(costs, axis=0).astype(int)
    rows = [("controller", *(f"{label}: cost (rank)" for label in labels), "spread")]
    settings = [("controller", "settings of each repetition, * at a bound")]
    for name, cost, rank in zip(names, costs, ranks):
        cells = (f"{value:.3f} ({place})" for value, place in zip(cost, rank))
        rows.append((CONTROLLERS[name].label, *cells, f"{100 * np.ptp(cost) / np.mean(cost):.0f} %"))
        settings.append((CONTROLLERS[name].label, "; ".join(_settings(name, tunings[label][name]) for label in labels)))
    taus = (f"- {one}, {other}: {tau:.2f}\n" for (one, other), tau in rank_correlations(tunings).items())
    return f"{markdown_table(rows)}\nKendall's τ between rankings:\n{''.join(taus)}\n{markdown_table(settings)}"


def _settings(name: str, tuning: Mapping[str, Any]) -> str:
    ends = at_bounds(name, tuning["settings"])
    values = {key: tuning["settings"][key] for key in CONTROLLERS[name].bounds}
    return ", ".join(f"{key} {value:.3g}{'*' if key in ends else ''}" for key, value in values.items())


def main(
    sensors: Sequence[Literal[*SENSORS]] = tuple(SENSORS), controllers: Sequence[str] = (), workers: int | None = None,
    out: Path = Path("results/tuning"),
) -> None:  # fmt: skip
    """Repeat the tuning of controllers (default: all that have bounds) with each set of sensors."""
    for name in sensors:

        def search(controller: str, repeated: Repeat, name: str = name) -> dict[str, Any]:
            return tune(controller, name, repeated.generations, seed=repeated.seed, workers=workers)

        repeat(out / name, list(controllers) or tunable(), search)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
