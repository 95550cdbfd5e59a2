"""Statistics of the comparison of steering controllers, out of one row for each run.

Columns: manoeuvre, regime, controller, seed, left (why the run did not reach its end, or empty), and the run's metrics,
which are infinite if it did not.
"""

from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from clearance_mj.vehicle.experiment import CONTROLLERS, REGIMES
from experiments.article.motion import Median, median

OBSERVERS = ("smc-dob", "mpc-dob")
"""Controllers that take out by a disturbance observer what the others take out by the clearance model"""
PAIRS = (
    *((name, "smc-dob") for name in ("smc-cm", "smc-twin", "smc-cm-dob", "smc-twin-dob")),
    *((name, "mpc-dob") for name in ("mpc-cm", "mpc-twin", "mpc-cm-dob", "mpc-twin-dob", "mpc-backlash")),
)  # Each controller with a clearance model, and the one with an observer that it is compared with in pairs


def names_of(rows: pd.DataFrame) -> list[str]:
    """Return the controllers that ran, in the order of tables."""
    return [name for name in CONTROLLERS if name in set(rows["controller"])]


class Paired(NamedTuple):
    """One controller against another on the same vehicles and noises."""

    manoeuvre: str
    regime: str
    new: str
    old: str
    below: Median  # % by which the peak error is below the other's
    reversals: float  # median difference of the servo's reversals

    @property
    def verdict(self) -> str:
        """The verdict that the interval supports."""
        if self.below.high < 0:
            return "worse"
        if self.below.low <= 0:
            return "no difference"
        return "better" if self.reversals <= 0 else "better, more reversals"


def values(rows: pd.DataFrame, manoeuvre: str, regime: str, controller: str, metric: str) -> np.ndarray:
    """Return a metric of each run, in the order of seeds; infinite where the run left the path."""
    here = (rows["manoeuvre"] == manoeuvre) & (rows["regime"] == regime) & (rows["controller"] == controller)
    return rows[here].sort_values("seed")[metric].to_numpy(dtype=float)


def below(new: np.ndarray, old: np.ndarray) -> np.ndarray:
    """Return by how much values are below others, %; nothing where both are infinite."""
    with np.errstate(invalid="ignore"):
        return 100 * (1 - np.where(np.isinf(new) & np.isinf(old), 1.0, new / old))


def paired(rows: pd.DataFrame) -> list[Paired]:
    """Compare the pairs on every manoeuvre in every regime."""
    there, comparisons = set(rows["controller"]), []
    for manoeuvre, regime, (new, old) in product(rows["manoeuvre"].unique(), REGIMES, PAIRS):
        if {new, old} <= there:
            peaks = [values(rows, manoeuvre, regime, name, "peak_e_y") for name in (new, old)]
            turns = [values(rows, manoeuvre, regime, name, "servo_reversals") for name in (new, old)]
            whole = np.isfinite(turns).all(axis=0)
            more = float(np.median(turns[0][whole] - turns[1][whole])) if whole.any() else np.inf
            comparisons.append(Paired(manoeuvre, regime, new, old, median(below(*peaks)), more))
    return comparisons


def below_both(rows: pd.DataFrame, regime: str, controller: str) -> tuple[int, int]:
    """Return on how many manoeuvres a median peak error is below both observers', and on how many of these it is so
    with no more reversals of the servo than the better of the two.
    """
    below, quiet = 0, 0
    for manoeuvre in rows["manoeuvre"].unique():
        peak, turns = (
            {n: np.median(values(rows, manoeuvre, regime, n, metric)) for n in (controller, *OBSERVERS)}
            for metric in ("peak_e_y", "servo_reversals")
        )
        better = min(OBSERVERS, key=lambda name: peak[name])
        below += int(peak[controller] < peak[better])
        quiet += int(peak[controller] < peak[better] and turns[controller] <= turns[better])
    return below, quiet
