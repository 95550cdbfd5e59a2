"""Productions: how many of them rattle, which tolerance to tighten, what random excitation does over hours."""

from .designs import Designs, draw_posterior
from .limits import Limit
from .production import Production, production, share_interval
from .scatter import Correlation, Scatter, Scattered
from .sensitivities import rattle_sensitivity
from .tightening import Tightening, tighten

__all__ = [
    "Correlation", "Designs", "Limit", "Production", "Scatter", "Scattered", "Tightening", "draw_posterior",
    "production", "rattle_sensitivity", "share_interval", "tighten",
]  # fmt: skip
