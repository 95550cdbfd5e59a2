"""A resonance that the records show and no part of the rig file explains: a mode of something without a name.

It is modelled as any single mode looks from the place where it is fixed to the shaft: a mass on a spring and
a damper (a dynamic absorber; Den Hartog, Mechanical Vibrations, 1956, section 3.2) at the end of a rigid arm, since
a part fixed there also turns with the shaft. It is tried at the frequencies at which the sensors contradict the rig
most. A hypothesis with a name explains more than this with less freedom: hence the handicap.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from functools import partial

import numpy as np

from ....rig import Rig
from ....structure.attached import Oscillator
from .candidate import Bench, Candidate, added, hypothesis, place_words, places_along

MASS = 0.02  # of the rig's, or kg where that is not known
DAMPING = 0.03
PLACES = np.linspace(0.25, 0.95, 5)  # of a shaft's length
LEVERS = -0.12, 0.0, 0.12  # of the length
FREQUENCY_RATIOS = 0.92, 1.0, 1.08
"""Of a frequency: the contradiction is a mode of the whole, not of the mass on its spring"""
REACH = 0.1  # of the length, 1 σ of place and lever
HANDICAP = 7.0
APART = "an accelerometer on whatever hangs on the shaft there"


@hypothesis("oscillator", "a mode that no part of the rig file explains", HANDICAP)
def oscillators(bench: Bench) -> Iterator[Candidate]:
    """Yield masses on springs along every shaft, about the frequencies of the largest contradictions."""
    mass = MASS * (bench.rig.total_mass or 1.0)
    words = partial(_words, len(bench.rig.oscillators))
    for shaft, place in places_along(bench.rig, PLACES):
        for lever, peak, ratio in itertools.product(LEVERS, bench.contradictions, FREQUENCY_RATIOS):
            frequency = float(np.clip(ratio * peak, *bench.band))
            oscillator = Oscillator(place, mass, frequency, DAMPING, lever * shaft.length)
            make = partial(_with, bench.rig, oscillator, shaft.length)
            yield Candidate("oscillator", make, words, APART, size="fixed", group=lever)


def _with(rig: Rig, hung: Oscillator, length: float, factor: float) -> Rig:
    hung, reach = dataclasses.replace(hung, mass=factor * hung.mass), f"{REACH * length!r} m"
    sizes = {"mass": "200 %", "frequency": "10 %", "damping_ratio": "100 %"}
    return added(rig, "oscillators", hung, **sizes, position=reach, lever=reach)


def _words(n: int, rig: Rig) -> str:
    hung = rig.oscillators[n]
    return (
        f"a mode at {hung.frequency:.4g} Hz that no part of the rig file explains (damping ratio "
        f"{hung.damping_ratio:.2g}), like that of {hung.mass:.2g} kg on a spring at the end of an arm of "
        f"{hung.lever:+.2g} m along the shaft from {place_words(hung.position)}"
    )
