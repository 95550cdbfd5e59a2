"""Periodic vibrations without marching in time: harmonic balance, continuation, stability."""

from .branch import Branch, SpecialPoint
from .forced import response
from .rattle_map import Jump, RattleMap, rattle_map

__all__ = ["Branch", "Jump", "RattleMap", "SpecialPoint", "rattle_map", "response"]
