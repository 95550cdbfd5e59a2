"""Tuning of the controllers: the same optimiser, budget, cost and kind of bounds for all, stored with its inputs.

Each controller follows the double lane changes of `MANOEUVRES`, on a crowned road, in crosswind, and close to the
tyres' limit, each with a vehicle off the nominal one, in a steering with the clearance that is reported on, and noise
of sensors and road: once with ideal sensors, once with those of a car. None of these lane changes, vehicles and winds
is reported on. Clearance and wind are included since a disturbance observer, dither or an adaptive inverse cannot be
tuned without them; they are the same for all controllers. The optimiser is differential evolution over the logarithms
of the settings, with the same population and generations for any number of settings.

``python -m clearance_mj.vehicle.tune`` repeats it and writes each controller's `Registration.settings_file`.
"""

from __future__ import annotations

import argparse
import functools
import tomllib
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import numpy as np
import scipy.optimize
import scipy.stats
import tomli_w
from tqdm import tqdm

from ..core.errors import ClearanceError, ManoeuvreError
from ..core.files import replacing
from .controllers import CONTROLLERS, Controller, Registration, get_controller
from .disturbances import Crosswind, CrownedRoad, Disturbance
from .experiment import Case, drive
from .sensors import SENSORS, get_sensors

__all__ = ["MANOEUVRES", "Course", "cost", "store", "tunable", "tune"]


class Course(NamedTuple):
    """A double lane change for tuning."""

    speed: float  # km/h
    length_factor: float
    regime: str  # of the steering
    disturbance: Disturbance | None = None  # in addition to the road's moment on the wheels


MANOEUVRES = (
    Course(72.0, 1.5, "friction", CrownedRoad(crown=0.015)),
    Course(120.0, 2.2, "torque", Crosswind(mean=6.0, turbulence=1.2)),
    Course(56.0, 1.0, "friction"),
)
FIRST_VEHICLE = 1000  # seed of the first course's vehicle and noise; those of reported runs begin at 0
POPULATION, GENERATIONS, SEED = 16, 7, 0  # of the differential evolution: 128 evaluations for each controller
FAILED = 100.0  # cost of a run that leaves the path, above that of any other


def cost(registration: Registration, controller: Controller, sensors: str = "ideal") -> float:
    """Return the cost of a controller, the mean over `MANOEUVRES`.

    Peak |e_y| / 50 mm + RMS e_y / 15 mm + servo's RMS rate / 0.03 rad/s + its reversals/s. Lane changes take 0.025 to
    0.07 rad/s and one reversal in 3 s. The controller has its settings; the registration adds its prior information.
    """
    costs = []
    for seed, (speed, factor, regime, disturbance) in enumerate(MANOEUVRES, FIRST_VEHICLE):
        case = Case(
            registration.name, speed, regime=regime, length_factor=factor, sensors=sensors, spread=True, seed=seed
        )
        try:
            run = drive(case, registration.informed(controller, case.task, case.prior), disturbance)
        except ClearanceError:
            return FAILED
        values, duration = run.metrics(), run.time[-1]
        error, reversals = values["peak_e_y"] / 0.05 + values["rms_e_y"] / 0.015, values["servo_reversals"] / duration
        costs.append(error + values["servo_rms_rate"] / 0.03 + reversals)
    return float(np.mean(costs))


def tunable() -> list[str]:
    """Return the names of the controllers that have bounds for tuning."""
    return [name for name, registration in CONTROLLERS.items() if registration.bounds]


def tune(
    name: str, sensors: str = "ideal", generations: int = GENERATIONS, population: int = POPULATION, seed: int = SEED,
    workers: int | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Optimise the settings of a controller within its bounds; the result does not depend on the number of workers.

    The differential evolution evaluates the cost population × (generations + 1) times. Returns settings, cost,
    evaluations and seed, as in a file of settings; its ``settings`` are those of `Registration.tuned`.
    """
    registration = get_controller(name)
    if not registration.bounds:
        raise ManoeuvreError(f'controller "{name}" has no bounds to tune within')
    low, high = np.log(list(registration.bounds.values())).T
    points = scipy.stats.qmc.Sobol(low.size, rng=seed).random(population)
    with ProcessPoolExecutor(workers) as pool:
        search: dict[str, Any] = {"maxiter": generations, "tol": 0.0, "polish": False, "updating": "deferred"}
        search |= {"init": low + points * (high - low), "rng": seed, "workers": pool.map}
        cost_at = functools.partial(_cost_at, registration, sensors)
        optimum = scipy.optimize.differential_evolution(cost_at, list(zip(low, high)), **search)
    settings = {key: float(f"{value:.4g}") for key, value in zip(registration.bounds, np.exp(optimum.x))}
    lowest = round(_cost_with(registration, sensors, settings), 6)
    return {"settings": settings, "cost": lowest, "evaluations": optimum.nfev, "seed": seed}


def _cost_at(registration: Registration, sensors: str, logarithms: np.ndarray) -> float:
    return _cost_with(registration, sensors, dict(zip(registration.bounds, np.exp(logarithms))))


def _cost_with(registration: Registration, sensors: str, settings: dict[str, float]) -> float:
    return cost(registration, registration.with_settings(settings, get_sensors(sensors).tuned), sensors)


def store(path: FilePath, sensors: str, name: str, result: dict[str, Any]) -> None:
    """Write the tuning result of a controller into a TOML file."""
    stored = tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    stored.setdefault(sensors, {})[name] = result
    with replacing(path) as temporary:
        temporary.write_text(tomli_w.dumps(stored), encoding="utf-8")


def main() -> None:
    """Tune controllers that have bounds and store the settings."""
    parser = argparse.ArgumentParser(description="tune the steering controllers")
    parser.add_argument("--sensors", choices=list(SENSORS), action="append", help="default: all")
    parser.add_argument("--controller", help="names with commas (default: all that have bounds)")
    parser.add_argument("--seed", type=int, default=SEED, help="of the search (default: %(default)s)")
    parser.add_argument("--generations", type=int, default=GENERATIONS, help="default: %(default)s")
    parser.add_argument("--out", type=FilePath, help="TOML file (default: each controller's own)")
    parser.add_argument("--workers", type=int, help="processes (default: one for each processor)")
    arguments = parser.parse_args()
    names = arguments.controller.split(",") if arguments.controller else tunable()
    jobs = [(sensors, name) for sensors in arguments.sensors or SENSORS for name in names]
    for sensors, name in tqdm(jobs, desc="tune", unit="controller"):
        result = tune(name, sensors, arguments.generations, seed=arguments.seed, workers=arguments.workers)
        store(arguments.out or get_controller(name).settings_file, sensors, name, result)


if __name__ == "__main__":
    main()
