"""Tuning of the controllers: one optimiser, budget, cost and kind of bounds for all, stored with its inputs.

Each controller follows the double lane changes of `MANOEUVRES` with the nominal multi-body plant without clearance and
noisy sensors. None of these lane changes is reported on, and none has clearance. The optimiser is differential
evolution over the logarithms of the settings, with the same population and generations whatever the number of settings.

``python -m clearance_mj.vehicle.tune`` repeats it and writes `TUNED`.
"""

from __future__ import annotations

import argparse
import functools
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import scipy.optimize
import scipy.stats
import tomli_w

from ..errors import ClearanceError, ManoeuvreError
from ..files import replacing
from .controllers import CONTROLLERS, Controller, Registration, get_controller
from .controllers.registry import TUNED
from .manoeuvres import double_lane_change
from .plant import MultiBody
from .run import follow_path, nominal_task
from .sensors import IdealSensors
from .steering import Steering

__all__ = ["MANOEUVRES", "cost", "tune"]

MANOEUVRES = ((72 / 3.6, 1.5), (120 / 3.6, 2.2))
"""(speed in m/s, length factor) of the double lane changes that are tuned on"""
POPULATION, GENERATIONS, SEED = 16, 7, 0
"""128 evaluations for each controller"""
FAILED = 100.0
"""Cost of leaving the path"""


def cost(controller: Controller) -> float:
    """Mean over `MANOEUVRES` of peak |e_y| / 50 mm + RMS e_y / 15 mm + total variation of the wheel angle / 0.1 rad."""
    costs = []
    for speed, factor in MANOEUVRES:
        task = nominal_task(double_lane_change(factor), speed)
        try:
            found = follow_path(MultiBody(), Steering(), controller, task, IdealSensors.inertial()).metrics()
        except ClearanceError:
            return FAILED
        costs.append(found["peak_e_y"] / 0.05 + found["rms_e_y"] / 0.015 + found["steer_variation"] / 0.1)
    return float(np.mean(costs))


def tune(
    name: str,
    generations: int = GENERATIONS,
    population: int = POPULATION,
    seed: int = SEED,
    workers: int | None = None,
) -> dict[str, Any]:
    """Search for the settings of a controller with bounds; the result does not depend on the number of workers.

    The differential evolution evaluates the cost population × (generations + 1) times. Returns settings, cost,
    evaluations, seed: what `TUNED` holds, and ``settings`` what `Registration.tuned` takes.
    """
    registration = get_controller(name)
    if not registration.bounds:
        raise ManoeuvreError(f'controller "{name}" has no bounds to tune within')
    low, high = np.log(list(registration.bounds.values())).T
    first = scipy.stats.qmc.Sobol(low.size, rng=seed).random(population)
    with ProcessPoolExecutor(workers) as pool:
        found = scipy.optimize.differential_evolution(
            functools.partial(_cost_at, registration),
            list(zip(low, high)),
            init=low + first * (high - low),
            maxiter=generations,
            tol=0.0,
            polish=False,
            updating="deferred",
            rng=seed,
            workers=pool.map,
        )
    settings = {key: float(f"{value:.4g}") for key, value in zip(registration.bounds, np.exp(found.x))}
    controller = registration.controller(**settings)
    return {"settings": asdict(controller), "cost": round(cost(controller), 6), "evaluations": found.nfev, "seed": seed}


def _cost_at(registration: Registration, logarithms: np.ndarray) -> float:
    return cost(registration.controller(**dict(zip(registration.bounds, np.exp(logarithms)))))


def main() -> None:
    """Tune every controller that has bounds and store the settings."""
    parser = argparse.ArgumentParser(description="tune the steering controllers")
    parser.add_argument("--out", type=FilePath, default=TUNED, help="TOML file (default: %(default)s)")
    parser.add_argument("--workers", type=int, help="processes (default: one for each processor)")
    arguments = parser.parse_args()
    found = {}
    for name in (name for name, known in CONTROLLERS.items() if known.bounds):
        found[name] = tune(name, workers=arguments.workers)
        print(name, found[name], flush=True)
    with replacing(arguments.out) as temporary:
        temporary.write_text(tomli_w.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
