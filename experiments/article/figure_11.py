"""Figure 11: lateral and yaw rate error at 72 km/h."""

from __future__ import annotations

from .context import Context
from .motion import drawn
from .result import Result

__all__ = ["run"]


def run(context: Context) -> Result:
    """Drive at 72 km/h.

    Parameters
    ----------
    context : Context
        Says how much to do.
    """
    return drawn(context, "figure_11", 72.0, ("smc", "smc-cm"), ("e_y", "yaw_rate_error"))
