"""Full spectra: forward and backward whirl of a point of a shaft, at one speed and over speed.

Displacements along y and z are one complex signal, w = y + i z. Its lines above 0 Hz are circles from y to z, which is
forward for a spin > 0, those below are circles the other way round. An ellipse with semi-axes a >= b that is run
through forwards is a forward circle of radius (a + b)/2 and a backward one of (a - b)/2; a motion on a line is both in
equal parts.

Source: Goldman & Muszynska, Application of full spectrum to rotating machinery diagnostics, Orbit, 1999.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.signal

from ..core.errors import RecordError
from .arrays import ArrayData

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FullSpectrum", "SpeedCascade", "full_spectrum", "speed_cascade"]

OVERLAP = 0.75  # of adjacent windows: a flat-top window weights so little of each that less overlap wastes samples
WINDOWS = ("flattop", "hann", "boxcar")


@dataclass(frozen=True, eq=False, repr=False)
class FullSpectrum(ArrayData):
    """Amplitudes of circles that make up a motion along y and z. Made by `full_spectrum`."""

    frequency: np.ndarray
    """(n_f,) Hz, rising and symmetric about 0: from y to z above 0, from z to y below"""
    amplitude: np.ndarray
    """(n_f,) m: a circle of radius a has a line a, in either sense"""
    window: str
    """of each stretch of samples: "flattop", "hann" or "boxcar" """
    averages: int
    """number of windows, whose squares are averaged"""

    @property
    def resolution(self) -> float:
        """Distance of the lines, Hz."""
        return float(self.frequency[1] - self.frequency[0])

    def plot(self, spin: float | None = None) -> Figure:
        """Draw amplitudes over frequency, backward whirl on the left.

        Parameters
        ----------
        spin : float, optional
            rad/s, of the shaft: its lines are marked, and its sign says which sense is forward. None: not known.
        """
        from .orbit_figures import full_spectrum_figure

        return full_spectrum_figure({"": self}, spin)


@dataclass(frozen=True, eq=False, repr=False)
class SpeedCascade(ArrayData):
    """Full spectra of windows along a run-up or run-down. Made by `speed_cascade`."""

    time: np.ndarray
    """(n,) s, of the windows' middles"""
    speed: np.ndarray
    """(n,) rad/s, mean spin within each window"""
    frequency: np.ndarray
    """(n_f,) Hz, as of a full spectrum"""
    amplitude: np.ndarray
    """(n, n_f) m"""
    window: str
    """of each stretch of samples"""

    @property
    def resolution(self) -> float:
        """Distance of the lines, Hz; the windows are as long as its inverse."""
        return float(self.frequency[1] - self.frequency[0])

    def order(self, n: float) -> np.ndarray:
        """Return the amplitude (n,) m at a multiple of the spin: the largest of the nearest line and its neighbours.

        Parameters
        ----------
        n : float
            Multiple, > 0 with the spin and < 0 against it.
        """
        nearest = np.rint(n * self.speed / (2 * np.pi) / self.resolution).astype(int) + self.frequency.size // 2
        lines = np.clip(nearest[:, None] + np.arange(-1, 2), 0, self.frequency.size - 1)
        largest = np.take_along_axis(self.amplitude, lines, axis=1).max(axis=1)
        inside = np.abs(n * self.speed) / (2 * np.pi) <= self.frequency[-1]
        return np.asarray(np.where(inside, largest, np.nan))

    def plot(self, highest: float | None = None) -> Figure:
        """Draw amplitudes over frequency and speed, with the lines of the spin and of its multiples.

        Parameters
        ----------
        highest : float, optional
            Hz, to which both sides are drawn; None: five times the highest spin, where that is known.
        """
        from .orbit_figures import cascade_figure

        return cascade_figure({"": self}, highest)


