"""Hits in a record: one block of samples for each, its fault if it has one, and the windows that are put on it.

A block begins shortly before its hit, where the structure is at rest. It is left out if a second hit is in it, if a
channel is clipped in it, or if the record does not hold all of it. The force window keeps the pulse and takes out what
the force channel shows when the hammer does not touch: noise, and ringing of the hammer. Both channels are then
multiplied by the same exponential, which moves the FRF exactly to H(jω + rate) (Ewins, Modal Testing, 2nd ed., 2000,
section 3.10; Fladung, Windows used for impact testing, IMAC 15, 1997).
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.fft
import scipy.signal

from ..core.errors import RecordError
from .channel_check import clipped
from .response import Response

__all__ = [
    "DECAYED", "TRIGGER", "Hit", "find_hits", "hit_blocks", "is_impulsive", "left_out_notes", "tail_level",
    "windowed_blocks",
]  # fmt: skip

TRIGGER = 0.1
"""Fraction of a record's largest hit from which on a pulse is a hit."""
TOUCH = 0.05  # of a hit: a further pulse that is as high makes it a double one
NOISE = 6.0  # standard deviations of the resting force that a pulse exceeds
BOUNCE = 0.25  # s: a further pulse within a block that comes sooner makes the hit before a double one
RINGING, RINGING_TIME = 0.5, 0.01  # a peak is ringing if the force is so large the other way within these s of it
OFFSET_TIME = 1.0  # s over which the offset of the force is the median
BRIEF, QUIET = 0.05, 0.02  # fraction of the time above TRIGGER, and median over the peak, of a force that is hits
STRONG = 0.01  # of the strongest line's power
WHOLE = 0.8  # of a block: what must follow its hit
OVERLOAD = "overload"
DECAYED = 0.05
"""Level at the end of a block, over that at its beginning, below which a response has decayed."""


@dataclass(frozen=True)
class Hit:
    """One hit of a record, and its block of samples."""

    record: int
    """index of its record"""
    time: float
    """s from the record's first sample to the peak"""
    peak: float
    """N (m/s² of a base), with its sign"""
    start: int
    """first sample of its block; below 0 where the record begins later, and zeros stand before it"""
    pulse: tuple[int, int]
    """samples between which the hammer touches"""
    fault: str = ""
    """why it is left out; "" if it is averaged"""


@dataclass(frozen=True)
class _Pulses:
    """Pulses of a force in rising order: peaks that stand alone on one side, and so no ringing and no noise."""

    at: np.ndarray  # (n,) samples of the peaks
    height: np.ndarray  # (n,) above 0
    hit: np.ndarray  # (n,) True for a pulse that is high enough for a hit
    push: np.ndarray  # (n_t,) force without offset, positive in the sense of the largest
    sign: int
    noise: float
    width: int  # samples of the largest


def _without_offset(force: np.ndarray, fs: float) -> np.ndarray:
    """Return a force that rests at zero between hits, whatever offset its channel has and however that drifts."""
    parts = max(1, int(force.size / (OFFSET_TIME * fs)))
    size = force.size // parts
    middle = np.median(force[: parts * size].reshape(parts, size), axis=1)
    return force - np.interp(np.arange(force.size), size * (np.arange(parts) + 0.5), middle)


def is_impulsive(force: np.ndarray, fs: float) -> bool:
    """Return True if an excitation is a few pulses with silence between them.

    Parameters
    ----------
    force : ndarray, shape (n_t,)
        Samples.
    fs : float
        Samples per second.
    """
    if not force.size or not np.isfinite(force).all():
        return False
    size = np.abs(_without_offset(force, fs))
    top = size.max()
    return bool(np.mean(size > TRIGGER * top) < BRIEF and np.median(size) < QUIET * top)


