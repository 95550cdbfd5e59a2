"""Conditions of tests: along which direction a rig was driven, and how its shaft turned."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..io.dataset import Record
from ..rig import Spin

__all__ = ["Condition", "condition_of", "conditions_of", "spin_words"]

RPM = 30 / math.pi


@dataclass(frozen=True)
class Condition:
    """Test condition of a rig in space, at any level."""

    kind: str
    """of the excitation, "base" or "force"; "spin": the shaft's turning alone"""
    reference: str
    """degree of freedom of the excitation, such as "100:+Y" """
    spin: Spin | None
    """how the shaft turned; None if it did not"""

    @property
    def direction(self) -> str:
        """Axis of the excitation: "x", "y" or "z"."""
        return self.reference[-1].lower()

    @property
    def speed(self) -> float:
        """Spin at the start, rev/min; 0 of a shaft that does not turn."""
        return RPM * self.spin.speed if self.spin else 0.0

    @property
    def words(self) -> str:
        """The condition in words, such as "along y, at 900 rev/min"."""
        turns = spin_words(self.spin)
        return turns if self.kind == "spin" else f"along {self.direction}, {turns}"

    @property
    def suffix(self) -> str:
        """Suffix of the names of its figures and tables."""
        return f"_{self.direction}_{self.speed:.0f}rpm" + ("_force" if self.kind == "force" else "")

    @property
    def columns(self) -> dict[str, str | float]:
        """Its columns in tables."""
        return {"direction": self.direction, "spin_rpm": self.speed}


def spin_words(spin: Spin | None) -> str:
    """Return in words how a shaft turns.

    Parameters
    ----------
    spin : Spin or None
        None of a shaft that does not turn.
    """
    if spin is None:
        return "not turning"
    to = f" to {RPM * spin.until:.4g}" if spin.until is not None else ""
    return f"at {RPM * spin.speed:.4g}{to} rev/min"


def condition_of(record: Record) -> Condition:
    """Return the condition of a record's test.

    Parameters
    ----------
    record : Record
        Of a rig in space.
    """
    rig, kind = record.tested_rig, record.excitation_kind
    turns = rig.spin if rig.spin and (rig.spin.speed or rig.spin.rate) else None
    spin = turns and dataclasses.replace(turns, angle=0.0)  # the shaft's angle at the start is chance
    return Condition(kind, rig.shaker.label("base" if kind == "spin" else kind), spin)


def conditions_of(records: Sequence[Record]) -> dict[Condition, tuple[Record, ...]]:
    """Return the records of each condition, both in the order in which they stand.

    Parameters
    ----------
    records : sequence of Record
        Of one rig in space.
    """
    records_of: dict[Condition, list[Record]] = {}
    for record in records:
        records_of.setdefault(condition_of(record), []).append(record)
    return {condition: tuple(members) for condition, members in records_of.items()}
