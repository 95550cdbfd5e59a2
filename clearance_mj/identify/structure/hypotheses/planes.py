"""A shaft whose two bending planes differ and are turned against the direction of shaking."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from functools import partial

from ....rig import Rig
from ....structure import Beam, Shaft
from ....structure.attached import Planes
from .candidate import Bench, Candidate, hypothesis, opened

DIFFERENCES = 0.01, 0.03, 0.06
ANGLES = 0.3, 0.8, 1.3  # rad
APART = "accelerometers across the direction of shaking, at the same places"


@hypothesis("planes", "two bending planes that differ")
def planes(bench: Bench) -> Iterator[Candidate]:
    """Yield small differences at several angles."""
    if bench.rig.planes or not isinstance(bench.rig.linear, Beam | Shaft):
        return
    for difference, angle in itertools.product(DIFFERENCES, ANGLES):
        yield Candidate("planes", partial(_with, bench.rig, difference, angle), _words, APART)


def _with(rig: Rig, difference: float, angle: float, factor: float) -> Rig:
    other = rig.replace(planes=Planes(factor * difference, angle))
    return opened(other, {"planes.difference": "100 %", "planes.angle": "0.3 rad"})


def _words(rig: Rig) -> str:
    assert rig.planes
    ratio, angle = 100 * rig.planes.difference, math.degrees(rig.planes.angle)
    return (
        f"the shaft's two bending planes differ by {ratio:.2g} % in stiffness, the stiffer one turned by {angle:.0f}°"
    )
