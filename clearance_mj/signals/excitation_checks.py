"""What generators of excitations refuse: durations, rates, bands, levels, periods and seeds that cannot be."""

from __future__ import annotations

from numbers import Integral

import numpy as np

from ..core.errors import ExcitationError
from ..core.memory import require_memory

__all__ = [
    "Band", "generator_of", "lines_within_band", "require", "require_band", "require_level", "require_period",
    "sample_count",
]  # fmt: skip

Band = tuple[float, float]
MAX_SAMPLES = 2**31
BYTES_PER_SAMPLE = 48  # memory that making an excitation takes for each sample


def sample_count(duration: float, fs: float) -> int:
    """Return the number of samples, or refuse the duration or the rate."""
    require(0 < fs < np.inf, "fs", fs, "must be > 0 Hz")
    require(0 < duration < np.inf and duration * fs >= 1.5, "duration", duration, "must be two samples or more")
    require(duration * fs < MAX_SAMPLES, "duration", duration, f"must be less than {MAX_SAMPLES} samples of 1/fs")
    require_memory(BYTES_PER_SAMPLE * duration * fs, f"{duration:g} s at {fs:g} Hz", "take less, or blocks of it")
    return round(duration * fs)


def generator_of(seed: int | list[int]) -> np.random.Generator:
    """Return the random numbers of a seed, or refuse it."""
    whole = all(isinstance(part, Integral) and part >= 0 for part in (seed if isinstance(seed, list) else [seed]))
    require(whole, "seed", seed, "must be a whole number >= 0")
    return np.random.default_rng(seed)


def require_level(**levels: float) -> None:
    """Refuse levels, by name, that are negative or not finite."""
    for name, level in levels.items():
        require(0 <= level < np.inf, name, level, "must be >= 0")


def require_period(period: float, duration: float, fs: float) -> None:
    """Refuse a period, s, that is not between a sample and the duration."""
    require(1 / fs < period <= duration, "period", period, "must be more than a sample and at most the duration")


def require_band(band: Band, fs: float) -> Band:
    """Return both ends of a band, Hz, or refuse it."""
    low, high = band
    require(0 <= low < high, "band", band, "must be two rising frequencies in Hz")
    require(high <= fs / 2, "band", band, f"must end at or below fs / 2 = {fs / 2:g} Hz")
    return low, high


def require(condition: object, name: str, value: object, rule: str) -> None:
    """Refuse a value if a condition does not hold; the message is its name, the value and the rule."""
    if not condition:
        raise ExcitationError(f"{name} {value!r}: {rule}")


def lines_within_band(samples: int, fs: float, band: Band) -> np.ndarray:
    """Return the whole numbers of cycles in so many samples that lie within a band, Hz; never 0."""
    low, high = require_band(band, fs)
    slack = 1e-9 * samples
    first, last = np.ceil(low * samples / fs - slack), np.floor(high * samples / fs + slack)
    return np.arange(max(1, int(first)), int(last) + 1)
