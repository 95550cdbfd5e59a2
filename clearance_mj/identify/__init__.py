"""Identification of the clearance from test records."""

from .laws import law

__all__ = ["law"]
