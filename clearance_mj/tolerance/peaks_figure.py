"""How often peaks exceed a value in a record, and what the largest one of a longer time is expected to be."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..core.drawing import ALARM, COLOURS, TEST, canvas, key, of_curves, tidy

__all__ = ["peaks_figure"]

SCALE = {"penetration": (1e3, "mm")}
WORDS = {"contact_force": "Contact force", "penetration": "Penetration", "acceleration": "Acceleration"}
PEAKS: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.0, "color": TEST}
FITTED: dict[str, Any] = {"lw": 1.2, "color": COLOURS[0]}
LARGEST: dict[str, Any] = {"lw": 2.0, "color": ALARM, "marker": "o", "ms": 4.0}


def peaks_figure(found: Any) -> Figure:
    """Draw, for each row, peaks per hour above a value, their fit, and the largest value with its interval.

    Parameters
    ----------
    found : HourPeaks
        What a record says of a longer time.
    """
    count = len(found.rows)
    columns = min(count, 3)
    figure = canvas(2.6 * -(-count // columns))
    axes = np.ravel(figure.subplots(-(-count // columns), columns, squeeze=False))
    for i, ax in enumerate(axes[:count]):
        _row(ax, found, i)
    for ax in axes[count:]:
        ax.set_axis_off()
    legend = {"peaks of the record": PEAKS, "fitted": FITTED, f"largest in {found.hours:g} h, 5 to 95 %": LARGEST}
    key(figure, of_curves(legend), 3)
    return figure


def _row(ax: Axes, found: Any, i: int) -> None:
    """Peaks per hour above a value, from the record's to one in the time that is predicted."""
    scale, unit = SCALE.get(found.quantity, (1.0, found.unit))
    largest, peaks = found.largest[i], np.sort(found.peaks[i])[::-1]
    per_hour = 3600.0 / found.duration
    tidy(ax, found.rows[i], "Peaks above it (1/h)", f"{WORDS[found.quantity]} ({unit})")
    if peaks.size:
        ax.plot(scale * peaks, per_hour * np.arange(1, peaks.size + 1), **PEAKS)
        ax.set_yscale("log")
    if np.isnan(largest.median):
        ax.text(0.5, 0.5, f"{largest.peaks} peaks: too few", transform=ax.transAxes, ha="center", fontsize=8)
        return
    value = np.linspace(largest.threshold, largest.high, 200)
    inside = np.maximum(1 + largest.shape * (value - largest.threshold) / largest.scale, 1e-12)
    rate = per_hour * largest.peaks * inside ** (-1 / largest.shape)
    seen = rate > 0.03 / found.hours
    ax.plot(scale * value[seen], rate[seen], **FITTED)
    # The largest value has its median where log 2 peaks are expected in the time.
    expected = np.log(2) / found.hours
    ax.plot([scale * largest.low, scale * largest.high], [expected, expected], lw=2.0, color=ALARM)
    ax.plot(scale * largest.median, expected, "o", ms=4.0, color=ALARM)
    if found.limit is not None:
        ax.axvline(scale * found.limit, color=TEST, lw=0.8, ls="--")
