"""TDMS files (.tdms), which LabVIEW and other programs of National Instruments write; by the package npTDMS.

A file holds groups of channels with properties: ``wf_increment`` and ``wf_start_offset`` say when a waveform was
sampled, ``unit_string`` (or ``NI_UnitDescription``) in which unit it is; npTDMS applies the scales of raw data. A
channel without an increment gets the times of a channel of its group that is named as time is.
"""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.checks import simplest_rate
from ..core.errors import RecordError
from ..core.files import replacing
from ..core.units import UNITS
from .channels import Channel
from .columns import Columns
from .registry import Format, register
from .tables.headers import is_time, split_header
from .time_axis import Rate, Rates, instants_in_seconds
from .waveforms import MeasurementProgram, Waveform, not_over_time

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsGroup

__all__ = ["read_tdms", "write_tdms"]

NPTDMS = MeasurementProgram("npTDMS", "nptdms", "TDMS", "tdms")
UNSET = np.datetime64("1970-01-01")  # before it a beginning is LabVIEW's zero, 1904, which says nothing
_UNITS = ("unit_string", "NI_UnitDescription", "Unit", "unit")


def read_tdms(
    path: str | PathLike[str], columns: Columns = None, fs: Rate = None, resample: Rate = None
) -> list[Channel]:
    """Read the time records of all groups of a TDMS file, each channel under its name, with its rate.

    ``columns`` gives the channel by its name, ``fs`` (Hz) is of channels that do not say theirs, ``resample`` (Hz) has
    samples at uneven times interpolated. Channels that begin later than the first (``wf_start_time``) start later. What
    is no row of numbers is left out, and a note says so.
    """
    return NPTDMS.read(path, _waves, columns, Rates(fs, resample, []))


def _waves(data: bytes) -> Iterator[Waveform]:
    from nptdms import TdmsFile

    # From memory, where as much can be read as there is: a damaged length may be any.
    with TdmsFile.open(io.BytesIO(data)) as file:
        waves: list[tuple[Waveform, np.datetime64 | None]] = []
        for group in file.groups():
            if wrong := next((c.name for c in group.channels() if len(c) > len(data)), None):
                raise RecordError(f'not a whole TDMS file: it has fewer bytes than "{wrong}" has samples')
            times = _times(group)
            for channel in group.channels():
                if channel.name not in times:
                    is_scaled = _is_scaled(channel.properties, group.properties, file.properties)
                    waves.append(_wave(channel, times, is_scaled))
    begins = [begin for _, begin in waves if begin is not None]
    for wave, begin in waves:
        delay = 0.0 if begin is None else float((begin - min(begins)) / np.timedelta64(1, "s"))
        words = f"begins {delay:.9g} s after the first channel (wf_start_time)" if delay else wave.words
        if begin is None and len({*begins}) > 1:
            words = "has no wf_start_time, taken to begin with the first channel"
        yield dataclasses.replace(wave, start=wave.start + delay, words=words)


def _is_scaled(*properties: Mapping[str, Any]) -> bool:
    """Return True if npTDMS applies all scales of a channel, its group and its file: it passes over unknown ones."""
    from nptdms.scaling import get_scaling

    return get_scaling(*properties) is not None or not any(
        "_Scale_Type" in name and item.get("NI_Scaling_Status") != "scaled" for item in properties for name in item
    )


@dataclass(frozen=True, eq=False)
class _Times:
    """A channel of instants."""

    time: np.ndarray  #: (n,) s
    begin: np.datetime64 | None = None  #: date of its zero
    words: str = ""  #: note on the unit that was assumed


def _times(group: TdmsGroup) -> dict[str, _Times]:
    """Return the channels of a group that are named as time is, of numbers or of dates."""
    times = {}
    for channel in group.channels():
        name, unit = split_header(channel.name)
        if not is_time(name) or not len(channel) or channel.dtype.kind not in "iufM":
            continue
        value, notes = channel[:], list[str]()
        if value.dtype.kind == "M":
            times[channel.name] = _Times((value - value[0]) / np.timedelta64(1, "s"), value[0])
        elif (unit := unit or _unit(channel)) in ("", *UNITS["time"]):
            time, _ = instants_in_seconds(value, UNITS["time"][unit or "s"], channel.name, notes, unit)
            times[channel.name] = _Times(np.asarray(time, float), None, "; ".join(notes))
    return times


def _unit(channel: TdmsChannel) -> str:
    return next((str(channel.properties[name]) for name in _UNITS if channel.properties.get(name)), "")


def _wave(channel: TdmsChannel, times: Mapping[str, _Times], is_scaled: bool) -> tuple[Waveform, np.datetime64 | None]:
    """Return a channel, and the date at which it begins, if it says one."""
    props: Mapping[str, Any] = channel.properties
    unit, begin = _unit(channel), props.get("wf_start_time")
    if not isinstance(begin, np.datetime64) or begin < UNSET:
        begin = None
    value = channel[:] if len(channel) else np.zeros(0)
    wave = Waveform(channel.name, unit, np.zeros(0), group=channel.group_name)
    if not value.size or value.dtype.kind not in "iuf":
        return dataclasses.replace(wave, useless="which holds no numbers" if value.size else "which is empty"), None
    fault = not_over_time(channel.name, unit, *(str(props.get(name, "")) for name in ("wf_xname", "wf_xunit_string")))
    if not is_scaled:
        fault = "has a scale (NI_Scale) that npTDMS does not apply: its numbers are raw; write it scaled"
    wave = dataclasses.replace(wave, value=np.asarray(value, float), fault=fault)
    if (step := _number(props.get("wf_increment"))) > 0:
        rate = simplest_rate(step, 1e-15 * step)
        return dataclasses.replace(wave, fs=rate, start=_number(props.get("wf_start_offset"))), begin
    for instants in times.values():
        if instants.time.size == value.size:
            begin = instants.begin if begin is None else begin
            return dataclasses.replace(wave, time=instants.time, digits=1e-9, words=instants.words), begin
    return wave, begin


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
    "TDMS", (".tdms",), (Channel,), read_tdms, write_tdms, options=("columns", "fs", "resample"),
    note='LabVIEW; needs npTDMS: `pip install "clearance-mj[tdms]"`',
))  # fmt: skip
