"""Drawing of a rig: a side view of its shafts, or a scheme of its degrees of freedom where it has none."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ...rig import Bushing, PointMass, Rig
from ...rig.sensing import sensor_points
from ...structure import Disc, Gears, Shaft, Spring
from ...structure.base import is_rotation
from ..outline import outline, position_label
from ..style import COLOURS, FONT, Drawing, sheet, tidy
from .gear_train import gear_train
from .rig_motion import draw_motion, instruments, words_of_motion
from .rig_scheme import scheme
from .rig_symbols import BLOCK, DARK, GREY, SENSOR, SHAKEN, Pen, draw_spring, draw_support

DRAWN_GAP, PLATE, PITCH = 0.13, -1.15, 1.75
"""Across the shaft nothing is to scale: gap, the base plate's top, from one shaft to the next"""
HALF_SHAFT, STEPPED = 0.10, 0.17
"""half thickness of the thickest section of shafts, if all are uniform and alike, and otherwise"""
BEHIND_WORDS = {"facecolor": "white", "edgecolor": "none", "pad": 1}


def rig_drawing(rig: Rig) -> Drawing:
    """Draw a side view of the rig, to scale along its shafts or of its gears, or a scheme where it has neither."""
    if isinstance(rig.linear, Gears):
        return gear_train(rig, rig.linear)
    return _SideView(rig).drawing() if rig.linear.shafts else scheme(rig)