def _pulses(force: np.ndarray, fs: float, trigger: float) -> _Pulses:
    centred = _without_offset(force, fs)
    sign = 1 if centred.max() >= -centred.min() else -1
    push, noise = sign * centred, 1.4826 * float(np.median(np.abs(centred)))  # the deviation of Gaussian noise
    low = max(trigger * TOUCH * push.max(), NOISE * noise)
    padded = np.pad(push, 1)  # so that a pulse cut by an end of the record has a peak
    samples, properties = scipy.signal.find_peaks(padded, height=low, prominence=low / 2)
    height = properties["peak_heights"]
    if not samples.size:
        raise RecordError("no hit stands out of the noise of the force")
    width = max(2, int(np.ceil(scipy.signal.peak_widths(padded, samples[[height.argmax()]], rel_height=0.9)[0][0])))
    reach = max(3 * width, round(RINGING_TIME * fs))
    rebound = np.array([-padded[max(0, k - reach) : k + reach + 1].min() for k in samples])
    is_single = (properties["prominences"] > height / 2) & (rebound < RINGING * height)
    if not is_single.any():
        raise RecordError("the force has no pulse that stands alone; needs hits with silence between them")
    samples, height = samples[is_single] - 1, height[is_single]
    return _Pulses(samples, height, height >= trigger * height.max(), push, sign, noise, width)


def find_hits(
    records: Sequence[Response], length: int | None = None, trigger: float = TRIGGER, lead: int = 0
) -> tuple[list[Hit], int]:
    """Return the hits of records in time order, with the faults of those to leave out, and the samples of a block.

    Parameters
    ----------
    records : sequence of Response
        Records of one rate, each with one hit or several.
    length : int, optional
        Samples of a block; None: a length that holds many hits and is long.
    trigger : float
        Fraction of a record's largest hit from which on a pulse is a hit.
    lead : int
        Samples of a block before the peak, at least; twice the width of the largest pulse if that is more.
    """
    if len({record.fs for record in records}) > 1:
        raise RecordError(f"records are sampled at {', '.join(f'{r.fs:g}' for r in records)} Hz; needs one rate")
    pulses = [_pulses(record.only_input, record.fs, trigger) for record in records]
    if length is None:
        after = np.concatenate([np.diff(p.at[p.hit], append=p.push.size) for p in pulses])
        before = np.concatenate([np.diff(p.at[p.hit], prepend=-np.inf) for p in pulses])[:, None]
        whole = (after[:, None] >= after) & ((before >= after) | (before < BOUNCE * records[0].fs))
        length = int(after[np.argmax(whole.sum(axis=0) ** 2 * after)])
    pairs = enumerate(zip(records, pulses))
    return [hit for i, (record, p) in pairs for hit in _hits(i, record, p, length, max(lead, 2 * p.width))], length


def _hits(number: int, record: Response, pulses: _Pulses, length: int, lead: int) -> Iterator[Hit]:
    names = record.responses or tuple(f"response {i + 1}" for i in range(len(record.channels)))
    channels = zip(("the force", *names), (record.excitation, *record.channels))
    overloads = {name: sum(clipped(channel), np.zeros(channel.size, dtype=bool)) for name, channel in channels}
    size, fs, before = record.excitation.size, record.fs, -np.inf
    for peak, height in zip(pulses.at[pulses.hit].tolist(), pulses.height[pulses.hit]):
        near = (pulses.height >= TOUCH * height) & (np.abs(pulses.at - peak) < length)
        earlier, later = np.flatnonzero(near & (pulses.at < peak)), np.flatnonzero(near & (pulses.at > peak))
        if earlier.size and peak - before < BOUNCE * fs:
            continue  # the second of a double hit, which is named with the first
        before, start = peak, min(peak - lead, size - length)
        low = np.flatnonzero(pulses.push <= max(TOUCH / 2 * height, 3 * pulses.noise))
        touch = [*low[low < peak][-1:], *low[low > peak][:1]]
        bad = [name for name, at_limit in overloads.items() if at_limit[max(start, 0) : start + length].any()]
        fault = f"{OVERLOAD}, {' and '.join(bad)} clipped" if bad else ""
        if earlier.size:
            fault = f"{(peak - pulses.at[earlier[-1]]) / fs:.3g} s after another hit, within the block of that"
        if later.size:
            gap, ratio = (pulses.at[later[0]] - peak) / fs, pulses.height[later[0]] / height
            fault = f"the next one comes {gap:.3g} s later, within its block of {length / fs:.3g} s"
            fault = f"double hit, {ratio:.0%} again {1e3 * gap:.3g} ms later" if gap < BOUNCE else fault
        if len(touch) < 2 or size - peak < WHOLE * length or size < length - lead:
            fault = f"the record does not hold its block of {length / fs:.3g} s"
            touch = [peak, peak]
        yield Hit(number, peak / fs, pulses.sign * float(height), start, (int(touch[0]), int(touch[1])), fault)


