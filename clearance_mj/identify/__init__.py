"""Identification of the clearance from test records."""

from typing import TYPE_CHECKING

from ..core.deprecation import old_names
from ..signals.free_decay import decay
from ..signals.wavelet import ridge, ridges
from . import methods
from .channels.mapping import map_channels
from .follow.alarms import Alarm
from .follow.bench_twin import twin
from .follow.history import Twin
from .in_operation.orbit_fit import OrbitFit
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
    "METHODS", "Alarm", "BenchFit", "Diagnosis", "FamilyFit", "Identified", "OrbitFit", "RigUpdate", "Twin",
    "decay", "diagnose", "fit_bench", "fitted_model", "follow_orbits", "get_method", "identify", "law",
    "map_channels", "methods", "orbits", "priors", "register", "require", "ridge", "ridges", "sdof", "twin",
    "update_rig",
]  # fmt: skip

if not TYPE_CHECKING:
    _DRIVES = ("DriveFit", "MotorSideFit", "fit_drive", "fit_motor_side")
    __getattr__ = old_names(__name__, {name: f"clearance_mj.drives.{name}" for name in _DRIVES})
