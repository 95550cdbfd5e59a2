"""Shafts that turn: whirl, Campbell diagrams, thresholds of stability, unbalance, rub in a round clearance."""

from .diagram import Campbell, campbell
from .rub import DryWhirl, SynchronousRub, dry_whirls, rolling_whirls, synchronous_rub
from .spatial import SpatialModel, spatial_model
from .turning import TurningShaft, turning_shaft

__all__ = [
    "Campbell",
    "DryWhirl",
    "SpatialModel",
    "SynchronousRub",
    "TurningShaft",
    "campbell",
    "dry_whirls",
    "rolling_whirls",
    "spatial_model",
    "synchronous_rub",
    "turning_shaft",
]
