"""The clearance element: gap, contact, grease, and the laws that set their parameters."""

from . import contacts, greases, walls
from .contact import ContactModel
from .contacts.cubic import Cubic
from .contacts.hertz import Flores, HuntCrossley, LankaraniNikravesh
from .contacts.hunt_crossley_1975 import HuntCrossley1975
from .contacts.impact import AdamsImpact
from .contacts.kelvin_voigt import KelvinVoigt
from .grease import GreaseModel
from .greases.finite_bearing import FiniteBearing
from .greases.maxwell_slip import MaxwellSlip
from .greases.short_bearing import ShortBearing
from .harmonic import harmonic_stiffness, periodic_amplitudes, slip_stiffness
from .law import AmplitudeLaw, ConstantLaw, ContactLaw, Law, TimeLaw
from .law_files import load_law
from .mesh import mesh_law
from .modelled import nominal_law
from .walls.slot import describing_function, gap

__all__ = [
    "AdamsImpact", "AmplitudeLaw", "ConstantLaw", "ContactLaw", "ContactModel", "Cubic", "FiniteBearing", "Flores",
    "GreaseModel", "HuntCrossley", "HuntCrossley1975", "KelvinVoigt", "LankaraniNikravesh", "Law", "MaxwellSlip",
    "ShortBearing", "TimeLaw", "contacts", "describing_function", "gap", "greases", "harmonic_stiffness", "load_law",
    "mesh_law", "nominal_law", "periodic_amplitudes", "slip_stiffness", "walls",
]  # fmt: skip
