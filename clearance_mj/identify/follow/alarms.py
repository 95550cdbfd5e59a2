"""Tracked quantities of a clearance, which of their changes are alarms, and the alarms' words."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["QUANTITIES", "RUB", "TRACKED", "Alarm", "Tracked", "shown_as"]

RUB = "rub"  # a force that neither laws nor the shaft explain


@dataclass(frozen=True)
class Tracked:
    """Expected changes of a quantity of a clearance. All numbers are relative; those of an offset are over the gap."""

    unit: str  #: of its values, SI
    walk: float  #: standard deviation of its random walk over a second
    window_std: float  #: standard deviation that a window's estimate may be off the last one
    change_std: float  #: prior standard deviation of a change
    threshold: float | None = None  #: change that matters; None: it is not tested for changes
    alarm: bool = True  #: True if a change is an alarm; else the twin only begins anew after it


TRACKED = {
    "gap": Tracked("m", 1e-3, 0.03, 0.3, threshold=0.03),
    "offset": Tracked("m", 2e-3, 0.03, 0.3),
    "stiffness": Tracked("N/m", 2e-3, 0.05, 0.5, threshold=0.05),
    # Only the shapes of their laws tell the contact's damping and the film's losses apart: a change is no alarm.
    "damping": Tracked("Ns/m", 0.01, 0.2, 1.0, threshold=0.3, alarm=False),
    "exponent": Tracked("1", 1e-3, 0.02, 0.1),
    "grease stiffness": Tracked("N/m", 1e-3, 0.02, 0.3, threshold=0.1),
    "grease damping": Tracked("Ns/m", 5e-3, 0.05, 0.5, threshold=0.3),
    "viscosity": Tracked("Pas", 5e-3, 0.05, 0.5, threshold=0.1),
}  # By name; `FamilyParameter.tracked_as` says of which one a family's parameter is a part
QUANTITIES = ("gap", "stiffness", "damping")
"""Those whose histories a bench's twin gives, in this order"""
SHOWN = {"gap": (1e3, "mm"), "viscosity": (1e3, "mPa s"), "damping": (1.0, "N s/m"), "grease damping": (1.0, "N s/m")}


def shown_as(quantity: str) -> tuple[float, str]:
    """Return the number of the unit in which a quantity is shown in an SI unit, and its label.

    Parameters
    ----------
    quantity : str
        One of `TRACKED`.
    """
    return SHOWN.get(quantity, (1.0, TRACKED[quantity].unit))


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
    """ "gap", "stiffness", "grease stiffness", "grease damping", "viscosity" or `RUB`"""
    before: float
    """value, SI unit; of a rub 0"""
    after: float
    """value since then, SI unit; of a rub the largest force, N, that nothing explains"""

    def to_dict(self) -> dict[str, Any]:
        """Return the alarm as plain data, SI units."""
        return asdict(self)

    def __str__(self) -> str:
        if self.quantity == RUB:
            return f"{self.time:.4g} s: bushings[{self.bushing}] rubs since {self.since:.4g} s, with {self.after:.3g} N"
        scale, unit = shown_as(self.quantity)
        return (
            f"{self.time:.4g} s: {self.quantity} of bushings[{self.bushing}] changed by "
            f"{100 * (self.after / self.before - 1):+.1f} % since {self.since:.4g} s, "
            f"{scale * self.before:.4g} to {scale * self.after:.4g} {unit}"
        )
