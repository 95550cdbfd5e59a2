"""Side view of a rig."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ...rig import Beam, Bushing, PointMass, Rig
from ..style import COLOURS, FONT, Drawing, sheet, tidy

HALF_SHAFT, DRAWN_GAP, BLOCK, PLATE = 0.10, 0.13, 0.22, -1.15
"""Across the shaft nothing is to scale: half thickness, gap, height of a bushing's halves, the base plate's top"""


def rig_drawing(rig: Rig) -> Drawing:
    """Draw a side view of the rig, to scale along the shaft."""
    figure = sheet(2.8, left=0.15, right=0.15, titled=0.05)
    ax, length = figure.subplots(), rig.beam.length
    ax.add_patch(Rectangle((0, -HALF_SHAFT), length, 2 * HALF_SHAFT, facecolor="#cccccc", edgecolor="#444444", lw=0.8))
    ax.add_patch(
        Rectangle((-0.05 * length, -0.45), 0.05 * length, 0.9, facecolor="#eeeeee", edgecolor="#444444", hatch="////")
    )
    for i, bushing in enumerate(rig.bushings):
        _draw_bushing(ax, i, bushing, length)
    _draw_sensors(ax, rig)
    for mass in rig.masses:
        _draw_mass(ax, mass)
    _draw_shaker(ax, rig)
    tidy(ax, xlabel="Distance from the clamp (m)")
    ax.grid(False)
    ax.set_yticks([])
    for side in ("left", "right", "top"):
        ax.spines[side].set_visible(False)
    ax.set_xlim(-0.12 * length, 1.13 * length)
    ax.set_ylim(PLATE - 0.62, 1.02)
    caption = (
        f"Rig “{rig.name}” out of its own data: to scale along the shaft, not across it; the gaps (radial) are drawn "
        f"wide. Numbered squares: accelerometers. Yellow: grease. {_shaft(rig.beam)}"
    )
    alt = f"Side view of rig {rig.name}: clamped shaft, {len(rig.bushings)} bushings, {len(rig.sensors)} sensors."
    return Drawing("rig", figure, caption, alt)


def _shaft(beam: Beam) -> str:
    across = ((beam.diameter, "diameter"), (beam.width, "width"), (beam.height, "height"))
    section = ", ".join(f"{name} {1e3 * size:.4g} mm" for size, name in across if size)
    stuff = f"E\N{NO-BREAK SPACE}= {beam.young_modulus / 1e9:.4g} GPa, ρ\N{NO-BREAK SPACE}= {beam.density:.4g} kg/m³"
    return f"Shaft: length {beam.length:.4g} m, {section}, {stuff}."


def _draw_bushing(ax: Axes, i: int, bushing: Bushing, length: float) -> None:
    left, inner = bushing.ends[0], HALF_SHAFT + DRAWN_GAP
    for bottom in (HALF_SHAFT, -inner):
        ax.add_patch(Rectangle((left, bottom), bushing.length, DRAWN_GAP, facecolor="#ffee88", edgecolor="none"))
    for bottom in (inner, -inner - BLOCK):
        ax.add_patch(Rectangle((left, bottom), bushing.length, BLOCK, facecolor="#777777", edgecolor="#333333", lw=0.6))
    ax.plot([bushing.position] * 2, [-inner - BLOCK, PLATE], color="#777777", linewidth=2.5, zorder=0)
    words = f"bushing {i + 1}\ngap {1e3 * bushing.gap:.3g} mm\nlength {1e3 * bushing.length:.3g} mm"
    corner: dict[str, Any] = {"ha": "right", "va": "top", "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 1}}
    ax.text(bushing.position - 0.01 * length, -inner - BLOCK - 0.06, words, fontsize=FONT - 1, **corner)


def _draw_sensors(ax: Axes, rig: Rig) -> None:
    """Numbered squares above the shaft, a row higher where they would cover their neighbour."""
    box = {"boxstyle": "square,pad=0.25", "facecolor": "white", "edgecolor": COLOURS[0], "linewidth": 0.9}
    row, previous = 0, -np.inf
    for sensor in sorted(rig.sensors, key=lambda s: s.position):
        close = sensor.position - previous < 0.035 * rig.beam.length
        row, previous = (row + 1) % 2 if close else 0, sensor.position
        height = HALF_SHAFT + DRAWN_GAP + BLOCK + 0.15 + 0.22 * row
        ax.plot([sensor.position] * 2, [HALF_SHAFT, height], color=COLOURS[0], linewidth=0.8, zorder=1)
        ax.text(sensor.position, height, f"{sensor.node}", ha="center", va="bottom", fontsize=FONT - 0.5, bbox=box)


def _draw_mass(ax: Axes, mass: PointMass) -> None:
    ax.plot([mass.position], [0], "o", markersize=15, markerfacecolor="#999999", markeredgecolor="#333333")
    words = f"{mass.name or 'mass'}\n{mass.mass:.3g} kg"
    ax.text(mass.position, -0.33, words, ha="center", va="top", fontsize=FONT - 1)


def _draw_shaker(ax: Axes, rig: Rig) -> None:
    length, arrow = rig.beam.length, {"arrowstyle": "<->", "color": COLOURS[1], "linewidth": 1.4}
    plate = (-0.05 * length, PLATE - 0.14), 1.1 * length, 0.14
    ax.add_patch(Rectangle(*plate, facecolor="#bbbbbb", edgecolor="#333333", lw=0.6))
    ax.plot([-0.025 * length] * 2, [-0.45, PLATE], color="#777777", linewidth=2.5, zorder=0)
    if rig.shaker.kind == "force":
        x, words = rig.shaker.position or 0.0, "shaker force"
        ax.annotate("", (x, -HALF_SHAFT), (x, PLATE), arrowprops=arrow, zorder=2)
    else:
        x, words = 0.5 * length, "base acceleration: plate, clamp and bushings move together"
        ax.annotate("", (x, PLATE - 0.15), (x, PLATE - 0.55), arrowprops=arrow)
    ax.text(x + 0.02 * length, PLATE - 0.36, words, va="center", fontsize=FONT - 1, color=COLOURS[1])
