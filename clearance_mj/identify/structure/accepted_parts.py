"""Parts of a bench beyond the structure in its rig file, by its records: hypotheses tried and accepted."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from .misfit import RecordMisfit

__all__ = ["Accepted", "AcceptedParts", "Tried"]


@dataclass(frozen=True)
class Tried:
    """A hypothesis as it was tried once."""

    name: str  #: of the hypothesis
    called: str  #: in words, with its numbers where it was fitted
    gain: float  #: of log evidence, less any handicap; by the score test alone where it was not fitted
    fitted: bool  #: True if it was fitted with all open parameters


@dataclass(frozen=True)
class Accepted:
    """A hypothesis that the records support."""

    name: str  #: of the hypothesis
    words: str  #: with its fitted numbers
    gain: float  #: of log evidence
    confirmed: float  #: gain of log likelihood in the part of the records that no fit has used
    rivals: tuple[str, ...]  #: hypotheses that explain the records about as well, in words
    apart: str  #: the measurement that would tell it from these

    def __str__(self) -> str:
        words = f"the rig file lacks something that the records show: {self.words}"
        if self.rivals:
            words += f"; {' or '.join(self.rivals)} explains them about as well"
            words += f", {self.apart} would tell which" if self.apart else ""
        return words


@dataclass(frozen=True, eq=False)
class AcceptedParts:
    """Hypotheses tried beyond the structure as it is drawn."""

    accepted: tuple[Accepted, ...] = ()
    """in the order of acceptance"""
    rounds: tuple[tuple[Tried, ...], ...] = ()
    """the best of every hypothesis, given those accepted before, the likeliest first"""
    as_drawn: tuple[RecordMisfit, ...] = ()
    """of each record, by the rig updated as it is drawn"""
    parameters: tuple[str, ...] = ()
    """names of the varied parameters of the rig as it is drawn"""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on the parts missing in the rig file."""
        return tuple(map(str, self.accepted))

    def to_dict(self) -> dict[str, Any]:
        """Return the accepted and the tried hypotheses as plain data."""
        accepted = [dataclasses.asdict(hypothesis) for hypothesis in self.accepted]
        return {"accepted": accepted, "tried": [[dataclasses.asdict(t) for t in tried] for tried in self.rounds]}
