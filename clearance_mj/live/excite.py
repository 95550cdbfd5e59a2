"""Excitations out of the page's settings."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence

from ..core.errors import ClearanceError, ExcitationError
from ..io.dataset import Dataset
from ..io.record import Record
from ..rig import Rig
from ..signals import excitation
from ..signals.excitation import Excitation
from .control import Value
from .controls import MAX_SAMPLES, NONE, RECORD

__all__ = ["make_excitation", "record_named", "segment", "stepped"]

MAX_STEPPED = 4 * MAX_SAMPLES  # samples of a stepped sine, which is requested separately


def make_excitation(rig: Rig, values: Mapping[str, Value], dataset: Dataset | None) -> Excitation:
    """Return the excitation that the settings ask for; impossible ones are an ExcitationError."""
    waveform, kind = str(values["excitation"]), str(values.get("kind", rig.shaker.kind))
    if waveform.startswith(RECORD):
        return record_named(dataset, waveform.removeprefix(RECORD)).excitation()
    level, frequency, low, high, duration, fs = (
        float(values[name]) for name in ("level", "frequency", "band_low", "band_high", "duration", "fs")
    )
    if not duration * fs <= MAX_SAMPLES:
        raise ExcitationError(f"{duration:g} s at {fs:g} Hz are more than {MAX_SAMPLES} samples; take fewer")
    band, seed, peak = (low, high), int(float(values["seed"])), math.sqrt(2) * level
    if waveform == NONE:
        return excitation.still(duration, fs, kind)
    if waveform == "sine":
        return excitation.stepped_sine(duration, fs, frequency, peak, kind)
    if waveform in ("sweep up", "sweep down"):
        return excitation.sweep(duration, fs, band if waveform == "sweep up" else band[::-1], peak, kind)
    if waveform == "level ramp":
        return excitation.level_ramp(duration, fs, band, level / 4, level, seed, kind)
    if waveform == "random":
        return excitation.random(duration, fs, band, level, seed, kind)
    period = segment(values)
    if waveform == "impacts":
        times = [period * i for i in range(int(duration / period + 1e-9))]
        pulses = excitation.hammer(duration, fs, float(values["peak"]), float(values["width"]), times, kind)
        return dataclasses.replace(pulses, band=band)
    make: Callable[..., Excitation] = excitation.multisine if waveform == "multisine" else excitation.burst_random
    return make(duration, fs, band, level, seed, kind, period=period)


def segment(values: Mapping[str, Value]) -> float:
    """Return the duration, s, of what an FRF with the setting's lines is estimated from: a whole number of samples."""
    fs, resolution = float(values["fs"]), float(values["resolution"])
    if not 0 < resolution <= fs / 4:
        raise ExcitationError(f"lines every {resolution:g} Hz: must be above 0 and at most a quarter of {fs:g} Hz")
    return round(fs / resolution) / fs


def stepped(rig: Rig, values: Mapping[str, Value], frequencies: Sequence[float], hold: float) -> Excitation:
    """Return a sine at the level of the settings that goes through frequencies, Hz, each for ``hold`` s."""
    fs, kind = float(values["fs"]), str(values.get("kind", rig.shaker.kind))
    if not 0 < hold * fs * len(frequencies) <= MAX_STEPPED:
        raise ExcitationError(
            f"{len(frequencies)} steps of {hold:g} s at {fs:g} Hz are not between 1 and {MAX_STEPPED} samples"
        )
    duration = round(hold * fs) / fs * len(frequencies)
    return excitation.stepped_sine(duration, fs, frequencies, math.sqrt(2) * float(values["level"]), kind)


def record_named(dataset: Dataset | None, name: str) -> Record:
    """Return a record of the dataset; a ClearanceError says if there is none of this name."""
    matches = [r for r in (dataset.records if dataset else ()) if r.name == name]
    if not matches:
        raise ClearanceError(f"the opened dataset has no record {name!r}")
    return matches[0]
