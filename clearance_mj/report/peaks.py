"""Peaks over an hour of random excitation: figure, rows for CSV, and plain data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import pandas as pd

from ..tolerance.peaks import HourPeaks
from .style import Drawing

__all__ = ["draw", "rows", "summary_lines", "to_dict"]


def draw(peaks: HourPeaks) -> Drawing:
    """Draw the peaks of a record, their fit and the largest value of the time."""
    quantity = peaks.quantity.replace("_", " ")
    caption = (
        f"Peaks of the {quantity} in {peaks.duration:g} s of random excitation, as many an hour as exceed a value, the "
        f"generalised Pareto distribution fitted to them, and the largest value of {peaks.hours:g} h: its median, "
        "and the interval that holds it nine times in ten, at the height where it is expected."
    )
    return Drawing("peaks", peaks.plot(), caption, f"Peaks of the {quantity} over how often they are exceeded.", False)


def rows(peaks: HourPeaks) -> pd.DataFrame:
    """Return a row for each clearance's impacts, and one for the largest value of each clearance or sensor."""
    unit = peaks.unit.replace("²", "2")
    impacts = [
        {"place": name, "what": "impacts per second", "unit": "1/s", "value": rate.value, "low": rate.low,
         "high": rate.high, "probability_of_impact": touch, "rests": bool(rests)}
        for name, rate, touch, rests in zip(peaks.clearances, peaks.impacts, peaks.impact_probability, peaks.rests)
    ]  # fmt: skip
    largest = [
        {"place": name, "what": f"largest {peaks.quantity}", "unit": unit, "value": fit.median, "low": fit.low,
         "high": fit.high, "in_record": seen, "exceeded": over, "threshold": fit.threshold, "peaks": fit.peaks,
         "scale": fit.scale, "shape": fit.shape, "misfit": fit.misfit}
        for name, fit, seen, over in zip(peaks.rows, peaks.largest, peaks.observed, peaks.exceeded)
    ]  # fmt: skip
    return pd.DataFrame([*impacts, *largest])


def to_dict(peaks: HourPeaks) -> dict[str, Any]:
    """Return everything but the peaks and where they come from as plain data."""
    clearances = [
        {"name": name, **asdict(rate), "probability": float(touch), "rests": bool(rests)}
        for name, rate, touch, rests in zip(peaks.clearances, peaks.impacts, peaks.impact_probability, peaks.rests)
    ]
    largest = [
        {"name": name, "in_record": float(seen), **asdict(fit)}
        for name, fit, seen in zip(peaks.rows, peaks.largest, peaks.observed)
    ]
    facts = {name: getattr(peaks, name) for name in ("quantity", "unit", "hours", "duration", "limit")}
    return facts | {"impacts_per_second": clearances, "largest": largest}


def summary_lines(peaks: HourPeaks) -> list[str]:
    """Return lines: the table of `HourPeaks`, probabilities of contact, and of exceeding the limit."""
    said = [str(peaks)]
    for name, touch, rests in zip(peaks.clearances, peaks.impact_probability, peaks.rests):
        event = "leaves the wall against which it rests" if rests else "touches"
        said.append(f"{name} {event} within {peaks.hours:g} h with a probability of {touch:.3g}")
    if peaks.limit is not None:
        over = ", ".join(f"{name} {value:.3g}" for name, value in zip(peaks.rows, peaks.exceeded))
        said.append(f"probability of more than {peaks.limit:g} {peaks.unit} within {peaks.hours:g} h: {over}")
    return said
