"""Figure 12: lateral and heading error at 120 km/h."""

from __future__ import annotations

from .context import Context
from .motion import drawn
from .result import Result

__all__ = ["run"]


def run(context: Context) -> Result:
    """Drive at 120 km/h.

    Parameters
    ----------
    context : Context
        Says how much to do.
    """
    return drawn(context, "figure_12", 120.0, ("mpc", "smc", "smc-cm"), ("e_y", "e_psi"))
