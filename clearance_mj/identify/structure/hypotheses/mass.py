"""A mass on the shaft that the rig file forgets: of a connector, a collar, a sensor."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ....rig import PointMass, Rig
from .candidate import Bench, Candidate, added, hypothesis, place_words, places_along

SHARE = 0.05  # of the structure's mass
PLACES = np.linspace(0.15, 1.0, 9)  # of a shaft's length
REACH = 0.07  # of the length, 1 σ of its place


@hypothesis("mass", "a mass that the rig file forgets")
def masses(bench: Bench) -> Iterator[Candidate]:
    """Yield a mass at places along every shaft."""
    whole = bench.rig.linear.total_mass or 0.0
    words = partial(_words, len(bench.rig.masses))
    for shaft, place in places_along(bench.rig, PLACES):
        yield Candidate("mass", partial(_with, bench.rig, place, whole, shaft.length), words)


def _with(rig: Rig, place: float | str, whole: float, length: float, factor: float) -> Rig:
    mass = PointMass(place, factor * SHARE * whole, "found")
    return added(rig, "masses", mass, mass="100 %", position=f"{REACH * length!r} m")


def _words(n: int, rig: Rig) -> str:
    mass = rig.masses[n]
    return f"a mass of {mass.mass:.3g} kg near {place_words(mass.position)} that the rig file does not have"
