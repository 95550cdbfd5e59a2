"""Identification of the clearance from test records."""

from . import methods
from .band_brake import band_brake, travel_since_reversal
from .decay import decay
from .diagnosis import Diagnosis, diagnose
from .hysteresis import bouc_wen
from .jointed_mode import ForcedCurve, fit_jointed_mode
from .jointed_structure import JointedStructure, fit_jointed_structure
from .methods.bench import BenchFit, FamilyFit, fit_bench
from .methods.nominal import nominal
from .mujoco_model import ModelFit, ModelRecord, Prediction, model
from .oscillator import sdof
from .priors import priors
from .registry import METHODS, Identified, get_method, law, register
from .twin import Alarm, Twin, twin
from .updating import RigUpdate, update_rig
from .wavelet import ridge, ridges

__all__ = [
    "METHODS",
    "Alarm",
    "BenchFit",
    "Diagnosis",
    "FamilyFit",
    "ForcedCurve",
    "Identified",
    "JointedStructure",
    "ModelFit",
    "ModelRecord",
    "Prediction",
    "RigUpdate",
    "Twin",
    "band_brake",
    "bouc_wen",
    "decay",
    "diagnose",
    "fit_bench",
    "fit_jointed_mode",
    "fit_jointed_structure",
    "get_method",
    "law",
    "methods",
    "model",
    "nominal",
    "priors",
    "register",
    "ridge",
    "ridges",
    "sdof",
    "travel_since_reversal",
    "twin",
    "update_rig",
]
