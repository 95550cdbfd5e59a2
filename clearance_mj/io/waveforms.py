"""Time functions as measurement programs store them, each with its name, unit, rate and start, as channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import RecordError
from .channels import Channel
from .columns import resolve

__all__ = ["GAPS", "Waveform", "named_channels"]

GAPS = 0.1
"""Share of a column's numbers that are missing from which on it is taken for one that is sampled more slowly"""


@dataclass(frozen=True, eq=False)
class Waveform:
    """One time function of a file."""

    name: str
    unit: str  #: label in the file
    value: np.ndarray  #: (n,) in that unit
    fs: float  #: samples per second
    start: float  #: s, time of the first sample
    group: str = ""  #: of channels in the file


def named_channels(waves: Sequence[Waveform], mapped: Mapping[str, str], notes: list[str]) -> list[Channel]:
    """Return channels under their own names, or those that a map of names gives them.

    A name that several groups have gets its group before it; notes say so, and which rates there are.
    """
    if not waves:
        raise RecordError("holds no time records")
    names = [wave.name for wave in waves]
    headers = []
    for wave in waves:
        name = f"{wave.group}/{wave.name}" if names.count(wave.name) > 1 and wave.group else wave.name
        headers.append(f"{name} [{wave.unit}]" if wave.unit else name)
    used = resolve(headers, mapped, None, notes)
    if any(column.reference or column.quantity in ("time", "frequency") for column in used):
        raise RecordError("its columns are channels over time: needs names such as acc:1, no FRFs and no time")
    found = [c.channel(waves[c.index].value, waves[c.index].fs, waves[c.index].start) for c in used]
    rates = {(c.fs, c.size) for c in found}
    if len(rates) > 1:
        counted = [f"{sum((c.fs, c.size) == rate for c in found)} at {rate[0]:.9g} Hz" for rate in sorted(rates)]
        notes.append(f"channels of several rates or lengths: {', '.join(counted)}")
    return found
