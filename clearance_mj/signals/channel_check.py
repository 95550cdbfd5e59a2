"""Whether a measured channel can be used at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import RecordError

__all__ = ["check_channel"]

CLIPPED = 4  # samples at the extreme of a channel, in runs of two or more, that count as clipping
NEAR_EXTREME = 0.9  # of the extreme: from here on the channel's resolution is taken
STEEP = 10  # resolutions: a smooth peak falls by less from its highest samples to the next, a clipped one by more
REST = 0.5  # of the RMS about the median: an extreme nearer to the median is where the channel rests


def check_channel(where: str, signal: ArrayLike, fs: float) -> None:
    """Refuse a channel (n_t,) that is not finite, constant or clipped; ``where`` names it in the message.

    Clipping shows as samples at the very extreme, two or more in a row, to which the signal comes steeply: a smooth
    peak that a coarse converter rounds to equal samples falls off by a few of its steps only.
    """
    signal = np.asarray(signal, dtype=float)
    finite = np.isfinite(signal)
    if not finite.all():
        raise RecordError(f"{where} is not a finite number at {np.argmin(finite) / fs:g} s")
    if np.ptp(signal) <= 1e-12 * np.abs(signal).max():
        raise RecordError(f"{where} is constant ({signal[0]:g}), as when no sensor is connected")
    for side in (signal, -signal):
        runs = _runs_at_the_top(side)
        if sum(stop - start for start, stop in runs) >= CLIPPED:
            first = runs[0][0]
            raise RecordError(f"{where} is clipped at {signal[first]:g} from {first / fs:g} s on; use a larger range")


def _runs_at_the_top(signal: np.ndarray) -> list[tuple[int, int]]:
    """First sample and end of each steep run of two or more samples at the maximum."""
    middle, top = np.median(signal), signal.max()
    if top - middle <= REST * np.sqrt(np.mean((signal - middle) ** 2)):
        return []
    levels = np.unique(signal[signal > middle + NEAR_EXTREME * (top - middle)])
    resolution = np.diff(levels).min() if levels.size > 1 else 0.0
    edges = np.flatnonzero(np.diff(np.concatenate(([False], signal == top, [False])))).reshape(-1, 2)
    runs = [(int(a), int(b)) for a, b in edges if b - a > 1]
    return [(a, b) for a, b in runs if top - signal[max(a - 1, 0) : b + 1].min() > STEEP * resolution]
