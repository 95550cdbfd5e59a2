"""Identification of the clearance from test records."""

from .hysteresis import bouc_wen
from .laws import law

__all__ = ["bouc_wen", "law"]
