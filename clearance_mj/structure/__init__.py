"""What is linear in a rig: shafts, matrices, modes, reduced to modes and static shapes at the rig's points."""

from typing import Annotated, TypeAlias

from ..validation import OneOf
from .base import LinearModel, Point, Structure, register
from .beam import Beam, Clamp
from .matrices import Matrices
from .mjcf import Mjcf
from .modes import ModalStructure
from .shaft import Disc, Material, Section, Shaft, Support
from .shafts import Shafts, Spring

__all__ = [
    "AnyStructure",
    "Beam",
    "Clamp",
    "Disc",
    "LinearModel",
    "Material",
    "Matrices",
    "Mjcf",
    "ModalStructure",
    "Point",
    "Section",
    "Shaft",
    "Shafts",
    "Spring",
    "Structure",
    "Support",
    "register",
]

AnyStructure: TypeAlias = Annotated[Structure, OneOf(Structure.known)]
"""What a rig file's [structure] can be, by its ``kind``: every structure that `register` knows"""
