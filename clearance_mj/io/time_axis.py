"""Instants of samples: in even steps, replaced by a sampling rate, or brought to even steps by interpolation."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from ..core.checks import even_rate
from ..core.errors import RecordError
from ..signals.sampling import resampled
from .channels import Channel
from .gaps import without_codes

__all__ = ["Rate", "Rates", "TimeAxis", "instants_in_seconds", "resample_channels", "time_axis"]

Rate = float | None  # Hz

EPOCHS = {"1970-01-01": (5e8, 2.3e9), "1904-01-01": (3.2e9, 4.4e9)}
"""Seconds since two dates that are taken for dates themselves: 1985 to 2042, and LabVIEW's 2005 to 2043"""
SCALES = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "ns": 1e-9}
_AGREES = 1e-3  # relative difference of two rates that are the same
_NEAR = 0.1  # relative difference of --fs from the mean rate of uneven times: more, and it is another channel's
_GAP = 2.5  # steps between two samples from which on some are missing
_TWICE = 0.01  # fraction of instants that may come twice
_ON_GRID = 1e-3  # of a step, by which an instant may miss the grid that it is on
_FINER = 8  # times the rate at which cubic splines follow what is below 0.4 of the rate, within 1e-4


@dataclass(frozen=True)
class Rates:
    """Sampling rates that the caller asks for, and notes on how a file was read."""

    fs: Rate  #: of records that give none, or have uneven times
    resample: Rate  #: to which all records will be brought: uneven times are interpolated
    notes: list[str]


@dataclass(frozen=True, eq=False)
class TimeAxis:
    """Even instants of samples, and the uneven ones that they are interpolated from."""

    fs: float  #: samples per second
    start: float = 0.0  #: s, time of the first sample
    time: np.ndarray | None = None  #: (n,) s, rising, of uneven samples that are interpolated; None of even ones
    order: np.ndarray | None = None  #: (n,) index of the sample at each of these

    def samples(self, value: np.ndarray) -> np.ndarray:
        """Return samples in even steps: as they are, or interpolated by cubic splines."""
        if self.time is None or self.order is None:
            return value
        size = math.floor((self.time[-1] - self.start) * self.fs + _ON_GRID) + 1
        instants = self.start + np.arange(size) / self.fs
        value = without_codes(value)[0][self.order]
        missing = np.isnan(value)
        interpolated = _spline(self.time[~missing], value[~missing], instants)
        after = np.clip(np.searchsorted(self.time, instants), 1, value.size - 1)
        return np.where(missing[after] | missing[after - 1], np.nan, interpolated)  # a gap stays one


def time_axis(time: np.ndarray, digits: float, rates: Rates) -> TimeAxis:
    """Return the axis of samples at the instants ``time`` (n,) in s, which have a relative precision of ``digits``.

    Instants within their jitter of even steps are even, which a note says. Others are interpolated at a multiple of
    ``rates.resample``, or replaced by steps of 1 / ``rates.fs`` if they are of this rate on average.
    """
    fs = rates.fs
    try:
        rate, start = even_rate(time, digits, None if rates.resample else rates.notes)
    except RecordError as error:
        if rates.resample and time.size > 1:
            return _interpolating_axis(time, rates.resample, rates.notes)
        if not fs:
            words = f"{error}; --resample RATE interpolates, or give the sampling rate in place of the times (--fs)"
            raise RecordError(words) from None
        mean = (time.size - 1) / (float(np.ptp(time)) or np.inf)
        if mean and abs(mean / fs - 1) > _NEAR:
            raise RecordError(f"its times have {mean:.5g} samples in a second, not {fs:g} (--fs)") from None
        rates.notes.append(f"{fs:.9g} Hz (--fs) in place of uneven times")
        return TimeAxis(fs, float(time[0]))
    if fs and abs(rate / fs - 1) > _AGREES:
        rates.notes.append(f"{rate:.9g} Hz by its times, not {fs:g} (--fs)")
    return TimeAxis(rate, start)


