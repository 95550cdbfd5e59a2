"""Periodic vibrations without marching in time: harmonic balance, continuation, stability."""

from .branch import Branch, SpecialPoint
from .forced import response

__all__ = ["Branch", "SpecialPoint", "response"]
