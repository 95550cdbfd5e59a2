"""Identification of the clearance from test records."""

from . import methods
from .hysteresis import bouc_wen
from .methods.nominal import nominal
from .oscillator import sdof
from .registry import METHODS, Identified, get_method, law, register
from .wavelet import ridge, ridges

__all__ = [
    "METHODS",
    "Identified",
    "bouc_wen",
    "get_method",
    "law",
    "methods",
    "nominal",
    "register",
    "ridge",
    "ridges",
    "sdof",
]
