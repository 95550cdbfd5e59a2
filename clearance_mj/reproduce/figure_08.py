"""Figure 8: FRFs away from the clearances, sensors 1, 2, 3, 4, 5 and 8."""

from __future__ import annotations

from .context import Context
from .overlays import frf_overlay
from .result import Result

__all__ = ["run"]


def run(context: Context, nodes=(1, 2, 3, 4, 5, 8), level: float | None = None) -> Result:
    """Overlay FRFs; parameters as `frf_overlay` takes them."""
    return frf_overlay(context, "figure_08", nodes, 2, level)