def _interpolating_axis(time: np.ndarray, rate: float, notes: list[str]) -> TimeAxis:
    """Return an axis of a multiple of a rate that is no slower than the samples, so that they can be filtered."""
    order = np.argsort(time, kind="stable")
    order = order[np.diff(time[order], prepend=-np.inf) > 0]
    if (duplicates := time.size - order.size) > _TWICE * time.size:
        raise RecordError(f"{duplicates} of its {time.size} times are those of other samples: they have too few digits")
    rising = time[order]
    steps = np.diff(rising)
    usual, longest = float(np.median(steps)), int(np.argmax(steps))
    words = f"interpolated by cubic splines between {order.size} of {time.size} uneven instants"
    if steps[longest] > _GAP * usual:
        words += f", over gaps of up to {steps[longest]:.4g} s (at {rising[longest]:.6g} s)"
    notes.append(words)
    fine_rate = rate * max(1, math.ceil(1 / (usual * rate) - 0.01))
    return TimeAxis(fine_rate, math.ceil(rising[0] * fine_rate - _ON_GRID) / fine_rate, rising, order)


def _spline(time: np.ndarray, value: np.ndarray, instants: np.ndarray) -> np.ndarray:
    return make_interp_spline(time, value, min(3, time.size - 1))(instants)


def instants_in_seconds(
    value: np.ndarray, scale: float, name: str, notes: list[str], unit: str
) -> tuple[np.ndarray, float]:
    """Return instants in s and their scale, of numbers in a unit of ``scale`` s; dates in numbers begin at 0.

    Numbers without a unit that are a date if they count ms, µs or ns do so. Notes say what was taken.
    """
    first = float(value[0])
    units = SCALES if scale == 1 and not unit else {unit or f"{scale:g} s": scale}
    for label, size in units.items():
        for epoch, (low, high) in EPOCHS.items():
            if low <= size * first <= high:
                date = np.datetime64(epoch) + np.timedelta64(round(size * first * 1e6), "us")
                notes.append(f'"{name}" is taken for {label} since {epoch[:4]}: time begins at {date} UTC')
                return size * (value - value[0]), size  # whole numbers less a whole one: those of ns have 19 digits
    if scale == 1 and not unit and value.dtype.kind in "iu" and value.size > 2:
        notes.append(f'"{name}" does not say its unit, s is taken; if it counts others, map it: "{name}=time [ms]"')
    return scale * value, scale


def resample_channels(channels: Sequence[Channel], rate: float, notes: list[str]) -> list[Channel]:
    """Return channels at one rate in Hz over the time common to all, from the latest start on.

    Filters are flat within 0.01 dB up to 0.4 of the lower rate, see `signals.resample.resampled`.
    """
    if not 0 < rate < math.inf:
        raise RecordError(f"the rate to resample to must be > 0 Hz, got {rate:g}")
    last = max(channels, key=lambda c: c.start)
    first = min(channels, key=lambda c: c.start + (c.size - 1) / c.fs)
    end = first.start + (first.size - 1) / first.fs
    size = math.floor((end - last.start) * rate + _ON_GRID) + 1
    if size < 2:
        raise RecordError(f'"{first.name}" ends at {end:g} s, "{last.name}" begins at {last.start:g} s; leave one out')
    notes.append(f"resampled to {rate:.9g} Hz from {last.start:.6g} s to {end:.6g} s, which all channels share")
    start, fs = last.start, float(rate)
    return [dataclasses.replace(c, value=_resample_from(c, start, fs)[:size], fs=fs, start=start) for c in channels]


def _resample_from(channel: Channel, start: float, rate: float) -> np.ndarray:
    """Return samples of a channel at a rate in Hz from an instant on."""
    offset = (start - channel.start) * channel.fs
    if abs(offset - round(offset)) < _ON_GRID:
        return resampled(channel.value[round(offset) :], channel.fs, rate, "line")
    value = resampled(channel.value, channel.fs, rate, "line")
    fine_samples = resampled(value, rate, _FINER * rate, "line")
    offset = (start - channel.start) * rate
    instants = np.arange(math.floor(value.size - 1 - offset + _ON_GRID) + 1) + offset
    return _spline(np.arange(fine_samples.size) / _FINER, fine_samples, instants)
