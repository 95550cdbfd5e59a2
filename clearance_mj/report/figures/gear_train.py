"""Drawing of a rig of gears: axes of turning from the side, base circles to scale, gears in mesh above each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ...rig import Bushing, Rig
from ...rig.sensing import sensor_points
from ...structure import Gears, Inertia, Spring
from ...structure.base import is_rotation, parse_dof
from ..style import COLOURS, FONT, Drawing, sheet, tidy
from .rig_motion import instruments
from .rig_symbols import DARK, GREY, SENSOR

WIDTH, PITCH = 0.2, 1.0  # of a gear along its axis, and from one to the next
INCHES = 1.9  # of the sheet's height for a gear
_Place = tuple[float, float]  # along the axes, in pitches, and across them, m


def gear_train(rig: Rig, gears: Gears) -> Drawing:
    """Draw what turns about each axis, and which gears are in mesh."""
    sizes = [each.base_radius for each in gears.inertias if each.base_radius]
    plain = 0.7 * float(np.mean(sizes)) if sizes else 1.0
    radius = {each.node: each.base_radius or plain for each in gears.inertias}
    places = _place_inertias(rig, gears, radius)
    x, y, r = (np.array(v) for v in zip(*((*places[node], radius[node]) for node in radius)))
    high, low = float(np.max(y + r)), float(np.min(y - r))
    figure = sheet(max(2.6, INCHES * (high - low) / (2 * r.max())), left=0.65, right=0.15, titled=0.05)
    ax = figure.subplots()
    for each, a, b, in_mesh in _joints(rig, gears):
        at = _draw_joint(ax, places[a], places[b], in_mesh, radius[a])
        if isinstance(each, Bushing):
            words = f"bushing {rig.bushings.index(each) + 1}\ngap {1e3 * each.gap:.3g} {'mm' if in_mesh else 'mrad'}"
            ax.text(*at, words, ha="right" if in_mesh else "center", va="top", fontsize=FONT - 1.5, zorder=6)
    for inertia in gears.inertias:
        _draw_inertia(ax, inertia, places[inertia.node], radius[inertia.node])
    _draw_instruments(ax, rig, places, radius)
    tidy(ax, ylabel="Base circles (mm)")
    ax.grid(False)
    ax.set_xticks([])
    ax.yaxis.set_major_formatter(lambda value, _: f"{1e3 * value:.3g}")
    ax.set(xlim=(x.min() - 1.1, x.max() + 1.3), ylim=(low - 0.12 * (high - low), high + 0.2 * (high - low)))
    torques = [f"{load.torque:.4g} N m on {load.position}" for load in rig.loads if load.torque]
    torques += [f"{o.torque:.4g} N m of order {o.order:g} on {o.position}" for o in rig.orders if o.torque]
    caption = (
        f"Rig “{rig.name}”: gears from the side, base circles (hatched) to scale, axes not. Yellow: meshes. Numbered "
        f"squares: {instruments(rig)}.{' Torques: ' * bool(torques)}{', '.join(torques)}{'.' * bool(torques)}"
    )
    counts = f"{len(gears.inertias)} inertias, {len(rig.bushings)} clearances, {len(rig.sensors)} sensors"
    alt = f"Gears of rig {rig.name}: {counts}."
    return Drawing("rig", figure, caption, alt)


def _nodes(points: tuple[float | str, ...]) -> list[int]:
    return [int(dof[0]) for point in points if (dof := parse_dof(point))]


def _joints(rig: Rig, gears: Gears) -> Iterator[tuple[Bushing | Spring, int, int, bool]]:
    """Yield each element between two inertias, their nodes, and whether it is a mesh of teeth."""
    joints: tuple[Bushing | Spring, ...] = (*rig.bushings, *gears.springs)
    for each in joints:
        if len(nodes := _nodes(each.joined)) == 2:
            yield each, nodes[0], nodes[1], not is_rotation(each.position)


def _place_inertias(rig: Rig, gears: Gears, radius: dict[int, float]) -> dict[int, _Place]:
    """Return the positions of inertias: those in mesh touch across their axes, those on a shaft stand side by side."""
    places: dict[int, _Place] = {}

    def is_free(node: int, place: _Place) -> bool:
        apart = (
            (abs(place[0] - x), abs(place[1] - y), radius[node] + radius[other]) for other, (x, y) in places.items()
        )
        return all(along > 0.9 * PITCH or across > 0.999 * reach for along, across, reach in apart)

    for first in radius:
        if first not in places:
            places[first] = (max((x for x, _ in places.values()), default=-2 * PITCH) + 2 * PITCH, 0.0)
        waiting = deque([first])
        while waiting:
            current = waiting.popleft()
            for _, a, b, in_mesh in _joints(rig, gears):
                node = b if a == current else a
                if current not in (a, b) or node in places:
                    continue
                (x, y), reach = places[current], radius[current] + radius[node]
                steps = ((0.0, -reach), (0.0, reach)) if in_mesh else ((n * PITCH, 0.0) for n in count(1))
                free = ((x + along, y + across) for along, across in steps if is_free(node, (x + along, y + across)))
                places[node] = next(free, (max(x for x, _ in places.values()) + PITCH, y - reach))
                waiting.append(node)
    return places


def _draw_joint(ax: Axes, first: _Place, other: _Place, in_mesh: bool, radius: float) -> _Place:
    """Draw a shaft between two inertias, or the line along which two gears touch; return where words have room."""
    if in_mesh and first[0] == other[0]:
        height = first[1] + radius * np.sign(other[1] - first[1])
        ax.plot([first[0] - WIDTH / 2, first[0] + WIDTH / 2], [height] * 2, color="#ddbb00", lw=3.5, zorder=4)
        return first[0] - 0.7 * WIDTH, height
    ax.plot(*zip(first, other), color=GREY, lw=1.0 if in_mesh else 2.5, ls=":" if in_mesh else "-", zorder=1)
    return (first[0] + other[0]) / 2, (first[1] + other[1]) / 2


def _draw_inertia(ax: Axes, each: Inertia, place: _Place, radius: float) -> None:
    x, y = place
    look: dict[str, Any] = {"facecolor": "#cccccc", "edgecolor": DARK, "lw": 0.8}
    look["hatch"] = "---" * bool(each.base_radius)
    ax.add_patch(Rectangle((x - WIDTH / 2, y - radius), WIDTH, 2 * radius, zorder=2, **look))
    ax.plot([x - 0.8 * WIDTH, x + 0.8 * WIDTH], [y, y], color=DARK, lw=0.8, ls=(0, (8, 2, 2, 2)), zorder=5)
    words = f"{each.node}{f': {each.name}' if each.name else ''}\n{each.polar_inertia:.3g} kg m²"
    at: dict[str, Any] = {"textcoords": "offset points", "va": "bottom", "fontsize": FONT - 1}
    ax.annotate(words, (x + 0.62 * WIDTH, y), (0, 3), zorder=6, **at)


def _draw_instruments(ax: Axes, rig: Rig, places: dict[int, _Place], radius: dict[int, float]) -> None:
    at: dict[str, Any] = {"textcoords": "offset points", "ha": "right", "va": "center"}
    on: dict[int, list[str]] = {}
    for sensor, point in zip(rig.sensors, sensor_points(rig)):
        on.setdefault(_nodes((point,))[0], []).append(f"{sensor.node}")
    for node, numbers in on.items():
        (x, y), r = places[node], radius[node]
        look = at | {"fontsize": FONT - 0.5, "bbox": SENSOR}
        ax.annotate(", ".join(numbers), (x - WIDTH / 2, y + 0.5 * r), (-8, 0), zorder=6, **look)
    for point, factor in rig.shaker.forces if rig.shaker.kind == "force" else ():
        x, y = places[_nodes((point,))[0]]
        words = "shaker" + (f" × {factor:g}" if factor != 1 else "")
        look = at | {"color": COLOURS[1], "arrowprops": {"arrowstyle": "->", "color": COLOURS[1]}}
        ax.annotate(words, (x - WIDTH / 2, y), (-26, 0), fontsize=FONT - 1, **look)
