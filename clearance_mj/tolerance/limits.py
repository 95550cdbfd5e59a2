"""Limits of designs: a force, penetration, displacement or acceleration that must not be exceeded."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ..core.errors import ClearanceError
from ..core.units import si_value
from ..periodic.level_branches import LIMITED
from ..rig import Rig

__all__ = ["Limit"]

KINDS = {"contact_force": "force", "penetration": "displacement", "displacement": "displacement",
         "acceleration": "acceleration"}  # fmt: skip
"""Physical quantity of each limited one, for units"""
UNITS = {"force": "N", "displacement": "m", "acceleration": "m/s²"}
_TEXT = re.compile(r"\s*([a-z_]+)(?:@(\S+))?\s*(?:>|=|\s)\s*(\S.*?)\s*")


@dataclass(frozen=True)
class Limit:
    """Limit of a quantity: of its peak in a period or, for sensors and displacements, of its amplitude.

    Raises
    ------
    ClearanceError
        For an unknown quantity, or a value that is not > 0.
    """

    quantity: str
    """ "contact_force", "penetration", "displacement" (of the clearances) or "acceleration" """
    value: float
    """N, m or m/s²"""
    at: str | None = None
    """name of the clearance or sensor; None: the largest of all"""

    def __post_init__(self) -> None:
        ClearanceError.require_known("limit of", self.quantity, LIMITED)
        if not 0 < self.value < math.inf:
            raise ClearanceError(f"limit of {self.quantity} must be > 0, got {self.value!r}")

    @classmethod
    def parse(cls, text: str) -> Limit:
        """Return the limit of a text such as "contact_force > 20 N" or "acceleration@3:+Z > 5 g".

        Parameters
        ----------
        text : str
            Quantity, place (or nothing for the largest of all), and a value with its unit; SI without.
        """
        if not (match := _TEXT.fullmatch(text)):
            raise ClearanceError(f'limit "{text}" is none such as "contact_force > 20 N" or "acceleration@3:+Z > 5 g"')
        quantity, at, value = match.groups()
        ClearanceError.require_known("limit of", quantity, LIMITED)
        return cls(quantity, si_value(value, KINDS[quantity]), at)

    def row(self, rig: Rig) -> int | None:
        """Return the row of its clearance or sensor in a rig; None: the largest of all.

        Parameters
        ----------
        rig : Rig
            A rig that has it.
        """
        if self.at is None:
            return None
        names = rig.sensor_labels if self.quantity == "acceleration" else rig.clearance_labels
        if self.at not in names:
            raise ClearanceError(f'limit of {self.quantity} at "{self.at}": the rig has {", ".join(names)}')
        return list(names).index(self.at)

    @property
    def words(self) -> str:
        """Phrase of the exceeded limit, for figures and tables."""
        where = f" at {self.at}" if self.at else ""
        return f"{self.quantity.replace('_', ' ')}{where} > {self.value:g} {self.unit}"

    @property
    def unit(self) -> str:
        """Unit of the value."""
        return UNITS[KINDS[self.quantity]]
