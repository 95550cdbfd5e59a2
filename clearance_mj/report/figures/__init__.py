"""The figures of a study. Engines beside the main one are drawn for the best law only, or curves hide each other."""

from ..style import Drawing
from .correlation_figures import correlation, csac_sensors, csf_sensors
from .frf_figures import frf_bushings, frf_others, study_waterfall
from .over_level import agreement, contact, modes
from .rig_figure import rig_drawing
from .uncertainty import band_drawing, study_bands

__all__ = [
    "Drawing", "agreement", "band_drawing", "contact", "correlation", "csac_sensors", "csf_sensors", "frf_bushings",
    "frf_others", "modes", "rig_drawing", "study_bands", "study_waterfall",
]  # fmt: skip