class _SideView:
    """Shafts one above another, the first at the top, over a base plate."""

    def __init__(self, rig: Rig):
        self.rig, self.shafts = rig, rig.linear.shafts
        self.first, self.last = rig.linear.span
        self.length = self.last - self.first
        self.outlines = [outline(shaft) for shaft in self.shafts]
        heights = np.concatenate([edges[1] for edges in self.outlines])
        self.scale = (HALF_SHAFT if np.ptp(heights) == 0 else STEPPED) / heights.max()
        self.top = PITCH * (len(self.shafts) - 1)
        self.figure = sheet(2.8 + self.top, left=0.15, right=0.15, titled=0.05)
        self.ax: Axes = self.figure.subplots()
        self.labelled: list[float] = []
        self.pen = Pen(self.ax, 1.25 * self.length / 7.2, PLATE)

    def level(self, i: int) -> float:
        """Return the height of a shaft's axis."""
        return self.top - PITCH * i

    def half(self, i: int, x: float | np.ndarray) -> Any:
        """Half height of a shaft."""
        return self.scale * np.interp(x, *self.outlines[i][:2])

    def drawing(self) -> Drawing:
        """Draw it all."""
        rig, ax = self.rig, self.ax
        for i, shaft in enumerate(self.shafts):
            self._draw_shaft(i, shaft)
        for spring in (*getattr(rig.linear, "springs", ()), *rig.springs):
            self._draw_spring(spring)
        for bearing in rig.bearings:
            self._draw_to_base(bearing.position, bool(np.any(bearing.damping)), bool(np.any(bearing.stiffness)))
        for i, bushing in enumerate(rig.bushings):
            self._draw_bushing(i, bushing)
        for i in range(len(self.shafts)):
            self._draw_sensors(i)
        for mass in rig.masses:
            self._draw_mass(mass)
        for hung in rig.oscillators:
            self._draw_mass(PointMass(hung.position, hung.mass, f"on a spring, {hung.frequency:.4g} Hz"))
        self._draw_shaker()
        draw_motion(self.pen, rig, [self._locate(each.position) for each in rig.unbalances], self.top + 0.92)
        tidy(ax, xlabel=position_label(self.shafts))
        ax.grid(False)
        ax.set_yticks([])
        for side in ("left", "right", "top"):
            ax.spines[side].set_visible(False)
        ax.set_xlim(self.first - 0.12 * self.length, self.last + 0.13 * self.length)
        ax.set_ylim(PLATE - 0.62, self.top + 1.02)
        caption = (
            f"Rig “{rig.name}” drawn from its file: to scale along the shaft, not across it; the gaps (radial) are "
            f"drawn wide. Numbered squares: {instruments(rig)}. Yellow: grease. {' '.join(map(_describe, self.shafts))}"
            f"{words_of_motion(rig)}{_omissions(rig)}"
        )
        kind = "clamped shaft" if rig.beam else "shaft" if len(self.shafts) == 1 else f"{len(self.shafts)} shafts"
        alt = f"Side view of rig {rig.name}: {kind}, {len(rig.bushings)} bushings, {len(rig.sensors)} sensors."
        return Drawing("rig", self.figure, caption, alt)

    def _draw_shaft(self, i: int, shaft: Shaft) -> None:
        y, (x, outer, bore) = self.level(i), self.outlines[i]
        edge = np.concatenate((self.scale * outer, -self.scale * outer[::-1]))
        self.ax.fill(np.concatenate((x, x[::-1])), y + edge, facecolor="#cccccc", edgecolor="#444444", lw=0.8)
        for start in range(0, x.size, 2):
            if bore[start]:
                hidden = y + self.scale * np.outer((-1, 1), bore[start : start + 2])
                self.ax.plot(x[start : start + 2], hidden.T, color="#444444", lw=0.6, ls=(0, (4, 2)))
        if len(self.shafts) > 1:
            self.ax.text(self.last + 0.035 * self.length, y, shaft.name, va="center", fontsize=FONT, style="italic")
        for support in shaft.supports:
            side = -1 if support.position == shaft.start else 1 if support.position == shaft.end else 0
            draw_support(self.pen, support, y, self.half(i, support.position), side)
        for disc in shaft.discs:
            self._draw_disc(i, disc)

    def _locate(self, point: float | str) -> tuple[float, float, float]:
        """Return the place along the shafts, the axis's height there and half the shaft's height."""
        i, x = self.rig.linear.place(point)
        return x, self.level(i), self.half(i, x)

    def _draw_disc(self, i: int, disc: Disc) -> None:
        y, width, high = self.level(i), 0.12 * self.pen.inch, self.half(i, disc.position) + 0.2
        left = disc.position - width / 2
        self.ax.add_patch(Rectangle((left, y - high), width, 2 * high, facecolor="#999999", edgecolor=DARK, lw=0.8))
        words, top = f"{disc.name or 'disc'}\n{disc.mass:.3g} kg", y + high + 0.04
        self.ax.text(disc.position, top, words, ha="center", va="bottom", fontsize=FONT - 1, bbox=BEHIND_WORDS)

    def _draw_spring(self, spring: Spring) -> None:
        """Draw a spring from shaft to shaft, or to the base."""
        if spring.to is None:
            self._draw_to_base(spring.position, bool(spring.damping), bool(spring.stiffness))
        else:
            i, x = self.rig.linear.place(spring.position)
            ends = self._facing_heights((i, x), self.rig.linear.place(spring.to))
            draw_spring(self.pen, x, *ends, bool(spring.damping), bool(spring.stiffness))

    def _draw_to_base(self, point: float | str, damped: bool, sprung: bool) -> None:
        """Draw a spring and a damper from a shaft to the base."""
        x, y, half = self._locate(point)
        draw_spring(self.pen, x, y - half, y - half - 0.42, damped, sprung)
        self.pen.ground(x, y - half - 0.42)

    def _facing_heights(self, face: tuple[int, float], other: tuple[int, float]) -> tuple[float, float]:
        """Return the heights of the facing surfaces of two shafts."""
        up = np.sign(self.level(other[0]) - self.level(face[0]))
        return self.level(face[0]) + up * self.half(*face), self.level(other[0]) - up * self.half(*other)

    def _draw_bushing(self, number: int, bushing: Bushing) -> None:
        (i, x), ax = self.rig.linear.place(bushing.position), self.ax
        y, left, width = self.level(i), x - bushing.length / 2, max(bushing.length, 0.004 * self.length)
        half = float(np.max(self.half(i, np.array([left, x, left + width]))))
        turns, inner = is_rotation(bushing.position), half + DRAWN_GAP
        filled, block = ("#ffee88", "none"), (GREY, DARK)
        lower, upper = np.isfinite(bushing.walls)
        if turns:  # teeth, of a wheel on the shaft and of what they touch below
            left, width, lower, upper = x - 0.02 * self.length, 0.04 * self.length, True, False
            filled = block = "#cccccc", DARK
        look: dict[str, Any] = {"lw": 0.6, "hatch": "||||" if turns else ""}
        for level, gap, solid in ((upper, half, inner), (lower, -inner, -inner - BLOCK)):
            for bottom, high, (face, edge) in ((gap, DRAWN_GAP, filled), (solid, BLOCK, block)) if level else ():
                ax.add_patch(Rectangle((left, y + bottom), width, high, facecolor=face, edgecolor=edge, **look))
        if bushing.to is None:
            self.pen.post(x, y + (inner if upper and not lower else -inner - BLOCK))
        else:
            self._draw_carrier(i, x, inner + BLOCK, *self.rig.linear.place(bushing.to))
        words = [f"bushing {number + 1}", f"gap {1e3 * bushing.gap:.3g} {'mrad' if turns else 'mm'}"]
        words += [f"length {1e3 * bushing.length:.3g} mm"] if bushing.length else []
        lines = sum(abs(x - other) < 0.13 * self.length for other in self.labelled)
        self.labelled.append(x)
        at = x - 0.01 * self.length, y - inner - BLOCK - 0.06 - 0.42 * lines
        ax.text(*at, "\n".join(words), fontsize=FONT - 1, ha="right", va="top", bbox=BEHIND_WORDS)

    def _draw_carrier(self, i: int, x: float, half: float, j: int, to: float) -> None:
        """Draw the carrier that fixes a bushing to another shaft."""
        up = np.sign(self.level(j) - self.level(i)) or -1.0
        start, surface = self.level(i) + up * half, self.level(j) - up * self.half(j, to)
        turn = start + up * 0.1
        self.ax.plot([x, x, to, to], [start, turn, turn, surface], color=GREY, lw=2.5, zorder=0)
        self.ax.plot([to], [surface], "o", color=GREY, ms=5)

    def _draw_sensors(self, i: int) -> None:
        """Draw numbered squares above the shaft, a row higher where they would cover their neighbour."""
        y = self.level(i)
        row, previous = 0, -np.inf
        points = zip(sensor_points(self.rig), self.rig.sensors)
        on_shafts = ((*self.rig.linear.place(point), s.node) for point, s in points)
        places: dict[float, list[int]] = {}
        for shaft, x, node in sorted(on_shafts):
            if shaft == i:
                places.setdefault(x, []).append(node)
        for x, nodes in places.items():
            row, previous = (row + 1) % 2 if x - previous < 0.035 * self.length else 0, x
            half = self.half(i, x)
            height = y + max(half, self.scale * self.outlines[i][1].max()) + DRAWN_GAP + BLOCK + 0.15 + 0.22 * row
            height += 0.24 if any(abs(x - d.position) < 0.05 * self.length for d in self.shafts[i].discs) else 0.0
            self.ax.plot([x, x], [y + half, height], color=COLOURS[0], linewidth=0.8, zorder=1)
            words = ", ".join(map(str, nodes))
            self.ax.text(x, height, words, ha="center", va="bottom", fontsize=FONT - 0.5, bbox=SENSOR)

    def _draw_mass(self, mass: PointMass) -> None:
        i, x = self.rig.linear.place(mass.position)
        self.ax.plot([x], [self.level(i)], "o", markersize=15, markerfacecolor="#999999", markeredgecolor=DARK)
        words = f"{mass.name or 'mass'}\n{mass.mass:.3g} kg"
        self.ax.text(x, self.level(i) - 0.33, words, ha="center", va="top", fontsize=FONT - 1)

    def _draw_shaker(self) -> None:
        rig, ax, length = self.rig, self.ax, self.length
        plate = (self.first - 0.05 * length, PLATE - 0.14), 1.1 * length, 0.14
        ax.add_patch(Rectangle(*plate, facecolor="#bbbbbb", edgecolor=DARK, lw=0.6))
        words_at = self.first + 0.52 * length
        if rig.shaker.kind == "force":
            for point, factor in ((p, f) for p, f in rig.shaker.forces if not is_rotation(p)):
                i, x = rig.linear.place(point)
                foot = PLATE if self.level(i) == 0 else self.level(i) - 0.75
                ax.annotate("", (x, self.level(i) - self.half(i, x)), (x, foot), arrowprops=SHAKEN, zorder=2)
                if factor != 1:
                    ax.text(x + 0.01 * length, foot + 0.06, f"× {factor:g}", fontsize=FONT - 1, color=COLOURS[1])
            moments = [f"{factor:g} N m/N" for point, factor in rig.shaker.forces if is_rotation(point)]
            words = ", and twists by ".join(["shaker force", *moments])
            words_at = rig.linear.place(rig.shaker.forces[0][0])[1] + 0.02 * length
        else:
            fixture = "clamp and bushings" if rig.beam else "supports and bushings"
            words, along = f"base acceleration: plate, {fixture} move together", rig.shaker.unit_direction
            x = words_at - 0.02 * length
            ax.annotate("", (x, PLATE - 0.15), (x, PLATE - 0.55), arrowprops=SHAKEN)
            if abs(along[2]) < 1:
                words += f", along ({', '.join(f'{a:.3g}' for a in along)})"
        ax.text(words_at, PLATE - 0.36, words, va="center", fontsize=FONT - 1, color=COLOURS[1])


