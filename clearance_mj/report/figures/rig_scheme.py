"""Scheme of a rig without shafts: the degrees of freedom that it uses and, where that is known, where they are."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ...rig import Bushing, Rig
from ...rig.sensing import sensor_points
from ...structure.base import dof_vector, parse_dof
from ..style import COLOURS, FONT, Drawing, sheet, tidy
from .rig_motion import instruments, words_of_motion
from .rig_symbols import BEHIND_WORDS, DARK, GREY, SENSOR, SHAKEN

PLATE, BOX = -1.4, 0.42  # heights of the base plate's top and of the structure
ABOVE, CROWDED = 2.7, 6  # height of the panel of places; places along the box beyond which words are few


def scheme(rig: Rig) -> Drawing:
    """Draw the structure as a box with its degrees of freedom, and what is fixed to these."""
    slots = _slots(rig)
    places = {dof: rig.linear.coordinates(_label(dof)) for dof in slots}
    known = np.ptp(list(places.values()), axis=0).any()
    figure = sheet(3.1 + ABOVE * known, left=0.62 if known else 0.15, right=0.15, titled=0.05)
    if known:
        upper, lower = figure.subplots(2, 1, height_ratios=(ABOVE - 0.6, 3.1))
        _draw_places(upper, places)
    else:
        lower = figure.subplots()
    _draw_scheme(lower, rig, slots)
    kind = getattr(rig.linear, "kind", "structure")
    caption = (
        f"Rig “{rig.name}”: its structure ({kind}) as a box with the degrees of freedom (node:direction) that are "
        "used, not to scale. Dark: clearances, to the base or to another degree of freedom; yellow: grease. Numbered "
        f"squares: {instruments(rig)}.{' Above: where these degrees of freedom are.' if known else ''}"
        f"{words_of_motion(rig)}"
    )
    alt = f"Scheme of rig {rig.name}: {len(rig.bushings)} clearances, {len(rig.sensors)} sensors."
    return Drawing("rig", figure, caption, alt)


def _key(point: float | str) -> tuple[int | str, str]:
    node, axis, _ = parse_dof(point) or (0, "", 1)
    return node, axis


def _label(dof: tuple[int | str, str]) -> str:
    return f"{dof[0]}:+{dof[1]}"


def _slots(rig: Rig) -> dict[tuple[int | str, str], float]:
    """Return the degrees of freedom in use and their places along the box, with room for each clearance."""
    points = [p for b in rig.bushings for p in b.joined] + [m.position for m in rig.masses]
    points += [p for p, _ in rig.shaker.forces] + sensor_points(rig)
    dofs = sorted(
        {_key(p) for p in points}, key=lambda dof: (*rig.linear.coordinates(_label(dof)), str(dof[0]).zfill(9), dof[1])
    )
    on = [_key(b.position) for b in rig.bushings]
    width = [max(1, on.count(dof)) for dof in dofs]
    return {dof: float(start + w / 2) for dof, start, w in zip(dofs, np.cumsum([0, *width[:-1]]), width)}


def _draw_scheme(ax: Axes, rig: Rig, slots: dict[tuple[int | str, str], float]) -> None:
    on = [_key(b.position) for b in rig.bushings]
    whole = sum(max(1, on.count(dof)) for dof in slots)
    ax.add_patch(Rectangle((0, 0), whole, BOX, facecolor="#dddddd", edgecolor="#444444", lw=0.8))
    for (node, axis), x in slots.items():
        ax.plot([x], [0], "o", color=DARK, ms=4, zorder=3)
        label_style = {"rotation": 90, "fontsize": FONT - 2} if whole > 14 else {"fontsize": FONT - 0.5}
        ax.text(x, BOX / 2, f"{node}:{axis}", ha="center", va="center", **label_style)
    for j, bushing in enumerate(rig.bushings):
        before = on[:j].count(on[j])
        x = slots[on[j]] + before - (on.count(on[j]) - 1) / 2
        to = None if bushing.to is None else slots[_key(bushing.to)]
        _draw_clearance(ax, j, bushing, (slots[on[j]], x), to, whole > CROWDED)
    _draw_sensors_and_masses(ax, rig, slots)
    _draw_shaker(ax, rig, slots, whole)
    ax.set_axis_off()
    ax.set(xlim=(-0.03 * whole, 1.03 * whole), ylim=(PLATE - 0.62, 1.42 if rig.shaker.kind == "force" else 1.0))


def _draw_clearance(ax: Axes, j: int, bushing: Bushing, at: tuple[float, float], to: float | None, few: bool) -> None:
    """Draw a head on a stem between two halves of a holder, on the base or fixed to another degree of freedom."""
    stem, x = at
    low, high, gap, thick, half = -0.72, -0.46, 0.06, 0.07, 0.08
    ax.plot([stem, stem, x, x], [0, -0.12, -0.12, high], color=DARK, lw=1.6, zorder=1)
    ax.add_patch(Rectangle((x - half, low), 2 * half, high - low, facecolor="#cccccc", edgecolor="#444444", lw=0.8))
    for side in (-1, 1):
        start = x + side * half
        for width, first, colour in ((gap, start, "#ffee88"), (thick, start + side * gap, GREY)):
            ax.add_patch(Rectangle((first, low), side * width, high - low, facecolor=colour, edgecolor="none"))
    reach, floor = half + gap + thick, low - 0.07
    ax.add_patch(Rectangle((x - reach, floor), 2 * reach, 0.05, facecolor=GREY, edgecolor="none"))
    path = [(x, floor), (x, PLATE)]
    if to is not None:
        deep = floor - 0.18 - 0.09 * (j % 4)
        path = [(x, floor), (x, deep), (to - 0.29, deep), (to - 0.29, -0.06), (to, -0.06), (to, 0.0)]
    ax.plot(*zip(*path), color=GREY, lw=2.5, zorder=0)
    if few:
        words = f"{j + 1}: {1e3 * bushing.gap:.3g} mm"
        ax.text(x, floor - 0.03, words, ha="center", va="top", fontsize=FONT - 2, bbox=BEHIND_WORDS)
    else:
        words = f"bushing {j + 1}\ngap {1e3 * bushing.gap:.3g} mm"
        ax.text(x + reach + 0.04, (low + high) / 2, words, va="center", fontsize=FONT - 1.5, bbox=BEHIND_WORDS)


def _draw_sensors_and_masses(ax: Axes, rig: Rig, slots: dict[tuple[int | str, str], float]) -> None:
    for sensor, point in zip(rig.sensors, sensor_points(rig)):
        x = slots[_key(point)]
        ax.plot([x, x], [BOX, BOX + 0.2], color=COLOURS[0], linewidth=0.8)
        ax.text(x, BOX + 0.2, f"{sensor.node}", ha="center", va="bottom", fontsize=FONT - 0.5, bbox=SENSOR)
    for mass in rig.masses:
        x = slots[_key(mass.position)] - 0.25
        ax.plot([x], [BOX], "o", markersize=11, markerfacecolor="#999999", markeredgecolor=DARK)
        words = f"{mass.name or 'mass'}\n{mass.mass:.3g} kg"
        ax.text(x, BOX + 0.13, words, ha="center", va="bottom", fontsize=FONT - 1.5)


def _draw_shaker(ax: Axes, rig: Rig, slots: dict[tuple[int | str, str], float], whole: float) -> None:
    ax.add_patch(Rectangle((0, PLATE - 0.14), whole, 0.14, facecolor="#bbbbbb", edgecolor=DARK, lw=0.6))
    if rig.shaker.kind == "force":
        for point, factor in rig.shaker.forces:
            x = slots[_key(point)] + 0.25
            ax.annotate("", (x, BOX), (x, BOX + 0.55), arrowprops=SHAKEN)
            words = "shaker force" + (f" × {factor:g}" if factor != 1 else "")
            ax.text(x, BOX + 0.57, words, ha="center", va="bottom", fontsize=FONT - 1, color=COLOURS[1])
        return
    along = ", ".join(f"{a:.3g}" for a in rig.shaker.unit_direction)
    ax.annotate("", (whole / 2, PLATE - 0.15), (whole / 2, PLATE - 0.55), arrowprops=SHAKEN)
    ax.text(0.52 * whole, PLATE - 0.36, f"base acceleration along ({along})", va="center", fontsize=FONT - 1,
            color=COLOURS[1])  # fmt: skip


def _draw_places(ax: Axes, places: dict[tuple[int | str, str], np.ndarray]) -> None:
    """Draw nodes and directions, seen along the axis in which they spread least."""
    points = np.array(list(places.values()))
    across = int(np.argmin(np.ptp(points, axis=0) * (1, 1.001, 0.999) + (0, 0, 1e-12)))
    shown = [i for i in range(3) if i != across]
    size = np.maximum(np.ptp(points, axis=0)[shown], 1e-9)
    ax.plot(*points[:, shown].T, "o", color=DARK, ms=4)
    named: dict[tuple[float, float], list[str]] = {}
    for (node, axis), point in places.items():
        along, at = dof_vector(_label((node, axis)))[shown], (point[shown[0]], point[shown[1]])
        if along.any():
            look = {"arrowstyle": "<-", "color": COLOURS[1], "lw": 1}
            ax.annotate("", at, xytext=(24 * along[0], 24 * along[1]), textcoords="offset points", arrowprops=look)
        named.setdefault(at, []).append(f"{node}")
    for at, nodes in named.items():
        ax.annotate(", ".join(dict.fromkeys(nodes)), at, (-5, -5), textcoords="offset points", fontsize=FONT - 1,
                    ha="right", va="top")  # fmt: skip
    names = [f"{'XYZ'[i]} (m)" for i in shown]
    tidy(ax, xlabel=names[0], ylabel=names[1])
    ax.margins(0.08, 0.3 if size[1] > 1e-9 else 0.5)
