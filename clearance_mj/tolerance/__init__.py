"""Productions: how many of them rattle, which tolerance to tighten, what random excitation does over hours."""

from . import peaks
from .designs import Designs
from .extremes import Largest
from .impacts import ImpactRate
from .limits import Limit
from .peaks import HourPeaks, peaks_over_an_hour
from .random_designs import DesignPeaks, LevelPeaks, peaks_of_designs, peaks_over_production, random_production
from .scatter import Scatter, draw_designs
from .scattered import Correlation, Scattered
from .sensitivities import rattle_sensitivity
from .shares import Production, production, share_interval
from .tightening import Tightening, random_tightening, tighten

__all__ = [
    "Correlation", "DesignPeaks", "Designs", "HourPeaks", "ImpactRate", "Largest", "LevelPeaks", "Limit", "Production",
    "Scatter", "Scattered", "Tightening", "draw_designs", "peaks", "peaks_of_designs", "peaks_over_an_hour",
    "peaks_over_production", "production", "random_production", "random_tightening",
    "rattle_sensitivity", "share_interval", "tighten",
]  # fmt: skip
