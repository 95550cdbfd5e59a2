"""The virtual test rig: its own finite-element shaft, bushing physics, integrator and data acquisition."""

from .bench import simulate_rig
from .others import RIGS
from .records import generate
from .truth import BoucWen, Iwan, LuGre, Truth

__all__ = ["RIGS", "BoucWen", "Iwan", "LuGre", "Truth", "generate", "simulate_rig"]
