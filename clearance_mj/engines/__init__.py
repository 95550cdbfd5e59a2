"""Engines: MuJoCo flexible links, compiled modes, MuJoCo modes."""

from .base import Engine, get_engine, simulate, simulate_batch
from .links import Links
from .modal import Modal
from .softness import solref_solimp

__all__ = ["Engine", "Links", "Modal", "get_engine", "simulate", "simulate_batch", "solref_solimp"]
