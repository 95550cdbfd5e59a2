"""MDF files (.mf4, .mdf), which loggers of cars write; by the package asammdf.

Channel groups each have a master channel, the time in s, and channels with names and units; asammdf applies their
conversions to physical values. Written is version 4.10.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np

from ..core.checks import even_rate, naming
from ..core.errors import RecordError
from ..core.files import most_unpacked, replacing
from .channels import Channel
from .mdf_blocks import require_whole
from .registry import Format, register
from .waveforms import Program, Waveform

__all__ = ["read_mdf", "write_mdf"]

ASAMMDF = Program("asammdf", "asammdf", "MDF", "mdf")
VIRTUAL = (3, 6)  # types of channels that have no bytes: they count the samples
DIGIT = 1e-9  # s, of the times of loggers, which count nanoseconds


def read_mdf(
    path: str | PathLike[str], columns: Mapping[str, str] | None = None, fs: float | None = None
) -> list[Channel]:
    """Read the time records of all groups of an MDF file, each channel under its own name, with its group's rate.

    ``columns`` gives the channel by its name, ``fs`` (Hz) takes the place of times that are uneven. What is no row of
    numbers is left out, and a note says so.
    """
    return ASAMMDF.read(path, lambda data, notes: _waves(data, fs, notes), columns)


def _waves(data: bytes, fs: float | None, notes: list[str]) -> Iterator[Waveform]:
    from asammdf import MDF

    require_whole(data)
    with MDF(io.BytesIO(data)) as file:
        groups: list[Any] = [*file.groups]
        for number, group in enumerate(groups):
            known = group.channel_group
            if max(known.samples_byte_nr, known.samples_byte_nr * known.cycles_nr) > most_unpacked(len(data)):
                raise RecordError(f"not a whole MDF file: group {number + 1} declares more samples than it holds")
            for channel in group.channels:  # asammdf reads beyond the sample, which may end the process
                if file.version < "4":
                    first = channel.start_offset + 8 * getattr(channel, "additional_byte_offset", 0)
                else:
                    first = 8 * channel.byte_offset + channel.bit_offset
                last = first + channel.bit_count
                if channel.channel_type not in VIRTUAL and last > 8 * known.samples_byte_nr:
                    raise RecordError(f'not a whole MDF file: "{channel.name}" lies behind the samples of its group')
            master = file.masters_db.get(number)
            label = str(getattr(known, "acq_name", "") or f"group {number + 1}")
            for index, channel in enumerate(group.channels):
                if index == master:
                    continue
                signal = file.get(group=number, index=index)
                value, time = np.asarray(signal.samples), np.asarray(signal.timestamps, float)
                if value.ndim != 1 or not value.size or value.dtype.kind not in "iuf":
                    notes.append(f'left out "{channel.name}", which {"holds no numbers" if value.size else "is empty"}')
                    continue
                rate, start = fs or 0.0, 0.0
                if fs is None:
                    rate, start = _timing(time, channel.name)
                yield Waveform(channel.name, str(signal.unit or ""), np.asarray(value, float), rate, start, label)


def _timing(time: np.ndarray, name: str) -> tuple[float, float]:
    with naming(f'"{name}"'):
        try:
            return even_rate(time, DIGIT / max(1.0, np.abs(time).max()))
        except RecordError as error:
            raise RecordError(
                f'{error}, the sampling rate in place of them (--fs), or the channel left out ("{name}=skip")'
            ) from None


def write_mdf(path: str | PathLike[str], channels: Sequence[Channel]) -> None:
    """Write time records as MDF 4.10, those of one rate, length and start as one group, as double precision."""
    headers = ASAMMDF.headers(path, channels)
    from asammdf import MDF, Signal

    groups: dict[tuple[int, float, float], list[Signal]] = {}
    for (name, unit), c in zip(headers, channels):
        signal = Signal(c.value, c.time, unit=unit, name=name)
        groups.setdefault((c.size, c.fs, c.start), []).append(signal)
    with MDF(version="4.10") as file:
        for signals in groups.values():
            file.append(signals, common_timebase=True)
        stored = io.BytesIO()
        file.save(stored)
    with replacing(path) as temporary:
        temporary.write_bytes(stored.getvalue())


register(Format(
    "MDF", (".mf4", ".mdf"), (Channel,), read_mdf, write_mdf, options=("columns", "fs"),
    note='loggers of cars, versions 2 to 4; needs asammdf: `pip install "clearance-mj[mdf]"`',
))  # fmt: skip
