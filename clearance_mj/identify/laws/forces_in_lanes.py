"""Forces of several laws in one measured motion, side by side in the lanes of a register, filtered and decimated."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.signal

from ...clearance.along import force_at
from ...clearance.record import laws_of, side_by_side
from ...clearance.registers import load, spread, store
from ...clearance.vectors import minus, of_one_or_two, plus, times
from ...core.jit import OPTIONS, inlined, jit
from .case import Case

__all__ = ["LANES", "Path", "decimated", "law_forces"]

LANES = 8  # laws at a time
BLOCK = 64  # samples that are filtered together: what lies between stays in the processor's cache


class Path(NamedTuple):
    """Motion of one clearance from rest, at a fine rate."""

    x: np.ndarray  #: (n, 3, d) displacements of the middle and both ends, m
    v: np.ndarray  #: (n, 3, d) velocities, m/s
    spin: np.ndarray  #: (n,) rad/s
    step: float  #: s
    length: float  #: m, between both ends; 0 of a point

    def lever(self, length: float) -> float:
        """Return how far from the middle the ends of a bushing of another length are, over these ends' distance."""
        return length / self.length if self.length else 1.0

    def at_ends(self, length: float) -> np.ndarray:
        """Return displacements (n, 2, d) at both ends of a bushing of another length: a shaft is straight in it."""
        return self.x[:, :1] + self.lever(length) * (self.x[:, 1:] - self.x[:, :1])


def law_forces(
    paths: Sequence[Path], taps: np.ndarray, factor: int, cases: Sequence[Case], slow: Sequence[np.ndarray] = ()
) -> np.ndarray:
    """Return the forces (n d, n_cases), N, of laws of one clearance in measured motions, one motion after the other.

    ``taps``: of the low-pass, odd in number and symmetric; every ``factor``-th sample is kept, the first included, with
    its d coordinates one after the other. All cases are of the same models of contact and filling, all motions of one
    step. ``slow``: displacements (n, n_cases) at the samples kept of each motion along one coordinate, which come on
    top of it at all points; periodic in the motion's duration.
    """
    parts = [
        _some(paths, taps, factor, cases[i : i + LANES], [x[:, i : i + LANES] for x in slow])
        for i in range(0, len(cases), LANES)
    ]
    return np.concatenate(parts, axis=1)


def _some(
    paths: Sequence[Path], taps: np.ndarray, factor: int, cases: Sequence[Case], slow: list[np.ndarray]
) -> np.ndarray:
    count, rest, size = len(cases), LANES - len(cases), paths[0].x.shape[2]
    whole = [*cases, *[cases[0]] * rest]
    laws = laws_of(cases[0], cases[0].law)
    records = side_by_side([case.records(paths[0].step) for case in whole], laws)
    found = [np.empty((size * -(-len(path.x) // factor), LANES)) for path in paths]
    still = np.zeros((0, LANES))
    for path, out, x in itertools.zip_longest(paths, found, slow):
        moved = still if x is None else np.pad(np.vstack((x, x[:1])), ((0, 0), (0, rest)), mode="edge")
        levers = np.array([[path.lever(case.bushing.length) for case in whole]])
        numbers = records.numbers.copy()  # at rest
        _fill(
            (0.0,) * size, path.x, path.v, path.spin, levers, moved, taps, factor, tuple(range(LANES)),
            records.bushings, numbers, out,
        )  # fmt: skip
    return np.concatenate(found)[:, :count]


def decimated(signal: np.ndarray, taps: np.ndarray, factor: int) -> np.ndarray:
    """Return every ``factor``-th sample of a signal (n, ...) from the first on, low-passed by an odd number of taps."""
    kept = scipy.signal.upfirdn(taps, signal, 1, factor, axis=0)[taps.size // 2 // factor :]
    return np.asarray(kept[: -(-len(signal) // factor)])


_at = of_one_or_two(
    lambda like, rows, i, p, none: (rows[i, p, 0] + none,),
    lambda like, rows, i, p, none: (rows[i, p, 0] + none, rows[i, p, 1] + none),
    "Point p of a motion at sample i, in all lanes.",
)
_shifted = of_one_or_two(lambda r, by: (r[0] + by,), lambda r, by: r, "A vector of one coordinate farther by a number.")


def _keep_one(force: Any, rows: Any, r: Any, lanes: Any) -> None:
    store(rows, r, force[0], lanes)


def _keep_two(force: Any, rows: Any, r: Any, lanes: Any) -> None:
    store(rows, 2 * r, force[0], lanes)
    store(rows, 2 * r + 1, force[1], lanes)


_keep = of_one_or_two(_keep_one, _keep_two)


@inlined
def _end(lever: Any, middle: Any, end: Any) -> Any:
    return plus(middle, times(lever, minus(end, middle)))


@jit(**OPTIONS)
def _fill(
    like: tuple[float, ...], x: np.ndarray, v: np.ndarray, spin: np.ndarray, levers: np.ndarray, slow: np.ndarray,
    taps: np.ndarray, factor: int, lanes: tuple[int, ...], bushings: np.ndarray, numbers: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Fill (ceil(n / factor) d, lanes) filtered forces in the motion x, v (n, 3, d), ends times levers (1, lanes) away.

    With displacements ``slow`` (ceil(n / factor) + 1, lanes) at the kept samples on top, or none (0, lanes).
    """
    bushing, lever, none, size = bushings[0], load(levers, 0, lanes), spread(0.0, lanes), len(like)
    count, n, half, kept = len(lanes), x.shape[0], taps.size // 2, out.shape[0] // len(like)
    stride = BLOCK * factor
    # Row r of a block is sample r - half of the motion, from the block's first on; none is beyond the ends.
    length = stride - factor + taps.size
    rows, done = np.zeros((length * size, count)), 0
    for block in range(0, kept, BLOCK):
        first = block * factor - half
        for r in range(done - first, length):
            i = first + r
            if i >= n:
                for d in range(size):
                    store(rows, r * size + d, none, lanes)
                continue
            place, speed = _at(like, x, i, 0, none), _at(like, v, i, 0, none)
            a, v_a = _end(lever, place, _at(like, x, i, 1, none)), _end(lever, speed, _at(like, v, i, 1, none))
            b, v_b = _end(lever, place, _at(like, x, i, 2, none)), _end(lever, speed, _at(like, v, i, 2, none))
            if slow.shape[0]:
                k = i // factor
                drift = load(slow, k + 1, lanes) - load(slow, k, lanes)
                by = load(slow, k, lanes) + (i - k * factor) / factor * drift
                place, a, b = _shifted(place, by), _shifted(a, by), _shifted(b, by)
                by = 1 / (factor * bushing.step) * drift
                speed, v_a, v_b = _shifted(speed, by), _shifted(v_a, by), _shifted(v_b, by)
            force = force_at(bushing, numbers, i * bushing.step, place, speed, a, v_a, b, v_b, spin[i] + none, lanes)
            _keep(force, rows, r, lanes)
        done = first + length
        for k in range(min(BLOCK, kept - block)):
            start = k * factor
            last = start + taps.size - 1
            for d in range(size):
                total = taps[half] * load(rows, (start + half) * size + d, lanes)
                for j in range(half):
                    of_both = load(rows, (start + j) * size + d, lanes) + load(rows, (last - j) * size + d, lanes)
                    total = total + taps[j] * of_both
                store(out, (block + k) * size + d, total, lanes)
        for r in range((length - stride) * size):
            store(rows, r, load(rows, r + stride * size, lanes), lanes)
