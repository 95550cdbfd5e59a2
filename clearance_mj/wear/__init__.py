"""Wear: how the gaps of a machine grow while it runs, how long it lasts, and what its history says of that."""

from .harmonic import Sine
from .life import Jump, Life, gap_limits, predict_life
from .marched import Marched
from .operation import Operation, Vibration

__all__ = ["Jump", "Life", "Marched", "Operation", "Sine", "Vibration", "gap_limits", "predict_life"]
