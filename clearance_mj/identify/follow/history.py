"""What a twin returns: histories of gaps, contact stiffness and contact damping with their bands, and alarms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...rig import Rig
from .alarms import QUANTITIES, TRACKED, Alarm

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Twin"]

NORMAL95 = 1.959963984540054  # standard deviations, half of a 95 % interval


@dataclass(frozen=True, eq=False)
class Twin:
    """What is known of a record's clearances over time, each value from what was measured by then.

    Stiffness and damping are those of the contact at `depth`: force over penetration, and its slope by speed.
    """

    record: str
    """name"""
    rig: Rig
    """as corrected by the first part of the record"""
    time: np.ndarray
    """(n,) s, ends of the windows"""
    window: float
    """s"""
    depth: np.ndarray
    """(n_bushings,) penetration, m, RMS of the part that the law was fitted to; nan if it never touched"""
    mean: np.ndarray
    """(3, n, n_bushings) logarithms of gap, stiffness and damping; nan while the gap is not known"""
    std: np.ndarray
    """(3, n, n_bushings) their standard deviations"""
    contact: np.ndarray
    """(n, n_bushings) share of the time in contact"""
    misfit: np.ndarray
    """(n, n_bushings) RMS of what the law misses of the force, over its misfit when it was fitted"""
    alarms: tuple[Alarm, ...]
    """in the order of time"""
    warnings: tuple[str, ...]
    """plain words on what not to rely on"""

    def value(self, quantity: str) -> np.ndarray:
        """Return the most likely values (n, n_bushings) of "gap", m, "stiffness", N/m, or "damping", N s/m.

        Parameters
        ----------
        quantity : str
            Name of the quantity.
        """
        return np.exp(self.mean[QUANTITIES.index(quantity)])

    def band(self, quantity: str) -> np.ndarray:
        """Return the limits (2, n, n_bushings) within which a quantity lies with a probability of 95 %.

        Parameters
        ----------
        quantity : str
            Name of the quantity, as in `value`.
        """
        number = QUANTITIES.index(quantity)
        half = NORMAL95 * self.std[number]
        return np.exp(self.mean[number] + np.array([-half, half]))

    def words(self) -> list[str]:
        """Say in a line for each clearance what is known of it at the end."""
        found = []
        for j in range(self.depth.size):
            known = np.flatnonzero(np.isfinite(self.mean[0, :, j]))
            if known.size:
                i, half = known[-1], NORMAL95 * self.std[:, known[-1], j]
                gap, k, c = np.exp(self.mean[:, i, j])
                found.append(
                    f"bushings[{j}] at {self.time[i]:.4g} s: gap {1e3 * gap:.4g} mm ± {100 * half[0]:.2g} %, stiffness "
                    f"{k:.4g} N/m ± {100 * half[1]:.2g} %, damping {c:.3g} N s/m ± {100 * half[2]:.2g} % "
                    f"(95 %, {1e3 * self.depth[j]:.3g} mm beyond the gap)"
                )
        return found

    def rows(self) -> list[dict[str, float]]:
        """Return a row of plain data for each window and clearance that is known: values with 95 % limits, SI units."""
        shown = {q: (self.value(q), *self.band(q)) for q in QUANTITIES}
        return [
            {"time_s": float(self.time[i]), "bushing": int(j)}
            | {
                f"{q}{end}_{TRACKED[q].unit}": float(values[i, j])
                for q, parts in shown.items()
                for end, values in zip(("", "_low", "_high"), parts)
            }
            | {"contact": float(self.contact[i, j]), "misfit": float(self.misfit[i, j])}
            for i, j in zip(*np.nonzero(np.isfinite(self.mean[0])))
        ]

    def to_xarray(self) -> xr.Dataset:
        """Return the histories as an xarray dataset: quantities by limit, time and bushing; SI units."""
        import xarray as xr

        data: dict[str, Any] = {
            q: (("limit", "time", "bushing"), np.stack((self.value(q), *self.band(q))), {"units": TRACKED[q].unit})
            for q in QUANTITIES
        }
        data |= {name: (("time", "bushing"), getattr(self, name), {"units": "1"}) for name in ("contact", "misfit")}
        coordinates: dict[str, Any] = {"limit": ["value", "low", "high"], "time": ("time", self.time, {"units": "s"})}
        coordinates |= {"bushing": np.arange(self.depth.size)}
        return xr.Dataset(data, coordinates, {"record": self.record, "rig": self.rig.name})
