"""The steering's twin on drives it was not developed on: convergence, coverage, wear, and what it is worth in control.

Writes the figures and tables of docs/vehicle_twin.md.
"""

import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from clearance_mj.vehicle.experiment import REGIMES
from experiments.script import run
from experiments.steering import twin_page
from experiments.steering.twin_drives import control, converge, wear
from experiments.tables import put_between_marks

PAGE = Path(__file__).parents[2] / "docs" / "vehicle_twin.md"


def main(
    page: Path = PAGE, vehicles: int = 30, compared: int = 8, minutes: float = 60.0, workers: int | None = None
) -> None:
    """Make the figures and tables; ``compared``: vehicles on which controllers are, ``minutes``: drives with wear."""
    names = [(f"{base}-{kind}", assumed) for base in ("smc", "mpc") for kind, assumed in
             (("cm", 1.0), ("cm", 0.5), ("cm", 1.5), ("twin", 1.0), ("twin", 0.5), ("twin", 1.5))]  # fmt: skip
    jobs: list[tuple[Callable[..., Any], Any]] = [
        *((wear, (regime, seed, minutes)) for seed in range(3) for regime in REGIMES),
        *((converge, (regime, seed)) for regime in REGIMES for seed in range(vehicles)),
        *(
            (control, (name, regime, seed, assumed))
            for regime in REGIMES
            for name, assumed in names
            for seed in range(compared)
        ),
    ]
    with ProcessPoolExecutor(workers) as pool:
        waiting = [pool.submit(function, job) for function, job in jobs]
        done = [future.result() for future in tqdm(waiting, desc="drives", unit="drive")]
    results: dict[Callable[..., Any], list[Any]] = {wear: [], converge: [], control: []}
    for (function, _), result in zip(jobs, done):
        results[function] += result if function is converge else [result]
    controlled, counts = pd.DataFrame(results[control]), twin_page.counted(results[converge])
    rate = np.median([h.rate for *_, h in results[converge]])
    tables = {
        "convergence": twin_page.convergence_table(counts), "wear": twin_page.wear_table(results[wear]),
        "control": twin_page.control_table(controlled),
        "rate": f"The twin ran {rate:.0f} times faster than real time on one core (median over the drives).",
    }  # fmt: skip
    for name, table in tables.items():
        print(f"{table}\n")
        put_between_marks(page, name, f"\n{table.rstrip()}\n\n")
    figures = {
        "": twin_page.convergence_figure(results[converge]),
        "_wear": twin_page.wear_figure(results[wear]),
        "_control": twin_page.control_figure(controlled),
    }
    for name, figure in figures.items():
        figure.savefig(page.with_name(f"vehicle_twin{name}.png"), dpi=100)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
