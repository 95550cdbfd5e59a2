"""A fixture with modes, between the base's accelerometer and the feet of clamp and bushings."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from ....rig import Rig
from ....structure.attached import FixtureMode
from .candidate import Bench, Candidate, added, hypothesis, mode_frequencies

DAMPING = 0.02
PARTICIPATION = 0.5
COUNT = 20  # frequencies
APART = "a second accelerometer on the base, at the foot of the clamp and in the direction of shaking"


@hypothesis("fixture", "a mode of the fixture below the rig")
def modes(bench: Bench) -> Iterator[Candidate]:
    """Yield modes whose frequencies are spread over the band."""
    if bench.rig.shaker.kind != "base":
        return
    for frequency in mode_frequencies(bench, COUNT):
        make = partial(_with, bench.rig, frequency)
        yield Candidate("fixture", make, partial(_words, len(bench.rig.fixture)), APART, size="signed")


def _with(rig: Rig, frequency: float, factor: float) -> Rig:
    mode = FixtureMode(frequency, DAMPING, factor * PARTICIPATION)
    return added(rig, "fixture", mode, frequency="10 %", damping_ratio="100 %", participation="50 %")


def _words(n: int, rig: Rig) -> str:
    mode = rig.fixture[n]
    return (
        f"the fixture has a mode at {mode.frequency:.4g} Hz (damping ratio {mode.damping_ratio:.2g}) between the "
        f"base's accelerometer and the feet of clamp and bushings, which take part in it by {mode.participation:.2g}"
    )
