"""Shafts that turn: whirl, Campbell diagrams, thresholds of stability, unbalance."""

from .diagram import Campbell, campbell
from .turning import TurningShaft, turning_shaft

__all__ = ["Campbell", "TurningShaft", "campbell", "turning_shaft"]
