"""Identification of the clearance from test records."""

from .hysteresis import bouc_wen
from .laws import law
from .oscillator import sdof
from .wavelet import ridge, ridges

__all__ = ["bouc_wen", "law", "ridge", "ridges", "sdof"]
