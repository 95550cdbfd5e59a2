"""Means of a comparison's measures over the seeds of each level, with their intervals."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .intervals import Interval, Pooled, on_power_law, over_seeds

__all__ = ["PERFECT", "has_interval", "interval_of", "mean_rows", "pooled", "repeat_rows"]

Rows = Mapping[float, Mapping[str, float]]  # measures by level
Repeated = Mapping[float, Sequence[Mapping[str, float]]]  # measures of each seed by level
PERFECT = {
    **dict.fromkeys(("mre", "rmse_db", "relative_error"), 0.0),
    **dict.fromkeys(("frac", "csac", "csf", "csac_per_sensor", "csf_per_sensor", "mac"), 1.0),
}  # Value of each measure for equal FRFs; its distance from there is the error whose logarithm scatters


def _measure(key: str) -> str:
    return re.sub(r"^mode_\d+_", "", key)


def has_interval(key: str) -> bool:
    """Return True if a column of `Comparison.summary`, such as "mode_2_mac", is an error or a criterion."""
    return _measure(key) in PERFECT


def pooled(by_level: Repeated, key: str) -> Pooled:
    """Return the mean error of one measure over the seeds of each level, with intervals."""
    perfect = PERFECT[_measure(key)]
    errors = {level: [abs(perfect - s[key]) for s in seeds] for level, seeds in by_level.items()}
    return over_seeds(errors, largest=_largest(key))


def _largest(key: str) -> float:
    """Return the largest possible error: criteria are 0 to 1."""
    return 1.0 if PERFECT[_measure(key)] == 1 else math.inf


def mean_rows(by_level: Repeated) -> dict[float, dict[str, Any]]:
    """Return means over the seeds of each level; errors and criteria with ``_low`` and ``_high``, their 95 % interval,
    ``_doubtful`` where Cochran's test refuses its assumption, and ``_no_interval``: why there is none.
    """
    means = {level: _means(seeds) for level, seeds in by_level.items()}
    return _rows(means, lambda key: pooled(by_level, key).means)


def repeat_rows(by_level: Rows) -> dict[float, dict[str, Any]]:
    """Return the measures of the repeatability, one pair of seeds for each level; intervals by `on_power_law`."""

    def intervals(key: str) -> Mapping[float, Interval]:
        errors = {level: abs(PERFECT[_measure(key)] - row[key]) for level, row in by_level.items()}
        return on_power_law(errors, largest=_largest(key))

    return _rows(by_level, intervals)


def _rows(means: Rows, intervals: Callable[[str], Mapping[float, Interval]]) -> dict[float, dict[str, Any]]:
    """Return rows of means with limits; those of a criterion are its error's in reverse."""
    rows: dict[float, dict[str, Any]] = {level: {} for level in means}
    for key in next(iter(means.values()), ()):
        interval_of_level = intervals(key) if has_interval(key) else {}
        for level, row in rows.items():
            row[key] = means[level][key]
            if error := interval_of_level.get(level):
                is_error = PERFECT[_measure(key)] == 0
                limits = (error.low, error.high) if is_error else (1 - error.high, 1 - error.low)
                row[f"{key}_low"], row[f"{key}_high"] = limits
                row[f"{key}_doubtful"], row[f"{key}_no_interval"] = error.doubtful, error.missing
    return rows


def _means(seeds: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return means of the values that are numbers; a mode may be missing in one record and not in another."""
    means = {}
    for key in seeds[0]:
        finite = [s[key] for s in seeds if np.isfinite(s[key])]
        means[key] = float(np.mean(finite)) if finite else float("nan")
    return means


def interval_of(row: Mapping[str, Any], key: str) -> Interval:
    """Return a measure of a row of `mean_rows` or `repeat_rows` with its limits."""
    doubtful, missing = bool(row[f"{key}_doubtful"]), str(row[f"{key}_no_interval"])
    return Interval(row[key], row[f"{key}_low"], row[f"{key}_high"], doubtful, missing)
