"""Gain of the clearance model under delay and noise of a car's sensors: SMC-CM against SMC over both.

Writes the figure and the table of docs/vehicle_sensors.md, with controllers as they are tuned in the package.
"""

import itertools
import math
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from tqdm import tqdm

from clearance_mj.core.errors import SimulationError
from clearance_mj.report.vehicle import look
from clearance_mj.vehicle.experiment import REGIMES, Case, run_case
from clearance_mj.vehicle.sensors import CarSensors
from experiments.script import run
from experiments.tables import markdown_table, put_between_marks

PAGE = Path(__file__).parents[2] / "docs" / "vehicle_sensors.md"
CONTROLLERS = ("smc", "smc-cm")
SPEED = 72.0  # km/h, of the double lane change
CAR = CarSensors()
NOISES = ("yaw_rate", "yaw_rate_offset", "lateral_acceleration", "acceleration_offset", "acceleration_scale", "speed")
JITTER = 0.01  # s, by which delays scatter to either side, as long as they stay positive


class Sweep(NamedTuple):
    """One property of the sensors over some values, all others those of a car."""

    label: str
    usual: float
    values: tuple[float, ...]
    sensors: Callable[[float], CarSensors]


def delayed(milliseconds: float) -> CarSensors:
    """Return sensors whose messages take this long in the mean."""
    mean = 1e-3 * milliseconds
    return replace(CAR, delay=(max(mean - JITTER, 0.0), mean + min(mean, JITTER)))


def noisy(factor: float) -> CarSensors:
    """Return sensors whose noises, offsets and scale, but for the position's, are so many times a car's."""
    return replace(CAR, **{name: factor * getattr(CAR, name) for name in NOISES})


SWEEPS = (
    Sweep("Delay of messages (ms)", 20.0, (0.0, 10.0, 20.0, 30.0, 40.0, 60.0), delayed),
    Sweep("Noise and offsets (times a car's)", 1.0, (0.0, 1.0, 2.0, 4.0), noisy),
    Sweep("Noise of position (mm)", 20.0, (0.0, 10.0, 20.0, 40.0), lambda mm: replace(CAR, position=1e-3 * mm)),
    Sweep("Rate of position (Hz)", 20.0, (5.0, 10.0, 20.0, 50.0), lambda hz: replace(CAR, position_rate=hz)),
)


def peak(case: Case) -> float:
    """Largest lateral error, mm; infinite if the vehicle left the path."""
    try:
        return 1e3 * run_case(case).run.metrics()["peak_e_y"]
    except SimulationError:
        return math.inf


def peaks(vehicles: int, workers: int) -> pd.DataFrame:
    """Run all: one row for each sweep, value, regime and vehicle, one column for each controller."""
    places = [(sweep, value) for sweep in SWEEPS for value in sweep.values]
    keys = list(itertools.product(places, REGIMES, range(vehicles)))
    cases = {
        (sensors, regime, seed, name): Case(name, SPEED, regime=regime, spread=True, seed=seed, sensors=sensors)
        for ((sweep, value), regime, seed) in keys
        for name in CONTROLLERS
        for sensors in [sweep.sensors(value)]
    }  # what a car has comes up in every sweep and runs once
    with ProcessPoolExecutor(workers) as pool:
        results = pool.map(peak, cases.values(), chunksize=4)
        known = dict(zip(cases, tqdm(results, total=len(cases), unit="run", desc="lane changes")))
    rows = [
        {"sweep": sweep.label, "value": value, "regime": regime, "vehicle": seed}
        | {name: known[sweep.sensors(value), regime, seed, name] for name in CONTROLLERS}
        for ((sweep, value), regime, seed) in keys
    ]
    ideal = [
        {"sweep": "ideal", "value": 0.0, "regime": regime, "vehicle": seed}
        | {n: peak(Case(n, SPEED, regime=regime, spread=True, seed=seed)) for n in CONTROLLERS}
        for regime in REGIMES
        for seed in range(vehicles)
    ]
    results = pd.DataFrame(rows + ideal)
    results["gain"] = 100 * (1 - results["smc-cm"] / results["smc"])  # of the same vehicle and noise
    return results


