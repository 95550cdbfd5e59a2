"""Productions: how many of them rattle, which tolerance to tighten, what random excitation does over hours."""

from .designs import Designs, draw_posterior
from .limits import Limit
from .production import Production, production, share_interval
from .scatter import Correlation, Scatter, Scattered

__all__ = [
    "Correlation", "Designs", "Limit", "Production", "Scatter", "Scattered", "draw_posterior", "production",
    "share_interval",
]  # fmt: skip
