"""Figure 10: CSF of each sensor over frequency."""

from __future__ import annotations

from .context import Context
from .criteria import criterion_over_frequency
from .result import Result

__all__ = ["run"]


def run(context: Context, level: float | None = None) -> Result:
    """Draw the criterion.

    Parameters
    ----------
    context : Context
        Gives tests and models.
    level : float, optional
        m/s²; default: the middle level.
    """
    return criterion_over_frequency(context, "figure_10", "csf", level)
