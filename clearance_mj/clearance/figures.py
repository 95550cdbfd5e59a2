"""Figures of laws, for `Law.plot` and the reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..core.drawing import COLOURS, FONT, REPEAT, TEST, canvas, key, of_curves, tidy
from ..rig import Rig
from .along import cycle_force
from .record import WithTable
from .table import LawTable

__all__ = ["QUANTITIES", "AmplitudeCurve", "draw_curves", "draw_walls", "law_figure", "over_time_figure"]

MM = 1e3
QUANTITIES = ("Stiffness k (N/m)", "Damping c (N s/m)")
POINTS = 75  # amplitudes of a law's curve


class LawToDraw(WithTable, Protocol):
    """A law."""

    def over_amplitude(
        self, gaps: Sequence[float], amplitude: np.ndarray, omega: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return tables as `Law.over_amplitude` does."""


@dataclass(frozen=True, eq=False)
class AmplitudeCurve:
    """Contact stiffness and damping of a law over amplitude."""

    label: str  #: name in the legend
    amplitude: np.ndarray  #: (n,) m
    k: np.ndarray  #: (n, n_bushings) N/m
    c: np.ndarray  #: (n, n_bushings) N s/m


def draw_curves(axes: Sequence[Axes], bushing: int, curves: Sequence[AmplitudeCurve], gap: float) -> None:
    """Draw stiffness and damping at a bushing over amplitude, a colour for each curve, and its gap, m."""
    for ax, name, label in zip(axes, "kc", QUANTITIES):
        for curve, colour in zip(curves, COLOURS):
            ax.plot(MM * curve.amplitude, getattr(curve, name)[:, bushing], color=colour, linewidth=1.6, zorder=3,
                    label=curve.label)  # fmt: skip
        ax.axvline(MM * gap, color=TEST, linewidth=0.9, linestyle="--", label="gap")
        tidy(ax, f"bushing {bushing + 1}", label)


def draw_walls(ax: Axes, walls: tuple[float, float]) -> None:
    """Draw the positions, m, of the existing walls."""
    for wall in filter(np.isfinite, walls):
        ax.axvline(MM * wall, color=REPEAT, linewidth=0.9, linestyle=":", label="walls")


def law_figure(law: LawToDraw, rig: Rig, cycles: dict[str, np.ndarray], frequency: float) -> Figure:
    """Draw cycles of force over displacement, and contact stiffness and damping over amplitude.

    The cycles' amplitudes are (n_bushings,), m, by their names in the legend, at a frequency, Hz.
    """
    n = len(rig.bushings)
    figure = canvas(0.35 + 1.9 * n)
    grid = figure.subplots(n, 3, squeeze=False, width_ratios=(1.4, 1, 1))
    styles = {f"cycle of {name}": {"color": colour} for name, colour in zip(cycles, COLOURS[1:] * len(cycles))}
    force_cycles = [cycle_force(rig, law, amplitude, frequency) for amplitude in cycles.values()]
    amplitudes = np.linspace(0, max(amplitude.max() for amplitude in cycles.values()), POINTS + 1)[1:]
    omega = np.full(n, 2 * np.pi * frequency)
    curve = AmplitudeCurve("", amplitudes, *law.over_amplitude([b.gap for b in rig.bushings], amplitudes, omega))
    for j, (panels, bushing) in enumerate(zip(grid, rig.bushings)):
        for (x, force), style in zip(force_cycles[::-1], list(styles.values())[::-1]):
            panels[0].plot(MM * x[j], force[j], linewidth=1.2, **style)
        draw_walls(panels[0], bushing.walls)
        tidy(panels[0], f"bushing {j + 1}: contact and grease, {frequency:.3g} Hz", "Force (N)")
        draw_curves(panels[1:], j, [curve], bushing.gap)
        for ax, values in zip(panels[1:], (curve.k, curve.c)):
            ax.set_ylim(0, 1.15 * np.nanmax(values[:, j], initial=1e-3))
    for ax, label in zip(grid[-1], ("Displacement (mm)", "Amplitude (mm)", "Amplitude (mm)")):
        ax.set_xlabel(label, fontsize=FONT)
    lines = {"contact": {"color": COLOURS[0]}, "walls": {"color": REPEAT, "linestyle": ":"},
             "gap": {"color": TEST, "linestyle": "--"}}  # fmt: skip
    key(figure, of_curves(styles | lines), 6)
    return figure


def over_time_figure(table: LawTable) -> Figure:
    """Draw contact stiffness and damping of every bushing over time."""
    n = table.parameters.shape[1]
    figure = canvas(0.1 + 1.9 * n)
    for j, panels in enumerate(figure.subplots(n, 2, squeeze=False, sharex=True)):
        for i, (ax, label) in enumerate(zip(panels, QUANTITIES)):
            ax.plot(table.abscissa, table.parameters[:, j, i], color=COLOURS[0], linewidth=1.1)
            tidy(ax, f"bushing {j + 1}", label, "Time (s)" if j == n - 1 else "")
            ax.set_ylim(bottom=0)
    return figure
