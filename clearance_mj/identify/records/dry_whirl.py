"""Dry whirl: a shaft that rubs all round the wall of a clearance, against its spin, as friction drives it."""

from __future__ import annotations

import numpy as np

from .prepared import PreparedRecord

__all__ = ["whirls_dry"]

SECONDS = 0.4  # of a part of a record
BACKWARD = 0.9  # share of the motion's energy
CIRCULAR = 0.5  # of the median: a radius that 95 % of a part's samples pass
ALONG_WALL = 0.6  # of the gap: least median radius


def whirls_dry(record: PreparedRecord) -> bool:
    """Return whether a shaft anywhere in a record runs backwards round the wall of a clearance.

    Parameters
    ----------
    record : PreparedRecord
        With two displacement probes in each clearance; of others that is not known.
    """
    size = round(SECONDS * record.fs)
    if record.displacement is None or not record.rig.moves_across or record.displacement.shape[1] < size:
        return False
    count = record.displacement.shape[1] // size
    for (y, z), bushing in zip(record.displacement.reshape(len(record.rig.bushings), 2, -1), record.rig.bushings):
        moved = (y + 1j * z)[: count * size].reshape(count, size)
        moved = moved - moved.mean(axis=1, keepdims=True)
        power, radius = np.abs(np.fft.fft(moved * np.hanning(size), axis=1)) ** 2, np.abs(moved)
        median = np.median(radius, axis=1)
        round_ = np.quantile(radius, 0.05, axis=1) > CIRCULAR * median
        backward = power[:, size // 2 + 1 :].sum(axis=1) > BACKWARD * power.sum(axis=1)
        if np.any(backward & round_ & (median > ALONG_WALL * bushing.gap)):
            return True
    return False
