"""Figure 1: the cantilever with double clearance, drawn from its rig file."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column
from clearance_mj.rig import Bushing, Rig

from .result import BLUE, FONT, ORANGE, VERMILION, Item, Result, sheet, to_table

EXAGGERATION = 10  # How much wider the gaps are drawn in the details
GREASE, STEEL, DARK = "#ffee88", "#cccccc", "#555555"
PLATE = -0.115  # m, top of the base plate in the side view
ARROW = {"arrowstyle": "<->", "linewidth": 0.7, "shrinkA": 0, "shrinkB": 0}


def run(item: Item, rig: Rig) -> Result:
    """Draw the model."""
    caption = (
        f"Rig “{rig.name}”. (a) side view, to scale except for the symbols of springs, dampers, boss and base plate. "
        f"(b), (c) sections through the bushings, with gaps drawn {EXAGGERATION} times too wide."
    )
    rows = dimensions(rig)
    columns = (Column("Quantity"), Column("Value", "", ".6g"), Column("Unit"))
    return Result(
        method="Drawn from the dataset's rig.toml, which the engines simulate.", shows=_shows(rig),
        drawings=(Drawing(item.name, _draw(rig), caption, "Cantilever with two bushings, with dimensions."),),
        data={item.name: rows}, tables=(to_table("dimensions", "Dimensions of the rig", columns, rows),),
    )  # fmt: skip


def dimensions(rig: Rig) -> pd.DataFrame:
    """Return what a rig is made of: quantity, value, unit."""
    beam = rig.beam
    sides = {name: getattr(beam, name) for name in ("diameter", "width", "height")}
    rows = [("length l", beam.length, "m"), *((name, size, "m") for name, size in sides.items() if size)]
    rows += [("Young's modulus E", beam.young_modulus, "Pa"), ("density ρ", beam.density, "kg/m³")]
    for i, b in enumerate(rig.bushings, 1):
        rows += [
            (f"position of clearance l{i}", b.position, "m"),
            (f"radial clearance d{i}", b.gap, "m"),
            (f"length of bushing {i}", b.length, "m"),
            (f"grease stiffness at clearance {i}", b.grease.stiffness, "N/m"),
            (f"grease damping at clearance {i}", b.grease.damping, "N s/m"),
            (f"contact stiffness kd{i}, datasheet", b.contact.stiffness, "N/m"),
            (f"contact damping cd{i}, datasheet", b.contact.damping, "N s/m"),
        ]
    rows += [(f"{mass.name or 'mass'} at {mass.position:g} m", mass.mass, "kg") for mass in rig.masses]
    return pd.DataFrame(rows, columns=["quantity", "value", "unit"])


def _shows(rig: Rig) -> str:
    positions = " and ".join(f"{b.position:g} m (d = {1e3 * b.gap:g} mm)" for b in rig.bushings)
    return f"A shaft of {rig.beam.length:g} m, clamped at its left end, through bushings at {positions}."


def _height(rig) -> float:
    return rig.beam.diameter or rig.beam.height


def _draw(rig) -> Figure:
    figure = sheet(4.3)
    grid = figure.add_gridspec(2, len(rig.bushings), height_ratios=(1.25, 1))
    _side_view(figure.add_subplot(grid[0, :]), rig)
    for i, bushing in enumerate(rig.bushings):
        _section(figure.add_subplot(grid[1, i]), i, bushing, _height(rig))
    return figure


def _bare(ax, title):
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.set_title(title, fontsize=FONT, loc="left", pad=3)


def _side_view(ax, rig):
    length, half = rig.beam.length, _height(rig) / 2
    ax.add_patch(Rectangle((-0.04, -0.05), 0.04, 0.1, facecolor="#eeeeee", edgecolor=DARK, hatch="////", lw=0.6))
    ax.add_patch(Rectangle((0, -half), length, 2 * half, facecolor=STEEL, edgecolor=DARK, lw=0.5))
    ax.add_patch(Rectangle((-0.04, PLATE - 0.012), length + 0.1, 0.012, facecolor=STEEL, edgecolor=DARK, lw=0.5))
    ax.plot([-0.02, -0.02], [-0.05, PLATE], color=DARK, lw=2)
    for i, b in enumerate(rig.bushings, 1):
        for bottom in (half + b.gap, -half - b.gap - 0.012):
            ax.add_patch(Rectangle((b.ends[0], bottom), b.length, 0.012, facecolor=DARK, edgecolor="none"))
        _spring_and_damper(ax, b.position, -half - 0.012, PLATE)
        words = f"$k_{{d{i}}}$, $c_{{d{i}}}$, grease"
        ax.text(b.position - 0.025, (PLATE - half) / 2, words, ha="right", va="center", fontsize=FONT - 1)
    for mass in rig.masses:
        ax.plot([mass.position], [0], "o", ms=10, mfc="#999999", mec=DARK, mew=0.7)
        place = (mass.position + 0.008, -0.03)
        ax.text(*place, f"{mass.name or 'mass'}\n{mass.mass:g} kg", ha="center", va="top", fontsize=FONT - 1)
    spans = [(b.position, f"$l_{i}$ = {b.position:g} m") for i, b in enumerate(rig.bushings, 1)]
    for row, (x, words) in enumerate([*spans, (length, f"$l$ = {length:g} m")]):
        _dimension(ax, (0, x), 0.035 + 0.032 * row, half, words)
    ax.text(-0.02, 0.055, "O", ha="center", va="bottom", fontsize=FONT)
    _shaker(ax, rig, half)
    _bare(ax, "(a) side view, to scale")
    ax.set(xlim=(-0.06, length + 0.08), ylim=(PLATE - 0.06, 0.125))


def _dimension(ax, ends, height, foot, words):
    for x in ends:
        ax.plot([x, x], [foot, height + 0.006], color=BLUE, lw=0.4)
    ax.annotate("", (ends[0], height), (ends[1], height), arrowprops=ARROW | {"color": BLUE})
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
    ax.text(sum(ends) / 2, height, words, ha="center", va="center", fontsize=FONT - 1, color=BLUE, bbox=box)


def _spring_and_damper(ax, x, top, bottom):
    """A spring on the left and a dashpot on the right of x, between two heights."""
    y = np.linspace(top - 0.25 * (top - bottom), bottom + 0.2 * (top - bottom), 9)
    zigzag = x - 0.011 + 0.006 * np.array([0, 1, -1, 1, -1, 1, -1, 1, 0])
    ax.plot([x - 0.011, *zigzag, x - 0.011], [top, *y, bottom], color=DARK, lw=0.8)
    middle, right = (top + bottom) / 2, x + 0.011
    ax.plot([right, right], [top, middle], color=DARK, lw=0.8)
    ax.plot([right - 0.005, right + 0.005], [middle, middle], color=DARK, lw=1.4)
    cup = [right - 0.008, right - 0.008, right + 0.008, right + 0.008]
    ax.plot(cup, [middle + 0.012, middle - 0.012, middle - 0.012, middle + 0.012], color=DARK, lw=0.8)
    ax.plot([right, right], [middle - 0.012, bottom], color=DARK, lw=0.8)


def _shaker(ax, rig, half):
    style = {"arrowstyle": "<->", "color": VERMILION, "linewidth": 1.2}
    if rig.shaker.kind == "force":
        x, ends, words = rig.shaker.position, (-half, -half - 0.05), f"f(t) at $l_f$ = {rig.shaker.position:g} m"
    else:
        x, ends, words = 0.3 * rig.beam.length, (PLATE - 0.014, PLATE - 0.055), "base acceleration a(t)"
    ax.annotate("", (x, ends[0]), (x, ends[1]), arrowprops=style)
    ax.text(x + 0.012, sum(ends) / 2, words, va="center", fontsize=FONT - 1, color=VERMILION)


def _section(ax, i, bushing: Bushing, height: float):
    """One bushing in mm."""
    half, length, gap = 500 * height, 1e3 * bushing.length, 1e3 * bushing.gap * EXAGGERATION
    wall, end = 4.0, 0.5 * length
    ax.add_patch(Rectangle((-1.6 * end, -half), 3.2 * end, 2 * half, facecolor=STEEL, edgecolor=DARK, lw=0.6))
    for low, bush in ((half, half + gap), (-half - gap, -half - gap - wall)):
        ax.add_patch(Rectangle((-end, low), length, gap, facecolor=GREASE, edgecolor="none"))
        ax.add_patch(Rectangle((-end, bush), length, wall, facecolor="#888888", edgecolor=DARK, hatch="///", lw=0.6))
    ax.plot([-1.75 * end, 1.75 * end], [0, 0], color=DARK, lw=0.6, ls=(0, (8, 2, 2, 2)))
    ax.annotate("", (1.2 * end, half), (1.2 * end, half + gap), arrowprops=ARROW | {"color": VERMILION})
    ax.plot([end, 1.3 * end], [half + gap] * 2, color=VERMILION, lw=0.5)
    words = f"$d_{i + 1}$ = {1e3 * bushing.gap:g} mm\n(drawn {EXAGGERATION} ×)"
    ax.text(1.4 * end, half + gap, words, va="center", fontsize=FONT - 1, color=VERMILION)
    ax.annotate("", (-1.4 * end, -half), (-1.4 * end, half), arrowprops=ARROW | {"color": BLUE})
    ax.text(-1.9 * end, 0, f"{1e3 * height:.4g} mm", ha="right", va="center", fontsize=FONT - 1, color=BLUE)
    top = half + gap + wall + 1.2
    ax.annotate("", (-end, top), (end, top), arrowprops=ARROW | {"color": BLUE})
    ax.text(0, top + 0.4, f"{length:g} mm", ha="center", va="bottom", fontsize=FONT - 1, color=BLUE)
    grease, contact = bushing.grease, bushing.contact
    below = (
        f"grease: {grease.stiffness:g} N/m, {grease.damping:g} N s/m\n"
        f"contact: {contact.stiffness:g} N/m, {contact.damping:g} N s/m (datasheet)"
    )
    ax.text(0, -half - gap - wall - 0.8, below, ha="center", va="top", fontsize=FONT - 1)
    line, place = {"arrowstyle": "-", "color": ORANGE, "lw": 0.7}, -half - 0.5 * gap
    ax.annotate("grease", (0.2 * end, place), (1.35 * end, place), va="center", fontsize=FONT - 1, arrowprops=line)
    _bare(ax, f"({'bc'[i] if i < 2 else i + 1}) clearance {i + 1}")
    ax.set(xlim=(-3.8 * end, 3.8 * end), ylim=(-half - gap - wall - 6.5, top + 3.5))
