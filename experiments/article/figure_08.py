"""Figure 8: FRFs away from the clearances, sensors 1, 2, 3, 4, 5 and 8."""

from __future__ import annotations

from .context import Context
from .overlays import frf_overlay
from .result import Result

__all__ = ["run"]


def run(context: Context, nodes=(1, 2, 3, 4, 5, 8), level: float | None = None) -> Result:
    """Overlay FRFs.

    Parameters
    ----------
    context : Context
        Gives tests and models.
    nodes : sequence of int
        Sensors to draw.
    level : float, optional
        m/s²; default: the middle level.
    """
    return frf_overlay(context, "figure_08", nodes, 2, level)
