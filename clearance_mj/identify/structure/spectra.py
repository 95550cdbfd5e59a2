"""Spectra of whole records at complex frequencies, in which motion that does not end with the record hardly counts."""

from __future__ import annotations

import numpy as np
import scipy.fft

from ..records.prepared import PreparedRecord

__all__ = ["ChannelSpectra", "complex_frequency", "complex_spectra", "flank_spectra", "rms"]

BAND_EXTENSION = 1.35  # upper end of the band over that of the excitation, if impacts reach beyond it
SILENT = 0.03
"""Of a channel's level within the excitation's band, beyond it: 0.005 to 0.01 by 1 % of noise alone, 0.05 to 0.3 by
impacts."""
UNKNOWN_BAND = 0.15  # of fs: upper end of the band where that of the excitation is not known
MIN_PERIODS = 4  # whole periods of the slowest line in a record
FADE = 0.5  # s, cosine flanks at both ends of a record; longer ones pass for damping of modes that ring for seconds
END_LEVEL = 0.25
"""Of a signal at the record's end, by the imaginary part of its frequencies (Wilcox, Int. J. Control 27, 1978)."""
MAX_LINES = 3000  # of a record, shared by the planes in which its channels are
CORRELATED_LINES = 10.0  # adjacent spectral lines counted as one independent observation
FORCE_BANDWIDTH = 50.0
"""Hz, over which the size of a force is a mean: impacts have broad spectra that follow no single resonance."""


class ChannelSpectra:
    """Channels of a record at complex frequencies.

    Parameters
    ----------
    record : PreparedRecord
        The record; its channels keep their order.
    thin : int
        Every so many-th line alone is kept.
    """

    def __init__(self, record: PreparedRecord, thin: int = 1) -> None:
        self.name, self.kind, self.duration, fs = record.name, record.kind, record.duration, record.fs
        self.tested, self.present = record.tested, record.present
        low, high = record.band or (0.0, UNKNOWN_BAND * fs / BAND_EXTENSION)
        band = max(low, MIN_PERIODS / self.duration), min(BAND_EXTENSION * high, 0.4 * fs)
        spectra = complex_spectra(record.signals, fs, band, MAX_LINES // (2 if record.rig.moves_across else 1))
        beyond, sensed = spectra[0] > high, self.present[:-1]
        if record.band and beyond.any() and not beyond.all():
            outside, within = (rms(spectra[1][part, :-1][:, sensed]) for part in (beyond, ~beyond))
            if np.median(outside / within) < SILENT:
                spectra = spectra[0][~beyond], spectra[1][~beyond]
        self.level = rms(spectra[1])
        """(n_channels,) RMS, with the lines near the turns"""
        lines = record.away_from_turns(spectra[0])
        self.frequency, self.measured = (part[lines][::thin] for part in spectra)
        """(n_f,) Hz; (n_f, n_channels) accelerometers, probes, excitation"""
        self.omega = complex_frequency(self.frequency, self.duration)
        self.in_flanks = flank_spectra(record.signals, fs, self.frequency)
        """(n_f, n_channels) 2 ḟ ẏ + f̈ y of each channel y in the window f, else 0 where lines hold much more"""
        flank_level, level = (np.linalg.norm(part[:, :-1], axis=1) for part in (self.in_flanks, self.measured))
        self.in_flanks[flank_level < 2 / FADE * np.abs(self.omega) * level] = 0.0
        n_lines, span = self.frequency.size, np.ptp(self.frequency)
        self.force_bandwidth = 1 + int(FORCE_BANDWIDTH * n_lines / span)
        """`FORCE_BANDWIDTH` in lines"""
        self.correlated_lines = max(1.0, CORRELATED_LINES * n_lines / (self.duration * span))
        """lines that count as one independent observation"""


def complex_spectra(
    signals: np.ndarray, fs: float, band: tuple[float, float], n_lines: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (n_f,), Hz, and the spectra (n_f, n_channels) of signals (n_t, n_channels) in a band.

    Spectra at `complex_frequency`, at most ``n_lines`` of them at equal distances.
    """
    n = len(signals)
    count = scipy.fft.next_fast_len(2 * n, real=True)
    frequency = np.fft.rfftfreq(count, 1 / fs)
    inside = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]))
    lines = inside[:: -(-inside.size // n_lines)]
    return frequency[lines], _transform(signals, _flanks(n, fs)[0], count, lines)


def _transform(signals: np.ndarray, window: np.ndarray, count: int, lines: np.ndarray) -> np.ndarray:
    """Return some lines (n_f, n_channels) of the transform of signals in a window, at complex frequencies."""
    decay = np.exp(np.log(END_LEVEL) * np.arange(len(signals)) / len(signals))
    return np.asarray(scipy.fft.rfft(signals.T * (decay * window), count, axis=1)[:, lines].T)


def _flanks(n: int, fs: float) -> np.ndarray:
    """Return (3, n_t) a window of ones with cosine flanks, and its two derivatives by time, 1/s and 1/s²."""
    fade = int(min(FADE * fs, n / 4))
    angle, rate = np.pi * (np.arange(fade) + 0.5) / fade, np.pi * fs / fade
    window = np.zeros((3, n))
    window[0] = 1.0
    rising = 0.5 * np.array([1 - np.cos(angle), rate * np.sin(angle), rate**2 * np.cos(angle)])
    window[:, :fade], window[:, n - fade :] = rising, rising[:, ::-1] * np.array([[1], [-1], [1]])
    return window


def flank_spectra(signals: np.ndarray, fs: float, frequency: np.ndarray) -> np.ndarray:
    """Return (n_f, n_channels) the transform of 2 ḟ ẏ + f̈ y, with the window f of `complex_spectra`.

    By parts, that of ḟ ẏ is s times that of ḟ y, less that of f̈ y, with the complex frequency s.

    Parameters
    ----------
    signals : ndarray, shape (n_t, n_channels)
        y.
    fs : float
        Samples per second.
    frequency : ndarray, shape (n_f,)
        Hz, of `complex_spectra`.
    """
    n = len(signals)
    count = scipy.fft.next_fast_len(2 * n, real=True)
    lines = np.round(frequency * count / fs).astype(int)
    first, second = (_transform(signals, each, count, lines) for each in _flanks(n, fs)[1:])
    return 2j * complex_frequency(frequency, n / fs)[:, None] * first - second


def complex_frequency(frequency: np.ndarray, duration: float) -> np.ndarray:
    """Return the complex frequencies (n_f,), rad/s, of lines in Hz of a record of a duration, s."""
    return 2 * np.pi * frequency + 1j * np.log(END_LEVEL) / duration


def rms(spectra: np.ndarray) -> np.ndarray:
    """Return the RMS (n_channels,) over the lines of spectra (n_f, n_channels)."""
    return np.sqrt(np.mean(np.abs(spectra) ** 2, axis=0))
