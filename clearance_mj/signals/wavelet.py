"""Wavelet ridges: the frequency and amplitude of a vibration from instant to instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pywt
import scipy.signal
from numpy.typing import ArrayLike

from ..core.errors import RecordError
from .channel_check import check_channel

__all__ = ["Ridge", "Scalogram", "ridge", "ridges", "scalogram"]

BANDWIDTH = 2.0  # B of cmorB-C: ψ(t) = (πB)^-1/2 exp(-t²/B + jω0 t) is the Morlet wavelet whose σ_t is its scale
SPACING = 0.25  # of neighbouring scales, in widths 1/σ_t of the wavelet in frequency
SUPPORT = 8 * np.sqrt(BANDWIDTH)  # of the tabulated wavelet, in scales
MASK = 4.0  # σ_t that are not valid at the ends and at each side of a jump
JUMP = 0.25  # change of frequency across a jump, in widths of the wavelet
RISE = 0.5  # of ln(amplitude) across an impact; a free decay never rises
SCATTER = 0.2  # of the instantaneous frequency, in widths of the wavelet; 0.3 to 0.5 in noise
STIFFNESS = 0.5  # of the ridge: price of a change of frequency by one width within σ_t, in ln(power)
GRID = 64  # points of PyWavelets' tabulated wavelet for each sample at the largest scale


@dataclass(frozen=True, eq=False)
class Scalogram:
    """Continuous wavelet transform of one signal over a band."""

    time: np.ndarray  #: (n_t,) s
    scale: np.ndarray  #: (n_a,) s, falling; the frequency at its centre is ω0/a
    value: np.ndarray
    """(n_a, n_t) complex; its magnitude is the amplitude of a sine at the centre frequency, in units of the signal"""
    omega0: float  #: centre of the wavelet, rad

    @property
    def frequency(self) -> np.ndarray:
        """(n_a,) Hz at the centres, rising"""
        return self.omega0 / (2 * np.pi * self.scale)


@dataclass(frozen=True, eq=False)
class Ridge:
    """One component of a vibration, A(t) cos φ(t), along the ridge of its wavelet transform."""

    time: np.ndarray  #: (n_t,) s
    omega: np.ndarray  #: (n_t,) rad/s, the derivative of the phase
    amplitude: np.ndarray  #: (n_t,) in units of the signal
    valid: np.ndarray  #: (n_t,) bool: at least 4 σ_t from the ends and from each jump, and above the noise
    phase: np.ndarray  #: (n_t,) rad, unwrapped
    spread: np.ndarray  #: (n_t,) σ_t of the wavelet on the ridge, s


def scalogram(signal: ArrayLike, fs: float, band: tuple[float, float], omega0: float = 5.0) -> Scalogram:
    """Transform a signal (n_t,) with Morlet wavelets exp(-t²/2 + jω0 t) whose centres lie in a band (Hz).

    The band begins above 0 and ends at most at fs / 2; ω0 is at least 4: the larger, the sharper in frequency and the
    blunter in time, σ_t = ω0/ω. Article, Eq. 13: A = 2|W|/√a with the transform W that PyWavelets normalises to equal
    energy at all scales. The spectrum of a wavelet reaches 4 ω/ω0 to each side of its centre; what is beyond fs / 2
    folds back.
    """
    signal = _check_signal(signal, fs, band, omega0)
    scale = _scales(fs, band, omega0)
    wavelet = pywt.ContinuousWavelet(f"cmor{BANDWIDTH}-{omega0 / (2 * np.pi)}")
    # PyWavelets takes the wavelet from -8 to 8 whatever B is
    wavelet.lower_bound, wavelet.upper_bound = -SUPPORT / 2, SUPPORT / 2
    # it steps through a table of 2^precision points, to the nearest one below
    precision = int(np.ceil(np.log2(SUPPORT * GRID * scale[0])))
    value, _ = pywt.cwt(signal - signal.mean(), scale, wavelet, method="fft", precision=max(12, precision))
    value *= (2 / np.sqrt(scale) / _sampling_loss(omega0 / scale))[:, None]
    return Scalogram(np.arange(signal.size) / fs, scale / fs, value, float(omega0))


def ridge(signal: ArrayLike, fs: float, band: tuple[float, float], omega0: float = 5.0) -> Ridge:
    """Follow the strongest component of a signal within a band.

    Parameters
    ----------
    signal : array_like
        (n_t,) samples, any unit.
    fs : float
        Samples per second.
    band : (float, float)
        Hz; wide enough for all frequencies of the component, narrow enough to leave out stronger ones.
    omega0 : float
        Centre of the Morlet wavelet, rad, at least 4. Components closer than about 4 ω/ω0 need a larger one.

    Raises
    ------
    RecordError
        If the signal is not finite, constant, clipped or too short for the wavelet, if there is no ridge above the
        noise, or if an argument is impossible.

    Notes
    -----
    The path of largest amplitude is found by dynamic programming (Carmona, Hwang and Torrésani, IEEE Trans. Signal
    Process. 47, 1999, 480), the frequency on it is the derivative of the phase (Delprat et al., IEEE Trans. Inf.
    Theory 38, 1992, 644), the amplitude is divided by the wavelet's spectrum at that frequency.
    """
    component, scatter = _follow(scalogram(signal, fs, band, omega0), fs)
    density = component.amplitude**2
    if np.sum(density * scatter) > SCATTER * np.sum(density):
        raise RecordError(f"no ridge above the noise between {band[0]:g} and {band[1]:g} Hz")
    return component


def skeleton(plane: Scalogram) -> Ridge:
    """Follow the strongest component of a scalogram even where no ridge stands above the noise."""
    return _follow(plane, 1 / (plane.time[1] - plane.time[0]))[0]


def shortest_record(lowest: float, omega0: float = 5.0) -> float:
    """Return the shortest record, s, that has valid samples between the masks at its ends."""
    return (2 * MASK + 2) * omega0 / (2 * np.pi * lowest)


def ridges(
    signal: ArrayLike, fs: float, bands: Sequence[tuple[float, float]], omega0: float = 5.0
) -> tuple[Ridge, ...]:
    """Follow several components, one in each band.

    Parameters
    ----------
    signal : array_like
        (n_t,) samples, any unit.
    fs : float
        Samples per second.
    bands : sequence of (float, float)
        Hz, one for each component.
    omega0 : float
        Centre of the Morlet wavelet, rad, at least 4.

    Returns
    -------
    tuple of Ridge
        In the order of the bands.

    Raises
    ------
    RecordError
        As `ridge`; the message names the band.
    """
    return tuple(ridge(signal, fs, band, omega0) for band in bands)


def _follow(plane: Scalogram, fs: float) -> tuple[Ridge, np.ndarray]:
    """Return the ridge of a plane, and the scatter of its frequency, in widths of the wavelet."""
    omega0, rows = plane.omega0, _path(plane, fs)
    columns = np.arange(rows.size)
    spread, value = plane.scale[rows], plane.value[rows, columns]
    before, after = np.maximum(columns - 1, 0), np.minimum(columns + 1, rows.size - 1)
    # row by row: neighbours on the ridge may lie on different scales
    turn = np.angle(plane.value[rows, after] * value.conj()) + np.angle(value * plane.value[rows, before].conj())
    omega, phase = turn * fs / (after - before), np.unwrap(np.angle(value))
    centre = omega0 / spread
    amplitude = np.abs(value) * np.exp(np.clip(omega / centre - 1, -1 / omega0, 1 / omega0) ** 2 * omega0**2 / 2)
    amplitude *= _sampling_loss(centre / fs) / _sampling_loss(omega / fs)
    scatter = _scatter(omega, phase, spread, fs)
    valid = (scatter < SCATTER) & _clear_of_jumps(amplitude, phase, spread, fs)
    return Ridge(plane.time, omega, amplitude, valid, phase, spread), scatter


def _check_signal(signal: ArrayLike, fs: float, band: tuple[float, float], omega0: float) -> np.ndarray:
    """Return the signal as floats, or refuse it or the arguments."""
    signal = np.asarray(signal, dtype=float)
    if signal.ndim != 1 or signal.size < 3:
        raise RecordError(f"a signal is one row of samples, got shape {signal.shape}")
    RecordError.require_positive(" Hz", fs=fs)
    if np.shape(band) != (2,) or not 0 < band[0] < band[1] <= fs / 2:
        raise RecordError(f"band must be two rising frequencies above 0 and up to fs / 2 = {fs / 2:g} Hz, got {band!r}")
    if not 4 <= omega0 < np.inf:
        raise RecordError(f"omega0 must be >= 4 rad for a wavelet without a mean, got {omega0!r}")
    check_channel("the signal", signal, fs)
    needed = shortest_record(band[0], omega0)
    if signal.size / fs < needed:
        raise RecordError(
            f"the record lasts {signal.size / fs:g} s; the wavelet (omega0 = {omega0:g}) needs {needed:.3g} s "
            f"at {band[0]:g} Hz"
        )
    return signal


def _scales(fs: float, band: tuple[float, float], omega0: float) -> np.ndarray:
    """Return (n_a,) scales in samples, falling, from the lower to the upper end of the band.

    The support of each has an odd number of steps (less a rounding): any other wavelet PyWavelets shifts by up to
    half a sample, and the phase would jump from scale to scale.
    """
    count = 2 + int(np.log(band[1] / band[0]) * omega0 / SPACING)
    scale = omega0 * fs / (2 * np.pi * np.geomspace(*band, count))
    return (2 * np.unique(np.rint((scale * SUPPORT - 1) / 2))[::-1] + 1 - 1e-6) / SUPPORT


def _sampling_loss(omega: np.ndarray) -> np.ndarray:
    """Return the factor at ω, rad per sample: PyWavelets takes the wavelet's mean between samples, not its value."""
    return np.sinc(omega / (2 * np.pi))


