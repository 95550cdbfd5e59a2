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
    """Bench on which hypotheses are tried."""

    rig: Rig  #: the rig file, with the parts accepted already
    band: tuple[float, float]  #: Hz, of the records' spectra
    probes: bool  #: True if displacement probes take part
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
    """describes it in words with the numbers of an updated rig"""
    apart: str = ""
    """the measurement that tells it from others"""
    size: Literal["positive", "signed", "fixed"] = "positive"
    """sign of its size, which may be negative, or "fixed": tried as it is"""
    group: float | None = None
    """of candidates of one group only the best is fitted; None: of none"""


@dataclass(frozen=True)
class Hypothesis:
    """A part that a bench may have and its rig file lacks."""

    name: str
    """in tables and files"""
    called: str
    """in sentences, with its article"""
    candidates: Callable[[Bench], Iterator[Candidate]]
    """the places at which it is tried"""
    handicap: float = 0.0
    """log evidence that it must have more than others"""
    of_rig_file: bool = False
    """True if it opens what the rig file says to be exact: fitted before all others, from every start"""


HYPOTHESES: dict[str, Hypothesis] = {}
"""All that are known, by name"""
_Candidates = Callable[[Bench], Iterator[Candidate]]


def hypothesis(
    name: str, called: str, handicap: float = 0.0, of_rig_file: bool = False
) -> Callable[[_Candidates], _Candidates]:  # fmt: skip
    """Register the function that yields a hypothesis's candidates; a decorator.

    Parameters
    ----------
    name : str
        In tables and files.
    called : str
        In sentences, with its article.
    handicap : float
        Log evidence that it must have more than others.
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
    tolerances_left = tuple(t for t in rig.tolerances if t.of not in tolerances)
    return rig.replace(tolerances=(*tolerances_left, *(Tolerance(of, std) for of, std in tolerances.items())))


def added(rig: Rig, part: str, new: Any, **tolerances: str) -> Rig:
    """Return a rig with one more element in a part, whose numbers are open.

    Parameters
    ----------
    rig : Rig
        The rig.
    part : str
        Field of the rig that holds such elements, such as "springs".
    new : Spring, PointMass, FixtureMode or Oscillator
        The element that is added.
    **tolerances : str
        Standard deviations of its fields with their units, such as "100 %".
    """
    before = getattr(rig, part)
    paths = {f"{part}[{len(before)}].{field}": std for field, std in tolerances.items()}
    return opened(rig.replace(**{part: (*before, new)}), paths)


def places_along(rig: Rig, fractions: np.ndarray) -> Iterator[tuple[Shaft, float | str]]:
    """Yield places at fractions of the length of every shaft, each with its shaft: numbers on one without a name."""
    for shaft in rig.linear.shafts:
        for fraction in fractions:
            x = shaft.start + float(fraction) * shaft.length
            yield shaft, f"{shaft.name}@{x!r}" if shaft.name else x


def place_words(place: float | str) -> str:
    """Return a place in words, such as "x = 0.4 m"."""
    return f"x = {place:.3g} m" if isinstance(place, float) else place


def frequency_words(stiffness: float, mass: float, bench: Bench) -> str:
    """Return the frequency of a mass on a spring in words; above the records' band, only that it is there."""
    frequency, highest = math.sqrt(stiffness / mass) / (2 * math.pi), bench.band[1]
    return f"{frequency:.3g} Hz" if frequency < highest else f"above {highest:.3g} Hz, where the records end"


def mode_frequencies(bench: Bench, count: int) -> list[float]:
    """Return frequencies, Hz, of modes of the base or fixture, spread over the band."""
    low, high = bench.band
    return np.geomspace(min(max(low, LOWEST_MODE), high), high, count).tolist()
