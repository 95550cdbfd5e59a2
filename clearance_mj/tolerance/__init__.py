"""Rattle over tolerances and under random excitation: impacts per second, and peaks over an hour with intervals."""

from . import peaks
from .extremes import Largest
from .impacts import ImpactRate
from .peaks import HourPeaks, peaks_over_an_hour
from .random_production import DesignPeaks, LevelPeaks, peaks_of_designs, peaks_over_production

__all__ = [
    "DesignPeaks", "HourPeaks", "ImpactRate", "Largest", "LevelPeaks", "peaks", "peaks_of_designs",
    "peaks_over_an_hour", "peaks_over_production",
]  # fmt: skip
