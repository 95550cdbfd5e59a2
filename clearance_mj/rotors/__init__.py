"""Rotordynamics: whirl, Campbell diagrams, thresholds of stability, unbalance, rub in a round clearance, orbits."""

from .api_617 import RunningClearance, UnbalanceResponse, running_clearance, unbalance_response
from .diagram import Campbell, campbell
from .rub import DryWhirl, SynchronousRub, dry_whirls, rolling_whirls, synchronous_rub
from .turning import TurningShaft, turning_shaft
from .whirling import Whirl, clearance_places, require_round, whirl

__all__ = [
    "Campbell", "DryWhirl", "RunningClearance", "SynchronousRub", "TurningShaft", "UnbalanceResponse", "Whirl",
    "campbell", "clearance_places", "dry_whirls", "require_round", "rolling_whirls", "running_clearance",
    "synchronous_rub", "turning_shaft", "unbalance_response", "whirl",
]  # fmt: skip