def quantiles(table: pd.DataFrame, column: str) -> np.ndarray:
    """Median and quartiles over vehicles, (3, values)."""
    return table.groupby("value")[column].quantile([0.5, 0.25, 0.75]).unstack().to_numpy().T


def draw(results: pd.DataFrame) -> Figure:
    """Peaks of both controllers in both regimes, and below the gain, over each property."""
    figure = Figure(figsize=(11, 7.2), layout="constrained")
    axes = figure.subplots(3, len(SWEEPS), sharex="col", sharey="row")
    for column, sweep in zip(axes.T, SWEEPS):
        table = results[results["sweep"] == sweep.label]
        for ax, regime in zip(column, REGIMES):
            here = table[table["regime"] == regime]
            for name in CONTROLLERS:
                style = look(name)
                median, low, high = quantiles(here, name)
                ax.plot(sweep.values, median, marker="o", ms=3, **style)
                ax.fill_between(sweep.values, low, high, color=style["color"], alpha=0.2, lw=0)
        for regime, line in zip(REGIMES, ("-", (0, (4, 1.5)))):
            median, low, high = quantiles(table[table["regime"] == regime], "gain")
            column[2].plot(sweep.values, median, color="black", ls=line, marker="o", ms=3, label=f"{regime}-driven")
            column[2].fill_between(sweep.values, low, high, color="black", alpha=0.1, lw=0)
        column[2].axhline(0, color="grey", lw=0.8)
        column[2].set_xlabel(sweep.label)
        for ax in column:
            ax.axvline(sweep.usual, color="grey", lw=0.8, ls=":")
            ax.grid(alpha=0.3)
    for ax, words in zip(axes[:, 0], (*(f"Peak error, {regime}-driven (mm)" for regime in REGIMES), "Gain (%)")):
        ax.set_ylabel(words)
    for ax in axes[:2, 0]:
        ax.set_ylim(bottom=0)
    axes[0, 0].legend(fontsize=8)
    axes[2, 0].legend(fontsize=8)
    return figure


def markdown(results: pd.DataFrame) -> str:
    """Medians of the peaks and of the gain, with quartiles, of a car's sensors and of the ends of the sweeps."""
    sweeps = {sweep.label: sweep for sweep in SWEEPS}
    lines = [("", "torque-driven: SMC/SMC-CM, mm", "gain, %", "friction-driven: SMC/SMC-CM, mm", "gain, %")]
    named: dict[str, pd.DataFrame] = {}
    for (label, value), table in results.groupby(["sweep", "value"], sort=False):
        if not (sweep := sweeps.get(label)):
            named["ideal sensors"] = table
        elif value == sweep.usual:
            named["car sensors"] = table  # the same runs in every sweep
        elif value in (sweep.values[0], sweep.values[-1]):
            quantity, _, unit = label.partition(" (")
            named[f"{quantity.lower()} {value:g} {unit.rstrip(')')}"] = table
    for name in sorted(named, key=lambda name: name != "car sensors"):
        cells = [name]
        for regime in REGIMES:
            here = named[name][named[name]["regime"] == regime]
            low, middle, high = here["gain"].quantile([0.25, 0.5, 0.75])
            peaks = "/".join(f"{here[n].median():.1f}" for n in CONTROLLERS)
            cells += [peaks, f"{middle:.0f} ({low:.0f}…{high:.0f})"]
        lines.append(cells)
    return markdown_table(lines)


def main(page: Path = PAGE, vehicles: int = 10, workers: int | None = None) -> None:
    """Make the figure and the table."""
    results = peaks(vehicles, workers)
    put_between_marks(page, "table", f"\n{markdown(results)}\n")
    draw(results).savefig(page.with_name("vehicle_sensors.png"), dpi=100)
    print(markdown(results))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
