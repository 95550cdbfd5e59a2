"""The steering's twin on drives it was not developed on: convergence, coverage, wear, and what it is worth in control.

Writes the figures and tables of docs/vehicle_twin.md.
"""

import argparse
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from clearance_mj.vehicle.experiment import REGIMES
from experiments.steering.twin_drives import control, converge, wear
from experiments.steering.twin_page import (
    control_figure,
    control_table,
    convergence_figure,
    convergence_table,
    counted,
    wear_figure,
    wear_table,
    write,
)

PAGE = Path(__file__).parents[2] / "docs" / "vehicle_twin.md"


def main() -> None:
    """Make the figures and tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path, default=PAGE, help="page with the tables, beside which the figures go")
    parser.add_argument("--vehicles", type=int, default=30, help="mass, tyres, friction and noise drawn for each")
    parser.add_argument("--controlled", type=int, default=8, help="of them, on which controllers are compared")
    parser.add_argument("--minutes", type=float, default=60.0, help="length of the drives with wear")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes")
    options = parser.parse_args()
    names = [(f"{base}-{kind}", told) for base in ("smc", "mpc") for kind, told in
             (("cm", 1.0), ("cm", 0.5), ("cm", 1.5), ("twin", 1.0), ("twin", 0.5), ("twin", 1.5))]  # fmt: skip
    jobs: list[tuple[Callable[..., Any], Any]] = [
        *((wear, (regime, seed, options.minutes)) for seed in range(3) for regime in REGIMES),
        *((converge, (regime, seed)) for regime in REGIMES for seed in range(options.vehicles)),
        *(
            (control, (name, regime, seed, told))
            for regime in REGIMES
            for name, told in names
            for seed in range(options.controlled)
        ),
    ]
    with ProcessPoolExecutor(options.workers) as pool:
        waiting = [pool.submit(function, job) for function, job in jobs]
        done = [future.result() for future in tqdm(waiting, desc="drives", unit="drive")]
    found: dict[Callable[..., Any], list[Any]] = {wear: [], converge: [], control: []}
    for (function, _), result in zip(jobs, done):
        found[function] += result if function is converge else [result]
    controlled, counts = pd.DataFrame(found[control]), counted(found[converge])
    rate = np.median([h.rate for *_, h in found[converge]])
    tables = {
        "convergence": convergence_table(counts), "wear": wear_table(found[wear]), "control": control_table(controlled),
        "rate": f"The twin ran {rate:.0f} times faster than real time on one core (median over the drives).",
    }  # fmt: skip
    for table in tables.values():
        print(f"{table}\n")
    write(options.page, tables)
    figures = {
        "": convergence_figure(found[converge]),
        "_wear": wear_figure(found[wear]),
        "_control": control_figure(controlled),
    }
    for name, figure in figures.items():
        figure.savefig(options.page.with_name(f"vehicle_twin{name}.png"), dpi=100)


if __name__ == "__main__":
    main()
