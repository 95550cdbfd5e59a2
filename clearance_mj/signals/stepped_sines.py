"""Steps of a record under a stepped sine: frequency and amplitudes of each, read from the record itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .response import Response

__all__ = ["SineSteps", "harmonic_amplitudes", "is_stepped_sine", "sine_steps"]

WINDOW = 0.5  # s of the excitation that are looked at at once
MAX_RESIDUE = 0.05  # residual of a sine's fit over its amplitude; windows across a step leave more
FREQUENCY_TOLERANCE = 2e-3  # relative difference up to which windows belong to one step
HARMONICS = 9  # harmonics that are fitted to a response
MIN_PERIODS = 3.0  # periods that a window must hold
MOST, LOOKS = 0.4, 40  # of the windows, without a sine only across steps; windows that are looked at
STEP = 0.05  # of frequency or amplitude, from one sine to another
POINTS_PER_PERIOD = 256  # points of a period, from which a history's highest and lowest values are taken


@dataclass(frozen=True, eq=False)
class SineSteps:
    """Steady vibrations at the end of every step."""

    frequency: np.ndarray
    """(n,) Hz"""
    level: np.ndarray
    """(n,) amplitude of the excitation, m/s² or N"""
    upwards: np.ndarray
    """(n,) True where the frequency came from below"""
    acceleration: np.ndarray
    """(n, n_sensors) half of the peak-to-peak value of a period, m/s²"""
    displacement: np.ndarray | None
    """(n, n_bushings) m; None without probes"""


def sine_steps(response: Response) -> SineSteps:
    """Read the steps of a record under a stepped sine; there are none where the excitation is no sine for a second.

    A sine is fitted to every half second of the excitation. Windows of one frequency after each other are a step, of
    which the last one is taken; the harmonics of the responses are fitted there.

    Parameters
    ----------
    response : Response
        The record, of which frequencies from 6 Hz on are recognised.
    """
    size = round(WINDOW * response.fs)
    force = response.only_input
    sines = [_sine(force[i : i + size], response.fs) for i in range(0, force.size - size + 1, size)]
    ends = [
        k for k in range(1, len(sines))
        if _is_one_step(sines[k - 1], sines[k]) and not (k + 1 < len(sines) and _is_one_step(sines[k], sines[k + 1]))
    ]  # fmt: skip
    frequency, level = np.array([sines[k] for k in ends]).reshape(-1, 2).T
    change = np.sign(np.diff(frequency, prepend=frequency[:1]))
    if change.size > 1:
        change[0] = change[1]

    def amplitudes(histories: np.ndarray) -> np.ndarray:
        rows = [harmonic_amplitudes(histories[:, k * size : (k + 1) * size], response.fs, sines[k][0]) for k in ends]
        return np.array(rows).reshape(len(ends), len(histories))

    displacement = None if response.displacement is None else amplitudes(response.displacement)
    return SineSteps(frequency, level, change >= 0, amplitudes(response.channels), displacement)


def is_stepped_sine(signal: np.ndarray, fs: float) -> bool:
    """Return True if a signal is one sine after the other, of other frequency or amplitude, from 6 Hz on.

    One sine that stays, as the mains' hum in a channel without a sensor, is none.

    Parameters
    ----------
    signal : ndarray, shape (n_t,)
        Of an excitation or a response.
    fs : float
        Samples per second.
    """
    size, signal = max(1, round(WINDOW * fs)), signal - np.mean(signal)
    count = signal.size // size
    starts = [size * i for i in range(0, count, -(-count // LOOKS) or 1)]
    windows = np.array([_sine(signal[i : i + size], fs) for i in starts]).reshape(-1, 2)
    sines = windows[windows[:, 0] > 0]
    return len(sines) > MOST * len(windows) and bool(np.any(np.ptp(sines, axis=0) > STEP * sines.max(axis=0)))


def _is_one_step(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return abs(a[0] - b[0]) <= FREQUENCY_TOLERANCE * a[0] and a[0] > 0


def _sine(signal: np.ndarray, fs: float) -> tuple[float, float]:
    """Return frequency, Hz, and amplitude of a signal that is a sine; zeros if it is none."""
    size, scale = signal.size, float(np.sqrt(2 * np.mean(signal**2)))
    spectrum = np.abs(np.fft.rfft(signal * np.hanning(size), 8 * size))
    frequency = float(np.argmax(spectrum)) * fs / (8 * size)
    if frequency * size / fs < MIN_PERIODS:
        return 0.0, 0.0
    time = np.arange(size) / fs
    for _ in range(3):  # the phase of the second half against the first gives the frequency's error
        halves = slice(size // 2), slice(size // 2, size)
        first, second = (_fit(signal[half], time[half], frequency) for half in halves)
        turns = np.angle(second * np.conj(first)) / (2 * np.pi)
        frequency += turns / (size / 2 / fs)
    amplitude = _fit(signal, time, frequency)
    residual = signal - (amplitude * np.exp(2j * np.pi * frequency * time)).real
    return (frequency, abs(amplitude)) if np.std(residual) < MAX_RESIDUE * scale else (0.0, 0.0)


def _fit(signal: np.ndarray, time: np.ndarray, frequency: float) -> complex:
    """Return the amplitude a of Re a exp(2πi f t) in a signal with a mean."""
    turns = 2 * np.pi * frequency * time
    columns = np.column_stack((np.ones(time.size), np.cos(turns), -np.sin(turns)))
    _, real, imaginary = np.linalg.lstsq(columns, signal, rcond=None)[0]
    return complex(real, imaginary)


def harmonic_amplitudes(histories: np.ndarray, fs: float, frequency: float) -> np.ndarray:
    """Return half of the peak-to-peak value of a period, of the first nine harmonics.

    Parameters
    ----------
    histories : ndarray (m, n)
        Steady vibrations of at least one period.
    fs : float
        Samples per second.
    frequency : float
        Frequency of the excitation, Hz.

    Returns
    -------
    ndarray (m,)
        In the unit of the histories; harmonics above 0.4 fs are left out.
    """
    orders = np.arange(1, min(HARMONICS, int(0.4 * fs / frequency)) + 1)
    time, phase = np.arange(histories.shape[1]) / fs, 2 * np.pi * np.arange(POINTS_PER_PERIOD) / POINTS_PER_PERIOD

    def columns(turns: np.ndarray) -> np.ndarray:
        return np.hstack((np.ones((turns.size, 1)), np.cos(np.outer(turns, orders)), np.sin(np.outer(turns, orders))))

    weights = np.linalg.lstsq(columns(2 * np.pi * frequency * time), histories.T, rcond=None)[0]
    return np.ptp(columns(phase) @ weights, axis=0) / 2
