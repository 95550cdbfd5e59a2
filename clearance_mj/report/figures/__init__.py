"""Figures of a study. Other engines than the main one are drawn for the best law only, or curves hide each other."""

from ..style import Drawing
from .correlation_figures import correlation, csac_sensors, csf_sensors
from .direction_figures import directional, frf_matrix
from .frf_figures import frf_bushings, frf_others, study_waterfall
from .over_level import agreement, contact, modes
from .rig_figure import rig_drawing
from .turning_figures import cascades, orbits_of_bushing, run_ups_of_bushing
from .uncertainty import band_drawing, study_bands

__all__ = [
    "Drawing", "agreement", "band_drawing", "cascades", "contact", "correlation", "csac_sensors", "csf_sensors",
    "directional", "frf_bushings", "frf_matrix", "frf_others", "modes", "orbits_of_bushing", "rig_drawing",
    "run_ups_of_bushing", "study_bands", "study_waterfall",
]  # fmt: skip
