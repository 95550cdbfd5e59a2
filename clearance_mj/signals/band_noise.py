"""Noise whose spectrum is zero outside of a band."""

from __future__ import annotations

import numpy as np

from .excitation_checks import Band, generator_of, lines_within_band, require, sample_count

__all__ = ["band_noise"]


def band_noise(duration: float, fs: float, band: Band, seed: int | list[int]) -> np.ndarray:
    """Return Gaussian noise of root mean square 1 that has lines within the band (Hz) only."""
    size = sample_count(duration, fs)
    lines = lines_within_band(size, fs, band)
    require(lines.size > 0, "duration", duration, f"puts no line of {fs / size:g} Hz into the band {tuple(band)}")
    spectrum = np.zeros(size // 2 + 1, dtype=complex)
    spectrum[lines] = generator_of(seed).standard_normal((2, lines.size)).T @ (1, 1j)
    value = np.fft.irfft(spectrum, size)
    return value / np.sqrt(np.mean(value**2))
