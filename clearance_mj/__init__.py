"""Predict how a shaft that runs through bushings with clearance vibrates.

One way through: a `Rig` and a `Dataset` of records, `identify.identify` for a `Model`, `simulate` with an engine,
`estimate_frf`, and `compare` with the test. `physical` is for any MuJoCo model.

Names are imported when they are used, so that a part such as `physical` needs no library that only others need.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .core import compile_cache, mujoco_version
from .version import __version__

mujoco_version.check()
compile_cache.choose()

if TYPE_CHECKING:  # the same as below, for editors and type checkers
    from . import beam, identify, periodic, physical, sound, structure
    from .clearance import AmplitudeLaw, ConstantLaw, ContactLaw, Law, TimeLaw, load_law
    from .core.errors import (
        ClearanceError,
        ExcitationError,
        LawError,
        ModelError,
        RecordError,
        RigError,
        SimulationError,
    )
    from .engines import Links, Modal, simulate, simulate_batch, simulate_blocks, simulate_each
    from .engines.energy import EnergyBalance, energy_balance
    from .identify.channels.mapping import map_channels
    from .io.channel_map import ChannelMap
    from .io.channels import Channel
    from .io.dataset import Dataset, Record, write_dataset
    from .io.formats import read, write
    from .io.uff import read_uff, write_uff
    from .linear import LinearModel, linear_model
    from .model import Model
    from .physical import solref_solimp
    from .rig import Beam, Bushing, Contact, Grease, Plate, PointMass, Rig, Sensor, Shaker
    from .signals import excitation
    from .signals.comparison import Comparison, compare, compare_modes
    from .signals.correlation import csac, csf, frac, mac, mre, relative_error, rmse_db
    from .signals.ema import extract_modes
    from .signals.excitation import Excitation
    from .signals.frf import FRF, estimate_frf, estimate_frf_blocks
    from .signals.psd import PSD
    from .signals.response import Response
    from .signals.spectra import Spectra
    from .structure.geometry import Geometry

__all__ = [
    "FRF", "PSD", "AmplitudeLaw", "Beam", "Bushing", "Channel", "ChannelMap", "ClearanceError", "Comparison",
    "ConstantLaw", "Contact", "ContactLaw", "Dataset", "EnergyBalance", "Excitation", "ExcitationError", "Geometry",
    "Grease", "Law", "LawError", "LinearModel", "Links", "Modal", "Model", "ModelError", "Plate",
    "PointMass", "Record", "RecordError", "Response", "Rig", "RigError", "Sensor", "Shaker", "SimulationError",
    "Spectra", "TimeLaw", "__version__", "beam", "compare", "compare_modes", "csac", "csf", "energy_balance",
    "estimate_frf", "estimate_frf_blocks", "excitation", "extract_modes", "frac", "identify", "linear_model",
    "load_law", "mac", "map_channels", "mre", "periodic", "physical", "read", "read_uff", "relative_error", "rmse_db",
    "simulate", "simulate_batch", "simulate_blocks", "simulate_each", "solref_solimp", "sound", "structure", "write",
    "write_dataset", "write_uff",
]  # fmt: skip

_NAMES = {
    "clearance": "AmplitudeLaw ConstantLaw ContactLaw Law TimeLaw load_law",
    "engines": "Links Modal simulate simulate_batch simulate_blocks simulate_each",
    "identify.channels.mapping": "map_channels",
    "io.channel_map": "ChannelMap",
    "io.channels": "Channel",
    "engines.energy": "EnergyBalance energy_balance",
    "core.errors": "ClearanceError ExcitationError LawError ModelError RecordError RigError SimulationError",
    "io.dataset": "Dataset Record write_dataset",
    "io.formats": "read write",
    "io.uff": "read_uff write_uff",
    "linear": "LinearModel linear_model",
    "model": "Model",
    "physical": "solref_solimp",
    "rig": "Beam Bushing Contact Grease Plate PointMass Rig Sensor Shaker",
    "signals.comparison": "Comparison compare compare_modes",
    "signals.correlation": "csac csf frac mac mre relative_error rmse_db",
    "signals.ema": "extract_modes",
    "signals.excitation": "Excitation",
    "signals.frf": "FRF estimate_frf estimate_frf_blocks",
    "signals.psd": "PSD",
    "signals.response": "Response",
    "signals.spectra": "Spectra",
    "structure.geometry": "Geometry",
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Import a public name, or a part of the package."""
    if name in _HOMES:
        value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    else:
        home = f"{__name__}.{'signals.excitation' if name == 'excitation' else name}"
        try:
            value = import_module(home)
        except ModuleNotFoundError as error:
            if error.name != home:
                raise
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
