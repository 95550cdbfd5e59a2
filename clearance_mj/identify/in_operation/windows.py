"""Windows of orbit records: spectra of the probes' displacement, and the slow motion that laws are driven by.

Under Hann's window w a shaft's forces are H⁻¹ (w d) but for the window's slope, which is small beside all dynamics but
the sharp antiresonances, where the forces' expected error is large in any case.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.fft
import scipy.signal
from scipy.interpolate import CubicSpline

from ...core.errors import RecordError
from ...estimate.parameter import Parameter
from ...rig import Rig
from ..records.prepared import PreparedRecord
from .gains import ORDERS, places_of_unbalance, probe_gains, unit_unbalance_forces

__all__ = ["BandLimits", "RecordWindow", "bands_of", "linear_parameters", "select_windows"]

LENGTH = 1.5  # s, of a window
STEADY, CHANGING = 3, 16  # windows of a record at one speed, and of a run-up, at most
PLAIN = ("structure.", "beam.", "masses[", "1/beam.clamp")
SUPPORT = math.log(2.0)  # 1 σ of the logarithm of a support's stiffness: orbits hardly identify it
LIKELY_UNBALANCE = 2.0  # of the rig file's: 1 σ of its parts along and across the mark
RUN_OUT = 0.1  # of the gap: 1 σ of the run-out per order, along cosine and sine
CLEARED = 1.0  # s, pieces in which noise is left out
CERTAIN = 6.0  # of the noise's power, from which on a line counts
WIDEST = 0.4  # of the rate: highest frequency of the motion
NOISY = 0.7  # of half the rate: from there on a probe shows but noise
QUIETEST = 1e-3  # of a probe's RMS: none is taken to be quieter
FORCE_NOISE = 0.03  # of the force's RMS that the probes' noise may make: where the band of forces ends
LEAST_TURNS = 5.0  # multiples of the fastest spin that the band of forces holds
RATE = 5.0  # samples of motion per period of its highest frequency


@functools.lru_cache(maxsize=32)
def hann(size: int) -> np.ndarray:
    """Return Hann's window (size,).

    Parameters
    ----------
    size : int
        Number of samples.
    """
    window = scipy.signal.get_window("hann", size)
    window.flags.writeable = False
    return np.asarray(window)


class BandLimits(NamedTuple):
    """Upper limits of the bands in which forces are compared and motion is known, Hz."""

    force: float
    motion: float


@dataclass(frozen=True, eq=False)
class RecordWindow:
    """A piece of a record."""

    record: str  #: name
    start: float  #: s in the record, of its first sample
    fs: float  #: samples per second of the spectra's signals
    displacement: np.ndarray  #: (n, m) m, from where the shaft rests standing still; m = 2 n_bushings
    clear: np.ndarray  #: (n, m) the same without noise, as far as it differs from motion
    angle: np.ndarray  #: (n,) rad
    speed: np.ndarray  #: (n,) rad/s
    steady: bool  #: True in a record at one speed
    noise: np.ndarray  #: (m,) m, standard deviation of a sample of each probe

    @property
    def mean_speed(self) -> float:
        """Mean spin, rad/s."""
        return float(self.speed.mean())

    @property
    def size(self) -> int:
        """Number of samples."""
        return len(self.angle)

    def spectra(self, lines: int) -> WindowSpectra:
        """Return the first lines of the spectra of the measured signals.

        Parameters
        ----------
        lines : int
            Number of lines from 0 Hz on.
        """
        taper = hann(self.size)
        forces, waves = unit_unbalance_forces(self.angle, self.speed), angle_harmonics(self.angle)
        parts = self.displacement, forces, waves, np.ones((self.size, 1))
        return WindowSpectra(*(np.fft.rfft((p.T * taper).T, axis=0)[:lines] for p in parts))


class WindowSpectra(NamedTuple):
    """Spectra of a window, under Hann's window."""

    displacement: np.ndarray  #: (n_f, m)
    unbalance: np.ndarray  #: (n_f, 2, 2) forces along y and z of unit unbalances along and across the mark
    waves: np.ndarray  #: (n_f, 2 n_orders) cosine and sine of multiples of the shaft's angle
    one: np.ndarray  #: (n_f, 1) of a constant


def angle_harmonics(angle: np.ndarray) -> np.ndarray:
    """Return (n, 2 n_orders) cosine and sine of the multiples of the shaft's angle that run-out has.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        rad.
    """
    return np.column_stack([f(order * angle) for order in ORDERS for f in (np.cos, np.sin)])


