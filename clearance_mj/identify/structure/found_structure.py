"""What a bench has beside the structure that its rig file draws, by its records: what was tried and what accepted."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from .misfit import RecordMisfit

__all__ = ["Accepted", "FoundStructure", "Tried"]


@dataclass(frozen=True)
class Tried:
    """A hypothesis as it was tried once."""

    name: str  #: of the hypothesis
    called: str  #: what it says, with the numbers found where it was fitted
    gain: float  #: of log evidence, less any handicap; by the score test alone where it was not fitted
    fitted: bool  #: whether it was fitted with all that is open


@dataclass(frozen=True)
class Accepted:
    """A hypothesis that the records want."""

    name: str  #: of the hypothesis
    words: str  #: with the numbers found
    gain: float  #: of log evidence
    confirmed: float  #: by how much it raises the log likelihood of the piece of the records that no fit has seen
    rivals: tuple[str, ...]  #: what explains the records about as well, in words
    apart: str  #: the measurement that would tell it from these

    def __str__(self) -> str:
        words = f"the rig file lacks something that the records show: {self.words}"
        if self.rivals:
            words += f"; {' or '.join(self.rivals)} explains them about as well"
            words += f", {self.apart} would tell which" if self.apart else ""
        return words


@dataclass(frozen=True, eq=False)
class FoundStructure:
    """What was tried beside the structure as it is drawn."""

    accepted: tuple[Accepted, ...] = ()
    """in the order in which they were found"""
    rounds: tuple[tuple[Tried, ...], ...] = ()
    """of every hypothesis the best beside what was accepted before, the likeliest first"""
    as_drawn: tuple[RecordMisfit, ...] = ()
    """of each record, by the rig updated as it is drawn"""
    parameters: tuple[str, ...] = ()
    """names of what varied in the rig as it is drawn"""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what the rig file does not have."""
        return tuple(map(str, self.accepted))

    def to_dict(self) -> dict[str, Any]:
        """Return what was accepted and what was tried as plain data."""
        return {
            "accepted": [dataclasses.asdict(one) for one in self.accepted],
            "tried": [[dataclasses.asdict(one) for one in tried] for tried in self.rounds],
        }
