"""Periodic vibrations without marching in time: harmonic balance, continuation, stability."""

from .backbones import Backbone, follow_backbone
from .branch import Branch, SpecialPoint
from .first_contact import find_first_contact
from .forced import follow_response, follow_response_over, follow_response_over_level, follow_unbalance
from .impact_maps import ImpactMap, map_impacts
from .isolated import Isolas, find_isolas
from .rattle_maps import Jump, RattleMap, map_rattle
from .subharmonic import follow_doubled
from .two_parameter import Curve, follow_folds, follow_special, follow_whirl_onset
from .whirling import WhirlOnset, find_whirl_onset, follow_whirl

__all__ = [
    "Backbone", "Branch", "Curve", "ImpactMap", "Isolas", "Jump", "RattleMap", "SpecialPoint", "WhirlOnset",
    "find_first_contact", "find_isolas", "find_whirl_onset", "follow_backbone", "follow_doubled", "follow_folds",
    "follow_response", "follow_response_over", "follow_response_over_level", "follow_special", "follow_unbalance",
    "follow_whirl", "follow_whirl_onset", "map_impacts", "map_rattle",
]  # fmt: skip
