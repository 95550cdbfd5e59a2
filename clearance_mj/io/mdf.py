"""MDF files (.mf4, .mdf), which loggers of cars write; by the package asammdf.

Channel groups each have a master channel, the time in s, and channels with names and units; asammdf applies their
conversions to physical values. Written is version 4.10.

All linked blocks are checked to be there before a reader follows them. ASAM MDF 4.1: the header block
begins at byte 64. A block has four characters "##HD", its length, the number of its links, and the links: bytes in the
file of other blocks, or 0. The first link of most leads to the next of its kind. Blocks of MDF 3.3 and before have two
characters "HD", their length and as many links as their kind has.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Sequence
from os import PathLike
from typing import Any

import numpy as np

from ..core.errors import RecordError
from ..core.files import most_unpacked, replacing
from .channels import Channel
from .columns import Columns
from .gaps import MAX_MISSING_FRACTION
from .registry import Format, register
from .time_axis import Rate, Rates
from .waveforms import MeasurementProgram, Waveform

__all__ = ["read_mdf", "write_mdf"]

ASAMMDF = MeasurementProgram("asammdf", "asammdf", "MDF", "mdf")
VIRTUAL = (3, 6)  # types of channels that have no bytes: they count the samples
AXES = {2: "angle", 3: "distance", 4: "index"}  # of masters that are no time
DIGIT = 1e-9  # s, of the times of loggers, which count nanoseconds


def read_mdf(
    path: str | PathLike[str], columns: Columns = None, fs: Rate = None, resample: Rate = None
) -> list[Channel]:
    """Read the time records of all groups of an MDF file, each channel under its name, with its group's rate.

    ``columns`` gives the channel by its name, ``fs`` (Hz) takes the place of times that are uneven, ``resample`` (Hz)
    has samples between them interpolated. What is no row of numbers is left out; samples that are marked as invalid are
    interpolated, or, where a tenth or more are, the channel is sampled at the others. Notes say so.
    """
    return ASAMMDF.read(path, _waves, columns, Rates(fs, resample, []))


def _waves(data: bytes) -> Iterator[Waveform]:
    from asammdf import MDF

    require_whole(data)
    with MDF(io.BytesIO(data)) as file:
        groups: list[Any] = [*file.groups]
        for number, group in enumerate(groups):
            layout = group.channel_group
            if max(layout.samples_byte_nr, layout.samples_byte_nr * layout.cycles_nr) > most_unpacked(len(data)):
                raise RecordError(f"not a whole MDF file: group {number + 1} declares more samples than it holds")
            for channel in group.channels:  # asammdf reads beyond the sample, which may end the process
                if file.version < "4":
                    first = channel.start_offset + 8 * getattr(channel, "additional_byte_offset", 0)
                else:
                    first = 8 * channel.byte_offset + channel.bit_offset
                if channel.channel_type not in VIRTUAL and first + channel.bit_count > 8 * layout.samples_byte_nr:
                    raise RecordError(f'not a whole MDF file: "{channel.name}" lies behind the samples of its group')
            master = file.masters_db.get(number)
            label = str(getattr(layout, "acq_name", "") or f"group {number + 1}")
            time = None if master is None else np.asarray(file.get_master(number), float)
            axis = "" if master is None else AXES.get(getattr(group.channels[master], "sync_type", 1), "")
            fault = f"is over {axis}, not over time; choose others" if axis else ""
            for index, channel in enumerate(group.channels):
                if index == master:
                    continue
                signal = file.get(group=number, index=index, ignore_invalidation_bits=True)
                value, unit = np.asarray(signal.samples), str(signal.unit or "")
                if value.ndim != 1 or not value.size or value.dtype.kind not in "iuf":
                    reason = "which holds no numbers" if value.size else "which is empty"
                    yield Waveform(channel.name, unit, np.zeros(0), group=label, useless=reason)
                    continue
                value, words = np.asarray(value, float), ""
                if signal.invalidation_bits is not None and np.any(signal.invalidation_bits):
                    value, words = _without_invalid(value, np.asarray(signal.invalidation_bits, bool))
                digits = 0.0 if time is None else DIGIT / max(1.0, np.abs(time).max())
                reason = "" if np.isfinite(value).any() else "which has no valid number"
                yield Waveform(channel.name, unit, value, None, 0.0, label, time, digits, words, reason, fault)


def _without_invalid(value: np.ndarray, invalid: np.ndarray) -> tuple[np.ndarray, str]:
    """Return samples without those that are invalid: interpolated, or nan where they are many; and words for a note."""
    words = f"{invalid.sum()} of {value.size} samples are marked as invalid, from sample {np.argmax(invalid)} on; "
    if invalid.mean() >= MAX_MISSING_FRACTION:
        return np.where(invalid, np.nan, value), words + "it is taken at the others"
    number = np.arange(value.size)
    return np.interp(number, number[~invalid], value[~invalid]), words + "they are interpolated"


def write_mdf(path: str | PathLike[str], channels: Sequence[Channel]) -> None:
    """Write time records as MDF 4.10, those of one rate, length and start as one group, as double precision."""
    headers = ASAMMDF.headers(path, channels)
    from asammdf import MDF, Signal

    groups: dict[tuple[int, float, float], list[Signal]] = {}
    for (name, unit), c in zip(headers, channels):
        groups.setdefault((c.size, c.fs, c.start), []).append(Signal(c.value, c.time, unit=unit, name=name))
    with MDF(version="4.10") as file:
        for signals in groups.values():
            file.append(signals, common_timebase=True)
        stored = io.BytesIO()
        file.save(stored)
    with replacing(path) as temporary:
        temporary.write_bytes(stored.getvalue())


register(Format(
    "MDF", (".mf4", ".mdf"), (Channel,), read_mdf, write_mdf, options=("columns", "fs", "resample"),
    note='loggers of cars, versions 2 to 4; needs asammdf: `pip install "clearance-mj[mdf]"`',
))  # fmt: skip


_HEAD = 64  # bytes before the header block
_HEADER = struct.Struct("<4s4xQQ")
_LINKS = {b"HD": 3, b"DG": 3, b"CG": 3, b"CN": 5}  # of MDF 3 that lead to blocks
_LISTS = (b"DG", b"CG", b"CN", b"##DG", b"##CG", b"##CN", b"##CH", b"##AT", b"##EV", b"##FH", b"##DL", b"##LD")
"""Kinds whose first link leads to the next in a list; one that leads back has no end"""


def require_whole(data: bytes) -> None:
    """Refuse a file that is no MDF, is cut off, or whose links lead nowhere or round in a circle."""
    if data[:3] != b"MDF":
        raise RecordError("not an MDF file")
    block = _old_block if data[8:9] in b"23" else _block
    todo, links_of = [_HEAD], dict[int, tuple[bytes, tuple[int, ...]]]()
    while todo:
        at = todo.pop()
        if at in links_of:
            continue
        kind, links = links_of[at] = block(data, at)
        todo += [link for link in links if link]
    for at, (kind, _) in links_of.items():
        seen, position = set[int](), at
        while position and kind in _LISTS:
            if position in seen:
                raise RecordError(f"not a whole MDF file: its list of blocks at byte {at} leads back to itself")
            seen.add(position)
            next_kind, links = links_of[position]
            position = links[0] if next_kind == kind and links else 0


def _old_block(data: bytes, begin: int) -> tuple[bytes, tuple[int, ...]]:
    """Return kind and links of a block of MDF 3."""
    kind = data[begin : begin + 2]
    count = _LINKS.get(kind, 0)
    if begin + 4 + 4 * count > len(data):
        raise RecordError(f"not a whole MDF file: a block at byte {begin} lies behind its end, {len(data)}")
    return kind, struct.unpack_from(f"{'>' if data[24:26] != bytes(2) else '<'}{count}I", data, begin + 4)


def _block(data: bytes, begin: int) -> tuple[bytes, tuple[int, ...]]:
    """Return kind and links of a block."""
    if begin + _HEADER.size > len(data):
        raise RecordError(f"not a whole MDF file: a block at byte {begin} lies behind its end, {len(data)}")
    kind, length, count = _HEADER.unpack_from(data, begin)
    if kind[:2] != b"##":
        raise RecordError(f"not a whole MDF file: no block begins at byte {begin}")
    if begin + length > len(data) or _HEADER.size + 8 * count > length:
        raise RecordError(f"not a whole MDF file: the block at byte {begin} ends behind the file or its links")
    return kind, struct.unpack_from(f"<{count}Q", data, begin + _HEADER.size)
