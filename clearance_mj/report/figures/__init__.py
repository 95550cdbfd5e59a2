"""The figures of a study. Engines beside the main one are drawn for the best law only, or curves hide each other."""

from ..style import Drawing
from ._correlation import correlation, csac_sensors, csf_sensors
from ._frf import frf_bushings, frf_others, study_waterfall
from ._over_level import agreement, contact, modes
from ._rig import rig_drawing
from ._uncertainty import band_drawing, study_bands

__all__ = [
    "Drawing", "agreement", "band_drawing", "contact", "correlation", "csac_sensors", "csf_sensors", "frf_bushings",
    "frf_others", "modes", "rig_drawing", "study_bands", "study_waterfall",
]  # fmt: skip
