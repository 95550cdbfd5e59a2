"""A branch of periodic vibrations over frequency, level, loads, spin or gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..model import Model
from ..signals.arrays import read_only
from .axes import level_axis, parameter_axis
from .vibrations import UNITS, Vibrations, half_extents

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Branch", "SpecialPoint"]

MARKERS = {"fold": "o", "period doubling": "s", "Neimark-Sacker": "^", "branch point": "D", "first contact": "x"}


@dataclass(frozen=True)
class SpecialPoint:
    """A point at which a branch folds or its stability changes."""

    kind: str
    """ "fold", "period doubling", "Neimark-Sacker", "branch point", where another branch crosses, or "first contact",
    where a vibration grazes a wall"""
    frequency: float
    """Hz"""
    level: float
    """of the excitation's first harmonic that is not zero, as `Branch.level`"""
    index: int
    """of the point on the branch"""


@dataclass(frozen=True, eq=False, repr=False)
class Branch(Vibrations):
    """Periodic vibrations of one excitation, in the order in which they follow each other along the curve.

    Harmonics are complex amplitudes, X_h in x(t) = Re Σ X_h exp(2πi h f t / periods), from the mean, h = 0, on.
    """

    model: Model
    """rig and law of its clearances"""
    kind: str
    """excitation: "base", "force" or "unbalance" of rotating parts; "whirl" if there is none"""
    over: str
    """continuation parameter: "frequency", "level", "load", "spin", "gap" or, of a whirl, "speed\""""
    periods: int
    """number of excitation periods in one period of the vibration"""
    n_modes: int
    """number of modes in the Ritz basis"""
    n_samples: int
    """number of samples of one vibration"""
    frequency: np.ndarray
    """(n,) of the excitation's first harmonic, Hz"""
    level: np.ndarray
    """(n, n_levels) complex amplitudes of the excitation's harmonics from the first on, m/s² or N; of an unbalance the
    factor of the rig's"""
    acceleration: np.ndarray
    """(n, n_sensors, H + 1) harmonics of what the sensors read, m/s²"""
    displacement: np.ndarray
    """(n, n_sensors, H + 1) of the sensors' points relative to the base, m"""
    clearance_displacement: np.ndarray
    """(n, n_bushings, H + 1) of the clearances' middles from rest, m"""
    end_displacement: np.ndarray
    """(n, 2 n_bushings, H + 1) of both ends of each clearance from rest, m"""
    contact_force: np.ndarray
    """(n, n_bushings, H + 1) of both ends, positive against positive displacement, N"""
    grease_force: np.ndarray
    """(n, n_bushings, H + 1) same sign, N"""
    multipliers: np.ndarray | None
    """(n, m) Floquet's, the largest first; None if stability was not asked for"""
    special: tuple[SpecialPoint, ...]
    """along the curve"""
    ended: str
    """why the branch ends before the last frequency: "" if it does not"""
    responses: tuple[str, ...]
    """degree of freedom of each sensor, such as "3:+Z" """
    clearances: tuple[str, ...]
    """name of each clearance, `Rig.clearance_labels`; where some are round of the coordinates, `Rig.probe_labels`"""
    spin: np.ndarray | None = None
    """(n,) of the shaft, rad/s, where some clearances are round, which have a row along y and one along z each"""
    share: np.ndarray | None = None
    """(n,) factor of the rig's constant loads or of all its gaps, of a branch over these"""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.multipliers is not None:  # real where all of them are
            self._set(multipliers=read_only(self.multipliers, complex))

    @property
    def parameter(self) -> np.ndarray:
        """(n,) frequency, Hz, level of the excitation's largest harmonic, speed, rad/s, or factor of loads or gaps."""
        if self.share is not None:
            return self.share
        if self.over in ("spin", "speed") and self.spin is not None:
            return self.spin
        return self.frequency if self.over == "frequency" else np.abs(self.level).max(axis=1)

    @property
    def stable(self) -> np.ndarray | None:
        """(n,) True where a small disturbance decays; None if stability was not asked for."""
        from .stability import ROUNDING

        return None if self.multipliers is None else np.abs(self.multipliers[:, 0]) <= 1 + ROUNDING

    def excursion(self) -> np.ndarray:
        """Return the amplitudes of the clearances' middles, (n, n_bushings) m, as of `clearance_displacement`.

        Of a rig with round ones half of the largest extent of the orbit in any direction: the radius of a circle, half
        the length of a line.
        """
        amplitudes, parts = self.amplitude("clearance_displacement"), []
        for rows in self.model.rig.clearance_rows:
            orbit = self.clearance_displacement[:, rows]
            parts.append(half_extents(orbit) if orbit.shape[1] == 2 else amplitudes[:, rows])
        return np.concatenate(parts, axis=1)

    def plot(self, quantity: str = "acceleration", rows: Sequence[int] | None = None) -> Figure:
        """Draw amplitudes over the parameter: stable vibrations as lines, unstable dashed, special points marked.

        Parameters
        ----------
        quantity : str
            Quantity, as in `amplitude`.
        rows : sequence of int, optional
            Which sensors or clearances; None: all.

        Raises
        ------
        ClearanceError
            For another quantity, or a row that is not there.
        """
        from ..core.drawing import canvas

        amplitude = self.amplitude(quantity)
        names = self._names(quantity, rows)
        figure = canvas(4.5, 8)
        axes = figure.subplots()
        stable = self.stable if self.stable is not None else np.ones(self.frequency.size, dtype=bool)
        x = self.parameter
        for i, (row, name) in enumerate(names.items()):
            colour = f"C{i % 10}"
            axes.plot(x, amplitude[:, row], "--", color=colour, lw=1)
            axes.plot(x, np.where(stable, amplitude[:, row], np.nan), color=colour, label=name)
        for kind, marker in MARKERS.items():
            at = [point.index for point in self.special if point.kind == kind]
            for i, row in enumerate(names):
                label = kind if at and not i else None
                axes.plot(x[at], amplitude[at, row], marker, color="k", mfc="w", ms=5, label=label)
        axes.set_xlabel(parameter_axis(self.over, self.kind)[0])
        axes.set(ylabel=f"amplitude of the {quantity.replace('_', ' ')} ({UNITS[quantity]})", yscale="log")
        axes.legend(frameon=False)
        return figure

    def to_xarray(self) -> xr.Dataset:
        """Return all quantities with labels and units: harmonics over (point, response or clearance, harmonic)."""
        special = np.full(self.frequency.size, "", dtype="U16")
        for point in self.special:
            special[point.index] = point.kind
        variables = {
            "frequency": ("point", self.frequency, "Hz"),
            "level": (("point", "excited"), self.level, level_axis(self.kind).symbol),
            **self._variables(),
            "spin": ("point", self.spin, "rad s-1"),
            "share": ("point", self.share, "1"),
            "multipliers": (("point", "multiplier"), self.multipliers, "1"),
            "stable": ("point", self.stable, "1"),
            "special": ("point", special, "1"),
        }
        attributes = {"kind": self.kind, "over": self.over, "periods": self.periods, "ended": self.ended}
        return self._dataset("branch", variables, np.arange(self.acceleration.shape[-1]) / self.periods, attributes)