def full_spectrum(
    y: np.ndarray, z: np.ndarray, fs: float, resolution: float = 1.0, window: str = "flattop"
) -> FullSpectrum:
    """Return the full spectrum of a point that moves along y and z, about its mean position.

    Parameters
    ----------
    y, z : ndarray, shape (n_t,)
        Displacements, m.
    fs : float
        Samples per second.
    resolution : float
        Distance of the lines, Hz; windows are as long as its inverse and overlap by three quarters.
    window : str
        "flattop": a line anywhere between two lines is at most 0.2 % too low, and seen over nine lines. "hann": seen
        over three, and up to 15 % too low. "boxcar": for a whole number of periods.

    Raises
    ------
    RecordError
        If y and z differ in length, are shorter than a window, or are not finite; if the window is unknown.
    """
    w = _whirl(y, z)
    size = _window_size(w.size, fs, resolution, window)
    starts = np.arange(0, w.size - size + 1, max(round(size * (1 - OVERLAP)), 1))
    frequency, amplitude = _window_amplitudes(w - w.mean(), starts, size, fs, window)
    return FullSpectrum(frequency, np.sqrt(np.mean(amplitude**2, axis=0)), window, starts.size)


def speed_cascade(
    y: np.ndarray, z: np.ndarray, fs: float, speed: np.ndarray, resolution: float = 2.0, window: str = "hann",
    n_windows: int = 80,
) -> SpeedCascade:  # fmt: skip
    """Return full spectra along a run-up or run-down: of windows that are equally far apart in time.

    The shaft's spin should change little within a window, by less than ``resolution``: a line is smeared over what it
    changes by.

    Parameters
    ----------
    y, z : ndarray, shape (n_t,)
        Displacements, m.
    fs : float
        Samples per second.
    speed : ndarray, shape (n_t,)
        Spin, rad/s, > 0 from y to z.
    resolution : float
        Distance of the lines, Hz; windows are as long as its inverse.
    window : str
        As of `full_spectrum`.
    n_windows : int
        Number of windows, at most as many as there are samples.

    Raises
    ------
    RecordError
        As of `full_spectrum`, and if speed has another length.
    """
    w, speed = _whirl(y, z), np.asarray(speed, dtype=float)
    if speed.shape != w.shape:
        raise RecordError(f"speed must have a value for each of the {w.size} samples, got shape {speed.shape}")
    if n_windows < 1:
        raise RecordError(f"n_windows {n_windows}: must be at least 1")
    size = _window_size(w.size, fs, resolution, window)
    starts = np.unique(np.linspace(0, w.size - size, n_windows).round().astype(int))
    frequency, amplitude = _window_amplitudes(w, starts, size, fs, window, about_mean=True)
    mean = np.array([speed[start : start + size].mean() for start in starts])
    return SpeedCascade((starts + (size - 1) / 2) / fs, mean, frequency, amplitude, window)


def _whirl(y: np.ndarray, z: np.ndarray) -> np.ndarray:
    y, z = np.asarray(y, dtype=float), np.asarray(z, dtype=float)
    if y.ndim != 1 or y.shape != z.shape:
        raise RecordError(f"y and z must have one value for each sample, got shapes {y.shape} and {z.shape}")
    w: np.ndarray = y + 1j * z
    if not np.isfinite(w).all():
        raise RecordError(f"y and z: sample {int(np.argmin(np.isfinite(w)))} is not a finite number")
    return w


def _window_size(n: int, fs: float, resolution: float, window: str) -> int:
    RecordError.require_known("window", window, WINDOWS)
    if not 0 < resolution <= fs / 8:
        raise RecordError(f"resolution {resolution:g} Hz: must be above 0 and at most an eighth of {fs:g} samples/s")
    size = round(fs / resolution)
    if size > n:
        raise RecordError(
            f"resolution {resolution:g} Hz needs windows of {1 / resolution:g} s, and there are {n / fs:g} s; give at "
            f"least {fs / n:.3g} Hz"
        )
    return size


def _window_amplitudes(
    w: np.ndarray, starts: np.ndarray, size: int, fs: float, window: str, about_mean: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return signed frequencies (n_f,), symmetric about 0, and amplitudes (n_starts, n_f) of windows of a signal."""
    shape = scipy.signal.get_window(window, size)
    shape /= shape.sum()
    half = (size - 1) // 2  # an even number of samples has a line at -fs/2 alone, which has no sense
    lines = np.arange(-half, half + 1)
    amplitude = np.empty((starts.size, lines.size))
    for i, start in enumerate(starts):  # one window after the other: all at once may not fit into memory
        part = w[start : start + size]
        part = part - part.mean() if about_mean else part
        amplitude[i] = np.abs(np.fft.fft(part * shape)[lines])
    return lines * fs / size, amplitude