def _describe(shaft: Shaft) -> str:
    """Return a shaft in words."""
    sizes = {name: [getattr(s, name.replace(" ", "_")) for s in shaft.sections] for name in _SIZES}
    dimensions = [f"{name} {_range(1e3 * np.ravel([v for v in values if v]))} mm" for name, values in sizes.items()
                  if any(values)]  # fmt: skip
    materials = list(dict.fromkeys(m for s in shaft.sections if (m := s.material or shaft.material)))
    stuff = f"E\N{NO-BREAK SPACE}= {_range([m.young_modulus / 1e9 for m in materials])} GPa, "
    stuff += f"ρ\N{NO-BREAK SPACE}= {_range([m.density for m in materials])} kg/m³"
    sections = [f"{len(shaft.sections)} sections"] if len(shaft.sections) > 1 else []
    name = f"Shaft{f' “{shaft.name}”' if shaft.name else ''}: length {shaft.end - shaft.start:.4g} m"
    theory = {"euler": "Euler-Bernoulli's", "timoshenko": "Timoshenko's"}[shaft.bending_theory]
    return f"{', '.join([name, *sections, *dimensions])}, {stuff}, {theory} theory."


def _omissions(rig: Rig) -> str:
    """Return a sentence on parts of a rig that a side view does not show."""
    omitted = [f"a mode of the fixture at {mode.frequency:.4g} Hz" for mode in rig.fixture]
    omitted += ["bushings on housings that give"] if any(b.housing for b in rig.bushings) else []
    omitted += ["two bending planes that differ"] if rig.planes else []
    omitted += ["a clamp with a mass of its own"] if rig.beam and rig.beam.clamp and rig.beam.clamp.mass else []
    optional = {"constant loads": rig.loads, "orders of the spin": rig.orders, "further inputs": rig.shakers}
    omitted += [words for words, items in optional.items() if items]
    return f" Not drawn: {', '.join(omitted)}." if omitted else ""


_SIZES = ("diameter", "inner diameter", "width", "height")


def _range(values: Any) -> str:
    low, high = f"{min(values):.4g}", f"{max(values):.4g}"
    return low if low == high else f"{low} to {high}"
