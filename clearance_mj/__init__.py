"""Predict how a shaft that runs through bushings with clearance vibrates.

One way through: a `Rig` and a `Dataset` of records, `identify.law` for the clearance's parameters, `simulate` with an
engine, `estimate_frf`, and `compare` with the test.
"""

from . import beam, identify, periodic, structure
from ._version import __version__
from .beam import ModalModel
from .clearance import AmplitudeLaw, ConstantLaw, ContactLaw, Law, TimeLaw, load_law, load_rig_and_law
from .engines import Links, Modal, ModalMujoco, simulate, simulate_batch, simulate_blocks, simulate_each, solref_solimp
from .engines.energy import EnergyBalance, energy_balance
from .errors import ClearanceError, ExcitationError, LawError, RecordError, RigError, SimulationError
from .io.dataset import Dataset, Record, write_dataset
from .io.formats import read, write
from .io.uff import read_uff, write_uff
from .rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from .signals import excitation
from .signals.comparison import Comparison, compare
from .signals.correlation import csac, csf, frac, mac, mre, relative_error, rmse_db
from .signals.ema import extract_modes
from .signals.excitation import Excitation
from .signals.frf import FRF, estimate_frf, estimate_frf_blocks
from .signals.response import Response

__all__ = [
    "FRF",
    "AmplitudeLaw",
    "Beam",
    "Bushing",
    "ClearanceError",
    "Comparison",
    "ConstantLaw",
    "Contact",
    "ContactLaw",
    "Dataset",
    "EnergyBalance",
    "Excitation",
    "ExcitationError",
    "Grease",
    "Law",
    "LawError",
    "Links",
    "Modal",
    "ModalModel",
    "ModalMujoco",
    "PointMass",
    "Record",
    "RecordError",
    "Response",
    "Rig",
    "RigError",
    "Sensor",
    "Shaker",
    "SimulationError",
    "TimeLaw",
    "__version__",
    "beam",
    "compare",
    "csac",
    "csf",
    "energy_balance",
    "estimate_frf",
    "estimate_frf_blocks",
    "excitation",
    "extract_modes",
    "frac",
    "identify",
    "load_law",
    "load_rig_and_law",
    "mac",
    "mre",
    "periodic",
    "read",
    "read_uff",
    "relative_error",
    "rmse_db",
    "simulate",
    "simulate_batch",
    "simulate_blocks",
    "simulate_each",
    "solref_solimp",
    "structure",
    "write",
    "write_dataset",
    "write_uff",
]
