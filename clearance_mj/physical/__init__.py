"""Contacts, limits and backlash of any MuJoCo model with stiffness and damping in physical units.

A specification (``mujoco.MjSpec``) gets softness and clearances by one call each, `compile` makes the model of it,
`check` lists what in a model changes them. This needs MuJoCo and NumPy alone; laws that change at every step and
friction (`Softener`) need numba as well.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .bristles import friction, joint_friction, tendon_friction
from .bushings import add_bushing
from .checks import ModelWarning, check, compile
from .clearances import add_annular_clearance, add_backlash
from .drives import DriveState, add_drive, drive_state
from .elements import apply, inverse_inertia
from .inertia import set_inverse_inertia
from .limits import contact, joint_limit, tendon_limit
from .packages import naming_package
from .robots import robot
from .rotor_sensors import add_rotor_sensor
from .softness import IMPEDANCE, INVERSE_INERTIA, SOLREF_PER_UNIT, solref_solimp, stiffness_damping
from .step import largest_step
from .transmission import DriveFriction, Efficiency

if TYPE_CHECKING:
    from .softener import Softener

__all__ = [
    "IMPEDANCE", "INVERSE_INERTIA", "SOLREF_PER_UNIT", "DriveFriction", "DriveState", "Efficiency", "ModelWarning",
    "Softener", "add_annular_clearance", "add_backlash", "add_bushing", "add_drive", "add_rotor_sensor", "apply",
    "check", "compile", "contact", "drive_state", "friction", "inverse_inertia", "joint_friction", "joint_limit",
    "largest_step", "robot", "set_inverse_inertia", "solref_solimp", "stiffness_damping", "tendon_friction",
    "tendon_limit",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import `Softener` and `identification`, which need more packages, when they are used."""
    if name not in ("Softener", "identification"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with naming_package("Softener and identification"):
        module = import_module(f".{name.lower()}", __name__)
    return getattr(module, name, module)
