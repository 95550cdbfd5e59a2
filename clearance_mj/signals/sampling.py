"""Conversion between the sampling rate of a record and the time step of a simulation.

An excitation is brought to the step by band-limited interpolation; outputs pass a linear-phase anti-alias filter
before they are decimated, as in a data acquisition system. Every engine and the virtual rig use these two.

Both filters are Kaiser-windowed sincs without delay: flat within 0.01 dB up to 0.4 fs, 80 dB down from 0.6 fs.
As flat and as steep is the one that brings a whole record from its rate to another (`resampled`).
"""

from __future__ import annotations

import functools
from fractions import Fraction

import numpy as np
import scipy.signal

from ..core.errors import RecordError
from ..core.jit import jit

__all__ = ["Decimator", "Interpolator", "decimate", "interpolate", "lowpass", "resampled"]

PASS, STOP, ATTENUATION = 0.4, 0.6, 80.0


@functools.cache
def lowpass(factor: int) -> np.ndarray:
    """Return taps (2 * m * factor + 1,) of the filter between ``fs`` and ``factor * fs``: symmetric, of unit gain."""
    taps = np.ones(1)
    if factor > 1:
        count, beta = scipy.signal.kaiserord(ATTENUATION, (STOP - PASS) / (factor / 2))
        half = factor * int(np.ceil(count / (2 * factor)))
        taps = scipy.signal.firwin(2 * half + 1, (PASS + STOP) / 2, window=("kaiser", beta), fs=factor)
    taps.flags.writeable = False
    return taps


def interpolate(value: np.ndarray, factor: int) -> np.ndarray:
    """Raise the rate of samples (n,) to (n * factor,), band-limited; they are zero beyond their ends.

    Sample i of the input is sample i * factor of the output.
    """
    interpolator = Interpolator(factor)
    return np.concatenate((interpolator.push(np.asarray(value, dtype=float)), interpolator.flush()))


class Interpolator:
    """Interpolate a stream of blocks, so that memory does not grow with the record; blocks do not change the sums.

    Blocks are (n,), or (n, inputs) of several ``inputs``.
    """

    def __init__(self, factor: int, inputs: int | None = None) -> None:
        self.factor = factor
        self.taps = factor * lowpass(factor)
        self.ahead = self.taps.size // 2 // factor
        """input samples that an output waits for"""
        self._input_shape = () if inputs is None else (inputs,)
        self._buffer = np.zeros((self.ahead, *self._input_shape))  # samples that the next outputs' filter needs

    def push(self, block: np.ndarray) -> np.ndarray:
        """Take the next samples (n,) and return the fast ones (m * factor,) that are complete."""
        buffer = np.concatenate((self._buffer, block))
        count = max(0, len(buffer) - 2 * self.ahead)
        self._buffer = buffer[count:]
        if not count:
            return np.empty((0, *self._input_shape))
        first = 2 * self.ahead * self.factor
        return scipy.signal.upfirdn(self.taps, buffer, up=self.factor, axis=0)[first : first + count * self.factor]

    def flush(self) -> np.ndarray:
        """Return the samples that still wait for input, as if zeros came after them."""
        return self.push(np.zeros((self.ahead, *self._input_shape)))


class Decimator:
    """Low-pass and decimate a stream of blocks; output sample i is centred on input sample i * factor.

    ``before``, one number or (channels,), is the channels' value before the stream.
    """

    def __init__(self, channels: int, factor: int, before: float | np.ndarray = 0.0) -> None:
        self.factor = factor
        self.taps = lowpass(factor)
        self.half = self.taps.size // 2
        self._buffer = np.zeros((channels, self.half)) + np.reshape(before, (-1, 1))
        self._first = 0  # position in the buffer of the first sample under the next output's filter

    def push(self, block: np.ndarray) -> np.ndarray:
        """Take the next fast samples (n, channels) and return the slow ones (m, channels) that are complete."""
        buffer = np.concatenate((self._buffer, block.T), axis=1)
        count = max(0, (buffer.shape[1] - self._first - self.taps.size) // self.factor + 1)
        out = np.empty((count, buffer.shape[0]))
        _filter(buffer, self.taps, self._first, self.factor, out)
        start = self._first + count * self.factor
        self._buffer, self._first = buffer[:, start:], max(0, start - buffer.shape[1])
        return out

    def flush(self) -> np.ndarray:
        """Return the samples that still wait for input, as if zeros came after them."""
        return self.push(np.zeros((self.half, self._buffer.shape[0])))


def decimate(value: np.ndarray, factor: int) -> np.ndarray:
    """Low-pass and decimate a whole record (n, channels) to (ceil(n / factor), channels)."""
    decimator = Decimator(value.shape[1], factor)
    out = np.concatenate((decimator.push(value), decimator.flush()))
    return out[: -(-value.shape[0] // factor)]


@jit(fastmath=True)
def _filter(buffer: np.ndarray, taps: np.ndarray, first: int, factor: int, out: np.ndarray) -> None:
    for i in range(out.shape[0]):
        start = first + i * factor
        for channel in range(buffer.shape[0]):
            under = buffer[channel, start : start + taps.size]  # a slice, so that the compiler sees no negative index
            total = 0.0
            for j in range(taps.size):
                total += taps[j] * under[j]
            out[i, channel] = total


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
        Continuation beyond the ends, as ``padtype`` of `scipy.signal.resample_poly`: "constant" is zero, "line" the
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
    largest = max(up, down)  # of the lower rate's samples, in the common fast rate
    count, beta = scipy.signal.kaiserord(ATTENUATION, (STOP - PASS) / (largest / 2))
    taps = scipy.signal.firwin(2 * (count // 2) + 1, (PASS + STOP) / 2, window=("kaiser", beta), fs=largest)
    samples: np.ndarray = scipy.signal.resample_poly(value, up, down, window=taps, padtype=ends)
    return samples
