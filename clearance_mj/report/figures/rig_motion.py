"""Gravity, spin and unbalance in the drawing of a rig in space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...rig import Rig
from ..style import COLOURS, FONT
from .rig_symbols import DARK, Pen

__all__ = ["draw_motion", "instruments", "words_of_motion"]

RPM = 30 / np.pi


def draw_motion(pen: Pen, rig: Rig, unbalances: Sequence[tuple[float, float, float]], top: float) -> None:
    """Draw the arrows of gravity, from a height on, and of spin, of a rig in space.

    Of each unbalance its place, the height of the axis there and that of the shaft's surface above it are given.
    """
    if not rig.moves_across:
        return
    ax = pen.ax
    left, right = rig.linear.span
    for x, axis, half in unbalances:
        ax.plot([x], [axis + half + 0.05], "o", color=COLOURS[1], ms=4, zorder=5)
        ax.annotate("unbalance", (x, axis + half + 0.05), xytext=(5, 3), textcoords="offset points",
                    fontsize=FONT - 1, color=COLOURS[1])  # fmt: skip
    at = right + 0.09 * (right - left)
    if rig.gravity is not None and (down := np.array(rig.gravity)[[0, 2]]).any():
        # Across the shaft nothing is to scale: the arrow has the direction in inches.
        along, up = 0.38 * down / np.linalg.norm(down) * (pen.inch, 1.0)
        ax.annotate("", (at + along, top + up), (at, top), arrowprops={"arrowstyle": "-|>", "color": DARK, "lw": 1.2})
        ax.text(at + 0.1 * pen.inch, top - 0.05, "g", fontsize=FONT, va="top")
    if spin := rig.spin:
        x = left - 0.055 * (right - left)
        look = {"arrowstyle": "->", "color": COLOURS[0], "lw": 1.3, "connectionstyle": "arc3,rad=-0.9"}
        ax.annotate("", (x, 0.24), (x, -0.24), arrowprops=look, zorder=6)
        end = f" to {RPM * spin.until:.4g}" if spin.until is not None else ""
        words = f"{RPM * spin.speed:.4g}{end}\nrev/min"
        ax.text(x, 0.3, words, fontsize=FONT - 1, color=COLOURS[0], ha="center", va="bottom")


def instruments(rig: Rig) -> str:
    """Return what the numbered squares of a drawing are."""
    return "accelerometers" if {sensor.quantity for sensor in rig.sensors} == {"acceleration"} else "sensors"


def words_of_motion(rig: Rig) -> str:
    """Return a sentence on how a rig in space moves, and what loads and turns it; nothing of a planar one."""
    if not rig.moves_across:
        return ""
    slots = [str(i) for i, bushing in enumerate(rig.bushings, 1) if not bushing.is_round]
    words = ["Points move along y and z" + (", and bushings are round" if rig.bushings else "")]
    words[0] += f" but for {', '.join(slots)}" if slots else ""
    if rig.gravity is not None:
        words.append(f"gravity ({', '.join(f'{g:.4g}' for g in rig.gravity)}) m/s²")
    if spin := rig.spin:
        changes = f", {spin.rate:.4g} rad/s² from there on" if spin.rate else ""
        words.append(f"the shaft turns at {RPM * spin.speed:.4g} rev/min{changes}")
    words += [f"unbalance {1e6 * each.moment:.4g} g mm" for each in rig.unbalances]
    rubbed = sorted({b.friction.coefficient for b in rig.bushings if b.friction})
    words += [f"friction μ\N{NO-BREAK SPACE}= {', '.join(f'{mu:.3g}' for mu in rubbed)}"] if rubbed else []
    words += ["oil in the gaps"] if any(b.film for b in rig.bushings) else []
    return f" {'; '.join(words)}."
