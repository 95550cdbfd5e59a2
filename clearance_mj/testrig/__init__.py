"""The virtual test rig: its own finite-element shaft, bushing physics, integrator and data acquisition."""

from .bench import simulate_rig
from .table1 import Truth

__all__ = ["Truth", "simulate_rig"]
