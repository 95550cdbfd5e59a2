"""Figure and files of an energy balance: energy flows, residual, and the impacts' speeds and restitution."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..core.files import replacing
from ..engines.energy import EnergyBalance
from .style import COLOURS, FONT, MARKERS, TEST, Drawing, canvas, tidy
from .tables import write_csv

__all__ = ["draw", "write"]

LOSSES = {"damping": "#0072b2", "hysteresis": "#e69f00", "film": "#56b4e9", "contact_loss": "#d55e00"}
LOSSES |= {"friction": "#cc79a7"}
WORDS = {"damping": "shaft's damping", "hysteresis": "grease's hysteresis", "film": "grease's damping"}
WORDS |= {"contact_loss": "contact", "friction": "friction", "stored": "stored"}
STORED = "#d9d9d9"
MAX_RESTITUTION = 2.0  # that is drawn
POINTS = 1500  # that a curve is drawn with at most


def write(folder: str | Path, balance: EnergyBalance) -> None:
    """Write energy.csv (J at every sample), impacts.csv (one row for each, SI units) and energy_balance.png."""
    folder, columns = Path(folder), balance.columns()
    with replacing(folder / "energy.csv") as temporary:
        values = np.column_stack(list(columns.values()))
        np.savetxt(temporary, values, "%.9g", ",", header=",".join(columns), comments="", encoding="utf-8")
    write_csv(folder / "impacts.csv", (asdict(i) | {"restitution": i.restitution} for i in balance.impacts))
    draw(balance).write(folder)


def draw(balance: EnergyBalance) -> Drawing:
    """Draw an energy balance."""
    figure = canvas(5.4)
    (energy, residual), (restitution, impulse) = figure.subplots(2, 2)
    _draw_energy(energy, balance)
    _draw_residual(residual, balance)
    _draw_restitution(restitution, balance)
    _draw_impulse(impulse, balance)
    most = max(np.max(balance.put_in), np.finfo(float).tiny)
    lost = {name: part for name in LOSSES if (part := getattr(balance, name)) is not None}
    percentages = ", ".join(f"{WORDS[name]} {100 * np.sum(part[..., -1]) / most:.0f} %" for name, part in lost.items())
    caption = (
        f"Energy of {balance.time[-1]:.3g} s: {most:.3g} J put in; shares lost: {percentages}. The residual, "
        f"neither lost nor stored, is at most {100 * balance.imbalance:.2g} %. {len(balance.impacts)} impacts of "
        "bushing ends; other forces act on the shaft while it touches, so that it may leave faster than it came (ratios"
        f" beyond {MAX_RESTITUTION:g} are drawn there)."
    )
    alt = "Energy over time by where it goes, residual, restitution and impulses."
    return Drawing("energy_balance", figure, caption, alt)


def _draw_energy(ax: Axes, balance: EnergyBalance) -> None:
    thin = slice(None, None, -(-balance.time.size // POINTS))
    every = {name: getattr(balance, name) for name in (*LOSSES, "stored")}
    parts = {name: value for name, value in every.items() if name == "stored" or (value is not None and np.any(value))}
    parts = {name: 1e3 * value.reshape(-1, balance.time.size).sum(axis=0)[thin] for name, value in parts.items()}
    colours = [LOSSES.get(name, STORED) for name in parts]
    time = balance.time[thin]
    ax.stackplot(time, *parts.values(), colors=colours, labels=[WORDS[name] for name in parts])
    ax.plot(time, 1e3 * balance.put_in[thin], color=TEST, lw=0.9, label="put in")
    tidy(ax, "(a) where the energy went", "Energy (mJ)", "Time (s)")
    ax.set_xlim(0, time[-1])
    handles, labels = ax.get_legend_handles_labels()
    ax.legend(handles[::-1], labels[::-1], fontsize=FONT - 1, frameon=False, loc="upper left")


def _draw_residual(ax: Axes, balance: EnergyBalance) -> None:
    most = max(np.max(balance.put_in), np.finfo(float).tiny)
    ax.plot(balance.time, 100 * balance.residual / most, color=TEST, lw=0.7)
    tidy(ax, "(b) residual: neither lost nor stored", "Share of the energy put in (%)", "Time (s)")
    ax.set_xlim(0, balance.time[-1])


def _values_by_bushing(balance: EnergyBalance, name: str) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the values of the impacts' attribute for each bushing that has any."""
    for j in range(len(balance.contact)):
        values = np.array([getattr(i, name) for i in balance.impacts if i.bushing == j])
        if values.size:
            yield j, values


def _draw_restitution(ax: Axes, balance: EnergyBalance) -> None:
    for (j, v_in), (_, ratio) in zip(_values_by_bushing(balance, "v_in"), _values_by_bushing(balance, "restitution")):
        look: dict[str, Any] = {"marker": MARKERS[j % len(MARKERS)], "color": COLOURS[j % len(COLOURS)], "mec": "none"}
        shown = np.minimum(ratio, MAX_RESTITUTION)
        ax.plot(1e3 * v_in, shown, ls="", ms=3, alpha=0.5, label=f"bushing {j + 1}", **look)
    ax.axhline(1, color=TEST, lw=0.6)
    ax.set_ylim(0, 1.02 * MAX_RESTITUTION)
    if balance.impacts:
        ax.set_xscale("log")
    tidy(ax, "(c) restitution", "Speed off over speed into the wall (1)", "Speed into the wall (mm/s)")
    _draw_legend(ax, "lower left")


def _draw_impulse(ax: Axes, balance: EnergyBalance) -> None:
    if impulses := dict(_values_by_bushing(balance, "impulse")):
        every = 1e3 * np.concatenate(list(impulses.values()))
        edges = np.geomspace(0.999 * every.min(), 1.001 * every.max(), 31).tolist()
        for j, values in impulses.items():
            look: dict[str, Any] = {"color": COLOURS[j % len(COLOURS)], "ls": ("-", "--")[j % 2]}
            ax.hist(1e3 * values, edges, histtype="step", lw=1.2, label=f"bushing {j + 1}", **look)
        ax.set_xscale("log")
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    tidy(ax, "(d) impulses", "Impacts in a class (number)", "Impulse of an impact (mN s)")
    _draw_legend(ax, "upper left")


def _draw_legend(ax: Axes, corner: Literal["lower left", "upper left"]) -> None:
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize=FONT - 1, frameon=False, loc=corner)
    else:
        ax.text(0.5, 0.5, "no impacts", transform=ax.transAxes, ha="center", fontsize=FONT)
