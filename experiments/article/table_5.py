"""Table 5: peaks of lateral acceleration and yaw rate at 120 km/h."""

from __future__ import annotations

from .context import Context
from .motion import tabulated
from .result import Result

__all__ = ["run"]

METRICS = {"lateral_acceleration_peak": "peak_lateral_acceleration", "yaw_velocity_peak": "peak_yaw_rate"}
"""Ours for each quantity of the article's"""


def run(context: Context) -> Result:
    """Drive many vehicles at 120 km/h.

    Parameters
    ----------
    context : Context
        Says how much to do.
    """
    return tabulated(context, "table_5", 5, 120.0, METRICS)
