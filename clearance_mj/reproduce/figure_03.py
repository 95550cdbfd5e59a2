"""Figure 3: damping and stiffness that fall steadily, identified from a free decay (working condition 2)."""

from __future__ import annotations

from .context import Context
from .decays import working_condition
from .result import Result

__all__ = ["run"]

WORDS = {
    "title": "Figure 3: damping and stiffness that fall steadily",
    "article": (
        "Working condition 2: c(t) = 0.02 - 0.02t, k(t) = 8000 - 1000t. The identified values fluctuate around the "
        "theoretical ones, more at an SNR of 20 dB than at 100 dB. No error is given as a number."
    ),
    "differs": (
        "The damping as printed is negative after 1 s; 0.02 - 0.002t takes its place. Eq. 12 leaves out that the "
        "amplitude also changes with the frequency (adiabatic invariance, -ω'/(2ω)), which biases c whenever k varies. "
        "Eq. 17 as printed is twice the damping."
    ),
}


def run(context: Context, snrs=(100, 20), seeds: int = 5) -> Result:
    """Identify working condition 2; parameters as `working_condition` takes them."""
    return working_condition(context, 2, "figure_03", WORDS, snrs, seeds)
