"""Productions: fractions that rattle, tolerances to tighten, peaks of hours under random excitation."""

from ..core.runner import Runner
from . import peaks
from .designs import Designs
from .extremes import Largest
from .impacts import ImpactRate
from .limits import Limit
from .peaks import HourPeaks, peaks_over_an_hour
from .random_designs import DesignPeaks, LevelPeaks, Noise, peaks_of_designs, peaks_over_production, random_production
from .scatter import Scatter, draw_designs
from .scattered import Correlation, Scattered
from .sensitivities import rattle_sensitivity
from .shares import Production, production
from .sines import Sines
from .tightening import Tightening, random_tightening, tighten

__all__ = [
    "Correlation", "DesignPeaks", "Designs", "HourPeaks", "ImpactRate", "Largest", "LevelPeaks", "Limit", "Noise",
    "Production", "Runner", "Scatter", "Scattered", "Sines", "Tightening", "draw_designs", "peaks", "peaks_of_designs",
    "peaks_over_an_hour", "peaks_over_production", "production", "random_production", "random_tightening",
    "rattle_sensitivity", "tighten",
]  # fmt: skip
