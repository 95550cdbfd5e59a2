"""Bushings on housings that give."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ....rig import Rig
from ....structure.attached import Housing
from .candidate import Bench, Candidate, frequency_words, hypothesis, opened

MASS = 0.12  # kg
DAMPING = 0.03
COUNT = 7  # frequencies
FREQUENCIES = 70.0, 500.0  # Hz
APART = "an accelerometer on the housing of each bushing, in the direction of shaking"


@hypothesis("housing", "bushings whose housings give")
def housings(bench: Bench) -> Iterator[Candidate]:
    """Yield housings of every bushing, and of each alone; without probes forces alone show nothing of them."""
    free = [j for j, b in enumerate(bench.rig.bushings) if b.housing is None and b.to is None]
    if not bench.probes or not free:
        return
    groups = [free, *([j] for j in free if len(free) > 1)]
    for group in groups:
        words = partial(_words, group, bench)
        for frequency in np.geomspace(*FREQUENCIES, COUNT).tolist():
            yield Candidate("housing", partial(_with, bench.rig, group, frequency), words, APART)


def _with(rig: Rig, group: Sequence[int], frequency: float, factor: float) -> Rig:
    omega, mass = 2 * np.pi * frequency, MASS / factor  # a lighter one gives more
    housing = Housing(mass * omega**2, mass, 2 * DAMPING * omega * mass)
    bushings = [dataclasses.replace(b, housing=housing) if j in group else b for j, b in enumerate(rig.bushings)]
    paths = [f"bushings[{j}].housing.{field}" for j in group for field in ("stiffness", "mass", "damping")]
    return opened(rig.replace(bushings=tuple(bushings)), dict.fromkeys(paths, "100 %"))


def _words(group: Sequence[int], bench: Bench, rig: Rig) -> str:
    parts = []
    for j in group:
        housing = rig.bushings[j].housing
        assert housing
        mode = frequency_words(housing.stiffness, housing.mass, bench)
        parts.append(f"{rig.clearance_labels[j]} by {housing.stiffness:.3g} N/m with {housing.mass:.2g} kg ({mode})")
    return f"the housing gives at bushing {', '.join(parts)}"
