"""Table 3: SMC and SMC-CM at 72 km/h."""

from __future__ import annotations

from .context import Context
from .motion import tabulated
from .result import Result

__all__ = ["run"]

METRICS = {"lateral_position_error_peak": "peak_e_y", "yaw_velocity_peak": "peak_yaw_rate_error"}
"""Ours for each quantity of the article's"""


def run(context: Context) -> Result:
    """Drive many vehicles at 72 km/h.

    Parameters
    ----------
    context : Context
        Says how much to do.
    """
    return tabulated(context, "table_3", 3, 72.0, METRICS)
