"""Figure of the rate of peaks above a value in a record, and of the predicted largest value."""

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


def peaks_figure(prediction: Any) -> Figure:
    """Draw, for each row, peaks per hour above a value, their fit, and the largest value with its interval.

    Parameters
    ----------
    prediction : HourPeaks
        Prediction from a record.
    """
    count = len(prediction.rows)
    columns = min(count, 3)
    figure = canvas(2.6 * -(-count // columns))
    axes = np.ravel(figure.subplots(-(-count // columns), columns, squeeze=False))
    for i, ax in enumerate(axes[:count]):
        _draw_row(ax, prediction, i)
    for ax in axes[count:]:
        ax.set_axis_off()
    legend = {"peaks of the record": PEAKS, "fitted": FITTED, f"largest in {prediction.hours:g} h, 5 to 95 %": LARGEST}
    key(figure, of_curves(legend), 3)
    return figure


def _draw_row(ax: Axes, prediction: Any, i: int) -> None:
    """Draw peaks per hour above a value, from the record's to one in the predicted time."""
    scale, unit = SCALE.get(prediction.quantity, (1.0, prediction.unit))
    largest, peaks = prediction.largest[i], np.sort(prediction.peaks[i])[::-1]
    per_hour = 3600.0 / prediction.duration
    tidy(ax, prediction.rows[i], "Peaks above it (1/h)", f"{WORDS[prediction.quantity]} ({unit})")
    if peaks.size:
        ax.plot(scale * peaks, per_hour * np.arange(1, peaks.size + 1), **PEAKS)
        ax.set_yscale("log")
    if np.isnan(largest.median):
        ax.text(0.5, 0.5, f"{largest.peaks} peaks: too few", transform=ax.transAxes, ha="center", fontsize=8)
        return
    value = np.linspace(largest.threshold, largest.high, 200)
    base = np.maximum(1 + largest.shape * (value - largest.threshold) / largest.scale, 1e-12)
    rate = per_hour * largest.peaks * base ** (-1 / largest.shape)
    shown = rate > 0.03 / prediction.hours
    ax.plot(scale * value[shown], rate[shown], **FITTED)
    # The largest value has its median where log 2 peaks are expected in the time.
    expected = np.log(2) / prediction.hours
    ax.plot([scale * largest.low, scale * largest.high], [expected, expected], lw=2.0, color=ALARM)
    ax.plot(scale * largest.median, expected, "o", ms=4.0, color=ALARM)
    if prediction.limit is not None:
        ax.axvline(scale * prediction.limit, color=TEST, lw=0.8, ls="--")