def select_windows(record: PreparedRecord) -> list[RecordWindow]:
    """Return windows of a record, half a window apart or farther, as many as say something new.

    Parameters
    ----------
    record : PreparedRecord
        Whose shaft turns, with probes.
    """
    windows = windows_of(record, LENGTH / 2)
    most = STEADY if windows[0].steady else CHANGING
    if len(windows) <= most:
        return windows
    return [windows[i] for i in np.round(np.linspace(0, len(windows) - 1, most)).astype(int).tolist()]


def windows_of(record: PreparedRecord, hop: float) -> list[RecordWindow]:
    """Return all windows of a record whose shaft turns, with probes.

    Parameters
    ----------
    record : PreparedRecord
        The record.
    hop : float
        s, from one to the next.
    """
    if record.displacement is None or record.turning is None:
        raise RecordError(f'record "{record.name}": has no two probes in each clearance, or its shaft does not turn')
    name, fs, spin, x = record.name, record.fs, record.tested.spin, record.displacement.T
    size, steady = round(LENGTH * fs), not (spin and spin.rate)
    if len(x) < size:
        raise RecordError(
            f'record "{name}": lasts {record.duration:.3g} s; orbits are looked at in windows of {LENGTH:g} s'
        )
    noise = noise_of(x)
    clear = without_noise(x, noise, fs)
    windows = []
    for start in range(0, len(x) - size + 1, round(hop * fs)):
        at = slice(start, start + size)
        angle, speed = smooth_angle(record.turning.angle[at], fs)
        windows.append(RecordWindow(name, start / fs, fs, x[at], clear[at], angle, speed, steady, noise))
    return windows


def smooth_angle(angle: np.ndarray, fs: float) -> tuple[np.ndarray, np.ndarray]:
    """Return angle (n,), rad, and speed (n,), rad/s, of a shaft without the jitter of its sampled pulses: a cubic.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        rad, of a window.
    fs : float
        Samples per second.
    """
    time = np.linspace(-1.0, 1.0, angle.size)
    cubic = np.polynomial.Chebyshev.fit(time, angle, 3)
    return np.asarray(cubic(time)), np.asarray(cubic.deriv()(time) * 2 * fs / (angle.size - 1))


