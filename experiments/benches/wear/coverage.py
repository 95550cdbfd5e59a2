"""Coverage of the intervals of the remaining life, of virtual machines that wear (docs/wear.md). Synthetic.

    python -m experiments.benches.wear.coverage --first 300 --count 40 --only sine

From the first third of each machine's life; a row for each machine and bushing, and a summary. ``--truth`` predicts by
what stands there instead of what is known of it: what intervals then are wide is the walk of the coefficients.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from tqdm import tqdm

from clearance_mj.core.errors import ClearanceError
from clearance_mj.report.tables import write_csv
from clearance_mj.wear import Marched, predict_remaining
from clearance_mj.wear.remaining import DRIFT, WAYS
from experiments.benches.wear.machine import COEFFICIENT, Machine, make_machine
from experiments.script import run

LEVEL = 0.9
MARCHED_WAYS = 3


def ways_of(machine: Machine) -> int:
    """Draws of the model's posterior: a way that is marched takes ten times as long."""
    return MARCHED_WAYS if isinstance(machine.operation, Marched) else WAYS


def rows_of(machine: Machine, drift: float) -> list[dict]:
    """A row for each bushing that wears: true and predicted remaining life, and whether the interval holds it."""
    history = machine.history()
    limits = {f"bushings[{j}]": float(limit) for j, limit in enumerate(machine.limit) if np.isfinite(limit)}
    start = time.process_time()
    try:
        life = predict_remaining(
            machine.model, machine.operation, history, limits, drift, ways_of(machine), machine.seed
        )
    except ClearanceError as error:
        return [{"seed": machine.seed, "bushing": -1, "error": str(error)}]
    took = time.process_time() - start
    low, high = life.interval(LEVEL)
    rows = []
    for j in history.known:
        true = float(machine.life[j] - history.hours[-1])
        rows.append({
            "seed": machine.seed, "operation": machine.operation.to_dict()["operation"], "bushing": j,
            "growth_%": 100 * (machine.limit[j] / machine.gap[0, j] - 1), "true_h": true, "median_h": life.median[j],
            "low_h": low[j], "high_h": high[j], "inside": bool(low[j] <= true <= high[j]),
            "rank": float(np.mean(life.hours[j] < true)), "drift": life.drift[j], "misfit": life.misfit[j],
            "coefficient": float(np.median(life.coefficient[j])) / COEFFICIENT, "cpu_s": took,
        })  # fmt: skip
    return rows


def summary(table: pd.DataFrame) -> str:
    """Return coverage and width of the intervals, and the error of the medians, in words."""
    predicted = table[table["bushing"] >= 0]
    error = np.abs(np.log(predicted["median_h"] / predicted["true_h"]))
    width = np.log(predicted["high_h"] / predicted["low_h"])
    failed = len(table) - len(predicted)
    return (
        f"{predicted['inside'].mean():.1%} of {len(predicted)} (machines x bushings) inside {LEVEL:.0%} intervals, "
        f"median |error| {100 * np.expm1(error.median()):.1f} %, intervals a factor {np.exp(width.median()):.2f} wide, "
        f"{predicted['seed'].nunique()} machines, {failed} refused, {predicted['cpu_s'].median():.1f} s each"
    )


def main(
    out: Path = Path("results/wear"), first: int = 0, count: int = 20, drift: float = DRIFT, truth: bool = False,
    only: Literal["sine", "noise"] | None = None,
) -> None:  # fmt: skip
    """Write the table, and print its summary."""
    rows: list[dict] = []
    seeds = range(first, first + count)
    wanted = [seed for seed in seeds if only in (None, "noise" if seed % 2 else "sine")]
    for seed in tqdm(wanted, desc="machines"):
        machine = make_machine(seed)
        if machine and truth:
            machine = replace(machine, model=machine.truth)
        rows += [] if machine is None or np.isnan(machine.life).all() else rows_of(machine, drift)
        write_csv(out / f"remaining_{first}.csv", rows)
    print(summary(pd.DataFrame(rows)))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
