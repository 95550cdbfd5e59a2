"""Checks of a measured channel: finite, not constant, not clipped."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from ..core.errors import RecordError
from .arrays import runs

__all__ = ["check_channel", "clipped"]

CLIPPED = 4  # samples at a limit of a channel that count as clipping
EQUAL, FLAT = 1e-6, 1e-3  # of a channel's range: two samples that are equal, and several that are alike
COARSEST = 1 / 100  # of a channel's range: the coarsest step of a converter
STEEP = 8.0  # times the latter that a clipped peak falls by from its last sample to the next
OF_DIFFERENCES = norm.ppf(0.75) * math.sqrt(70)  # median magnitude of the fourth differences of white noise
FEW = 12  # samples at a limit, which noise may make
REST = 0.5  # of the RMS about the median: an extreme nearer to the median is where the channel rests


def check_channel(where: str, signal: ArrayLike, fs: float) -> None:
    """Refuse a channel (n_t,) that is not finite, constant or clipped; ``where`` names it in the message."""
    signal = np.asarray(signal, dtype=float)
    finite = np.isfinite(signal)
    if not finite.all():
        raise RecordError(f"{where} is not a finite number at {np.argmin(finite) / fs:g} s")
    if np.ptp(signal) <= 1e-12 * np.abs(signal).max():
        raise RecordError(f"{where} is constant ({signal[0]:g}), as when no sensor is connected")
    for at_limit in clipped(signal):
        if at_limit.sum() >= CLIPPED:
            extreme = signal[at_limit][np.argmax(np.abs(signal[at_limit] - np.median(signal)))]
            start = np.argmax(at_limit) / fs
            raise RecordError(f"{where} is clipped at {extreme:g} from {start:g} s on; use a larger range")


def clipped(signal: np.ndarray) -> Iterator[np.ndarray]:
    """Yield, for each limit of the converter that a signal (n_t,) comes to, a mask (n_t,) of the samples there.

    Equal samples are, to which the signal comes steeply. Where three samples lie within a step of a smooth peak's top,
    the next ones lie within four. Two samples that are equal lie on either side of it, and so the next ones are alike.
    A channel that fills fewer steps than the coarsest converter has is rounded to equal samples, not limited. Noise
    larger than what samples at a limit differ by makes a few alike by chance: as few must be equal.
    """
    centred = signal - np.median(signal)
    steps = np.diff(np.unique(centred))
    resolution = float(steps[steps > EQUAL * np.abs(centred).max()].min(initial=np.inf))
    noise = np.median(np.abs(np.diff(centred, 4))) / OF_DIFFERENCES if centred.size > CLIPPED else 0.0
    for side in (centred, -centred):
        top = side.max()
        if top <= REST * np.sqrt(np.mean(centred**2)) or resolution > COARSEST * top:
            continue
        flat = max(FLAT * top, (1 + EQUAL) * resolution)
        at_limit = side >= top - flat
        if at_limit.sum() < FEW and noise > FLAT * top:
            flat = (1 + EQUAL) * resolution
            at_limit = side >= top - flat
        edges = runs(at_limit)
        fall = top - np.pad(side, 1, mode="edge")[edges + np.array((0, 1))]
        run, steep = np.diff(edges)[:, 0], fall.max(axis=1) > STEEP * flat
        pair = (run == 2) & (np.abs(np.subtract(*side[edges - np.array((0, 1))].T)) <= EQUAL * top)
        if (steep & ((run > 2) | (pair & (np.ptp(fall, axis=1) > STEEP * flat)))).any():
            yield at_limit
