"""A production within hours of random excitation: figure, rows and words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..periodic.axes import level_axis
from ..tolerance import LevelPeaks, Noise
from ..tolerance.limits import KINDS, UNITS
from .style import COLOURS, FONT, Drawing, canvas, tidy

__all__ = ["RandomProduction"]


@dataclass(frozen=True, eq=False)
class RandomProduction:
    """A production at several levels of random excitation."""

    levels: tuple[LevelPeaks, ...]
    """in rising order"""
    noise: Noise
    """the excitation, and what was asked"""
    clearances: tuple[str, ...]
    """names of those that touch"""
    places: tuple[str, ...]
    """names of the clearances or sensors that the quantity is of"""

    @property
    def _unit(self) -> str:
        return UNITS[KINDS[self.noise.quantity]]

    def rows(self) -> list[dict[str, Any]]:
        """Return a row of plain data for each level and place; three numbers are a value with its 5 and 95 % ends."""
        rows: list[dict[str, Any]] = []
        for each in self.levels:
            for i, name in enumerate(self.clearances):
                rows.append({
                    "level": each.level, "place": name, "touches": each.touches[i].tolist(),
                    "impacts_per_second": each.impacts_per_second[i].tolist(),
                })  # fmt: skip
            for i, name in enumerate(self.places):
                rows.append({
                    "level": each.level, "place": name, f"largest_{self.noise.quantity}": each.largest[i].tolist(),
                    "too_few_peaks": float(each.too_few[i]),
                } | ({"exceeds": each.exceeds[i].tolist()} if self.noise.limit else {}))  # fmt: skip
        return rows

    def words(self) -> list[str]:
        """Return lines on the results at each level."""
        said = []
        unit = level_axis(self.noise.psd.kind).unit
        for each in self.levels:
            most = int(each.touches[:, 0].argmax())
            percent, low, high = 100 * each.touches[most]
            few, middle, many = each.impacts_per_second[most]
            words = (
                f"at {each.level:.4g} {unit} RMS, in {self.noise.hours:g} h: {self.clearances[most]} touches in "
                f"{percent:.3g} % of the designs ({low:.3g} to {high:.3g} %), {middle:.3g} times a second "
                f"({few:.2g} to {many:.2g})"
            )
            largest = int(each.largest[:, 1].argmax())
            few, middle, many = each.largest[largest]
            quantity = f"largest {self.noise.quantity.replace('_', ' ')}"
            known = f"{quantity} at {self.places[largest]}: {middle:.4g} {self._unit} ({few:.3g} to {many:.3g})"
            words += f"; {known}" if middle else f"; too few peaks for the {quantity} of most designs"
            if self.noise.limit:
                percent, low, high = 100 * each.exceeds[largest]
                words += f", over {self.noise.limit:g} {self._unit} in {percent:.3g} % ({low:.3g} to {high:.3g} %)"
            said.append(words)
        return said

    def draw(self) -> Drawing:
        """Draw shares of designs, impacts per second and the largest value over the level."""
        figure = canvas(2.5)
        axes = figure.subplots(1, 3)
        level = [each.level for each in self.levels]
        panels = (
            ("touches", self.clearances, 100.0, "touch (%)"),
            ("impacts_per_second", self.clearances, 1.0, "impacts per second (1/s)"),
            ("largest", self.places, 1.0, f"largest {self.noise.quantity.replace('_', ' ')} ({self._unit})"),
        )
        for ax, (name, places, scale, title) in zip(axes, panels):
            for i, (place, colour) in enumerate(zip(places, COLOURS)):
                three = scale * np.array([getattr(each, name)[i] for each in self.levels]).T
                low, middle, high = three if name != "touches" else three[[1, 0, 2]]
                ax.plot(level, middle, "o-", color=colour, lw=1.2, ms=3, label=place)
                ax.vlines(level, low, high, color=colour, lw=0.9)
            tidy(ax, title, "", f"RMS ({level_axis(self.noise.psd.kind).unit})")
        axes[0].set_ylim(-2, 102)
        axes[0].legend(fontsize=FONT - 1, frameon=False)
        caption = (
            f"Random excitation for {self.noise.hours:g} h: share of the designs that touch, with its 5 to 95 % "
            "interval; impacts per second and the largest value: median of the designs, lines from 5 to 95 % of them."
        )
        return Drawing("production_random", figure, caption, "Shares, impact rates and largest values over level.")
