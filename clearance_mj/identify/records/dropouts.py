"""Signs of a loose cable or a wrong zero in a measured channel: dropouts, spikes, offsets and drifts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ...signals.arrays import runs

__all__ = ["describe_dropouts", "zero_error"]

HELD = 10  # equal samples in a row, from which on they are a dropout
BEFORE = 20  # steps before a dropout, in which a signal that comes to rest would have calmed down
ABRUPT = 10.0  # resolutions: steps before a dropout
SPIKE = 12.0  # standard deviations by which one sample stands out of both its neighbours
SHARED = 4.0  # standard deviations by which a sample of another channel does so, too, where both feel an impact
ONE_IMPACT = 0.05  # s, within which they feel it
PARTS = 4  # of a record: the quietest shows the zero, the first and the last a drift
DRIFT = 0.3  # of the gap, and of the motion: of a probe in another unit that is much larger
LOUDER = 3.0
"""Factor between the levels of two parts: after a louder one, grease holds the shaft away from where it rests."""
OFFSET = 0.01, 0.2
"""Of the gap, and of the motion in the quietest part, both: sound records have up to 0.05 of the motion."""


def describe_dropouts(signals: Sequence[np.ndarray] | np.ndarray, fs: float) -> list[str]:
    """Return for each channel (n_t,) of a record, in words, where it drops out or has a spike alone; "" if not."""
    peaks = [_prominence(signal) for signal in signals]
    near = math.ceil(ONE_IMPACT * fs)
    described = []
    for i, (signal, spikes) in enumerate(zip(signals, peaks)):
        at = int(np.argmax(spikes))
        around = slice(max(0, at - near), at + near + 1)
        lone = spikes[at] > SPIKE and all(other[around].max() < SHARED for other in peaks[:i] + peaks[i + 1 :])
        described.append(_dropout(signal, fs) or (f"has a spike of one sample at {at / fs:.4g} s" if lone else ""))
    return described


def _dropout(signal: np.ndarray, fs: float) -> str:
    """Equal samples in a row, to which the signal did not calm down: at rest it steps by its resolution."""
    steps = np.abs(np.diff(signal))
    moving = steps[steps > 0]
    if moving.size < HELD:
        return ""
    edges = runs(steps == 0)
    for begin, end in edges[np.diff(edges, axis=1)[:, 0] >= HELD - 1].tolist():
        jump = begin and signal[begin] == 0  # into the dropout, if that is to zero
        before = steps[max(0, begin - BEFORE) : begin - bool(jump)]
        if before.size and np.median(before) > ABRUPT * moving.min():
            return f"drops out at {begin / fs:.4g} s for {(end - begin + 1) / fs:.3g} s"
    return ""


def _prominence(signal: np.ndarray) -> np.ndarray:
    """Return how far each sample (n_t,) stands out of both its neighbours, in standard deviations of the signal."""
    steps = np.diff(signal)
    out = np.zeros(signal.size)
    out[1:-1] = np.maximum(np.minimum(steps[:-1], -steps[1:]), np.minimum(-steps[:-1], steps[1:]))
    spread = float(np.std(np.delete(signal, int(np.argmax(out)))))  # the spike itself makes the spread
    return out / spread if spread > 0 else np.zeros(signal.size)


def zero_error(displacement: ArrayLike, gap: float) -> str:
    """Return in words how a probe's zero (n_t,) is off or drifts, in m, compared with a gap, m; "" if it does not.

    A probe reads zero where the shaft rests: its median in the quietest quarter of a record.
    """
    parts = np.array_split(np.asarray(displacement, dtype=float), PARTS)
    rests = [float(np.median(part)) for part in parts]
    levels = [float(np.std(part)) for part in parts]
    quietest = int(np.argmin(levels))
    drift, offset = rests[-1] - rests[0], rests[quietest]
    if abs(drift) > DRIFT * max(gap, levels[0], levels[-1]):
        return f"drifts by {1e3 * drift:.3g} mm"
    limit = max(OFFSET[0] * gap, OFFSET[1] * levels[quietest])
    if max(levels[: quietest + 1]) < LOUDER * levels[quietest] and abs(offset) > limit:
        return f"has an offset of {1e3 * offset:.3g} mm"
    return ""
