"""The virtual test rig: its own finite-element shaft, bushing physics, integrator and data acquisition."""

from .bench import simulate_rig
from .records import generate
from .table1 import Truth

__all__ = ["Truth", "generate", "simulate_rig"]
