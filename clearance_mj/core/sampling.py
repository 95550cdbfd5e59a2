"""Sample times with jitter: the even times that were meant, and the missing samples."""

from __future__ import annotations

import numpy as np

from .errors import RecordError

__all__ = ["even_times"]

LATE = 0.5  # of the usual step, by which a sample may be late, or those that follow it
AROUND = 9  # samples before and after, whose medians tell a lost sample from one that was only stamped late


def even_times(time: np.ndarray, where: str) -> tuple[float, np.ndarray]:
    """Return the sampling rate, Hz, and the even times (n,), s, that are meant by times that jitter.

    A sample may be stamped late or early. If those that follow are later than those before by more than half a step,
    one has been lost.

    Parameters
    ----------
    time : ndarray, shape (n,)
        s.
    where : str
        What has these times, for errors.

    Raises
    ------
    RecordError
        For times that do not rise, and where samples are missing.
    """
    step = np.diff(time)
    if not step.size or not np.isfinite(step).all() or step.min() <= 0:
        raise RecordError(f"{where}: times must rise from sample to sample")
    far = min(2 * AROUND, step.size)
    usual = float(np.median((time[far:] - time[:-far]) / far))
    drift = time - usual * np.arange(time.size)

    def shift(i: int) -> float:
        """Return how much later samples are after a step than before it."""
        return float(abs(np.median(drift[i + 1 : i + 1 + AROUND]) - np.median(drift[max(0, i + 1 - AROUND) : i + 1])))

    uneven = np.flatnonzero(np.abs(step - usual) > LATE * usual)
    lost = [i for i in uneven.tolist() if shift(i) > LATE * usual]
    if lost:
        raise RecordError(
            f"{where}: {step[lost[0]]:.4g} s pass after {time[lost[0]]:.6g} s instead of {usual:.4g} s "
            f"({len(lost)} times): samples are missing; cut the run there, or bring it to an even rate"
        )
    fs = 1 / float(np.mean(step))
    return fs, time[0] + np.arange(time.size) / fs
