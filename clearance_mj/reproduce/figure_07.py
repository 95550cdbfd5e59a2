"""Figure 7: FRFs at the two clearances, sensors 6 and 7."""

from __future__ import annotations

from .context import Context
from .overlays import frf_overlay
from .result import Result

__all__ = ["run"]


def run(context: Context, nodes=(6, 7), level: float | None = None) -> Result:
    """Overlay FRFs; parameters as `frf_overlay` takes them."""
    return frf_overlay(context, "figure_07", nodes, 1, level)
