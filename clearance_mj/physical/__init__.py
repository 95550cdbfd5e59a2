"""Contacts, limits and backlash of any MuJoCo model with stiffness and damping in physical units.

MuJoCo is the only thing that this part needs, and NumPy: a specification (``mujoco.MjSpec``) gets softness and
clearances by one call each, `compile` makes the model of it, `check` says what in a model spoils them.
"""

from .checks import check, compile
from .clearances import add_annular_clearance, add_backlash
from .elements import apply, inverse_inertia
from .inertia import set_inverse_inertia
from .limits import contact, joint_limit, tendon_limit
from .softness import IMPEDANCE, INVERSE_INERTIA, SOLREF_PER_UNIT, solref_solimp, stiffness_damping
from .step import largest_step

__all__ = [
    "IMPEDANCE",
    "INVERSE_INERTIA",
    "SOLREF_PER_UNIT",
    "add_annular_clearance",
    "add_backlash",
    "apply",
    "check",
    "compile",
    "contact",
    "inverse_inertia",
    "joint_limit",
    "largest_step",
    "set_inverse_inertia",
    "solref_solimp",
    "stiffness_damping",
    "tendon_limit",
]
