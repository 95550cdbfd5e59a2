"""Identification of the clearance from test records."""

from . import methods
from .follow.alarms import Alarm
from .follow.bench_twin import twin
from .follow.history import Twin
from .laws.comparison import FamilyFit
from .laws.hysteresis import bouc_wen
from .laws.jointed_mode import ForcedCurve, fit_jointed_mode
from .laws.jointed_structure import JointedStructure, fit_jointed_structure
from .methods.bench import BenchFit, fit_bench
from .methods.nominal import nominal
from .registry import METHODS, Identified, get_method, law, register
from .structure.faults.diagnosis import Diagnosis, diagnose
from .structure.priors import priors
from .structure.rig_update import RigUpdate
from .structure.updating import update_rig
from .wavelets.free_decay import decay
from .wavelets.oscillator import sdof
from .wavelets.wavelet import ridge, ridges

__all__ = [
    "METHODS",
    "Alarm",
    "BenchFit",
    "Diagnosis",
    "FamilyFit",
    "ForcedCurve",
    "Identified",
    "JointedStructure",
    "RigUpdate",
    "Twin",
    "bouc_wen",
    "decay",
    "diagnose",
    "fit_bench",
    "fit_jointed_mode",
    "fit_jointed_structure",
    "get_method",
    "law",
    "methods",
    "nominal",
    "priors",
    "register",
    "ridge",
    "ridges",
    "sdof",
    "twin",
    "update_rig",
]
