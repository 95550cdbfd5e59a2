"""Steering effort: how much, how often and how fast an angle turns."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.signal

from .controllers.compensation import Direction

__all__ = ["FAST_STEERING", "REVERSAL", "RateSpectrum", "effort", "rate_spectrum"]

REVERSAL = math.radians(1.0 / 16.0)
"""Angle at the road wheel, rad, by which a reversal turns back: 1° of the hand wheel."""
FAST_STEERING = 3.0  # Hz, above which no path asks for steering: a slalom at 80 km/h needs 0.35 Hz, a driver up to 2.
SEGMENT = 256  # samples of a segment of the spectrum, 2.56 s at 100 Hz


class RateSpectrum(NamedTuple):
    """One-sided power spectral density of an angle's rate."""

    frequency: np.ndarray  # (n_f,) Hz
    density: np.ndarray  # (n_f,) (rad/s)²/Hz

    def rms_above(self, frequency: float) -> float:
        """Return the RMS of the rate's part above a frequency, Hz, in rad/s."""
        step = self.frequency[1] - self.frequency[0]
        return float(np.sqrt(self.density[self.frequency > frequency].sum() * step))


def rate_spectrum(angle: np.ndarray, period: float) -> RateSpectrum:
    """Estimate the spectrum of the rate of an angle, rad (n,), sampled at a period, s.

    Welch's method on the differences from sample to sample: Hann windows of 256 samples that overlap by half; a shorter
    history is one segment. Welch, IEEE Trans. Audio Electroacoust. 15, 1967.
    """
    rate = np.diff(angle) / period
    return RateSpectrum(*scipy.signal.welch(rate, 1 / period, "hann", min(SEGMENT, rate.size), detrend="constant"))


def effort(angle: np.ndarray, period: float) -> dict[str, float]:
    """Return RMS rate and its part above `FAST_STEERING`, rad/s, and the number of reversals of an angle, rad (n,).

    A reversal is a change of direction by more than `REVERSAL`; the period of sampling is in s.
    """
    direction = Direction(REVERSAL)
    signs = np.array([direction.advance(value) for value in (angle - angle[0]).tolist()])
    return {
        "rms_rate": float(np.sqrt(np.mean((np.diff(angle) / period) ** 2))),
        "fast_rate": rate_spectrum(angle, period).rms_above(FAST_STEERING),
        "reversals": float(np.count_nonzero(np.diff(signs[signs != 0]))),
    }
