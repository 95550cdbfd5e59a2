"""Backbones: figure, rows for CSV, and in words how frequency and damping of nonlinear modes change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, ScalarFormatter

from ..periodic import Backbone
from ..periodic.summaries import motion
from .responses import amplitude_columns
from .style import COLOURS, TEST, Drawing, canvas, letters, tidy

__all__ = ["draw", "rows", "summary_lines"]

PANEL = 1.9  # in, height


def draw(backbones: Sequence[Backbone]) -> Drawing:
    """Draw frequency, damping ratio and the level that holds resonance over the amplitude, a row for each mode."""
    figure = canvas(0.3 + PANEL * len(backbones))
    axes = figure.subplots(len(backbones), 3, squeeze=False)
    names = iter(letters(axes.size))
    for row, (panels, each) in enumerate(zip(axes, backbones)):
        label = "Displacement / gap (1)" if row == len(backbones) - 1 else ""
        unit = "m/s²" if each.model.rig.shaker.kind == "base" else "N"
        shown = {"Frequency (Hz)": each.frequency, "Damping ratio (%)": 100 * each.damping}
        shown[f"Level ({unit})"] = each.level
        for ax, (words, values) in zip(panels, shown.items()):
            _draw_panel(ax, each, values)
            tidy(ax, f"{next(names)} mode {each.mode}", words, label)
        if (each.level[np.isfinite(each.level)] > 0).any():  # not of modes that nothing excites, or nothing damps
            panels[-1].set_yscale("log")
    modes = "; ".join(f"mode {each.mode}: clearance {each.clearances[each.clearance]}" for each in backbones)
    caption = (
        f"Nonlinear modes of rig “{backbones[0].model.rig.name}” over amplitude: frequency, damping ratio, and the "
        "amplitude of a sine that would hold the vibration in resonance. The displacement is that of the clearance "
        f"that a mode moves most ({modes}), its fundamental; beyond the gap it touches."
    )
    return Drawing("backbone", figure, caption, f"Frequency and damping of {len(backbones)} modes over amplitude.")


def _draw_panel(ax: Axes, backbone: Backbone, values: np.ndarray) -> None:
    amplitude = motion(backbone) / backbone.gap
    ax.plot(amplitude, np.where(np.isfinite(values), values, np.nan), color=COLOURS[0], lw=1.1)
    if backbone.ended:
        ax.plot(amplitude[-1], values[-1], "x", color=TEST, ms=4.5, mew=0.9)
    ax.axvline(1.0, color=TEST, lw=0.6)
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(10, (1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_locator(LogLocator(10, ()))
    ax.ticklabel_format(axis="y", useOffset=False)


def rows(backbones: Sequence[Backbone]) -> pd.DataFrame:
    """Return a row per point: frequency, damping, level of resonance, harmonics' amplitudes at sensors; SI units."""
    return pd.concat([_rows(each) for each in backbones], ignore_index=True)


def _rows(backbone: Backbone) -> pd.DataFrame:
    columns: dict[str, Any] = {
        "mode": backbone.mode, "frequency_hz": backbone.frequency, "damping_ratio": backbone.damping,
        "level": backbone.level, "level_unit": "m/s²" if backbone.model.rig.shaker.kind == "base" else "N",
    }  # fmt: skip
    return pd.DataFrame(columns | amplitude_columns(backbone, 1, False))


def summary_lines(backbone: Backbone) -> Iterator[str]:
    """Yield lines on where a backbone begins and ends, and whether it ends early."""
    ends = (
        f"{backbone.frequency[i]:.5g} Hz, {100 * backbone.damping[i]:.3g} % at {1e3 * motion(backbone)[i]:.3g} mm"
        for i in (0, -1)
    )
    low, high = backbone.frequency.min(), backbone.frequency.max()
    yield (
        f"mode {backbone.mode}, amplitudes at {backbone.clearances[backbone.clearance]}: {' to '.join(ends)}; "
        f"between {low:.5g} and {high:.5g} Hz"
    )
    if backbone.ended:
        yield f"  {backbone.ended}"
