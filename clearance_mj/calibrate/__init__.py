"""Calibration: the rig's dimensions, stiffnesses and masses from measured frequencies, shapes or FRFs.

The rig is taken in its linear state within the gap. Free parameters vary by their logarithms within bounds; the
residuals, in standard deviations of the data, are minimised from several starts (`clearance_mj.estimate.solve`). The
singular values of the Jacobian say what the data do not identify: 1/s is the standard deviation of a combination of
logarithms, v its exponents. Several rigs may fit equally well; every start's solution is kept.

Friswell and Mottershead, Finite Element Model Updating in Structural Dynamics, 1995, chapters 5 and 8.
"""

from .fit import Calibration, StartSolution, calibrate, profile
from .free import value_of
from .targets import FRFTarget, ModalTarget, modal_target, read_frequencies, read_frf

__all__ = [
    "Calibration", "FRFTarget", "ModalTarget", "StartSolution", "calibrate", "modal_target", "profile",
    "read_frequencies", "read_frf", "value_of",
]  # fmt: skip
