"""Channels of one bench as a logger wrote them: their samples side by side, and what the files say of each."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.fft
import scipy.signal

from ...core.errors import RecordError
from ...io.channels import UNKNOWN, Channel

__all__ = ["RawSignals", "gather"]

LEAST_SAMPLES = 2048  # of a record: fewer do not show resonances
LOW_POWER, HIGH_POWER = 0.005, 0.9  # of the power of all channels: between these fractions lies the band
MARGIN = 1.15  # by which the band extends beyond
LOWEST_PERIODS = 8  # of the lowest frequency in a record
SEGMENTS = 12  # averages at least
LINES = 250  # of the averaged spectra
UNRELATED = 0.15  # mean coherence with every other channel below which a channel shows nothing of the structure


@dataclass(frozen=True, eq=False)
class RawSignals:
    """Samples of the usable channels of a bench's files."""

    names: tuple[str, ...]  #: (n,) of the channels
    quantities: tuple[str, ...]  #: (n,) "acceleration" ... where the file says so, then in SI units; or "unknown"
    units: tuple[str, ...]  #: (n,) label of the unit of a channel of unknown quantity, or ""
    labels: tuple[str, ...]  #: (n,) degree of freedom where the file says it, or ""
    fs: float  #: samples per second
    records: tuple[np.ndarray, ...]  #: (n_t, n) of each file, without their mean
    unusable: dict[str, str]  #: why channels are left out, by name

    def without(self, unrelated: dict[str, str]) -> RawSignals:
        """Return the signals without some channels; why each is left out, by its name."""
        indices = [i for i, name in enumerate(self.names) if name not in unrelated]
        fields = ("names", "quantities", "units", "labels")
        texts: dict[str, Any] = {field: tuple(getattr(self, field)[i] for i in indices) for field in fields}
        records = tuple(record[:, indices] for record in self.records)
        return dataclasses.replace(self, **texts, records=records, unusable=self.unusable | unrelated)

    def earlier(self, delays: dict[str, float]) -> RawSignals:
        """Return the signals with some channels brought forward by delays in s, by their names."""
        late = np.array([delays.get(name, 0.0) for name in self.names])
        records = []
        for record in self.records:
            size = scipy.fft.next_fast_len(len(record) + int(self.fs * np.abs(late).max()) + 1, real=True)
            phases = np.exp(2j * np.pi * np.outer(np.fft.rfftfreq(size, 1 / self.fs), late))
            records.append(np.fft.irfft(np.fft.rfft(record, size, axis=0) * phases, size, axis=0)[: len(record)])
        return dataclasses.replace(self, records=tuple(records))

    def unrelated(self, band: tuple[float, float]) -> dict[str, str]:
        """Return the channels that move with no other one in a band, and how little they do, by name."""
        _, cross = self.cross_spectra(*band)
        power = np.einsum("fii->fi", cross).real
        coherence = np.mean(np.abs(cross) ** 2 / (power[:, :, None] * power[:, None, :]), axis=0)
        most = np.max(coherence - np.eye(len(self.names)), axis=1)
        words = "moves with no other channel (coherence {:.2f})"
        return {name: words.format(c) for name, c in zip(self.names, most) if c < UNRELATED}

    @property
    def duration(self) -> float:
        """Duration of all records in s."""
        return sum(len(record) for record in self.records) / self.fs

    def band(self) -> tuple[float, float]:
        """Return the frequencies in Hz between which most of a channel's power is, at the median of the channels."""
        segment = min(min(map(len, self.records)), int(4 * self.fs))
        power = np.zeros(segment // 2 + 1)
        for record in self.records:
            frequency, density = scipy.signal.welch(record / record.std(axis=0), self.fs, nperseg=segment, axis=0)
            power += np.median(density, axis=1)
        fraction = np.cumsum(power) / power.sum()
        low, high = frequency[np.searchsorted(fraction, (LOW_POWER, HIGH_POWER))]
        least = LOWEST_PERIODS * self.fs / min(map(len, self.records))
        return max(float(low), least), min(MARGIN * float(high), 0.4 * self.fs)

    def cross_spectra(self, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Return frequencies (n_f,) in Hz and cross spectra (n_f, n, n) of the channels, averaged over all records.

        Loud and quiet parts of the records count the same. RecordError if no line lies between ``low`` and ``high``.
        """
        spacing = max((high - low) / LINES, SEGMENTS / 2 / self.duration, 2 * self.fs / min(map(len, self.records)))
        size = int(self.fs / spacing)
        window = scipy.signal.get_window("hann", size)[:, None]
        level = np.mean([record.std(axis=0) for record in self.records], axis=0)
        frequency = np.fft.rfftfreq(size, 1 / self.fs)
        in_band = (frequency >= low) & (frequency <= high)
        if not in_band.any():
            above = f"above {low:.3g} Hz, and most of their power is below {high:.3g}"
            where = above if low > high else f"in {low:g} to {high:g}"
            raise RecordError(f"records as short as these tell nothing {where} Hz: give longer ones, or another --band")
        total = np.zeros((int(in_band.sum()), len(self.names), len(self.names)), dtype=complex)
        for record in self.records:
            for start in range(0, len(record) - size + 1, size // 2):
                piece = record[start : start + size]
                piece = piece - piece.mean(axis=0)
                power = float(np.mean((piece / level) ** 2))
                if power > 0:
                    spectrum = np.fft.rfft(piece * window, axis=0)[in_band]
                    total += spectrum[:, :, None] * spectrum[:, None, :].conj() / power
        return frequency[in_band], total


def gather(files: Sequence[tuple[str, Sequence[Channel]]]) -> RawSignals:
    """Put the channels of a bench's files side by side.

    Parameters
    ----------
    files : sequence of (str, sequence of Channel)
        Name and channels of each file; the channels have the same names in all of them.

    Raises
    ------
    RecordError
        If a file lacks a channel of the first one, is too short, or has no more than one usable channel.
    """
    if not files:
        raise RecordError("there is no file to map")
    first_file, first = files[0]
    names = [channel.name for channel in first]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise RecordError(f'{first_file}: two channels have the name "{twice}"; a map goes by names: give each its own')
    by_name = [{channel.name: channel for channel in channels} for _, channels in files]
    for (file, _), of_file in zip(files, by_name):
        if missing := [name for name in names if name not in of_file]:
            raise RecordError(
                f'{file}: has no channel "{missing[0]}", which {first_file} has; map files of one set-up together'
            )
    rates = [channel.fs for channel in first]
    fs = max(set(rates), key=rates.count)
    unusable: dict[str, str] = {}
    for by_channel in by_name:
        size = max((channel.size for channel in by_channel.values() if channel.fs == fs), default=0)
        unusable |= {n: reason for n in names if n not in unusable and (reason := _fault(by_channel[n], fs, size))}
    usable = [name for name in names if name not in unusable]
    if len(usable) < 2:
        why = "; ".join(f'"{name}" {reason}' for name, reason in unusable.items())
        raise RecordError(f"{first_file}: needs two channels that move{f': {why}' if why else ''}")
    records = tuple(np.stack([f[name].value for name in usable], axis=1) for f in by_name)
    for (file, _), record in zip(files, records):
        if len(record) < LEAST_SAMPLES:
            raise RecordError(
                f"{file}: has {len(record)} samples ({len(record) / fs:.3g} s); needs {LEAST_SAMPLES} to show which "
                "channel is which; give a longer record"
            )
    described = [by_name[0][name] for name in usable]
    units = tuple(channel.unit if channel.quantity == UNKNOWN else "" for channel in described)
    labels = tuple(channel.label if channel.placed else "" for channel in described)
    without_mean = tuple(record - record.mean(axis=0) for record in records)
    quantities = tuple(channel.quantity for channel in described)
    return RawSignals(tuple(usable), quantities, units, labels, fs, without_mean, unusable)


def _fault(channel: Channel, fs: float, size: int) -> str:
    """Return why a channel cannot be a vibration; "" if it can."""
    if channel.fs != fs or channel.size != size:
        return f"has {channel.size} samples at {channel.fs:g} Hz, the others {size} at {fs:g} Hz"
    if np.ptp(channel.value) <= 1e-12 * np.abs(channel.value).max():
        return f"is constant ({channel.value[0]:g})"
    steps = np.diff(channel.value)
    if channel.quantity == UNKNOWN and (np.all(steps >= 0) or np.all(steps <= 0)):
        return "only rises or falls, as a clock or a counter does"
    return ""
