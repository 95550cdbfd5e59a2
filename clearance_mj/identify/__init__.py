"""Identification of the clearance from test records."""

from ..drives import DriveFit, MotorSideFit, fit_drive, fit_motor_side
from ..joints.hysteresis import bouc_wen
from ..joints.jointed_mode import ForcedCurve, fit_jointed_mode
from ..joints.jointed_structure import JointedStructure, fit_jointed_structure
from ..signals.free_decay import decay
from ..signals.wavelet import ridge, ridges
from . import methods
from .channels.mapping import map_channels
from .follow.alarms import Alarm
from .follow.bench_twin import twin
from .follow.history import Twin
from .in_operation.found import OrbitFit
from .in_operation.orbits import orbits
from .in_operation.twin import follow_orbits
from .laws.comparison import FamilyFit
from .laws.oscillator import sdof
from .methods.bench import BenchFit, fit_bench
from .registry import METHODS, Identified, fitted_model, get_method, identify, law, register, require
from .structure.examination import update_rig
from .structure.faults.diagnosis import Diagnosis, diagnose
from .structure.priors import priors
from .structure.rig_update import RigUpdate

__all__ = [
    "METHODS", "Alarm", "BenchFit", "Diagnosis", "DriveFit", "FamilyFit", "ForcedCurve", "Identified",
    "JointedStructure", "MotorSideFit", "OrbitFit", "RigUpdate", "Twin", "bouc_wen",
    "decay", "diagnose", "fit_bench", "fit_drive", "fit_jointed_mode", "fit_jointed_structure", "fit_motor_side",
    "fitted_model", "follow_orbits", "get_method", "identify", "law", "map_channels", "methods", "orbits", "priors",
    "register", "require", "ridge", "ridges", "sdof", "twin", "update_rig",
]  # fmt: skip
