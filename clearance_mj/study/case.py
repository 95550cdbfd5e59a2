"""A case of a study: one law on one engine against one validation record."""

from __future__ import annotations

from dataclasses import dataclass

from ..io.dataset import Record
from ..signals.comparison import Comparison
from ..signals.frf import FRF

__all__ = ["Case"]


@dataclass(frozen=True, eq=False)
class Case:
    """One law on one engine against one validation record."""

    law: str
    """name"""
    engine: str
    """name"""
    record: Record
    """validation record whose excitation is simulated"""
    frf: FRF
    """the model's"""
    comparison: Comparison
    """of the test's FRFs with the model's"""
    statistics: dict
    """as `contact_statistics`"""
