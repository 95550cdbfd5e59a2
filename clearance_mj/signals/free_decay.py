"""Frequency and damping of a mode over its amplitude, from the ridge of a free decay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyfit

from ..core.errors import RecordError
from .arrays import runs
from .wavelet import Ridge

__all__ = ["Decay", "decay"]

DEGREE = 2  # of the polynomials through phase and ln(amplitude) of a window


@dataclass(frozen=True, eq=False)
class Decay:
    """Amplitude, frequency and damping of a free decay from window to window, one after the other."""

    time: np.ndarray  #: (n,) s, middles of the windows
    amplitude: np.ndarray  #: (n,) in units of the signal
    frequency: np.ndarray  #: (n,) Hz
    damping: np.ndarray  #: (n,) ratio to critical, -A'/(ω A)


def decay(line: Ridge, window: float, fs: float) -> Decay:
    """Read frequency and damping from the valid part of a ridge, window by window.

    Parameters
    ----------
    line : Ridge
        Ridge of a free decay, as `ridge` finds it.
    window : float
        s; windows of this length follow one another without overlap.
    fs : float
        Samples per second.

    Returns
    -------
    Decay
        At the middle of each window the values and slopes of parabolas through phase and ln(amplitude), weighted by
        Hann's window: what beats with the wavelet's cut end (an impact) averages out.

    Raises
    ------
    RecordError
        If the valid part is shorter than one window, or a window shorter than eight samples.
    """
    size = round(window * fs)
    if size < 8:
        raise RecordError(f"a window of {window:g} s has {max(size, 0)} samples at {fs:g} Hz, at least 8 are needed")
    starts = [i for begin, end in runs(line.valid) for i in range(begin, end - size + 1, size)]
    if not starts:
        raise RecordError(f"no valid part of the ridge is as long as a window of {window:g} s")
    rows = np.array(starts)[:, None] + np.arange(size)
    time = (np.arange(size) - (size - 1) / 2) / fs
    weight = np.sqrt(np.hanning(size + 2)[1:-1])
    phase = np.cumsum(line.omega[rows], axis=1) / fs  # the ridge's own jumps where it changes its scale
    turning, level = (polyfit(time, v.T, DEGREE, w=weight) for v in (phase, np.log(line.amplitude[rows])))
    omega = turning[1]
    middle = line.time[rows[:, 0]] + (size - 1) / (2 * fs)
    return Decay(middle, np.exp(level[0]), omega / (2 * np.pi), -level[1] / omega)
