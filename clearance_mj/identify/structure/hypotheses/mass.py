"""A mass on the shaft that the rig file forgets: a connector, a collar, a sensor's own."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ....rig import PointMass, Rig
from .candidate import Bench, Candidate, hypothesis, opened

SHARE = 0.05  # of the structure's mass
PLACES = np.linspace(0.15, 1.0, 9)  # of a shaft's length
REACH = 0.07  # of the length, 1 σ of its place


@hypothesis("mass", "a mass that the rig file forgets")
def masses(bench: Bench) -> Iterator[Candidate]:
    """Yield a mass at places along every shaft."""
    whole = bench.rig.linear.total_mass or 0.0
    for shaft in bench.rig.linear.shafts:
        for share in PLACES:
            x = shaft.start + float(share) * shaft.length
            place = f"{shaft.name}@{x!r}" if shaft.name else x
            yield Candidate(
                "mass", partial(_with, bench.rig, place, whole, shaft.length), partial(_words, len(bench.rig.masses))
            )


def _with(rig: Rig, place: float | str, whole: float, length: float, factor: float) -> Rig:
    n = len(rig.masses)
    return opened(
        rig.replace(masses=(*rig.masses, PointMass(place, factor * SHARE * whole, "found"))),
        {f"masses[{n}].mass": "100 %", f"masses[{n}].position": f"{REACH * length!r} m"},
    )


def _words(n: int, rig: Rig) -> str:
    found = rig.masses[n]
    where = f"x = {found.position:.3g} m" if isinstance(found.position, float) else found.position
    return f"a mass of {found.mass:.3g} kg near {where} that the rig file does not have"
