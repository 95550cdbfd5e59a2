"""The virtual test rig: its own finite-element shaft, bushing physics, integrator and data acquisition."""

from .bench import simulate_rig
from .records import generate
from .rigs import RIGS, BoucWen, Iwan, LuGre, Truth

__all__ = ["RIGS", "BoucWen", "Iwan", "LuGre", "Truth", "generate", "simulate_rig"]
