"""A hypothesis of a structure that is not as drawn: the places and sizes with which it is tried, and its words."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from ....rig import Rig, Tolerance
from ....structure import Shaft

__all__ = [
    "HYPOTHESES", "Bench", "Candidate", "Hypothesis", "added", "frequency_words", "hypothesis",
    "mode_frequencies", "opened", "place_words", "places_along",
]  # fmt: skip

LOWEST_MODE = 10.0  # Hz, of modes that are tried


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
    of_rig_file: bool = False
    """whether it opens what the rig file says to be exact: fitted before all others, from every start"""


HYPOTHESES: dict[str, Hypothesis] = {}
"""All that are known, by name"""
_Candidates = Callable[[Bench], Iterator[Candidate]]


def hypothesis(
    name: str, called: str, handicap: float = 0.0, of_rig_file: bool = False
) -> Callable[[_Candidates], _Candidates]:  # fmt: skip
    """Register what yields the candidates of a hypothesis; a decorator.

    Parameters
    ----------
    name : str
        In tables and files.
    called : str
        In sentences, with its article.
    handicap : float
        By how much more log evidence than others it must have.
    of_rig_file : bool
        It opens what the rig file says to be exact: fitted before all others, from every start.
    """

    def register(candidates: _Candidates) -> _Candidates:
        HYPOTHESES[name] = Hypothesis(name, called, candidates, handicap, of_rig_file)
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


def added(rig: Rig, part: str, new: Any, **tolerances: str) -> Rig:
    """Return a rig with one more thing in a part, whose numbers are open.

    Parameters
    ----------
    rig : Rig
        The rig.
    part : str
        Field of the rig that holds such things, such as "springs".
    new : Spring, PointMass, FixtureMode or Oscillator
        What is added.
    **tolerances : str
        Standard deviations of its fields with their units, such as "100 %".
    """
    before = getattr(rig, part)
    paths = {f"{part}[{len(before)}].{field}": std for field, std in tolerances.items()}
    return opened(rig.replace(**{part: (*before, new)}), paths)


def places_along(rig: Rig, shares: np.ndarray) -> Iterator[tuple[Shaft, float | str]]:
    """Yield places at shares of the length of every shaft, each with its shaft: numbers on one without a name."""
    for shaft in rig.linear.shafts:
        for share in shares:
            x = shaft.start + float(share) * shaft.length
            yield shaft, f"{shaft.name}@{x!r}" if shaft.name else x


def place_words(place: float | str) -> str:
    """Return a place in words, such as "x = 0.4 m"."""
    return f"x = {place:.3g} m" if isinstance(place, float) else place


def frequency_words(stiffness: float, mass: float, bench: Bench) -> str:
    """Return the frequency of a mass on a spring in words; beyond the records' band, that it is there."""
    frequency, highest = math.sqrt(stiffness / mass) / (2 * math.pi), bench.band[1]
    return f"{frequency:.3g} Hz" if frequency < highest else f"above {highest:.3g} Hz, where the records end"


def mode_frequencies(bench: Bench, count: int) -> list[float]:
    """Return frequencies, Hz, of modes of what carries the rig, spread over the band."""
    low, high = bench.band
    return np.geomspace(min(max(low, LOWEST_MODE), high), high, count).tolist()
