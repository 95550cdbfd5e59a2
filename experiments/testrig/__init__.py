"""The virtual test rig: its own finite-element shaft, bushing physics, integrator and data acquisition."""

from experiments.testrig.bench import simulate_rig
from experiments.testrig.records import generate
from experiments.testrig.rigs import RIGS, BoucWen, Iwan, LuGre, Truth

__all__ = ["RIGS", "BoucWen", "Iwan", "LuGre", "Truth", "generate", "simulate_rig"]
