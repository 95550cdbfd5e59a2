"""A fixture that has modes of its own, between the base's accelerometer and the feet of clamp and bushings."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ....rig import Rig
from ....structure.attached import FixtureMode
from .candidate import Bench, Candidate, hypothesis, opened

DAMPING = 0.02
PARTICIPATION = 0.5
COUNT = 20  # frequencies
BEYOND = 1.5  # times the band's upper end: modes up to there are tried
APART = "a second accelerometer on the base, at the foot of the clamp and in the direction of shaking"


@hypothesis("fixture", "a mode of the fixture below the rig")
def modes(bench: Bench) -> Iterator[Candidate]:
    """Yield modes whose frequencies are spread over the band and beyond."""
    if bench.rig.shaker.kind != "base":
        return
    for frequency in np.geomspace(max(bench.band[0], 10.0), BEYOND * bench.band[1], COUNT).tolist():
        make = partial(_with, bench.rig, frequency)
        yield Candidate("fixture", make, partial(_words, len(bench.rig.fixture)), APART, size="signed")


def _with(rig: Rig, frequency: float, factor: float) -> Rig:
    n = len(rig.fixture)
    return opened(
        rig.replace(fixture=(*rig.fixture, FixtureMode(frequency, DAMPING, factor * PARTICIPATION))),
        {f"fixture[{n}].frequency": "10 %", f"fixture[{n}].damping_ratio": "100 %",
         f"fixture[{n}].participation": "50 %"},
    )  # fmt: skip


def _words(n: int, rig: Rig) -> str:
    mode = rig.fixture[n]
    return (
        f"the fixture has a mode at {mode.frequency:.4g} Hz (damping ratio {mode.damping_ratio:.2g}) between the "
        f"base's accelerometer and the feet of clamp and bushings, which take part in it by {mode.participation:.2g}"
    )
