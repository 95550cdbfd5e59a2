"""Dry whirl: a shaft that rubs all round the wall of a clearance, against its spin, as friction drives it."""

from __future__ import annotations

import numpy as np

from .prepared import PreparedRecord

__all__ = ["without_dry_whirl"]

SECONDS = 0.4  # of a part of a record
BACKWARD = 0.9  # fraction of the motion's energy
CIRCULAR = 0.5  # of the median: a radius that 95 % of a part's samples pass
ALONG_WALL = 0.6  # of the gap: least median radius
LEAST = 4.0  # s, of the longest stretch without it, if it is to be used


def without_dry_whirl(record: PreparedRecord) -> PreparedRecord | None:
    """Return a record, or the longest stretch of it, in which no shaft runs backwards round the wall of a clearance.

    Parameters
    ----------
    record : PreparedRecord
        With two displacement probes in each clearance; of others it is not known.

    Returns
    -------
    PreparedRecord or None
        The record itself where there is no dry whirl; None where nothing is left that is long enough.
    """
    size = round(SECONDS * record.fs)
    if record.displacement is None or not record.rig.moves_across or record.displacement.shape[1] < size:
        return record
    count = record.displacement.shape[1] // size
    whirling = np.zeros(count, dtype=bool)
    for rows, bushing in zip(record.rig.clearance_rows, record.rig.bushings):
        if not bushing.is_round:
            continue
        y, z = record.displacement[rows]
        motion = (y + 1j * z)[: count * size].reshape(count, size)
        motion = motion - motion.mean(axis=1, keepdims=True)
        power, radius = np.abs(np.fft.fft(motion * np.hanning(size), axis=1)) ** 2, np.abs(motion)
        median = np.median(radius, axis=1)
        round_ = np.quantile(radius, 0.05, axis=1) > CIRCULAR * median
        backward = power[:, size // 2 + 1 :].sum(axis=1) > BACKWARD * power.sum(axis=1)
        whirling |= backward & round_ & (median > ALONG_WALL * bushing.gap)
    if not whirling.any():
        return record
    widened = np.convolve(whirling, np.ones(3), "same") > 0  # it begins and ends between
    stops = np.flatnonzero(np.concatenate(([True], widened, [True])))
    longest = int(np.argmax(np.diff(stops)))
    part = slice(stops[longest] * size, (stops[longest + 1] - 1) * size)
    return record.part(part) if part.stop - part.start >= LEAST * record.fs else None
