"""The modes of the records of a level: those that are compared, and why others are not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from ..signals.compared_modes import common_modes
from ..signals.ema import Modes
from ..signals.frf import FRF

__all__ = ["LevelModes"]


@dataclass(frozen=True, eq=False)
class LevelModes:
    """Modes that all records of a level show well, in one order."""

    of_record: dict[str, Modes]
    """by the record's name, as it shows them"""
    left_out: tuple[str, ...]
    """which modes are not compared and why, in words"""

    @classmethod
    def of(cls, names: Sequence[str], frfs: Sequence[FRF], n_modes: int) -> Self:
        """Find them.

        Parameters
        ----------
        names : sequence of str
            Names of the records.
        frfs : sequence of FRF
            Measured FRFs of each.
        n_modes : int
            Largest number of modes of each.
        """
        modes, left_out = common_modes(frfs, names, n_modes)
        return cls(dict(zip(names, modes)), tuple(left_out))
