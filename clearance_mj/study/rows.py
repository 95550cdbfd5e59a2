"""The agreement of laws with records as rows of plain data: means over the records of a level, with their intervals."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ..signals.comparison import Comparison
from ..statistics import repeatability

__all__ = ["Summaries", "agreement_rows", "level_summaries", "scatter_rows"]

Summaries = dict[float, list[dict[str, float]]]
"""Summary of each record's comparison, by level."""


def level_summaries(comparisons: Sequence[Comparison]) -> list[dict[str, float]]:
    """Return the summaries of the records of a level, of the modes that are compared in all of them.

    A mean over records of which one has another mode, or none, would be no mean of anything.

    Parameters
    ----------
    comparisons : sequence of Comparison
        One for each record, modes in one order.
    """
    compared = np.all([np.isfinite(c.per_mode["relative_error"]) for c in comparisons], axis=0)
    columns = ["model_hz", "relative_error", "mac", "model_damping"]
    summaries = []
    for comparison in comparisons:
        modes = comparison.per_mode
        modes = modes.assign(**{name: np.where(compared, modes[name], np.nan) for name in columns})
        summaries.append(dataclasses.replace(comparison, per_mode=modes).summary())
    return summaries


def agreement_rows(
    levels: Sequence[float], repeats: Mapping[float, dict[str, float]], summaries: Mapping[tuple[str, str], Summaries]
) -> list[dict]:
    """Return a row per level, law and engine, see `Study.rows`.

    Parameters
    ----------
    levels : sequence of float
        Levels, in the order of the rows.
    repeats : mapping of float to dict
        By level, the summary of the second record's comparison with the first.
    summaries : mapping of (str, str) to Summaries
        By law and engine.
    """
    tables = {("repeat", "rig"): repeatability.repeat_rows(repeats)}
    tables |= {key: repeatability.mean_rows(by_level) for key, by_level in summaries.items()}
    return [
        {"level": level, "law": law, "engine": engine} | table[level]
        for level in levels
        for (law, engine), table in tables.items()
        if level in table
    ]


def scatter_rows(summaries: Mapping[tuple[str, str], Summaries]) -> list[dict]:
    """Return the scatter behind the intervals: a row per law, engine and measure, with Cochran's test of equal scatter.

    Parameters
    ----------
    summaries : mapping of (str, str) to Summaries
        By law and engine.
    """
    rows = []
    for (law, engine), by_level in summaries.items():
        for key in filter(repeatability.has_interval, next(iter(by_level.values()))[0]):
            pooled = repeatability.pooled(by_level, key)
            row = {"law": law, "engine": engine, "measure": key, "scatter_of_logarithm": pooled.scatter}
            row |= {"degrees_of_freedom": pooled.freedom, "cochran": pooled.cochran}
            rows.append(row | {"cochran_limit": pooled.cochran_limit})
    return rows
