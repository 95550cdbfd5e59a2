"""Figure 3: damping and stiffness that fall steadily, identified from a free decay (working condition 2)."""

from __future__ import annotations

from .context import Context
from .decays import working_condition
from .result import Result

__all__ = ["run"]


def run(context: Context, snrs=(100, 20), seeds: int = 5) -> Result:
    """Identify working condition 2.

    Parameters
    ----------
    context : Context
        As `working_condition` takes it.
    snrs : sequence of float
        Signal-to-noise ratios, dB.
    seeds : int
        Noises of each.
    """
    return working_condition(context, 2, "figure_03", snrs, seeds)