def _path(plane: Scalogram, fs: float) -> np.ndarray:
    """Return (n_t,) row of the ridge: largest sum of ln(power), less the price of the changes (Viterbi)."""
    hop = max(1, int(plane.scale[-1] * fs / 2))
    power = np.abs(plane.value[:, hop // 2 :: hop]) ** 2
    gain = np.log(power + 1e-30 * power.max()).T
    n_hops, n_a = gain.shape
    step = np.log(plane.scale[0] / plane.scale[1]) * plane.omega0
    reach = min(n_a - 1, max(1, int(1 / step)))
    moves = np.arange(-reach, reach + 1)
    price = STIFFNESS * (moves * step) ** 2 * plane.scale[-1] * fs / hop
    origin = np.empty((n_hops, n_a), dtype=np.int32)
    padded = np.full(n_a + 2 * reach, -np.inf)
    choices = np.lib.stride_tricks.sliding_window_view(padded, moves.size)
    rows = np.arange(n_a)
    best = gain[0]
    for i in range(1, n_hops):
        padded[reach : reach + n_a] = best
        totals = choices - price
        move = totals.argmax(axis=1)
        origin[i] = rows + move - reach
        best = totals[rows, move] + gain[i]
    path = np.empty(n_hops, dtype=np.intp)
    path[-1] = best.argmax()
    for i in range(n_hops - 1, 0, -1):
        path[i - 1] = origin[i, path[i]]
    return path[np.minimum(np.arange(plane.time.size) // hop, n_hops - 1)]


def _around(spread: np.ndarray, fs: float, start: float, stop: float) -> tuple[np.ndarray, np.ndarray]:
    """Return first and last sample from ``start`` to ``stop`` σ_t after each sample, cut at the record's ends."""
    sample, width = np.arange(spread.size), spread * fs
    first, last = (np.clip(np.rint(sample + x * width).astype(int), 0, spread.size - 1) for x in (start, stop))
    return first, last


def _mean(value: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    total = np.concatenate(([0], np.cumsum(value)))
    return (total[last + 1] - total[first]) / (last + 1 - first)


def _scatter(omega: np.ndarray, phase: np.ndarray, spread: np.ndarray, fs: float) -> np.ndarray:
    """Return (n_t,) mean distance of the frequency from its mean over 8 σ_t, in widths of the wavelet."""
    first, last = _around(spread, fs, -MASK, MASK)
    mean = (phase[last] - phase[first]) * fs / np.maximum(last - first, 1)
    return _mean(np.minimum(spread * np.abs(omega - mean), 1), first, last)


def _clear_of_jumps(amplitude: np.ndarray, phase: np.ndarray, spread: np.ndarray, fs: float) -> np.ndarray:
    """Return (n_t,) bool: 4 σ_t or more from the ends and each jump of the frequency or rise of the amplitude."""
    past, future = _around(spread, fs, -MASK, -1), _around(spread, fs, 1, MASK)
    mean = [(phase[last] - phase[first]) * fs / np.maximum(last - first, 1) for first, last in (past, future)]
    level = [_mean(np.log(amplitude), first, last) for first, last in (past, future)]
    time, reach = np.arange(spread.size) / fs, MASK * spread
    inside = (time >= reach) & (time <= time[-1] - reach)
    jumps = _peaks(inside * spread * np.abs(mean[1] - mean[0]) / JUMP, spread, fs)
    rises = _peaks(inside * (level[1] - level[0]) / RISE, spread, fs)
    clear = inside
    for centre in (*jumps, *(_onset(rise, amplitude, phase, spread, fs) for rise in rises)):
        clear = clear & (np.abs(time - time[centre]) >= reach)
    return clear


def _peaks(score: np.ndarray, spread: np.ndarray, fs: float) -> np.ndarray:
    return scipy.signal.find_peaks(score, height=1, distance=max(1, int(spread.min() * fs)))[0]


def _onset(rise: int, amplitude: np.ndarray, phase: np.ndarray, spread: np.ndarray, fs: float) -> int:
    """Return the sample near a rise where the transform changes fastest, but for its mean rotation: the impact."""
    first, last = (edge[rise] for edge in _around(spread, fs, -MASK, MASK))
    part = np.arange(first, last + 1)
    rotation = (phase[last] - phase[first]) / (last - first)
    envelope = amplitude[part] * np.exp(1j * (phase[part] - rotation * part))
    return first + int(np.abs(np.gradient(envelope)).argmax())
