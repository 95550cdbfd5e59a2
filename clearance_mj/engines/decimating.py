"""Decimation of the steps of compiled loops, several cases in lanes, see lanes.py."""

from __future__ import annotations

import numpy as np

from ..clearance.registers import load, spread, store
from ..core.jit import jit

__all__ = ["BLOCK_SAMPLES", "decimate", "fill_before", "padded_taps"]

DECIMATED = 4  # samples computed together in one pass over the steps
BLOCK_SAMPLES = 64  # simulated between two decimations: their steps stay in the processor's cache


@jit(inline="always")
def padded_taps(taps: np.ndarray, factor: int) -> np.ndarray:
    """Return a filter padded with zeros on both sides, so that it can be shifted over several samples at once."""
    padded = np.zeros(taps.size + 2 * (DECIMATED - 1) * factor)
    padded[(DECIMATED - 1) * factor : (DECIMATED - 1) * factor + taps.size] = taps
    return padded


@jit(inline="always")
def fill_before(before: np.ndarray, count: int, lanes: tuple[int, ...], steps: np.ndarray) -> None:
    """Fill so many steps with the columns' values before the first one, ``before`` (columns, lanes)."""
    for column in range(steps.shape[0]):
        for i in range(count):
            store(steps, column * steps.shape[1] + i, load(before, column, lanes), lanes)


@jit(inline="always")
def decimate(
    steps: np.ndarray, filled: int, padded: np.ndarray, taps: int, factor: int, lanes: tuple[int, ...],
    out: np.ndarray, samples: int,
) -> int:  # fmt: skip
    """Compute all samples whose steps are known, from ``samples`` on, drop these steps, and return their number.

    ``steps`` (columns, size, lanes): steps under the next sample's filter, those that follow, some zeros;
    ``filled`` of them are known. ``padded`` is of so many ``taps``; ``out``: (lanes, columns, n).
    """
    columns, size = steps.shape[0], steps.shape[1]
    ready = min(max(0, (filled - taps) // factor + 1), out.shape[2] - samples)
    for column in range(columns):
        for i in range(0, ready, DECIMATED):
            row, few = column * size + i * factor, min(DECIMATED, ready - i)
            _decimate(steps, row, padded, factor, lanes, out[:, column, samples + i : samples + i + few])
        row = column * size
        for i in range(row, row + filled - ready * factor):
            store(steps, i, load(steps, i + ready * factor, lanes), lanes)
    return ready


@jit(inline="always")
def _decimate(
    steps: np.ndarray, row: int, padded: np.ndarray, factor: int, lanes: tuple[int, ...], out: np.ndarray
) -> None:
    """Fill (lanes, n) up to `DECIMATED` samples, under the filter of the first of which the steps begin at a row."""
    first = (DECIMATED - 1) * factor
    a = b = c = d = spread(0.0, lanes)
    for j in range(first, padded.size):
        x = load(steps, row + j - first, lanes)
        a += padded[j] * x
        b += padded[j - factor] * x
        c += padded[j - 2 * factor] * x
        d += padded[j - 3 * factor] * x
    values = np.empty((DECIMATED, len(lanes)))
    store(values, 0, a, lanes)
    store(values, 1, b, lanes)
    store(values, 2, c, lanes)
    store(values, 3, d, lanes)
    for lane in range(out.shape[0]):
        for k in range(out.shape[1]):
            out[lane, k] = values[k, lane]
