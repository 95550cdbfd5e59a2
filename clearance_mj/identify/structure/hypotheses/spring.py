"""A spring or a dashpot from the shaft to the base that the rig file forgets: a cable, a seal, a stinger."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ....rig import Rig
from ....structure import Spring
from .candidate import Bench, Candidate, added, hypothesis, place_words, places_along

STIFFNESS, DAMPING = 300.0, 0.5  # N/m, N s/m
SIZES = (STIFFNESS, 0.03 * DAMPING), (0.03 * STIFFNESS, DAMPING), (STIFFNESS, DAMPING)
"""Springs, dashpots, and both: a fit that starts at a small fraction of either hardly reaches it"""
PLACES = np.linspace(0.2, 0.95, 7)  # of a shaft's length
REACH = 0.08  # of the length, 1 σ of its place


@hypothesis("spring", "a spring or dashpot to the base that the rig file forgets")
def springs(bench: Bench) -> Iterator[Candidate]:
    """Yield a spring and a dashpot at places along every shaft."""
    for shaft, place in places_along(bench.rig, PLACES):
        for kind, (stiffness, damping) in enumerate(SIZES):
            make = partial(_with, bench.rig, place, stiffness, damping, shaft.length)
            yield Candidate("spring", make, partial(_words, len(bench.rig.springs)), group=kind)


def _with(rig: Rig, place: float | str, stiffness: float, damping: float, length: float, factor: float) -> Rig:
    spring = Spring(place, factor * stiffness, damping=factor * damping)
    return added(rig, "springs", spring, stiffness="200 %", damping="200 %", position=f"{REACH * length!r} m")


def _words(n: int, rig: Rig) -> str:
    spring = rig.springs[n]
    size = f"{spring.stiffness:.3g} N/m and {spring.damping:.3g} N s/m"
    return f"a spring and dashpot of {size} from the shaft near {place_words(spring.position)} to the base"
