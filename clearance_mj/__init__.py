"""Predict how a shaft that runs through bushings with clearance vibrates.

One way through: a `Rig` and a `Dataset` of records, `identify.law` for the clearance's parameters, `simulate` with an
engine, `estimate_frf`, and `compare` with the test.
"""

from . import beam, excitation, identify
from ._version import __version__
from .beam import ModalModel
from .clearance import AmplitudeLaw, ConstantLaw, ContactLaw, Law, TimeLaw, load_law
from .correlation import Comparison, compare, csac, csf, frac, mac, mre, relative_error, rmse_db
from .engines import Links, Modal, ModalMujoco, simulate, simulate_batch, simulate_blocks, simulate_each, solref_solimp
from .errors import ClearanceError, ExcitationError, LawError, RecordError, RigError, SimulationError
from .excitation import Excitation
from .frf import FRF, estimate_frf, estimate_frf_blocks
from .io.dataset import Dataset, Record, write_dataset
from .io.uff import read_uff, write_uff
from .ledger import keep_ledger
from .modes import extract_modes
from .response import Response
from .rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker

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
    "estimate_frf",
    "estimate_frf_blocks",
    "excitation",
    "extract_modes",
    "frac",
    "identify",
    "keep_ledger",
    "load_law",
    "mac",
    "mre",
    "read_uff",
    "relative_error",
    "rmse_db",
    "simulate",
    "simulate_batch",
    "simulate_blocks",
    "simulate_each",
    "solref_solimp",
    "write_dataset",
    "write_uff",
]
