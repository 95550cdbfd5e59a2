"""Shafts that turn: whirl, Campbell diagrams, thresholds of stability, unbalance, rub in a round clearance."""

from .diagram import Campbell, campbell
from .rub import DryWhirl, SynchronousRub, dry_whirls, rolling_whirls, synchronous_rub
from .turning import TurningShaft, turning_shaft

__all__ = [
    "Campbell",
    "DryWhirl",
    "SynchronousRub",
    "TurningShaft",
    "campbell",
    "dry_whirls",
    "rolling_whirls",
    "synchronous_rub",
    "turning_shaft",
]
