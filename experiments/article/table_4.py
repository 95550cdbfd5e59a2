"""Table 4: tracking errors at 120 km/h."""

from __future__ import annotations

from .context import Context
from .motion import tabulated
from .result import Result

__all__ = ["run"]

METRICS = {"lateral_position_error_peak": "peak_e_y", "yaw_velocity_error_peak": "peak_yaw_rate_error"}
"""Ours for each quantity of the article's"""


def run(context: Context) -> Result:
    """Drive many vehicles at 120 km/h.

    Parameters
    ----------
    context : Context
        Says how much to do.
    """
    return tabulated(context, "table_4", 4, 120.0, METRICS)
