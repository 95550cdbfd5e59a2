"""Loudness of sounds by Zwicker's method, ISO 532-1:2017, as MoSQITo computes it."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..core.errors import ClearanceError, RecordError
from ..core.overview import HasOverview, Overview
from ..signals.arrays import ArrayData
from ..signals.sampling import resampled
from .pressure import Sound
from .wav import RATE

__all__ = ["Field", "Loudness", "Method", "has_mosqito", "loudness", "loudness_level"]

Method: TypeAlias = Literal["time-varying", "stationary"]
Field: TypeAlias = Literal["free", "diffuse"]
BAND = 0.1  # Bark, between two values of the specific loudness
STEP = 0.002  # s, between two values of the loudness over time
SHORTEST = 0.1  # s, least duration of a sound: settling time of the filters of the lowest bands


@dataclass(frozen=True, eq=False, repr=False)
class Loudness(HasOverview, ArrayData):
    """Loudness of a sound by ISO 532-1: over time, or of a stationary sound."""

    method: Method
    """"time-varying" (method 2 of the standard) or "stationary" (method 1)"""
    field: Field
    """"free" or "diffuse" sound field"""
    sone: np.ndarray
    """(n,) N(t) every 2 ms, sone, read-only; (1,) of a stationary sound"""
    specific: np.ndarray
    """(240, n) N'(z, t), sone/Bark, read-only"""

    @property
    def time(self) -> np.ndarray:
        """(n,) s"""
        return STEP * np.arange(self.sone.size)

    @property
    def bark(self) -> np.ndarray:
        """(240,) critical-band rate z of the specific loudness, 0.1 to 24 Bark"""
        return BAND * np.arange(1, len(self.specific) + 1)

    def exceeded(self, share: float) -> float:
        """Return the loudness, sone, exceeded for a fraction of the time, 0 to 1.

        Parameters
        ----------
        share : float
            0.05 for N5.
        """
        return float(np.percentile(self.sone, 100 * (1 - share)))

    @property
    def n5(self) -> float:
        """Loudness exceeded in 5 % of the time, sone, the value of ISO 532-1 for time-varying sounds."""
        return self.exceeded(0.05)

    @property
    def maximum(self) -> float:
        """Largest loudness, sone."""
        return float(self.sone.max())

    @property
    def phon(self) -> float:
        """Loudness level of N5 (of a stationary sound: of its loudness), phon."""
        return loudness_level(self.n5)

    def _overview(self) -> Overview:
        facts = {"method": f"ISO 532-1, {self.method}, {self.field} field", "level": f"{self.phon:.1f} phon"}
        if self.method == "time-varying":
            facts["largest"] = f"{self.maximum:.3g} sone"
            return Overview(f"Loudness: {self.n5:.3g} sone exceeded in 5 % of the time", facts)
        return Overview(f"Loudness: {self.maximum:.3g} sone", facts)


def loudness(sound: Sound, method: Method = "time-varying", field: Field = "free") -> Loudness:
    """Return the loudness of a sound by ISO 532-1:2017 (Zwicker's method).

    Parameters
    ----------
    sound : Sound
        Pressure at the position of the listener's head; it is resampled to 48000 samples per second.
    method : {"time-varying", "stationary"}
        For any sound, 2 s of computation per second; or for a stationary sound, at once.
    field : {"free", "diffuse"}
        Sound from the front, or from all directions.

    Returns
    -------
    Loudness

    Raises
    ------
    ClearanceError
        If MoSQITo is not installed.
    RecordError
        If the sound is shorter than 0.1 s, or the method or field is unknown.
    """
    if method not in ("time-varying", "stationary"):
        raise RecordError(f'method "{method}" is unknown; use time-varying or stationary')
    if field not in ("free", "diffuse"):
        raise RecordError(f'field "{field}" is unknown; use free or diffuse')
    if sound.duration < SHORTEST:
        raise RecordError(f"a sound of {sound.duration:g} s is too short for its loudness; needs {SHORTEST:g} s")
    if not has_mosqito():
        raise ClearanceError('loudness needs the package mosqito: pip install "clearance-mj[sound]"')
    from mosqito.sq_metrics.loudness.loudness_zwst.loudness_zwst import loudness_zwst
    from mosqito.sq_metrics.loudness.loudness_zwtv.loudness_zwtv import loudness_zwtv

    pressure = resampled(sound.pressure, sound.fs, RATE)
    if method == "stationary":
        sone, specific, _ = loudness_zwst(pressure, int(RATE), field_type=field)
        return Loudness(method, field, np.atleast_1d(sone), np.reshape(specific, (-1, 1)))
    over_time, specific, _, _ = loudness_zwtv(pressure, int(RATE), field_type=field)
    return Loudness(method, field, over_time, specific)


def has_mosqito() -> bool:
    """Return True if MoSQITo, which computes loudness, is installed."""
    return importlib.util.find_spec("mosqito") is not None


def loudness_level(sone: float) -> float:
    """Return the loudness level of a loudness, phon (ISO 532-1:2017, 5.3).

    Parameters
    ----------
    sone : float
        Loudness, sone.
    """
    if sone >= 1:
        return float(40 + 10 * np.log2(sone))
    return float(max(40 * (sone + 0.0005) ** 0.35, 3.0))
