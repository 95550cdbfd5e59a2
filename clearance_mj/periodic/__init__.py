"""Periodic vibrations without marching in time: harmonic balance, continuation, stability."""

from .backbone import Backbone, backbone
from .branch import Branch, SpecialPoint
from .forced import response
from .rattle_map import Jump, RattleMap, rattle_map

__all__ = [
    "Backbone", "Branch", "Jump", "RattleMap", "SpecialPoint", "backbone", "rattle_map", "response",
]  # fmt: skip
