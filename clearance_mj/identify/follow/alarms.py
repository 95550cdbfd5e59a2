"""What a twin tracks of a clearance, which of its changes are alarms, and the alarms' words."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from .changes import Change, Changes

__all__ = ["QUANTITIES", "TESTED", "TRACKED", "Alarm", "Tracked", "significant_change"]

SIGNIFICANCE = 4.0  # standard deviations beyond its threshold from which on a change counts
MIN_WINDOWS = 2  # that show a change before it counts, so that its kind is known


@dataclass(frozen=True)
class Tracked:
    """How a part of a clearance varies. All numbers are relative; those of an offset are over the gap."""

    unit: str  #: of its values, SI
    walk: float  #: standard deviation of its random walk over a second
    window_std: float  #: standard deviation that a window's estimate may be off the last one
    change_std: float  #: prior standard deviation of a change
    threshold: float | None = None  #: change that matters; None: it is not tested for changes
    alarm: bool = True  #: whether a change is an alarm; else the twin only begins anew with what followed it


TRACKED = {
    "gap": Tracked("m", 1e-3, 0.03, 0.3, threshold=0.03),
    "offset": Tracked("m", 2e-3, 0.03, 0.3),
    "stiffness": Tracked("N/m", 2e-3, 0.05, 0.5, threshold=0.05),
    # Only the shapes of their laws tell the contact's damping and the film's losses apart: a change is no alarm.
    "damping": Tracked("Ns/m", 0.01, 0.2, 1.0, threshold=0.3, alarm=False),
    "exponent": Tracked("1", 1e-3, 0.02, 0.1),
    "grease stiffness": Tracked("N/m", 1e-3, 0.02, 0.3, threshold=0.1),
    "grease damping": Tracked("Ns/m", 5e-3, 0.05, 0.5, threshold=0.3),
}  # By name; `FamilyParameter.tracked_as` says of which one a family's parameter is a part
TESTED = {name: tracked.threshold for name, tracked in TRACKED.items() if tracked.threshold is not None}
"""Thresholds of those that are tested for changes, by name"""
QUANTITIES = ("gap", "stiffness", "damping")
"""Those whose histories a twin gives, in this order"""


@dataclass(frozen=True)
class Alarm:
    """A change that a record shows."""

    time: float
    """s, end of the window that shows it"""
    since: float
    """s, beginning of the window in which it most likely began"""
    bushing: int
    """number"""
    quantity: str
    """ "gap", "stiffness", "grease stiffness" or "grease damping" """
    before: float
    """value, SI unit"""
    after: float
    """value since then, SI unit"""

    def to_dict(self) -> dict[str, Any]:
        """Return the alarm as plain data, SI units."""
        return dataclasses.asdict(self)

    @property
    def shown_in(self) -> tuple[float, str]:
        """Number of the unit in which the quantity is shown in an SI unit, and its label."""
        return (1e3, "mm") if self.quantity == "gap" else (1.0, TRACKED[self.quantity].unit)

    def __str__(self) -> str:
        scale, unit = self.shown_in
        return (
            f"{self.time:.4g} s: {self.quantity} of bushings[{self.bushing}] changed by "
            f"{100 * (self.after / self.before - 1):+.1f} % since {self.since:.4g} s, "
            f"{scale * self.before:.4g} to {scale * self.after:.4g} {unit}"
        )


def significant_change(changes: Changes, directions: np.ndarray) -> tuple[str, Change] | None:
    """Return what changed, by its name in `TESTED`, and the change; None if no change is significant.

    Parameters
    ----------
    changes : Changes
        With the observations so far.
    directions : ndarray
        (n_tested, n) of the parameters' changes, one for each of `TESTED`, of a relative change of 1.
    """
    found = changes.likeliest(directions, np.log1p(list(TESTED.values())))
    if found is None or found[1] < SIGNIFICANCE or found[0].windows < MIN_WINDOWS:
        return None
    return list(TESTED)[found[0].kind], found[0]