def without_noise(displacement: np.ndarray, noise: np.ndarray, fs: float) -> np.ndarray:
    """Return probes (n_t, m), m, in which lines that are not above the noise are left out (Wiener's filter).

    Laws see the motion with its noise, and the probes show the same noise: it would count as a force of springs.

    Parameters
    ----------
    displacement : ndarray, shape (n_t, m)
        Of a record.
    noise : ndarray, shape (m,)
        Standard deviation of a sample, m.
    fs : float
        Samples per second.
    """
    size = min(round(CLEARED * fs), len(displacement))
    taper = hann(size)
    transform = scipy.signal.ShortTimeFFT(taper, max(size // 4, 1), fs)
    padded = np.pad(displacement, [(size // 2, size - size // 2), (0, 0)], "reflect", reflect_type="odd")
    spectra = transform.stft(padded, axis=0)
    level = (CERTAIN * np.sum(taper**2) * noise**2)[None, :, None]
    spectra *= np.clip(1 - level / np.maximum(np.abs(spectra) ** 2, 1e-300), 0.0, 1.0)
    clear = transform.istft(spectra, k1=len(padded), f_axis=0, t_axis=-1)
    return np.asarray(clear.reshape(len(padded), -1)[size // 2 : size // 2 + len(displacement)])


def noise_of(displacement: np.ndarray) -> np.ndarray:
    """Return the white noise of probes (m,), m, from their spectra above the frequencies of any motion.

    Parameters
    ----------
    displacement : ndarray, shape (n_t, m)
        Of a record.
    """
    size = min(len(displacement), 4096)
    taper = hann(size)
    pieces = [displacement[i : i + size].T * taper for i in range(0, len(displacement) - size + 1, size)]
    power = np.mean([np.abs(np.fft.rfft(piece)[:, round(NOISY * size / 2) :]) ** 2 for piece in pieces], axis=0)
    quiet = np.median(power, axis=1) / float(np.sum(taper**2))
    return np.asarray(np.maximum(np.sqrt(quiet), QUIETEST * np.std(displacement, axis=0)))


def linear_parameters(rig: Rig, numbers: Sequence[Parameter]) -> list[Parameter]:
    """Return the parameters of the forces that probes show: the linear rig's numbers, unbalances and run-out.

    Parameters
    ----------
    rig : Rig
        The rig.
    numbers : sequence of Parameter
        Open parameters of its file, of which those that the probes' signals depend on are taken.
    """
    ends, parameters = (".position", ".probe_angle"), []
    for p in numbers:
        if p.name.startswith((*PLAIN, "probes[")) or (p.name.startswith("bushings[") and p.name.endswith(ends)):
            parameters.append(replace(p, prior_std=min(p.prior_std, SUPPORT)) if ".supports[" in p.name else p)
    for i, (_, size) in enumerate(places_of_unbalance(rig)):
        most, std = 50 * size, LIKELY_UNBALANCE * size
        for part in ("along", "across"):
            parameters.append(Parameter(f"unbalances[{i}] {part} the mark", "kg m", 0.0, -most, most, std, "linear"))
    for probe, order, wave in itertools.product(range(2 * len(rig.bushings)), ORDERS, ("cos", "sin")):
        name, std = f"probes[{probe}] run-out {order}x {wave}", RUN_OUT * rig.bushings[probe // 2].gap
        parameters.append(Parameter(name, "m", 0.0, -10 * std, 10 * std, std, "linear"))
    return parameters


def bands_of(rig: Rig, windows: Sequence[RecordWindow]) -> BandLimits:
    """Return the bands within which probes show forces and motion over their noise.

    Parameters
    ----------
    rig : Rig
        The rig.
    windows : sequence of Window
        Of all records, of one length and rate.
    """
    fs, size = windows[0].fs, windows[0].size
    fastest = max(abs(w.mean_speed) for w in windows) / (2 * np.pi)
    frequency = np.fft.rfftfreq(size, 1 / fs)
    taper = hann(size)
    power = np.array([np.abs(np.fft.rfft((w.displacement.T * taper).T, axis=0)) ** 2 for w in windows])
    noise = np.median([w.noise for w in windows], axis=0)
    highest = WIDEST * fs
    inside = frequency <= highest
    middle = float(np.median([w.mean_speed for w in windows]))
    inverse = np.abs(probe_gains(rig, {}, middle, 2 * np.pi * frequency[inside]).inverse) ** 2
    # Antiresonances, where the noise of few lines would make any force, count as their surroundings do.
    by_line = np.einsum("fij,j->f", inverse, noise**2 * float(np.sum(taper**2)))
    of_noise = np.cumsum(scipy.signal.medfilt(by_line, 2 * (by_line.size // 20) + 1))
    least = min(max(LEAST_TURNS * fastest, 20.0), 0.5 * highest)
    below = frequency[inside] <= least
    levels = np.sum(power[:, inside][:, below] * np.abs(inverse[0].max()), axis=(1, 2))
    end = float(frequency[inside][max(np.searchsorted(of_noise, FORCE_NOISE**2 * np.quantile(levels, 0.75)) - 1, 0)])
    force = min(max(end, least), 0.5 * highest)
    return BandLimits(force, min(highest, max(2 * force, 8 * fastest, 100.0)))


class LowFrequencyMotion(NamedTuple):
    """The motion of windows below the highest frequency at which it is known, one after the other."""

    rate: float  #: samples per second
    size: int  #: samples of a window
    x: np.ndarray  #: (n_t, m) displacement at the probes, m
    v: np.ndarray  #: (n_t, m) m/s
    waves: np.ndarray  #: (n_t, 2 n_orders) see `angle_harmonics`
    waves_by_time: np.ndarray  #: (n_t, 2 n_orders) 1/s
    spin: np.ndarray  #: (n_t,) rad/s


def slow_motion(windows: Sequence[RecordWindow], bands: BandLimits) -> LowFrequencyMotion:
    """Return the motion of windows at a rate that its band needs.

    Parameters
    ----------
    windows : sequence of Window
        Of one length and rate.
    bands : Bands
        As `bands_of` returns them.
    """
    fs = windows[0].fs
    step, half = max(1, int(fs / (RATE * bands.motion))), round(2.0 * fs / bands.motion)
    taps = scipy.signal.firwin(2 * half + 1, min(1.1 * bands.motion, 0.49 * fs), fs=fs, window=("kaiser", 4.0))
    parts_of_windows = []
    for window in windows:
        ends = np.pad(window.clear, ((half, half), (0, 0)), "reflect", reflect_type="odd")
        smooth = scipy.signal.fftconvolve(ends, taps[:, None], "valid", axes=0)
        time = np.arange(window.size) / fs
        v = CubicSpline(time, smooth, axis=0)(time, 1)
        waves = angle_harmonics(window.angle)
        derivative = waves.reshape(-1, len(ORDERS), 2)[:, :, ::-1] * np.array([-1.0, 1.0])
        by_time = derivative.reshape(len(waves), -1) * np.repeat(ORDERS, 2) * window.speed[:, None]
        parts_of_windows.append([each[::step] for each in (smooth, v, waves, by_time, window.speed)])
    signals = [np.concatenate(parts) for parts in zip(*parts_of_windows)]
    return LowFrequencyMotion(fs / step, len(parts_of_windows[0][0]), *signals)
