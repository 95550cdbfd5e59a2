"""Sound pressure over time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..core.errors import RecordError
from ..core.overview import HasOverview, Overview
from ..signals.arrays import ArrayData, read_only

__all__ = ["REFERENCE_PRESSURE", "Sound"]

REFERENCE_PRESSURE = 20e-6
"""Pa, of sound pressure levels in dB (ISO 1683)."""
FLANK = 0.02  # s, fade at the ends of a cut sound, against clicks


@dataclass(frozen=True, eq=False, repr=False)
class Sound(HasOverview, ArrayData):
    """Sound pressure over time, at one place.

    Raises
    ------
    RecordError
        If it is not one row of finite samples, or the sampling rate is not above 0.
    """

    pressure: np.ndarray
    """(n_t,) Pa, read-only"""
    fs: float
    """samples per second"""
    name: str = ""
    """description of the source"""
    provenance: dict[str, Any] = field(default_factory=dict)
    """inputs of the computation; plain data"""

    def __post_init__(self) -> None:
        self._set(pressure=read_only(self.pressure))
        if self.pressure.ndim != 1 or not self.pressure.size or not np.isfinite(self.pressure).all():
            raise RecordError(f"pressure must be one row of finite samples, got shape {self.pressure.shape}")
        RecordError.require_positive(" Hz", fs=self.fs)

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.pressure.size) / self.fs

    @property
    def duration(self) -> float:
        """S"""
        return self.pressure.size / self.fs

    @property
    def level(self) -> float:
        """Sound pressure level of the whole sound, dB re 20 µPa, without weighting; -inf of silence."""
        with np.errstate(divide="ignore"):
            return float(10 * np.log10(np.mean(self.pressure**2) / REFERENCE_PRESSURE**2))

    def between(self, start: float, stop: float | None = None) -> Sound:
        """Return the part from one time to another.

        Parameters
        ----------
        start : float
            s, time of the first sample.
        stop : float, optional
            s, end of the part; None: that of the sound.

        Raises
        ------
        RecordError
            If no sample lies between.
        """
        first, end = (None if t is None else max(0, round(t * self.fs)) for t in (start, stop))
        part = self.pressure[first:end]
        if not part.size:
            raise RecordError(f"no sample lies between {start} and {stop} s: the sound lasts {self.duration:g} s")
        return replace(self, pressure=part)

    def faded(self, seconds: float = FLANK) -> Sound:
        """Return the sound faded in and out by raised cosines.

        Parameters
        ----------
        seconds : float
            Length of each fade, s; at most half the sound's.
        """
        count = min(round(seconds * self.fs), self.pressure.size // 2)
        flank = np.sin(np.pi / 2 * (np.arange(count) + 0.5) / max(count, 1)) ** 2
        middle = np.ones(self.pressure.size - 2 * count)
        return replace(self, pressure=self.pressure * np.concatenate((flank, middle, flank[::-1])))

    def _overview(self) -> Overview:
        facts = {
            "level": f"{self.level:.1f} dB re 20 µPa",
            "peak": f"{np.abs(self.pressure).max():.4g} Pa",
            "from": self.name,
        }
        return Overview(f"Sound of {self.duration:g} s at {self.fs:g} Hz", facts)
