"""Delayed channels: outputs of an engine delayed by fractions of a step, block by block."""

from __future__ import annotations

import numpy as np

__all__ = ["DelayedChannels"]

BEFORE, AFTER = 1, 2  # steps about the one at or before an instant that its cubic takes


class DelayedChannels:
    """Delay the columns of a stream of blocks individually, by the cubic through four steps.

    Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, 25.2.13. Steps are many times finer than samples,
    so that the cubic is exact to some 1e-5 in the records' band.

    Parameters
    ----------
    delays : ndarray, shape (n_columns,)
        Steps, negative ones for columns that are early.
    multiple : int
        The look-ahead `ahead` of the stream is a multiple of so many steps.
    before : float or ndarray, shape (n_columns,)
        Values of the columns before the stream.
    """

    def __init__(self, delays: np.ndarray, multiple: int, before: float | np.ndarray = 0.0) -> None:
        early = max(0.0, -float(delays.min(initial=0.0)))
        self.ahead = multiple * int(np.ceil((early + AFTER) / multiple))
        """steps needed beyond the returned ones"""
        back = np.ceil(self.ahead + delays)  # steps from the newest sample to the one at or before the instant
        p = back - (self.ahead + delays)
        self._weights = np.array(
            [-p * (p - 1) * (p - 2) / 6, (p**2 - 1) * (p - 2) / 2, -p * (p + 1) * (p - 2) / 2, p * (p**2 - 1) / 6]
        )
        self._buffer = np.zeros((int(back.max(initial=0)) + BEFORE, delays.size)) + before
        self._first = len(self._buffer) - back.astype(int) - BEFORE
        self._early = self.ahead

    def push(self, block: np.ndarray) -> np.ndarray:
        """Take the next steps (n, n_columns) and return those (m, n_columns) that are complete."""
        stream, out = np.concatenate((self._buffer, block)), np.zeros(block.shape)
        for column, first in enumerate(self._first):
            for k, weight in enumerate(self._weights[:, column]):
                if weight:
                    out[:, column] += weight * stream[first + k : first + k + len(block), column]
        self._buffer = stream[len(block) :]
        dropped = min(self._early, len(block))
        self._early -= dropped
        return out[dropped:]
