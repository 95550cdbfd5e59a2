"""Figure 7: FRFs at the two clearances, sensors 6 and 7."""

from __future__ import annotations

from .context import Context
from .overlays import frf_overlay
from .result import Result

__all__ = ["run"]


def run(context: Context, nodes=(6, 7), level: float | None = None) -> Result:
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
    return frf_overlay(context, "figure_07", nodes, 1, level)
