"""A clamp with a mode: its block on a spring."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import partial

import numpy as np

from ....rig import Rig
from ....structure.beam import Clamp
from .candidate import Bench, Candidate, frequency_words, hypothesis, opened

MASS = 0.4  # kg
DAMPING = 0.02
COUNT = 8  # frequencies
FREQUENCIES = 60.0, 600.0  # Hz
APART = "an accelerometer on the clamp's block, in the direction of shaking"


@hypothesis("clamp", "a clamp with a mode of its own")
def clamps(bench: Bench) -> Iterator[Candidate]:
    """Yield clamps of a cantilever."""
    beam = bench.rig.beam
    if beam is None or (beam.clamp and beam.clamp.mass):
        return
    for frequency in np.geomspace(*FREQUENCIES, COUNT).tolist():
        yield Candidate("clamp", partial(_with, bench.rig, frequency), partial(_words, bench), APART)


def _with(rig: Rig, frequency: float, factor: float) -> Rig:
    assert rig.beam
    omega, mass = 2 * np.pi * frequency, MASS / factor  # a lighter one moves more
    moving = {"translation": mass * omega**2, "mass": mass, "translation_damping": 2 * DAMPING * omega * mass}
    clamp = dataclasses.replace(rig.beam.clamp or Clamp(), **moving)
    paths = "beam.clamp.mass", "beam.clamp.translation_damping"
    return opened(rig.replace(beam=dataclasses.replace(rig.beam, clamp=clamp)), dict.fromkeys(paths, "100 %"))


def _words(bench: Bench, rig: Rig) -> str:
    assert rig.beam and rig.beam.clamp
    clamp = rig.beam.clamp
    assert clamp.translation
    frequency = frequency_words(clamp.translation, clamp.mass, bench)
    return f"the clamp has a mode of its own: {clamp.mass:.2g} kg on {clamp.translation:.3g} N/m ({frequency})"
