"""Missing samples: codes of overloads and of missing numbers, empty cells; and the stretch that is read without them.

A code is never a number. Channels of the same times are read over the longest stretch in which all of them have
numbers, at its times; a channel that lacks a tenth of its numbers or more is left out. A note says so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import RecordError
from ..signals.arrays import runs
from .channels import Channel

__all__ = ["MAX_MISSING_FRACTION", "MISSING_WORDS", "ChannelSamples", "gapless_channels", "is_code", "without_codes"]

MAX_MISSING_FRACTION = 0.1
"""Fraction of missing numbers from which on a channel is left out, or taken for one that is sampled more slowly"""
MISSING_WORDS = frozenset((
    "ovl", "ovld", "ovf", "ovr", "ovrld", "overload", "overloaded", "overrange", "over range", "over-range",
    "overflow", "over", "out of range", "under", "underrange", "under range", "under-range", "underflow", "ol",
    "o.l.", "0l", "open", "clip", "clipped", "err", "error", "invalid", "inv", "bad", "fault", "missing", "no data",
    "nodata", "null", "none", "nan", "nanq", "na", "n/a", "n.a.", "n. a.", "inf", "infinity", "1.#inf", "1.#ind",
    "1.#qnan", "#n/a", "#na", "#nv", "#null!", "#div/0!", "#value!", "#wert!", "#ref!", "#bezug!", "#name?", "#num!",
    "#zahl!", *(mark * n for mark in "-*#?" for n in range(2, 21)), "?", "*",
))  # fmt: skip
"""Words that programs write in place of a number, in lower case, with or without a sign"""
_BEYOND = 1e30  # nothing that is measured: 9.9e37 and 9.91e37 of SCPI instruments, 3.4e38 and 1.8e308 of full registers
_PLAIN = [-999.0, -999.25, -999.9, -999.99, *(s * x for s in (-1, 1) for x in (9999, 9999.9, 9999.99, 99999, 999999))]
_SENTINELS = frozenset(float(kind(code)) for code in _PLAIN for kind in (np.float64, np.float32))
"""Codes of loggers and well logs (LAS: -999.25), also as single precision has them"""
_APART = 0.1  # of the range of all other numbers, by which such a code must lie beyond it


@dataclass(frozen=True, eq=False)
class ChannelSamples:
    """Numbers of a channel as read, with missing ones, before they are scaled."""

    name: str
    value: np.ndarray  #: (n,) as in the file, nan where there is none
    fs: float  #: Hz
    start: float  #: s
    channel: Callable[[np.ndarray, float, float], Channel]  #: of numbers, rate and start
    code: str = ""  #: text in place of the first missing number


def is_code(cell: str) -> bool:
    """Return True if a cell is empty, or holds a word that programs write in place of a number."""
    plain = cell.strip().lower()
    return not plain or plain in MISSING_WORDS or plain.lstrip("+-") in MISSING_WORDS


def gapless_channels(parts: Sequence[ChannelSamples], notes: list[str]) -> list[Channel]:
    """Return channels over the longest stretch in which all of the same times have numbers; notes name the gaps."""
    groups: dict[tuple[int, float, float], list[tuple[ChannelSamples, np.ndarray]]] = {}
    for part in parts:
        if not 0 < part.fs < np.inf:
            raise RecordError(f'"{part.name}": the sampling rate must be > 0 Hz, got {part.fs:g}')
        value, code = without_codes(part.value)
        missing = np.isnan(value)
        words = f'"{part.name}" lacks {missing.sum()} of {value.size} numbers ({part.code or code or "no number"})'
        if missing.mean() >= MAX_MISSING_FRACTION:
            notes.append(f"{words} and is left out")
            continue
        if missing.any():
            notes.append(f"{words}, the first at {part.start + missing.argmax() / part.fs:.6g} s")
        groups.setdefault((value.size, part.fs, part.start), []).append((part, value))
    if not groups:
        raise RecordError(f"has no channel of numbers: {'; '.join(notes)}")
    channels: dict[int, Channel] = {}
    for (size, fs, start), group in groups.items():
        complete = np.logical_and.reduce([np.isfinite(value) for _, value in group])
        if not complete.any():
            raise RecordError("has no sample at which all channels have numbers; leave some out (NAME=skip)")
        begin, end = max(runs(complete).tolist(), key=lambda run: run[1] - run[0])  # the longest
        if end - begin < size:
            notes.append(
                f"all is read from {start + begin / fs:.6g} s to {start + (end - 1) / fs:.6g} s, {end - begin} of "
                f"{size} samples, the longest stretch without a gap"
            )
        for part, value in group:
            channels[id(part)] = part.channel(value[begin:end], fs, start + begin / fs)
    return [channels[id(part)] for part in parts if id(part) in channels]


def without_codes(value: np.ndarray) -> tuple[np.ndarray, str]:
    """Return numbers with nan in place of codes, and one of the codes as text."""
    with np.errstate(invalid="ignore"):
        is_number = np.abs(value) < _BEYOND
    numbers = value if is_number.all() else value[is_number]
    codes: list[float] = []
    while numbers.size and (code := next((c for c in (numbers.min(), numbers.max()) if c in _SENTINELS), None)):
        numbers = numbers[numbers != code]
        if numbers.size and np.abs(numbers - code).min() <= _APART * np.ptp(numbers):
            break  # it is one of the numbers
        codes.append(float(code))
    if is_number.all() and not codes:
        return value, ""
    examples = [*value[~is_number & ~np.isnan(value)][:1], *codes]
    return np.where(is_number & ~np.isin(value, codes), value, np.nan), f"{examples[0]:g}" if examples else ""
