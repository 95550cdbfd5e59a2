"""Nonlinear rigs under periodic excitations: best linear approximation with its variances, and harmonics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import RecordError
from .arrays import ArrayData
from .frf import FRF, QUANTITY
from .response import Response
from .welch import lines_within

__all__ = ["BestLinear", "best_linear", "periods", "stepped_harmonics"]

SILENT_LINE = 1e-9  # fraction of the strongest line below which a line of the excitation counts as left out


@dataclass(frozen=True, eq=False, repr=False)
class BestLinear(ArrayData):
    """Best linear approximation of a rig for one class of excitations, with the two causes of its scatter apart."""

    frf: FRF
    """mean over the realisations"""
    noise_variance: np.ndarray
    """(n_outputs, 1, n_f) of the mean, by changes from period to period"""
    total_variance: np.ndarray
    """(n_outputs, 1, n_f) of the mean, by changes from realisation to realisation"""
    realisations: int
    """M, over which the mean is taken"""

    @property
    def distortion_variance(self) -> np.ndarray:
        """(n_outputs, 1, n_f) stochastic distortion of one realisation; 0 where noise explains the scatter."""
        return self.realisations * np.maximum(self.total_variance - self.noise_variance, 0)


def best_linear(responses: Sequence[Response], period: float, drop: int = 1) -> BestLinear:
    """Estimate the best linear approximation from random-phase multisines by the robust method.

    It holds the lines of the records' band, or every line that is excited if they have none.

    Parameters
    ----------
    responses : sequence of Response
        One record for each realisation of the phases, all of one length: whole periods of the multisine.
    period : float
        Period of the multisine, s.
    drop : int
        Periods at the start that are left out until the transient has died.

    Raises
    ------
    RecordError
        If there are fewer than two realisations or two periods to keep, if the records differ, do not hold whole
        periods, or excite no line.

    Notes
    -----
    Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 4. With the
    means over the periods Ū and Ȳ, G = Ȳ/Ū for each realisation. Its noise variance is that of Y - G U over the P
    periods, Σ|Y - G U|² / (P (P-1) |Ū|²), which counts noise on the excitation too. What G scatters over the
    realisations beyond that is stochastic nonlinear distortion. A motion that does not repeat itself from period to
    period, as chaos, counts as noise.
    """
    if len(responses) < 2:
        raise RecordError(f"a best linear approximation needs at least two realisations, got {len(responses)}")
    if len({(r.fs, r.kind, r.band, r.responses, np.shape(r.channels)) for r in responses}) > 1:
        raise RecordError("the realisations differ in sampling rate, length, kind or band of excitation, or responses")
    signals = np.stack([periods(response, period, drop) for response in responses])
    first, samples = responses[0], signals.shape[-1]
    frequency = np.arange(samples // 2 + 1) * (first.fs / samples)
    lines = np.r_[lines_within(frequency, first.band or (frequency[1], frequency[-1]))]
    spectra = np.fft.rfft(signals)[..., lines]
    if np.any(np.abs(spectra[:, 0]).min(axis=(0, 1)) <= SILENT_LINE * np.abs(spectra[:, 0]).max()):
        raise RecordError("the excitation leaves out lines of its band; a multisine over the whole band is needed")
    n_realisations, _, n_periods, _ = spectra.shape
    mean = spectra.mean(axis=2)
    u, g = mean[:, :1], mean[:, 1:] / mean[:, :1]
    residual = spectra[:, 1:] - g[:, :, None] * spectra[:, :1]
    noise = np.sum(np.abs(residual) ** 2, axis=2) / (n_periods * (n_periods - 1) * np.abs(u) ** 2)
    value = g.mean(axis=0)
    scatter = np.sum(np.abs(g - value) ** 2, axis=0) / (n_realisations * (n_realisations - 1))
    frf = FRF(frequency[lines], value, None, first.responses, (first.reference,), QUANTITY[first.kind])
    noise = noise.mean(axis=0) / n_realisations
    return BestLinear(frf, noise[:, None], scatter[:, None], n_realisations)


def periods(response: Response, period: float, drop: int = 1) -> np.ndarray:
    """Return the excitation and the accelerations of a periodic record, period by period.

    Parameters
    ----------
    response : Response
        Record of whole periods.
    period : float
        Period of the multisine, s.
    drop : int
        Periods at the start that are left out until the transient has died.

    Returns
    -------
    ndarray, shape (1 + n_sensors, n_periods, n_samples)
        Excitation first.

    Raises
    ------
    RecordError
        If the record does not hold whole periods, fewer than two are left, or samples are not finite.
    """
    samples = round(period * response.fs)
    signals = np.vstack((response.only_input, response.channels))
    if samples < 2 or abs(samples - period * response.fs) > 1e-6 or signals.shape[1] % samples:
        raise RecordError(f"a record of {response.duration:g} s does not hold whole periods of {period!r} s")
    count = signals.shape[1] // samples
    if drop < 0 or count - drop < 2:
        raise RecordError(f"{count} periods less {drop!r} dropped leave fewer than two: noise cannot be estimated")
    if not np.isfinite(signals).all():
        raise RecordError("a realisation holds samples that are not finite")
    return signals.reshape(-1, count, samples)[:, drop:]


def stepped_harmonics(
    signal: ArrayLike, fs: float, frequency: ArrayLike, n_harmonics: int = 5, settle: float = 0.5
) -> np.ndarray:
    """Return the complex amplitudes of the harmonics in a record under a stepped sine (`excitation.stepped_sine`).

    Parameters
    ----------
    signal : array_like, shape (n_t,)
        Response, in any unit.
    fs : float
        Samples per second.
    frequency : sequence of float
        Hz, of each step; all steps have one length.
    n_harmonics : int
        Number of harmonics.
    settle : float
        Fraction of each step that is left out at its start, 0 <= settle < 1.

    Returns
    -------
    ndarray, shape (n_steps, n_harmonics)
        Of the steady motion Re Σ c_k exp(2πi k f t), t from the start of the record; unit of the signal.

    Raises
    ------
    RecordError
        If the steps do not fit the record, if less than a period of a step is left, or fs is below twice the highest
        harmonic.

    Notes
    -----
    Least squares on whole periods of a mean, sines and cosines: no window, no leakage.
    """
    signal, frequency = np.asarray(signal, dtype=float), np.asarray(frequency, dtype=float)
    if signal.ndim != 1 or not frequency.size or signal.size % frequency.size:
        raise RecordError(f"{frequency.size} steps of one length do not fit a record of shape {signal.shape}")
    if n_harmonics < 1 or not 0 <= settle < 1:
        raise RecordError(f"n_harmonics must be >= 1 and 0 <= settle < 1, got {n_harmonics!r} and {settle!r}")
    if np.any(2 * n_harmonics * frequency >= fs):
        raise RecordError(f"fs {fs:g} Hz is not above twice harmonic {n_harmonics} of {frequency.max():g} Hz")
    size = signal.size // frequency.size
    ends = size * np.arange(1, frequency.size + 1)
    return np.array([_harmonics(signal[:e], fs, f, n_harmonics, size * (1 - settle)) for e, f in zip(ends, frequency)])


def _harmonics(signal: np.ndarray, fs: float, frequency: float, n_harmonics: int, longest: float) -> np.ndarray:
    """Return the harmonics in the last whole periods of a signal, no longer than so many samples."""
    if not (periods := int(longest * frequency / fs + 1e-9)):
        raise RecordError(f"less than a period of {frequency:g} Hz is left of its step")
    last = np.arange(signal.size - round(periods * fs / frequency), signal.size)
    turns = np.exp(2j * np.pi * frequency / fs * np.outer(last, np.arange(1, n_harmonics + 1)))
    columns = np.hstack((np.ones((last.size, 1)), turns.real, -turns.imag))
    solution = np.linalg.lstsq(columns, signal[last], rcond=None)[0]
    return solution[1 : n_harmonics + 1] + 1j * solution[n_harmonics + 1 :]
