"""A car's bus: each message arrives after a random delay, in the order in which it was sent."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

__all__ = ["Message", "age", "draws"]

ROUNDING = 1e-9  # s, tolerance of arrival times


class Message:
    """A kind of message on the bus: its delays are uniform between two bounds, s, and its order is kept."""

    def __init__(self, delay: tuple[float, float], noise: np.random.Generator):
        self._delays = draws(lambda count: noise.uniform(*delay, count))
        self._pending: deque[tuple[float, Any]] = deque()
        self._arrived = -math.inf

    def send(self, time: float, value: Any) -> None:
        """Put a value on the bus at a time, s."""
        self._arrived = max(self._arrived, time + next(self._delays))
        self._pending.append((self._arrived, value))

    def read(self, time: float) -> Any | None:
        """Return the newest value that has arrived since the last reading, None if none has."""
        value = None
        while self._pending and self._pending[0][0] <= time + ROUNDING:
            value = self._pending.popleft()[1]
        return value


def draws(many: Callable[[int], np.ndarray]) -> Iterator[Any]:
    """Yield random numbers, or lists of them, drawn in blocks by a function, which is faster than single draws."""
    while True:
        yield from many(256).tolist()


def age(delay: tuple[float, float], period: float) -> tuple[float, float]:
    """Return mean and standard deviation, s, of the newest value's age, sent and read once a period, s.

    It is at most n periods if all values sent n periods ago and before have arrived. That has the probability
    F_n = Π_i≥n P(delay ≤ i · period), and E N = Σ_n (1 - F_n), E N² = Σ_n (2 n + 1) (1 - F_n).
    """
    low, high = delay
    periods = np.arange(math.ceil((high - ROUNDING) / period) + 1)
    arrived = np.where(periods * period >= high - ROUNDING, 1.0, 0.0)
    if high > low:
        arrived = np.clip((periods * period - low) / (high - low), 0.0, 1.0)
    not_arrived = 1 - np.cumprod(arrived[::-1])[::-1]
    mean, mean_square = not_arrived.sum(), ((2 * periods + 1) * not_arrived).sum()
    return period * float(mean), period * math.sqrt(max(mean_square - mean**2, 0.0))
