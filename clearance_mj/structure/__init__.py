"""Linear structures: shafts, matrices and modes, reduced to modes and static shapes at the rig's points."""

from typing import Annotated, TypeAlias

from ..core.validation import OneOf
from .base import Assembly, Point, Structure, register
from .beam import Beam, Clamp
from .gears import Gears, Inertia
from .matrices import Matrices
from .measured import MeasuredModes, modes_from_frf
from .mjcf import Mjcf
from .modes import ModalStructure
from .shaft import Disc, Material, Section, Shaft, Support
from .shafts import Shafts, Spring
from .truncation import Truncation, find_truncation

__all__ = [
    "AnyStructure", "Assembly", "Beam", "Clamp", "Disc", "Gears", "Inertia", "Material", "Matrices", "MeasuredModes",
    "Mjcf", "ModalStructure", "Point", "Section", "Shaft", "Shafts", "Spring", "Structure", "Support", "Truncation",
    "find_truncation", "modes_from_frf", "register",
]  # fmt: skip

AnyStructure: TypeAlias = Annotated[Structure, OneOf(Structure.known)]
"""Type of a rig file's [structure], by its ``kind``: every structure that `register` knows"""
