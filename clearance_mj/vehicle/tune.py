"""Tuning of the controllers: one optimiser, budget, cost and kind of bounds for all, stored with its inputs.

Each controller drives the double lane changes of `MANOEUVRES` on the nominal multi-body plant without clearance, with
noisy sensors. None of these lane changes is reported on, and none has clearance. The optimiser is differential
evolution over the logarithms of the settings, with the same population and generations whatever the number of settings.

``python -m clearance_mj.vehicle.tune`` repeats it and writes `STORED`.
"""

from __future__ import annotations

import argparse
import functools
import tomllib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path as FilePath

import numpy as np
import scipy.optimize
import scipy.stats
import tomli_w

from ..errors import ClearanceError, ManoeuvreError
from ..files import replacing
from .controller import Controller
from .manoeuvre import Sensors, drive, nominal_task
from .mpc import ModelPredictive
from .path import double_lane_change
from .plant import MultiBody
from .smc import SlidingMode, SuperTwisting
from .steering import Steering

__all__ = ["BOUNDS", "MANOEUVRES", "STORED", "cost", "stored", "tune"]

STORED = FilePath(__file__).with_name("tuned.toml")
MANOEUVRES = ((72 / 3.6, 1.5), (120 / 3.6, 2.2))
"""(speed in m/s, length factor) of the double lane changes that are tuned on"""
POPULATION, GENERATIONS, SEED = 16, 7, 0
"""128 evaluations for each controller"""
FAILED = 100.0
"""Cost of leaving the path"""
KINDS: dict[str, type[Controller]] = {"smc": SlidingMode, "mpc": ModelPredictive, "super-twisting": SuperTwisting}
BOUNDS: dict[str, dict[str, tuple[float, float]]] = {
    "smc": {
        "look_ahead": (1.0, 10.0),
        "convergence": (1.0, 15.0),
        "reaching": (0.5, 20.0),
        "switching": (0.05, 5.0),
        "layer": (0.05, 2.0),
    },
    "super-twisting": {
        "look_ahead": (1.0, 10.0),
        "convergence": (1.0, 15.0),
        "root": (0.2, 10.0),
        "integral": (0.05, 10.0),
        "layer": (0.02, 1.0),
    },
    "mpc": {"course": (1e-3, 1.0), "yaw": (1e-2, 10.0), "effort": (10.0, 1e5)},
}
"""Range of each setting, searched over its logarithm"""


def cost(controller: Controller) -> float:
    """Mean over `MANOEUVRES` of peak |e_y| / 50 mm + RMS e_y / 15 mm + total variation of the wheel angle / 0.1 rad.

    Parameters
    ----------
    controller : Controller
        The controller with its settings.
    """
    costs = []
    for speed, factor in MANOEUVRES:
        task = nominal_task(double_lane_change(factor), speed)
        try:
            found = drive(MultiBody(), Steering(), controller, task, Sensors.inertial()).metrics()
        except ClearanceError:
            return FAILED
        costs.append(found["peak_e_y"] / 0.05 + found["rms_e_y"] / 0.015 + found["steer_variation"] / 0.1)
    return float(np.mean(costs))


def tune(
    name: str, generations: int = GENERATIONS, population: int = POPULATION, seed: int = SEED, workers=None
) -> dict:
    """Search for the settings of a controller.

    Parameters
    ----------
    name : str
        "smc", "super-twisting" or "mpc".
    generations, population : int
        Of the differential evolution, which evaluates the cost population × (generations + 1) times.
    seed : int
        Of the search; the result does not depend on the number of workers.
    workers : int, optional
        Processes; default: one for each processor.

    Returns
    -------
    dict
        settings, cost, evaluations, seed.
    """
    low, high = np.log(list(BOUNDS[name].values())).T
    first = scipy.stats.qmc.Sobol(low.size, rng=seed).random(population)
    with ProcessPoolExecutor(workers) as pool:
        found = scipy.optimize.differential_evolution(
            functools.partial(_cost_at, name),
            list(zip(low, high)),
            init=low + first * (high - low),
            maxiter=generations,
            tol=0.0,
            polish=False,
            updating="deferred",
            rng=seed,
            workers=pool.map,
        )
    settings = {key: float(f"{value:.4g}") for key, value in zip(BOUNDS[name], np.exp(found.x))}
    controller = KINDS[name](**settings)
    return {"settings": asdict(controller), "cost": round(cost(controller), 6), "evaluations": found.nfev, "seed": seed}


def _cost_at(name, logarithms):
    return cost(KINDS[name](**dict(zip(BOUNDS[name], np.exp(logarithms)))))


@functools.cache
def stored(name: str) -> Controller:
    """Return a controller with its tuned settings.

    Parameters
    ----------
    name : str
        "smc", "super-twisting" or "mpc".

    Raises
    ------
    ManoeuvreError
        For another name.
    """
    if name not in KINDS:
        raise ManoeuvreError(f'controller "{name}" has no tuned settings; known: {", ".join(KINDS)}')
    return KINDS[name](**tomllib.loads(STORED.read_text(encoding="utf-8"))[name]["settings"])


def main():
    """Tune every controller and store the settings."""
    parser = argparse.ArgumentParser(description="tune the steering controllers")
    parser.add_argument("--out", type=FilePath, default=STORED, help="TOML file (default: %(default)s)")
    parser.add_argument("--workers", type=int, help="processes (default: one for each processor)")
    arguments = parser.parse_args()
    found = {}
    for name in KINDS:
        found[name] = tune(name, workers=arguments.workers)
        print(name, found[name], flush=True)
    with replacing(arguments.out) as temporary:
        temporary.write_text(tomli_w.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
