"""Band-limited change of a sampling rate, by any ratio."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import scipy.signal

from ..core.errors import RecordError
from .sampling import ATTENUATION, PASS, STOP

__all__ = ["resampled"]

MAX_TERM = 10_000  # largest numerator or denominator of a ratio: rates are met within 1e-8


def resampled(value: np.ndarray, fs: float, rate: float, ends: str = "constant") -> np.ndarray:
    """Return samples at another rate; the first one stays where it is.

    The filter is as those between records and simulations: flat within 0.01 dB up to 0.4 of the lower rate, 80 dB down
    from 0.6 of it on, without delay.

    Parameters
    ----------
    value : ndarray, shape (n,)
        Samples.
    fs, rate : float
        Samples per second, before and after.
    ends : str
        What is taken beyond the ends, as ``padtype`` of `scipy.signal.resample_poly`: "constant" is zero, "line" the
        straight line through the first and the last sample.

    Returns
    -------
    ndarray, shape (ceil(n rate / fs),)

    Raises
    ------
    RecordError
        If the rates' ratio is beyond 10000.
    """
    if not 1 / MAX_TERM < rate / fs < MAX_TERM:
        raise RecordError(f"{fs:g} samples per second cannot be brought to {rate:g}")
    ratio = Fraction(rate / fs).limit_denominator(MAX_TERM)
    if ratio == 1:
        return np.array(value, dtype=float)
    up, down = ratio.numerator, ratio.denominator
    most = max(up, down)  # of the lower rate's samples, in the common fast rate
    count, beta = scipy.signal.kaiserord(ATTENUATION, (STOP - PASS) / (most / 2))
    taps = scipy.signal.firwin(2 * (count // 2) + 1, (PASS + STOP) / 2, window=("kaiser", beta), fs=most)
    found: np.ndarray = scipy.signal.resample_poly(value, up, down, window=taps, padtype=ends)
    return found
