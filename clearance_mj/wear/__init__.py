"""Wear: growth of a machine's gaps in operation, its life, and its remaining life from a history of gaps."""

from .harmonic import Sine
from .history import GapHistory
from .life import Life, WearJump, gap_limits, predict_life
from .lives import Lives, predict_lives
from .marched import Marched
from .operation import Operation, Vibration
from .remaining import Remaining, predict_remaining

__all__ = [
    "GapHistory", "Life", "Lives", "Marched", "Operation", "Remaining", "Sine", "Vibration", "WearJump", "gap_limits",
    "predict_life", "predict_lives", "predict_remaining",
]  # fmt: skip
