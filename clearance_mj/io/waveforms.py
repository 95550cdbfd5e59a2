"""Time functions as measurement programs store them, each with its name, unit, rate and start, as channels."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib.util
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import read_bytes
from ..core.notes import note
from ..core.overview import few
from ..core.units import quantity_of
from .channels import Channel
from .columns import SKIP, Columns, as_channel, resolve, written_header
from .gaps import MAX_MISSING_FRACTION, ChannelSamples, gapless_channels
from .time_axis import Rates, TimeAxis, time_axis

__all__ = ["MeasurementProgram", "Waveform", "channels_of_waveforms", "not_over_time"]

_SPECTRUM = re.compile(r"\b(?:FFT|PSD|ASD|spectr(?:um|a)|spektrum|(?:power )?spectral density)\b", re.IGNORECASE)
_LEVEL = re.compile(r"(?:\b|_)dB\w?\b", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Waveform:
    """One time function of a file; one with a fault is refused or left out when channels are made of it."""

    name: str
    unit: str  #: label in the file
    value: np.ndarray  #: (n,) in that unit; nan where there is none
    fs: float | None = None  #: samples per second, if the file says them
    start: float = 0.0  #: s, time of the first sample, or of the zero of ``time``
    group: str = ""  #: of channels in the file
    time: np.ndarray | None = None  #: (n,) s, instants of samples without a rate; one for all channels of a group
    digits: float = 0.0  #: relative precision of the instants
    words: str = ""  #: note on how its numbers were read
    useless: str = ""  #: why it is no row of numbers, and is left out: "which is empty"
    fault: str = ""  #: why its numbers are no time record: refused, unless the channel is skipped


@contextlib.contextmanager
def whole(file: str) -> Iterator[None]:
    """Turn whatever a package raises of a damaged file, such as a "TDMS file", into a RecordError of one line."""
    try:
        yield
    except RecordError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RecordError(f"not a whole {file}: {reason}") from None


@dataclass(frozen=True)
class MeasurementProgram:
    """A package that reads and writes a format of measurement programs."""

    name: str  #: "npTDMS"
    module: str  #: that is imported
    format: str  #: "TDMS"
    extra: str  #: of this package that brings it

    def require(self) -> None:
        """Refuse if it is not installed."""
        if importlib.util.find_spec(self.module) is None:
            raise RecordError(f'{self.format} needs the package {self.name}: pip install "clearance-mj[{self.extra}]"')

    def read(
        self, path: str | PathLike[str], waves: Callable[[bytes], Iterable[Waveform]], mapped: Columns, rates: Rates
    ) -> list[Channel]:
        """Return the channels of a file, whose waveforms ``waves`` reads from its bytes; notes say what is left out.

        Whatever the package raises of a damaged file becomes one line.
        """
        with naming(path):
            self.require()
        data = read_bytes(path)
        with naming(path):
            with whole(f"{self.format} file"):
                waveforms = list(waves(data))
            channels = channels_of_waveforms(waveforms, mapped or {}, rates)
        note(path, rates.notes)
        return channels

    def headers(self, path: str | PathLike[str], channels: Sequence[Channel]) -> list[tuple[str, str]]:
        """Return name and unit under which each channel is written; refuses none, and two of one name."""
        with naming(f"{path}: cannot be written"):
            self.require()
            if not channels:
                raise RecordError("there is no channel")
            headers = [written_header(channel) for channel in channels]
            names = [name for name, _ in headers]
            if duplicate := next((name for name in names if names.count(name) > 1), None):
                raise RecordError(f'two channels would be "{duplicate}"; give each its own node, or write .uff')
        return headers


def not_over_time(name: str, unit: str, *axis: str) -> str:
    """Return why a column is no time function, by its name, its unit and the labels of its axis; "" if it is one."""
    if label_of_axis := next((label for label in axis if label.lower().startswith(("freq", "hz", "khz"))), ""):
        return f"is over {label_of_axis}, not over time"
    if _SPECTRUM.search(name):
        return "is a spectrum by its name, not over time"
    return f"is in dB by its name, not in {unit}" if _LEVEL.search(name) and quantity_of(unit) else ""


def channels_of_waveforms(waves: Sequence[Waveform], mapped: Mapping[str, str], rates: Rates) -> list[Channel]:
    """Return channels under their own names, or those of a map of names; channels that it skips may be anything.

    A name that several groups have gets its group before it; notes say so, and which rates there are.
    """
    if not waves:
        raise RecordError("holds no time records")
    counted = [Counter(w.name for w in waves if not w.useless), Counter(w.name for w in waves)]
    headers = []
    for wave in waves:
        is_shared = wave.group and counted[bool(wave.useless)][wave.name] > 1
        name = f"{wave.group}/{wave.name}" if is_shared else wave.name
        headers.append(f"{name} [{wave.unit}]" if wave.unit else name)
    notes = rates.notes
    used = [as_channel(c) if c.is_raw_time else c for c in resolve(headers, mapped, None, notes)]
    if any(column.reference or column.quantity in ("time", "frequency") for column in used):
        raise RecordError("its columns are channels over time: needs names such as acc:1, no FRFs and no time")
    parts = []
    names_of_note: dict[str, list[str]] = {}
    for column in used:
        wave = waves[column.index]
        if wave.useless and column.is_raw:
            notes.append(f'left out "{column.name}", {wave.useless}')
            continue
        wave_rates = dataclasses.replace(rates, notes=[wave.words] if wave.words else [])
        try:
            axis, value = _sample_axis(wave, wave_rates)
        except RecordError as error:
            raise RecordError(f'"{column.name}": {error}, or leave it out ("{column.name}={SKIP}")') from None
        parts.append(ChannelSamples(column.name, value, axis.fs, axis.start, column.channel))
        for words in wave_rates.notes:
            names_of_note.setdefault(words, []).append(f'"{column.name}"')
    if not parts:
        raise RecordError("holds no time records")
    notes += [f"{few(names, 3)}: {words}" for words, names in names_of_note.items()]
    channels = gapless_channels(parts, notes)
    counts = Counter((c.fs, c.size) for c in channels)
    if len(counts) > 1:
        rates_in_words = [f"{counts[rate]} at {rate[0]:.9g} Hz" for rate in sorted(counts)]
        notes.append(f"channels of several rates or lengths: {', '.join(rates_in_words)}")
    return channels


def _sample_axis(wave: Waveform, rates: Rates) -> tuple[TimeAxis, np.ndarray]:
    """Return the time axis of a channel and its samples."""
    if wave.fault or wave.useless:
        raise RecordError(wave.fault or f"{wave.useless.removeprefix('which ')}; choose another")
    value, time, is_number = wave.value, wave.time, np.isfinite(wave.value)
    rate = wave.fs or rates.fs or 0.0
    if time is None and not rate:
        raise RecordError("does not say its sampling interval or rate; give the sampling rate (--fs)")
    if is_number.mean() <= 1 - MAX_MISSING_FRACTION:  # sampled more slowly; fewer are gaps
        value, time = value[is_number], (np.arange(value.size) / rate if time is None else time)[is_number]
    if time is not None and not np.isfinite(time).all():
        if not (valid := np.flatnonzero(np.isfinite(time))).size:
            raise RecordError("has no times; give the sampling rate (--fs)")
        time = np.interp(np.arange(time.size), valid, time[valid])
    axis = TimeAxis(rate) if time is None else time_axis(time, wave.digits, rates)
    return dataclasses.replace(axis, start=axis.start + wave.start), axis.samples(value)
