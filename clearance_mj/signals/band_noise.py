"""Noise whose spectrum is zero outside of a band, and noise of any duration out of segments of some seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from .excitation_checks import Band, generator_of, lines_within_band, require, sample_count

__all__ = ["band_noise", "noise_blocks"]

HALF = 8.0  # s of noise of any duration that are made at once


def band_noise(duration: float, fs: float, band: Band, seed: int | list[int]) -> np.ndarray:
    """Return Gaussian noise of root mean square 1 that has lines within the band (Hz) only."""
    size = sample_count(duration, fs)
    lines = lines_within_band(size, fs, band)
    require(lines.size > 0, "duration", duration, f"puts no line of {fs / size:g} Hz into the band {tuple(band)}")
    spectrum = np.zeros(size // 2 + 1, dtype=complex)
    spectrum[lines] = generator_of(seed).standard_normal((2, lines.size)).T @ (1, 1j)
    value = np.fft.irfft(spectrum, size)
    return value / np.sqrt(np.mean(value**2))


def noise_blocks(segment: Callable[[float, int], np.ndarray], duration: float, fs: float) -> Iterator[np.ndarray]:
    """Yield noise of a duration, s, in pieces that follow without a break, out of ``segment(s, number)``.

    Segments overlap by half under a power-complementary window; see `excitation.random_blocks`.
    """
    size, half = sample_count(duration, fs), sample_count(HALF, fs)
    window = np.sin(np.pi / 2 * np.sin(np.pi / 2 * (np.arange(half) + 0.5) / half) ** 2)

    def halves(number: int) -> np.ndarray:
        return segment(2 * half / fs, number).reshape(2, half)

    _, falling = halves(0)
    for number, start in enumerate(range(0, size, half), 1):
        rising, after = halves(number)
        yield (window[::-1] * falling + window * rising)[: size - start]
        falling = after
