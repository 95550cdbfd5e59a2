"""Faults of a channel that no sign, swap, unit or gain explains: delay, noise, a loose cable, or distortion."""

from __future__ import annotations

import numpy as np
import scipy.interpolate

from ...records.dropouts import describe_dropouts
from ..spectra import complex_spectra
from .assessment import Assessment, distance, predicted_spectra

__all__ = ["describe_signal_fault", "likeness_over_delays"]

MAX_DELAY = 0.05  # s
DELAYS = 2001  # that are tried
CERTAIN = 0.3  # of a line's level: standard deviation of its prediction by the other channels, up to which it counts
MIN_LINES = 20  # with a prediction that is certain enough
DELAYED = 0.8  # likeness to the prediction from which on a delay explains a channel
UNRELATED = 0.2  # likeness below which a channel holds nothing of the rig's motion
DELAY_GAIN = 0.02  # least gain of likeness by a delay
PARTLY_DELAYED, PARTLY_DELAYED_GAIN = 0.5, 0.1
"""Likeness and its gain by a delay, from which on that explains a channel whose prediction is less certain."""
WHOLE = 0.95  # likeness from which on a channel is whole
MAX_CLOCK_ERROR = 2e-3  # of a channel's sampling rate, that is tried
CLOCK_GAIN = 0.2  # least gain of likeness by another sampling rate
FINER = 8  # steps into which the step between those is divided about the best


def describe_signal_fault(assessment: Assessment) -> str:
    """Return in words the likeliest fault of the channel that the others contradict most; "" if none."""
    if not assessment.suspects or not assessment.measured:
        return ""
    gains = assessment.gains(assessment.update.rig, {})
    i = min(assessment.suspects, key=lambda channel: distance(gains, assessment.measured, (channel,)))
    return f"{assessment.update.channels[i]} {_dropouts(assessment, i) or _distortion(assessment, gains, i)}"


def _dropouts(assessment: Assessment, channel: int) -> str:
    for record in assessment.update.records:
        if words := describe_dropouts(record.signals.T, record.fs)[channel]:
            return f'{words} in record "{record.name}", as of a loose cable'
    return ""


def _distortion(assessment: Assessment, gains: list[np.ndarray], channel: int) -> str:
    """Return in words how a channel is distorted, by its likeness to its prediction by the others over delays."""
    expected, known = _prediction(assessment, gains, channel, (channel,))
    if np.sum(known) < MIN_LINES:
        return "contradicts the others"
    measured, frequency = np.vstack(assessment.measured)[known, channel], assessment.frequency[known]
    delays = np.linspace(-MAX_DELAY, MAX_DELAY, DELAYS)
    # Of each line alike: else the few at resonances would tell all.
    shifts = np.exp(2j * np.pi * np.outer(delays, frequency))
    likeness = likeness_over_delays(measured, expected[known], shifts)
    best, now = float(likeness.max()), float(likeness[DELAYS // 2])
    if -now > DELAYED or (-now > PARTLY_DELAYED and -now > best + PARTLY_DELAYED_GAIN):
        return f"has the wrong sign (likeness {now:.2f}): turn it round in the dataset, as -Z for +Z"
    for without in dict.fromkeys(((channel,), assessment.suspects)) if best < WHOLE else ():
        if words := _clock_error(assessment, channel, *_prediction(assessment, gains, channel, without), delays, best):
            return words
    if (best > DELAYED and best > now + DELAY_GAIN) or (best > PARTLY_DELAYED and best > now + PARTLY_DELAYED_GAIN):
        late = 1e3 * float(delays[np.argmax(likeness)])
        return f"is {'late' if late > 0 else 'early'} by {abs(late):.3g} ms, as of another filter or converter"
    if best < UNRELATED:
        return "holds noise or another signal: no motion of this rig"
    if best > WHOLE:
        return f"follows the others (likeness {best:.2f}) but for what is added to it, as an offset, a drift or hum"
    return f"follows the others in part only (likeness {best:.2f}): clipped, overloaded, filtered, or hum is added"


def likeness_over_delays(measured: np.ndarray, expected: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """(n_shifts,) likeness of lines (n_f,) to their prediction by the other channels, over delays; 1: the same."""
    product = measured * expected.conj() / np.maximum(np.abs(measured), np.abs(expected)) ** 2
    return np.asarray((shifts @ product).real / product.size)


def _clock_error(
    assessment: Assessment, channel: int, expected: np.ndarray, known: np.ndarray, delays: np.ndarray, best: float
) -> str:
    """Return in words the error of a channel's sampling rate; "" where that does not make it like ``expected``."""
    if np.sum(known) < MIN_LINES:
        return ""
    shifts = np.exp(2j * np.pi * np.outer(delays, assessment.frequency[known]))
    records = {record.name: record for record in assessment.update.records}
    lines = [(records[name], frequency) for name, frequency in assessment.lines]
    splines = [scipy.interpolate.CubicSpline(np.arange(len(r.signals)), r.signals[:, channel]) for r, _ in lines]
    # A quarter of a period at the record's end, of the highest line, is the most that lies between two that are tried.
    step = 0.25 / max(record.duration * frequency[-1] for record, frequency in lines)
    count = int(MAX_CLOCK_ERROR / step)

    def corrected(error: float) -> np.ndarray:
        spectra = []
        for (record, frequency), spline in zip(lines, splines):
            at = np.minimum((1 + error) * np.arange(len(record.signals)), len(record.signals) - 1.0)
            band = (frequency[0], frequency[-1])
            all_lines, spectrum = complex_spectra(spline(at)[:, None], record.fs, band, len(at))
            spectra.append(spectrum[np.searchsorted(all_lines, frequency), 0])
        return np.concatenate(spectra)[known]

    error = 0.0
    for errors in (step * np.arange(-count, count + 1), step / FINER * np.arange(1 - FINER, FINER)):
        tried = (error + errors).tolist()
        alike = {e: likeness_over_delays(corrected(e), expected[known], shifts).max() for e in tried}
        error = max(alike, key=alike.__getitem__)
    if alike[error] < max(PARTLY_DELAYED, best + CLOCK_GAIN):
        return ""
    return (
        f"has a clock of its own, {100 * abs(error):.2g} % too {'fast' if error > 0 else 'slow'} (likeness "
        f"{best:.2f}, {alike[error]:.2f} without): sample all channels by one clock, or resample this one"
    )


def _prediction(
    assessment: Assessment, gains: list[np.ndarray], channel: int, without: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """(n_f,) lines of a channel predicted by all others but some, and True where that is certain enough."""
    weights, predicted = predicted_spectra(gains, assessment.measured, without)
    stacked_gains, expected = np.vstack(gains), predicted[:, channel]
    used = np.setdiff1d(np.arange(stacked_gains.shape[1]), without)
    if len(used) < stacked_gains.shape[2]:  # fewer channels than forces
        return expected, np.zeros(len(expected), dtype=bool)
    _, upper = np.linalg.qr(stacked_gains[:, used] * weights[:, used, None])
    noise_gains = np.linalg.solve(upper.conj().transpose(0, 2, 1), stacked_gains[:, channel, :, None].conj())
    return expected, np.linalg.norm(noise_gains[:, :, 0], axis=1) < CERTAIN * np.abs(expected)
