"""A hypothesis of a structure that is not as drawn: the places and sizes with which it is tried, and its words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ....rig import Rig, Tolerance

__all__ = ["HYPOTHESES", "Bench", "Candidate", "Hypothesis", "hypothesis", "opened"]


class Bench(NamedTuple):
    """What a hypothesis is tried on."""

    rig: Rig  #: the rig file, with what was accepted already
    band: tuple[float, float]  #: Hz, of the records' spectra
    probes: bool  #: whether displacement probes take part
    fs: float  #: Hz, lowest rate of the records
    contradictions: tuple[float, ...] = ()  #: Hz, where the sensors contradict the rig


@dataclass(frozen=True)
class Candidate:
    """One place at which a hypothesis is tried."""

    name: str
    """of the hypothesis"""
    make: Callable[[float], Rig]
    """adds it to the rig file, as large as usual times a factor; a ClearanceError if it cannot be as large as that"""
    words: Callable[[Rig], str]
    """says what an updated rig has of it, with numbers"""
    apart: str = ""
    """the measurement that tells it from others"""
    size: Literal["positive", "signed", "fixed"] = "positive"
    """whether its size may be negative, or is tried as it is"""
    group: float | None = None
    """of candidates of one group only the best is fitted; None: of none"""


@dataclass(frozen=True)
class Hypothesis:
    """A thing that a bench may have and its rig file does not."""

    name: str
    """in tables and files"""
    called: str
    """in sentences, with its article"""
    candidates: Callable[[Bench], Iterator[Candidate]]
    """the places at which it is tried"""
    handicap: float = 0.0
    """by how much more log evidence than others it must have"""


HYPOTHESES: dict[str, Hypothesis] = {}
"""All that are known, by name"""
_Candidates = Callable[[Bench], Iterator[Candidate]]


def hypothesis(name: str, called: str, handicap: float = 0.0) -> Callable[[_Candidates], _Candidates]:
    """Register what yields the candidates of a hypothesis; a decorator.

    Parameters
    ----------
    name : str
        In tables and files.
    called : str
        In sentences, with its article.
    handicap : float
        By how much more log evidence than others it must have.
    """

    def register(candidates: _Candidates) -> _Candidates:
        HYPOTHESES[name] = Hypothesis(name, called, candidates, handicap)
        return candidates

    return register


def opened(rig: Rig, tolerances: dict[str, str]) -> Rig:
    """Return a rig with tolerances of numbers by their paths, instead of those that these had.

    Parameters
    ----------
    rig : Rig
        The rig.
    tolerances : dict of str to str
        Standard deviations with their units, such as "100 %".
    """
    kept = tuple(t for t in rig.tolerances if t.of not in tolerances)
    return rig.replace(tolerances=(*kept, *(Tolerance(of, std) for of, std in tolerances.items())))
