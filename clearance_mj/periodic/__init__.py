"""Periodic vibrations without marching in time: harmonic balance, continuation, stability."""

from .backbones import Backbone, backbone
from .branch import Branch, SpecialPoint
from .forced import response
from .isolated import Isolas, isolas
from .over_level import response_over_level
from .rattle_maps import Jump, RattleMap, rattle_map
from .subharmonic import doubled
from .two_parameter import Curve, first_contact, fold_curve

__all__ = [
    "Backbone", "Branch", "Curve", "Isolas", "Jump", "RattleMap", "SpecialPoint", "backbone", "doubled",
    "first_contact", "fold_curve", "isolas", "rattle_map", "response", "response_over_level",
]  # fmt: skip
