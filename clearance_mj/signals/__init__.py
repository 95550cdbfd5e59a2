"""Signals of tests and simulations, and their analysis: excitations, responses, FRFs, modes, correlation.

One order of axes everywhere, that of python-control: outputs, then inputs, then frequency or time last. A response has
``acceleration`` (n_sensors, n_t), ``displacement`` and forces (n_bushings, n_t) over ``time`` (n_t,); an FRF has
``value`` (n_outputs, n_inputs, n_f) over ``frequency`` (n_f,). Mode shapes are columns, (n_dof, n_modes). Arrays of
these types are read-only.
"""

from . import excitation
from .alignment import Alignment, accelerance, align, convert_quantity
from .comparison import Comparison, compare
from .correlation import csac, csf, frac, mac, mre, relative_error, rmse_db
from .directional import DirectionalFRF, directional_frfs
from .ema import Modes, extract_modes
from .excitation import Excitation
from .frf import FRF, estimate_frf, estimate_frf_blocks
from .frf_error import random_db, random_error
from .full_spectra import FullSpectrum, SpeedCascade, full_spectrum, speed_cascade
from .hammer import HammerTest, hammer_frf
from .nonlinear import BestLinear, best_linear, stepped_harmonics
from .orbits import FilteredOrbit, Orbits, orbits_by_turn, shaft_angle
from .psd import PSD
from .quantities import with_quantity
from .references import join_references
from .response import Response
from .road import QuarterCar, Road, road_psd
from .spectra import Spectra
from .spectra_frf import frf_from_spectra
from .stepped_sines import SineSteps, sine_steps

__all__ = [
    "FRF", "PSD", "Alignment", "BestLinear", "Comparison", "DirectionalFRF", "Excitation", "FilteredOrbit",
    "FullSpectrum", "HammerTest", "Modes", "Orbits", "QuarterCar", "Response", "Road", "SineSteps", "Spectra",
    "SpeedCascade", "accelerance", "align", "best_linear", "compare", "convert_quantity", "csac", "csf",
    "directional_frfs", "estimate_frf", "estimate_frf_blocks", "excitation", "extract_modes", "frac",
    "frf_from_spectra", "full_spectrum", "hammer_frf", "join_references", "mac", "mre", "orbits_by_turn", "random_db",
    "random_error", "relative_error", "rmse_db", "road_psd", "shaft_angle", "sine_steps", "speed_cascade",
    "stepped_harmonics", "with_quantity",
]  # fmt: skip
