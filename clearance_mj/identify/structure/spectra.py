"""Spectra of whole records at complex frequencies, in which what a record did not end with does not count."""

from __future__ import annotations

import numpy as np
import scipy.fft

from ..records.prepared import PreparedRecord

__all__ = ["ChannelSpectra", "complex_frequency", "rms"]

BAND_EXTENSION = 1.35  # upper end of the band over that of the excitation: impacts reach beyond it
UNKNOWN_BAND = 0.15  # of fs: upper end of the band where that of the excitation is not known
MIN_PERIODS = 4  # whole periods of the slowest line in a record
FADE = 0.5  # s, cosine flanks at both ends of a record; longer ones pass for damping of modes that ring for seconds
END_LEVEL = 0.25
"""Of a signal at the record's end, by the imaginary part of its frequencies (Wilcox, Int. J. Control 27, 1978)."""
MAX_LINES = 3000  # of a record
CORRELATED_LINES = 10.0  # adjacent spectral lines counted as one independent observation
FORCE_BANDWIDTH = 50.0
"""Hz, over which the size of a force is a mean: what impacts do is broad, and follows no single resonance."""


class ChannelSpectra:
    """Channels of a record at complex frequencies.

    Parameters
    ----------
    record : PreparedRecord
        The record; its channels keep their order.
    """

    def __init__(self, record: PreparedRecord) -> None:
        fs, signals = record.fs, record.signals.T
        self.name, self.kind, self.duration = record.name, record.kind, record.duration
        n = signals.shape[1]
        count, time = scipy.fft.next_fast_len(2 * n, real=True), np.arange(n) / fs
        fade = int(min(FADE * fs, n / 4))
        window = np.exp(np.log(END_LEVEL) * time / self.duration)
        flank = 0.5 - 0.5 * np.cos(np.pi * (np.arange(fade) + 0.5) / fade)
        window[:fade] *= flank
        window[n - fade :] *= flank[::-1]
        low, high = record.band or (0.0, UNKNOWN_BAND * fs / BAND_EXTENSION)
        frequency = np.fft.rfftfreq(count, 1 / fs)
        inside = np.flatnonzero(
            (frequency >= max(low, MIN_PERIODS / self.duration)) & (frequency <= min(BAND_EXTENSION * high, 0.4 * fs))
        )
        kept = inside[:: -(-inside.size // MAX_LINES)]
        self.frequency = frequency[kept]
        """(n_f,) Hz"""
        self.omega = complex_frequency(self.frequency, self.duration)
        self.measured = scipy.fft.rfft(signals * window, count, axis=1)[:, kept].T
        """(n_f, n_channels) accelerometers, probes, excitation"""
        self.force_bandwidth = 1 + int(FORCE_BANDWIDTH * self.frequency.size / np.ptp(self.frequency))
        """`FORCE_BANDWIDTH` in lines"""
        self.correlated_lines = max(
            1.0, CORRELATED_LINES * self.frequency.size / (self.duration * np.ptp(self.frequency))
        )
        """lines that count as one independent observation"""


def complex_frequency(frequency: np.ndarray, duration: float) -> np.ndarray:
    """Return the complex frequencies (n_f,), rad/s, of lines in Hz of a record of a duration, s."""
    return 2 * np.pi * frequency + 1j * np.log(END_LEVEL) / duration


def rms(spectra: np.ndarray) -> np.ndarray:
    """Return the RMS (n_channels,) over the lines of spectra (n_f, n_channels)."""
    return np.sqrt(np.mean(np.abs(spectra) ** 2, axis=0))
