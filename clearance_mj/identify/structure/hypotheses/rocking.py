"""A base that rocks as it is shaken."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from ....rig import Rig
from ....structure.attached import FixtureMode
from .candidate import Bench, Candidate, added, hypothesis, mode_frequencies

DAMPING = 0.2
LEVER = 0.1  # of the base's motion, that rocking adds at the end of the rig
COUNT = 10  # frequencies
APART = "a second accelerometer on the base, in the same direction and as far along the shaft as can be"


@hypothesis("rocking", "a base that rocks")
def rocking(bench: Bench) -> Iterator[Candidate]:
    """Yield modes of rocking about the shaft's beginning."""
    if bench.rig.shaker.kind != "base" or not bench.rig.linear.shafts:
        return
    start, end = bench.rig.linear.span
    for frequency in mode_frequencies(bench, COUNT):
        make = partial(_with, bench.rig, frequency, LEVER / (end - start), start)
        yield Candidate("rocking", make, partial(_words, len(bench.rig.fixture)), APART, size="signed")


def _with(rig: Rig, frequency: float, rate: float, about: float, factor: float) -> Rig:
    mode = FixtureMode(frequency, DAMPING, 0.0, factor * rate, about)
    return added(rig, "fixture", mode, frequency="40 %", damping_ratio="100 %", rocking="100 %")


def _words(n: int, rig: Rig) -> str:
    mode = rig.fixture[n]
    return (
        f"the base rocks as it is shaken, by {abs(mode.rocking):.3g} rad/m of a mode at {mode.frequency:.3g} Hz "
        f"(damping ratio {mode.damping_ratio:.2g})"
    )