def windowed_blocks(
    record: Response, hits: Sequence[Hit], length: int, force_window: float = 0.0, rate: float = 0.0
) -> Iterator[Response]:
    """Yield the block of each hit that is not left out, with its windows on it.

    Parameters
    ----------
    record : Response
        The record of the hits.
    hits : sequence of Hit
        As `find_hits` returns them.
    length : int
        Samples of a block.
    force_window : float
        s after the touch for which the force is kept.
    rate : float
        Of the exponential window, 1/s.
    """
    force, offset = _without_offset(record.excitation, record.fs), np.median(record.channels, axis=1, keepdims=True)
    signals = np.vstack((force, record.channels - offset))
    for hit in (hit for hit in hits if not hit.fault):
        (begin, end), sample = hit.pulse, np.arange(hit.start, hit.start + length)
        width = end - begin
        last = end + force_window * record.fs
        block = np.pad(signals[:, max(hit.start, 0) : hit.start + length], ((0, 0), (max(-hit.start, 0), 0)))
        block *= np.exp(-rate / record.fs * np.arange(length))
        block[0] *= np.interp(sample, (begin - 2 * width, begin - width, last, last + width), (0, 1, 1, 0))
        yield Response(record.fs, block[0], block[1:], None, None, None, record.kind, record.band, record.responses,
                       record.reference)  # fmt: skip


def tail_level(blocks: Sequence[Response]) -> float:
    """Return the level of the slowest strong vibration at the end of blocks over that at their beginning.

    Of a decay of one frequency, the power in the second half of a block over that in the first is just that.

    Parameters
    ----------
    blocks : sequence of Response
        Blocks of one length without an exponential window.
    """
    half, signals = blocks[0].excitation.size // 2, np.concatenate([block.channels for block in blocks])
    halves = (signals[:, :half], signals[:, half : 2 * half])
    first, second = (np.sum(np.abs(scipy.fft.rfft(part)) ** 2, axis=0) for part in halves)
    strong = first > STRONG * first.max()
    return float(np.max(second[strong] / first[strong], initial=0.0))


def left_out_notes(hits: Sequence[Hit]) -> list[str]:
    """Return which hits are left out and why, in words.

    Parameters
    ----------
    hits : sequence of Hit
        As `find_hits` returns them.
    """
    several = len({hit.record for hit in hits}) > 1
    places = [f"{f'of record {h.record + 1} ' if several else ''}at {h.time:.3f} s" for h in hits]
    return [f"left out the hit {place}: {hit.fault}" for place, hit in zip(places, hits) if hit.fault]


def hit_blocks(record: Response, resolution: float) -> tuple[list[Response], list[str]]:
    """Return the windowed blocks of a record's hits, of 1 / resolution each, and notes on them.

    Hits that are clipped are taken where there are no others. There is no block if none holds one hit alone.

    Parameters
    ----------
    record : Response
        A record whose excitation `is_impulsive`.
    resolution : float
        Hz.
    """
    hits: list[Hit] = []
    length = round(min(record.fs / resolution, record.excitation.size + 1.0)) if resolution > 0 else 0
    with contextlib.suppress(RecordError):  # no pulse that stands alone
        hits, _ = find_hits([record], length)
    used, span = [hit for hit in hits if not hit.fault], f"{length / record.fs:.3g} s"
    words = [f"is hits: a block of {span} from each of {len(used)}, without a window", *left_out_notes(hits)]
    if not used:
        used = [replace(hit, fault="") for hit in hits if hit.fault.startswith(OVERLOAD)]
        words = [f"is hits: a block of {span} from each of {len(used)}, all of which are clipped: the FRFs are wrong"]
    if not used:
        hann = "has pulses, and a Hann window damps what they excite: damping is too high, peaks are too low"
        words = [f"{hann}; no block of {span} holds one hit alone", *left_out_notes(hits)]
    blocks = list(windowed_blocks(record, used, length))
    if blocks and (level := tail_level(blocks)) > DECAYED:
        words.append(f"{level:.0%} of the response is left at the end of a block: peaks are too low by as much")
    return blocks, words
