"""Excitations out of the page's settings."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..errors import ClearanceError, ExcitationError
from ..io.dataset import Dataset
from ..io.record import Record
from ..rig import Rig
from ..signals import excitation
from ..signals.excitation import Excitation
from .controls import MOST_SAMPLES, RECORD, Value

__all__ = ["excited", "record_named"]


def excited(rig: Rig, values: Mapping[str, Value], dataset: Dataset | None) -> Excitation:
    """Return the excitation that the settings ask for; impossible ones are an ExcitationError."""
    what, kind = str(values["excitation"]), str(values.get("kind", rig.shaker.kind))
    if what.startswith(RECORD):
        return record_named(dataset, what.removeprefix(RECORD)).excitation()
    level, frequency, low, high, duration, fs = (
        float(values[name]) for name in ("level", "frequency", "band_low", "band_high", "duration", "fs")
    )
    if not duration * fs <= MOST_SAMPLES:
        raise ExcitationError(f"{duration:g} s at {fs:g} Hz are more than {MOST_SAMPLES} samples; take fewer")
    band, seed, peak = (low, high), int(float(values["seed"])), math.sqrt(2) * level
    if what == "sine":
        return excitation.stepped_sine(duration, fs, frequency, peak, kind)
    if what == "sweep":
        return excitation.sweep(duration, fs, band, peak, kind)
    if what == "level ramp":
        return excitation.level_ramp(duration, fs, band, level / 4, level, seed, kind)
    make = {"random": excitation.random, "multisine": excitation.multisine, "burst random": excitation.burst_random}
    return make[what](duration, fs, band, level, seed, kind)


def record_named(dataset: Dataset | None, name: str) -> Record:
    """Return a record of the dataset; a ClearanceError says if there is none of this name."""
    found = [r for r in (dataset.records if dataset else ()) if r.name == name]
    if not found:
        raise ClearanceError(f"the opened dataset has no record {name!r}")
    return found[0]
