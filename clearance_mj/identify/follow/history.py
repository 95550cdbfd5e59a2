"""Result of a twin: histories of gaps, contacts and oil with their bands, and alarms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...rig import Rig
from .alarms import QUANTITIES, RUB, TRACKED, Alarm, shown_as

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Twin"]

NORMAL95 = 1.959963984540054  # standard deviations, half of a 95 % interval
MISFIT = "Force missed (relative)"


@dataclass(frozen=True, eq=False)
class Twin:
    """Estimates of a record's clearances over time, each value from the measurements by then.

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
    """(n_bushings,) penetration, m, RMS of the part that the law was fitted to; nan if it never touched, and where no
    contact is tracked"""
    mean: np.ndarray
    """(n_quantities, n, n_bushings) logarithms of `quantities`; nan while or where they are not known"""
    std: np.ndarray
    """(n_quantities, n, n_bushings) their standard deviations"""
    contact: np.ndarray
    """(n, n_bushings) fraction of time in contact according to the law"""
    misfit: np.ndarray
    """(n, n_bushings) RMS of the force that the law misses, over its misfit when it was fitted; of a machine in
    operation over its expected error"""
    alarms: tuple[Alarm, ...]
    """in the order of time"""
    warnings: tuple[str, ...] = ()
    """plain words on what not to rely on"""
    quantities: tuple[str, ...] = QUANTITIES
    """tracked quantities: of a bench "gap", "stiffness", "damping", of a machine in operation "gap" and "viscosity" """

    def value(self, quantity: str) -> np.ndarray:
        """Return the most likely values (n, n_bushings) of a quantity: m, N/m, N s/m or Pa s.

        Parameters
        ----------
        quantity : str
            One of `quantities`.
        """
        return np.exp(self.mean[self.quantities.index(quantity)])

    def band(self, quantity: str) -> np.ndarray:
        """Return the limits (2, n, n_bushings) within which a quantity lies with a probability of 95 %.

        Parameters
        ----------
        quantity : str
            Name of the quantity, as in `value`.
        """
        number = self.quantities.index(quantity)
        half = NORMAL95 * self.std[number]
        return np.exp(self.mean[number] + np.array([-half, half]))

    def words(self) -> list[str]:
        """Return a line of words for each clearance on its estimates at the end."""
        sentences = []
        for j, depth in enumerate(self.depth.tolist()):
            windows = np.flatnonzero(np.isfinite(self.mean[:, :, j]).any(axis=0))
            if windows.size:
                i, at = windows[-1], f", {1e3 * depth:.3g} mm beyond the gap" if math.isfinite(depth) else ""
                values = [
                    _words(q, mean, std)
                    for q, mean, std in zip(self.quantities, self.mean[:, i, j], self.std[:, i, j])
                    if math.isfinite(mean)
                ]
                sentences.append(f"bushings[{j}] at {self.time[i]:.4g} s: {', '.join(values)} (95 %{at})")
        return sentences

    def rows(self) -> list[dict[str, float]]:
        """Return a row of plain data for each window and clearance that is known: values with 95 % limits, SI units."""
        limits = {q: (self.value(q), *self.band(q)) for q in self.quantities}
        return [
            {"time_s": float(self.time[i]), "bushing": int(j)}
            | {
                f"{q}{end}_{TRACKED[q].unit}": float(values[i, j])
                for q, parts in limits.items()
                for end, values in zip(("", "_low", "_high"), parts)
                if math.isfinite(values[i, j])
            }
            | {"contact": float(self.contact[i, j]), "misfit": float(self.misfit[i, j])}
            for i, j in zip(*np.nonzero(np.isfinite(self.misfit)))
        ]

    def to_xarray(self) -> xr.Dataset:
        """Return the histories as an xarray dataset: quantities by limit, time and bushing; SI units."""
        import xarray as xr

        data: dict[str, Any] = {
            q: (("limit", "time", "bushing"), np.stack((self.value(q), *self.band(q))), {"units": TRACKED[q].unit})
            for q in self.quantities
        }
        data |= {name: (("time", "bushing"), getattr(self, name), {"units": "1"}) for name in ("contact", "misfit")}
        coordinates: dict[str, Any] = {"limit": ["value", "low", "high"], "time": ("time", self.time, {"units": "s"})}
        coordinates |= {"bushing": np.arange(self.depth.size)}
        return xr.Dataset(data, coordinates, {"record": self.record, "rig": self.rig.name})

    def plot(self) -> Figure:
        """Draw quantities over time with their 95 % bands above the laws' misfit, a column for each clearance.

        Vertical lines are alarms, dotted ones those of another quantity.
        """
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        from ...core.drawing import ALARM, COLOURS, FONT, canvas, tidy

        rows = (*self.quantities, MISFIT)
        figure = canvas(0.8 + 1.8 * len(rows))
        axes = figure.subplots(len(rows), self.depth.size, sharex=True, sharey="row", squeeze=False)
        for row, quantity in zip(axes, rows):
            for j, ax in enumerate(row):
                label = self._panel(ax, quantity, j)
                ends = f"bushing {j + 1}" if quantity == rows[0] else "", "Time (s)" if quantity == rows[-1] else ""
                tidy(ax, ends[0], "" if j else label, ends[1])
        handles: list[Any] = [
            Line2D([], [], color=COLOURS[0], lw=1.2, label="most likely"),
            Patch(facecolor=COLOURS[0], alpha=0.25, lw=0, label="95 % band"),
        ]
        if self.alarms:
            handles.append(Line2D([], [], color=ALARM, lw=1.0, label="alarm"))
            handles.append(Line2D([], [], color=ALARM, lw=1.0, ls=":", label="alarm of another quantity"))
        figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=FONT - 0.5, frameon=False)
        return figure

    def _panel(self, ax: Axes, quantity: str, bushing: int) -> str:
        """Draw a quantity of a clearance; return the label of its axis."""
        from ...core.drawing import ALARM, COLOURS

        label, factor = MISFIT, 1.0
        if quantity == MISFIT:
            value = self.misfit
        else:
            factor, unit = shown_as(quantity)
            label = f"{quantity.capitalize()} ({unit})"
            value, (low, high) = (factor * part for part in (self.value(quantity), self.band(quantity)))
            ax.fill_between(self.time, low[:, bushing], high[:, bushing], color=COLOURS[0], alpha=0.25, lw=0)
        ax.plot(self.time, value[:, bushing], color=COLOURS[0], lw=1.2)
        known = value[np.isfinite(value)]
        if known.size:  # bands of a clearance that hardly touches would hide all others
            ax.set_ylim(0.8 * known.min(), 1.2 * known.max())
        for alarm in self.alarms:
            of_quantity = (MISFIT if alarm.quantity == RUB else alarm.quantity) == quantity
            if alarm.bushing == bushing:
                ax.axvline(alarm.time, color=ALARM, lw=1.0, ls="-" if of_quantity else ":")
        return label


def _words(quantity: str, mean: float, std: float) -> str:
    """Say a value and its 95 % interval; mean and standard deviation are those of its logarithm."""
    factor, unit = shown_as(quantity)
    return f"{quantity} {factor * math.exp(mean):.4g} {unit} ± {100 * NORMAL95 * std:.2g} %"
