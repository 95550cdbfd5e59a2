"""The clearance element: gap, contact, grease, and the laws that set their parameters."""

from .contact import Flores, HuntCrossley, KelvinVoigt, LankaraniNikravesh
from .gap import describing_function, gap
from .law import AmplitudeLaw, ConstantLaw, ContactLaw, Law, TimeLaw, load_law

__all__ = [
    "AmplitudeLaw",
    "ConstantLaw",
    "ContactLaw",
    "Flores",
    "HuntCrossley",
    "KelvinVoigt",
    "LankaraniNikravesh",
    "Law",
    "TimeLaw",
    "describing_function",
    "gap",
    "load_law",
]
