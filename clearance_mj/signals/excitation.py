"""Excitations of the rig's shaker: generators of the usual test signals.

Every generator raises ExcitationError for an impossible parameter; the message names it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from .excitation_data import (
    Band,
    Excitation,
    described,
    generator_of,
    lines_within_band,
    require,
    require_band,
    require_level,
    require_period,
    sample_count,
)
from .psd import PSD, psd_noise

__all__ = [
    "Excitation", "burst_random", "from_psd", "from_psd_blocks", "hammer", "level_ramp", "multisine", "random",
    "random_blocks", "stepped_sine", "still", "sweep", "together",
]  # fmt: skip

BAND: Band = (5.0, 220.0)
TAPER = 0.1  # fraction of a burst in its two cosine flanks
HALF = 8.0  # s of noise of any duration that are made at once


def still(duration: float, fs: float, kind: str = "base") -> Excitation:
    """Return an excitation of zeros: gravity, spin and unbalance alone move the rig.

    Parameters
    ----------
    duration : float
        Length, s.
    fs : float
        Samples per second.
    kind : str
        "base" or "force".
    """
    value = np.zeros(sample_count(duration, fs))
    return Excitation(value, fs, kind, None, {"generator": "still", "duration": duration})


def together(*excitations: Excitation) -> Excitation:
    """Return one excitation of all inputs at once, of excitations of single ones.

    Parameters
    ----------
    *excitations : Excitation
        One for each of `Rig.inputs`, each of its own kind; shorter ones end with zeros.

    Raises
    ------
    ExcitationError
        If there is none, one has several inputs, or they differ in rate.
    """
    require(excitations, "excitations", excitations, "give one for each input of the rig")
    for item in excitations:
        require(item.value.ndim == 1, "inputs", len(item.kinds), "must be one of each excitation that is put together")
        require(item.fs == excitations[0].fs, "fs", item.fs, f"must be that of the first one, {excitations[0].fs:g} Hz")
    size, bands = max(item.value.size for item in excitations), [item.band for item in excitations if item.band]
    band = (min(low for low, _ in bands), max(high for _, high in bands)) if len(bands) == len(excitations) else None
    value = np.array([np.pad(item.value, (0, size - item.value.size)) for item in excitations])
    description = {"generator": "together", "excitations": [dict(item.description) for item in excitations]}
    return Excitation(value, excitations[0].fs, "mixed", band, description, tuple(item.kind for item in excitations))


def random(
    duration: float, fs: float, band: Band = BAND, rms: float = 1.0, seed: int = 0, kind: str = "base"
) -> Excitation:
    """Return band-limited Gaussian noise whose spectrum is exactly zero outside the band.

    Parameters
    ----------
    duration : float
        Length of the excitation, s.
    fs : float
        Samples per second.
    band : (float, float)
        Lower and upper end of the band, Hz; the upper one at most fs / 2.
    rms : float
        Exact root mean square, m/s² or N.
    seed : int
        Seed of the random numbers.
    kind : {"base", "force"}
        Base acceleration, or force at the shaker.

    Raises
    ------
    ExcitationError
        If a parameter is impossible; the message names it.
    """
    require_level(rms=rms)
    value = rms * band_noise(duration, fs, band, seed)
    return described("random", value, fs, kind, band, duration=duration, rms=rms, seed=seed)


def random_blocks(
    duration: float, fs: float, band: Band = BAND, rms: float = 1.0, seed: int = 0, kind: str = "base"
) -> Iterator[Excitation]:
    """Yield band-limited Gaussian noise of any duration, in pieces of some seconds that follow without a break.

    Segments of `random` overlap by half under a power-complementary window (Vorbis I specification, 1.3.2),
    so that the noise is stationary and has no seams. It is 60 dB down 1 Hz outside the band.

    Parameters
    ----------
    duration, fs, band, seed, kind
        As in `random`.
    rms : float
        Expected root mean square, m/s² or N.
    """
    require_level(rms=rms)

    def segment(length: float, number: int) -> np.ndarray:
        return band_noise(length, fs, band, [seed, number])

    for value in noise_blocks(segment, duration, fs):
        yield described("random_blocks", rms * value, fs, kind, band, duration=duration, rms=rms, seed=seed)


def from_psd(psd: PSD, duration: float, fs: float, seed: int = 0) -> Excitation:
    """Return Gaussian noise with the spectrum of a PSD: zero outside its band, and periodic in the duration.

    Amplitudes are random as phases are, so that the noise is Gaussian; its RMS is that of the PSD on average only.

    Parameters
    ----------
    psd : PSD
        One-sided power spectral density of the base's acceleration, or of the shaker's force.
    duration, fs : float
        As in `random`.
    seed : int
        Seed of the random numbers.

    Raises
    ------
    ExcitationError
        If a parameter is impossible, the band reaches beyond fs / 2, or is too narrow for a line of 1 / duration.
    """
    value = psd_noise(psd, duration, fs, seed)
    return described("from_psd", value, fs, psd.kind, psd.band, duration=duration, seed=seed, psd=psd.to_dict())


def from_psd_blocks(psd: PSD, duration: float, fs: float, seed: int = 0) -> Iterator[Excitation]:
    """Yield Gaussian noise of a PSD and of any duration, in pieces that follow without a break, as `random_blocks`.

    Parameters
    ----------
    psd, duration, fs, seed
        As in `from_psd`.
    """

    def segment(length: float, number: int) -> np.ndarray:
        return psd_noise(psd, length, fs, [seed, number])

    parameters = {"duration": duration, "seed": seed, "psd": psd.to_dict()}
    for value in noise_blocks(segment, duration, fs):
        yield described("from_psd_blocks", value, fs, psd.kind, psd.band, **parameters)


def burst_random(
    duration: float, fs: float, band: Band = BAND, rms: float = 1.0, seed: int = 0, kind: str = "base",
    burst: float = 0.6, period: float = 2.0,
) -> Excitation:  # fmt: skip
    """Return noise that is on at the start of each period and leaves the rest of it for the decay.

    With a boxcar of one period, estimated FRFs have no leakage if the decay ends within it. The flanks of a burst are
    half cosines, so little leaves the band.

    Parameters
    ----------
    duration, fs, band, kind
        As in `random`.
    rms : float
        Root mean square of all that is within bursts, m/s² or N.
    seed : int
        Seed of the random numbers; each burst is another noise.
    burst : float
        Fraction of the period in which the noise is on, 0 < burst <= 1.
    period : float
        Time from the start of a burst to that of the next, s; at most the duration.
    """
    require_level(rms=rms)
    require(0 < burst <= 1, "burst", burst, "must be > 0 and <= 1")
    value = band_noise(duration, fs, band, seed)
    require_period(period, duration, fs)
    phase = np.arange(value.size) / fs % period / (burst * period)
    is_on = phase < 1
    flank = np.minimum(phase[is_on], 1 - phase[is_on]) / (TAPER / 2)
    value[~is_on] = 0
    value[is_on] *= 0.5 - 0.5 * np.cos(np.pi * np.minimum(flank, 1))
    value *= rms / np.sqrt(np.mean(value[is_on] ** 2))
    parameters = {"duration": duration, "rms": rms, "seed": seed, "burst": burst, "period": period}
    return described("burst_random", value, fs, kind, band, **parameters)


def level_ramp(
    duration: float, fs: float, band: Band = BAND, start_rms: float = 0.5, end_rms: float = 8.0, seed: int = 0,
    kind: str = "base",
) -> Excitation:  # fmt: skip
    """Return noise whose level changes geometrically, by as many dB in every second.

    Parameters
    ----------
    duration, fs, band, seed, kind
        As in `random`.
    start_rms, end_rms : float
        Root mean square at the start and at the end, m/s² or N.
    """
    require(0 < start_rms < np.inf, "start_rms", start_rms, "must be > 0")
    require(0 < end_rms < np.inf, "end_rms", end_rms, "must be > 0")
    noise = band_noise(duration, fs, band, seed)
    value = noise * np.geomspace(start_rms, end_rms, noise.size)
    parameters = {"duration": duration, "start_rms": start_rms, "end_rms": end_rms, "seed": seed}
    return described("level_ramp", value, fs, kind, band, **parameters)


def multisine(
    duration: float, fs: float, band: Band = BAND, rms: float = 1.0, seed: int = 0, kind: str = "base",
    period: float = 2.0,
) -> Excitation:  # fmt: skip
    """Return sines of equal amplitude and random phase at every multiple of 1 / period within the band.

    Parameters
    ----------
    duration, fs, kind
        As in `random`.
    band : (float, float)
        Lower and upper end of the band, Hz; the upper one at most fs / 2, where no sine is.
    rms : float
        Exact root mean square of a period, m/s² or N.
    seed : int
        Seed of the phases.
    period : float
        Period, s; a whole number of samples, at most the duration.
    """
    size = sample_count(duration, fs)
    require_level(rms=rms)
    require_period(period, duration, fs)
    samples = round(period * fs)
    require(abs(period * fs - samples) < 1e-6, "period", period, f"must be a whole number of samples of {1 / fs:g} s")
    lines = lines_within_band(samples, fs, band)
    lines = lines[2 * lines < samples]
    require(lines.size > 0, "period", period, f"puts no line of {1 / period:g} Hz into the band {tuple(band)}")
    phase = generator_of(seed).uniform(0, 2 * np.pi, lines.size)
    spectrum = np.zeros(samples // 2 + 1, dtype=complex)
    spectrum[lines] = samples / np.sqrt(2 * lines.size) * np.exp(1j * phase)
    value = rms * np.resize(np.fft.irfft(spectrum, samples), size)
    return described("multisine", value, fs, kind, band, duration=duration, rms=rms, seed=seed, period=period)


def sweep(
    duration: float, fs: float, band: Band = BAND, amplitude: float = 1.0, kind: str = "base",
    method: str = "logarithmic",
) -> Excitation:  # fmt: skip
    """Return a sine that runs once through the band, upwards or downwards.

    Parameters
    ----------
    duration, fs, kind
        As in `random`.
    band : (float, float)
        First and last frequency, Hz, in either order; at most fs / 2, and > 0 for a logarithmic sweep.
    amplitude : float
        Amplitude of the sine, m/s² or N.
    method : {"logarithmic", "linear"}
        "logarithmic": as many octaves in every second; "linear": as many Hz.
    """
    time = np.arange(sample_count(duration, fs)) / fs
    first, last = band
    low, _ = require_band((min(band), max(band)), fs)
    require_level(amplitude=amplitude)
    require(method in ("logarithmic", "linear"), "method", method, 'must be "logarithmic" or "linear"')
    if method == "linear":
        turns = (first + (last - first) * time / (2 * duration)) * time
    else:
        require(low > 0, "band", band, "must stay above 0 Hz for a logarithmic sweep")
        rate = np.log(last / first) / duration
        turns = first * np.expm1(rate * time) / rate
    value = amplitude * np.sin(2 * np.pi * turns)
    return described("sweep", value, fs, kind, band, duration=duration, amplitude=amplitude, method=method)


def stepped_sine(
    duration: float, fs: float, frequency: ArrayLike, amplitude: ArrayLike, kind: str = "base"
) -> Excitation:
    """Return a sine whose frequency or amplitude steps, each as long, without a jump in phase; its band is left open.

    The rig goes on from the motion of the step before: up and down through a resonance shows jumps and hysteresis.

    Parameters
    ----------
    fs, kind
        As in `random`.
    duration : float
        Length of all steps together, s.
    frequency : float or sequence of float
        Frequency of every step, or one for each step, Hz, above 0 and below fs / 2.
    amplitude : float or sequence of float
        Amplitude of every step, or one for each step, m/s² or N.
    """
    size = sample_count(duration, fs)
    steps = [np.atleast_1d(np.asarray(values, dtype=float)) for values in (frequency, amplitude)]
    count = max(values.size for values in steps)
    require(steps[0].size in (1, count), "frequency", frequency, f"must be one, or one for each of {count} steps")
    require(steps[1].size in (1, count), "amplitude", amplitude, f"must be one, or one for each of {count} steps")
    require(np.all((steps[0] > 0) & (steps[0] < fs / 2)), "frequency", frequency, f"must be in 0 to {fs / 2:g} Hz")
    require(np.all(steps[1] >= 0) and np.isfinite(steps[1]).all(), "amplitude", amplitude, "must be >= 0")
    require(size % count == 0, "duration", duration, f"must give each of {count} steps a whole number of samples")
    per_sample = [np.repeat(np.broadcast_to(values, count), size // count) for values in steps]
    turns = np.concatenate(([0.0], np.cumsum(per_sample[0])[:-1])) / fs
    parameters = {"duration": duration, "frequency": steps[0].tolist(), "amplitude": steps[1].tolist()}
    return described("stepped_sine", per_sample[1] * np.sin(2 * np.pi * turns), fs, kind, None, **parameters)


def hammer(
    duration: float, fs: float, peak: ArrayLike, width: float, times: ArrayLike, kind: str = "base"
) -> Excitation:
    """Return half-sine pulses, one for each time; their band is left open.

    Parameters
    ----------
    duration, fs, kind
        As in `random`.
    peak : float or sequence of float
        Height of every pulse, or one for each pulse, m/s² or N; negative pulses are allowed.
    width : float
        Duration of a pulse, s, at least two samples.
    times : sequence of float
        Starts of the pulses, s, rising; no pulse may reach the next one or the end.
    """
    time = np.arange(sample_count(duration, fs)) / fs
    require(2 / fs <= width < np.inf, "width", width, f"must be at least two samples, {2 / fs:g} s")
    times, peaks = np.atleast_1d(np.asarray(times, dtype=float)), np.asarray(peak, dtype=float)
    is_apart = times.ndim == 1 and times.size and times[0] >= 0
    is_apart = is_apart and np.all(np.diff(np.append(times, duration)) >= width * (1 - 1e-9))
    require(is_apart, "times", times.tolist(), f"must rise within 0 to {duration:g} s, a width {width:g} s apart")
    fits = peaks.shape in ((), times.shape) and np.all(np.isfinite(peaks))
    require(fits, "peak", peaks.tolist(), f"must be one finite number, or one for each of {times.size} times")
    last = np.searchsorted(times, time, side="right") - 1  # pulse that started last; -1 before the first
    phase = (time - times[last]) / width
    height = np.where((last >= 0) & (phase < 1), np.broadcast_to(peaks, times.shape)[last], 0.0)
    value = height * np.sin(np.pi * phase)
    parameters = {"duration": duration, "peak": peaks.tolist(), "width": width, "times": times.tolist()}
    return described("hammer", value, fs, kind, None, **parameters)


def band_noise(duration: float, fs: float, band: Band, seed: int | list[int]) -> np.ndarray:
    """Return Gaussian noise of root mean square 1 that has lines within the band (Hz) only."""
    size = sample_count(duration, fs)
    lines = lines_within_band(size, fs, band)
    require(lines.size > 0, "duration", duration, f"puts no line of {fs / size:g} Hz into the band {tuple(band)}")
    spectrum = np.zeros(size // 2 + 1, dtype=complex)
    spectrum[lines] = generator_of(seed).standard_normal((2, lines.size)).T @ (1, 1j)
    value = np.fft.irfft(spectrum, size)
    return value / np.sqrt(np.mean(value**2))


def noise_blocks(segment: Callable[[float, int], np.ndarray], duration: float, fs: float) -> Iterator[np.ndarray]:
    """Yield noise of a duration, s, in pieces that follow without a break, out of ``segment(s, number)``.

    Segments overlap by half under a power-complementary window; see `excitation.random_blocks`.
    """
    size, half = sample_count(duration, fs), sample_count(HALF, fs)
    window = np.sin(np.pi / 2 * np.sin(np.pi / 2 * (np.arange(half) + 0.5) / half) ** 2)

    def halves(number: int) -> np.ndarray:
        return segment(2 * half / fs, number).reshape(2, half)

    _, falling = halves(0)
    for number, start in enumerate(range(0, size, half), 1):
        rising, after = halves(number)
        yield (window[::-1] * falling + window * rising)[: size - start]
        falling = after
