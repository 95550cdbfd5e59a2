"""TDMS files (.tdms), which LabVIEW and other programs of National Instruments write; by the package npTDMS.

A file holds groups of channels with properties: ``wf_increment`` and ``wf_start_offset`` say when a waveform was
sampled, ``unit_string`` (or ``NI_UnitDescription``) in which unit it is; npTDMS applies the scales of raw data. A
channel without an increment gets the times of a channel of its group that is named as time is.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.checks import even_rate, naming, simplest_rate
from ..core.errors import RecordError
from ..core.files import replacing
from .channels import Channel
from .registry import Format, register
from .tables.headers import is_time, split_header
from .waveforms import Program, Waveform

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsGroup

__all__ = ["read_tdms", "write_tdms"]

NPTDMS = Program("npTDMS", "nptdms", "TDMS", "tdms")
_UNITS = ("unit_string", "NI_UnitDescription", "Unit", "unit")


def read_tdms(
    path: str | PathLike[str], columns: Mapping[str, str] | None = None, fs: float | None = None
) -> list[Channel]:
    """Read the time records of all groups of a TDMS file, each channel under its own name, with its own rate.

    ``columns`` gives the channel by its name, ``fs`` (Hz) is of channels that do not say theirs. What is no row of
    numbers is left out, and a note says so.
    """
    return NPTDMS.read(path, lambda data, notes: _waves(data, fs, notes), columns)


def _waves(data: bytes, fs: float | None, notes: list[str]) -> Iterator[Waveform]:
    from nptdms import TdmsFile

    # From memory, where as much can be read as there is: a damaged length may be any.
    with TdmsFile.open(io.BytesIO(data)) as file:
        for group in file.groups():
            if wrong := next((c.name for c in group.channels() if len(c) > len(data)), None):
                raise RecordError(f'not a whole TDMS file: it has fewer bytes than "{wrong}" has samples')
            times = _times(group)
            for channel in group.channels():
                wave = None if channel.name in times else _wave(channel, times, fs)
                if isinstance(wave, Waveform):
                    yield wave
                elif wave:
                    notes.append(f'left out "{channel.name}", {wave}')


def _times(group: TdmsGroup) -> dict[str, np.ndarray]:
    """Instants in s of the channels of a group that are named as time is, of numbers or of dates."""
    found = {}
    for channel in group.channels():
        name, _ = split_header(channel.name)
        if is_time(name) and len(channel) and channel.dtype.kind in "iufM":
            value = channel[:]
            found[channel.name] = (value - value[0]) / np.timedelta64(1, "s") if value.dtype.kind == "M" else value
    return found


def _wave(channel: TdmsChannel, times: Mapping[str, np.ndarray], fs: float | None) -> Waveform | str:
    """Return a channel, or why it is none."""
    said: Mapping[str, Any] = channel.properties
    if not len(channel):
        return "which is empty"
    value = channel[:]
    if value.dtype.kind not in "iuf":
        return "which holds no numbers"
    unit = next((str(said[name]) for name in _UNITS if said.get(name)), "")
    start = _number(said.get("wf_start_offset"))
    step = _number(said.get("wf_increment"))
    fitting = [time for time in times.values() if time.size == value.size]
    if step > 0:
        rate = simplest_rate(step, 1e-15 * step)
    elif fitting:
        with naming(f'"{channel.name}"'):
            rate, start = even_rate(np.asarray(fitting[0], float), 1e-9)
    elif fs is not None:
        rate = fs
    else:
        raise RecordError(
            f'"{channel.name}" does not say its time step (wf_increment); give the sampling rate (--fs), or leave it '
            f'out ("{channel.name}=skip")'
        )
    return Waveform(channel.name, unit, np.asarray(value, float), rate, start, channel.group_name)


def _number(value: object) -> float:
    """Return a property that is a finite number, or 0."""
    return float(value) if isinstance(value, int | float | np.number) and np.isfinite(value) else 0.0


def write_tdms(path: str | PathLike[str], channels: Sequence[Channel]) -> None:
    """Write time records as waveforms of one group, in SI units or those of their file, as double precision."""
    headers = NPTDMS.headers(path, channels)
    from nptdms import ChannelObject, TdmsWriter

    objects = []
    for (name, unit), c in zip(headers, channels):
        properties = {"unit_string": unit} if unit else {}
        waveform = {"wf_increment": 1 / c.fs, "wf_start_offset": float(c.start), "wf_samples": c.size}
        objects.append(ChannelObject("records", name, c.value, properties | waveform))
    with replacing(path) as temporary, TdmsWriter(temporary) as writer:
        writer.write_segment(objects)


register(Format(
    "TDMS", (".tdms",), (Channel,), read_tdms, write_tdms, options=("columns", "fs"),
    note='LabVIEW; needs npTDMS: `pip install "clearance-mj[tdms]"`',
))  # fmt: skip
