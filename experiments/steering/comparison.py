"""Every steering controller on six manoeuvres that none is tuned on, in both regimes, over thirty vehicles.

Vehicles, noises and disturbances are the same for each controller; sensors are those of a car. A run that leaves the
path counts as the worst. Finished runs are kept in the folder and not run again while the code is the same.
"""

import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

import experiments.steering.controllers  # noqa: F401  (registers those that are compared with)
from clearance_mj.core.cache import code, digest
from clearance_mj.core.errors import ClearanceError, SimulationError
from clearance_mj.core.files import replacing
from clearance_mj.core.tasks import run_tasks
from clearance_mj.vehicle.experiment import CONTROLLERS, GAP, REGIMES, Case, check, run_case
from clearance_mj.vehicle.manoeuvres import MANOEUVRES, get_manoeuvre
from experiments.script import run
from experiments.steering.comparison_page import write_page

SEEDS = 30
SETTINGS_FILES = sorted({known.settings_file for known in CONTROLLERS.values()})
WRONG_START = dict.fromkeys(("smc-twin", "mpc-twin", "smc-twin-dob", "mpc-twin-dob"), 0.5)
"""Half-gap that controllers begin with over the true one, where that is not 1"""


class Group(NamedTuple):
    """Runs of one controller on one manoeuvre in one regime."""

    manoeuvre: str
    regime: str
    controller: str
    seeds: int
    sensors: str

    def cases(self) -> list[Case]:
        """One case for each seed."""
        settings = {"regime": self.regime, "manoeuvre": self.manoeuvre, "sensors": self.sensors, "spread": True}
        assumed, speed = WRONG_START.get(self.controller, 1.0) * GAP, get_manoeuvre(self.manoeuvre).speed
        return [
            Case(self.controller, speed, assumed_gap=assumed, seed=seed, **settings)
            for seed in range(1, self.seeds + 1)
        ]


def run_group(group: Group) -> pd.DataFrame:
    """One row for each seed: why the run did not reach its end, or nothing, and its metrics, infinite if it did not."""
    rows = []
    for case in group.cases():
        row = {"manoeuvre": case.manoeuvre, "regime": case.regime, "controller": case.controller, "seed": case.seed}
        try:
            row |= {"left": "", **run_case(case).run.metrics()}
        except SimulationError as error:
            row["left"] = str(error)
        rows.append(row)
    return pd.DataFrame(rows).fillna(np.inf)


def run_all(groups: list[Group], folder: Path, workers: int | None = None) -> pd.DataFrame:
    """Run what is not in the folder yet, with a progress bar, and return all rows in the order of the groups."""
    inputs = code(()), *(file.read_text(encoding="utf-8") for file in SETTINGS_FILES)
    files = {group: folder / f"{'_'.join(map(str, group))}_{digest(inputs, group)[:16]}.csv" for group in groups}
    missing = [group for group, file in files.items() if not file.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    known = len(groups) - len(missing)
    for group, rows in run_tasks(run_group, missing, workers, processes=True, progress="groups", done=known):
        with replacing(files[group]) as temporary:
            rows.to_csv(temporary, index=False)
    tables = [pd.read_csv(file, keep_default_na=False) for file in files.values()]
    return pd.concat(tables, ignore_index=True).fillna(np.inf)  # of controllers that never reached the end


def main(
    out: Path = Path("results/steering"), controllers: Sequence[str] = tuple(CONTROLLERS),
    manoeuvres: Sequence[str] = tuple(MANOEUVRES), seeds: int = SEEDS, sensors: str = "car", workers: int | None = None,
) -> int:  # fmt: skip
    """Run the comparison; writes runs.csv and the page with its figures."""
    groups = [Group(*names, seeds, sensors) for names in product(manoeuvres, REGIMES, controllers)]
    try:
        for group in groups:
            check(group.cases()[0])
        rows = run_all(groups, out / "runs", workers)
    except ClearanceError as error:
        return print(f"comparison: {error}", file=sys.stderr) or 2
    rows.to_csv(out / "runs.csv", index=False)
    write_page(rows, sensors, out)
    print(out / "vehicle_comparison.md")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
