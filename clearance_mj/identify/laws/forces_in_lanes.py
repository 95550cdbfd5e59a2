"""Forces of several laws in one measured motion, filtered and decimated; along a line in the lanes of a register."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.signal

from ...clearance.along import force_at
from ...clearance.record import laws_of, side_by_side
from ...clearance.registers import load, spread, store
from ...core.jit import OPTIONS, jit
from .case import ClearanceWithLaw, forces_along

__all__ = ["LANES", "BushingMotion", "decimated", "law_forces"]

LANES = 8  # laws at a time
BLOCK = 64  # samples that are filtered together: intermediate results stay in the processor's cache


class BushingMotion(NamedTuple):
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
    paths: Sequence[BushingMotion], taps: np.ndarray, factor: int, cases: Sequence[ClearanceWithLaw],
    slow: Sequence[np.ndarray] = (),
) -> np.ndarray:  # fmt: skip
    """Return the forces (n d, n_cases), N, of laws of one clearance in measured motions, one motion after the other.

    ``taps``: of the low-pass, odd in number and symmetric; every ``factor``-th sample is kept, the first included, with
    its d coordinates one after the other. All cases are of the same models of contact and filling, all motions of one
    step. ``slow``: displacements (n, n_cases) at the samples kept of each motion along one coordinate, which come on
    top of it at all points; periodic in the motion's duration.
    """
    if paths[0].x.shape[2] > 1:
        return _one_by_one(paths, taps, factor, cases)
    parts = [
        _forces_of_lanes(paths, taps, factor, cases[i : i + LANES], [x[:, i : i + LANES] for x in slow])
        for i in range(0, len(cases), LANES)
    ]
    return np.concatenate(parts, axis=1)


def _forces_of_lanes(
    paths: Sequence[BushingMotion], taps: np.ndarray, factor: int, cases: Sequence[ClearanceWithLaw],
    slow: list[np.ndarray],
) -> np.ndarray:  # fmt: skip
    count, unused = len(cases), LANES - len(cases)
    padded = [*cases, *[cases[0]] * unused]
    records = side_by_side([case.records(paths[0].step) for case in padded], laws_of(cases[0], cases[0].law))
    forces = [np.empty((-(-len(path.x) // factor), LANES)) for path in paths]
    no_motion = np.zeros((0, LANES))
    for path, out, x in itertools.zip_longest(paths, forces, slow):
        slow_motion = no_motion if x is None else np.pad(np.vstack((x, x[:1])), ((0, 0), (0, unused)), mode="edge")
        levers = np.array([[path.lever(case.bushing.length) for case in padded]])
        numbers = records.numbers.copy()  # at rest
        places, speeds = path.x[:, :, 0], path.v[:, :, 0]
        _fill(places, speeds, levers, slow_motion, taps, factor, tuple(range(LANES)), records.bushings, numbers, out)
    return np.concatenate(forces)[:, :count]


def _one_by_one(
    paths: Sequence[BushingMotion], taps: np.ndarray, factor: int, cases: Sequence[ClearanceWithLaw]
) -> np.ndarray:
    """As `law_forces`: walls and friction of two coordinates branch, and lanes would wait for each other."""
    columns = []
    for case in cases:
        forces = [forces_along(case, p.x, p.v, p.spin, p.step, p.lever(case.bushing.length)) for p in paths]
        columns.append(np.concatenate([decimated(force, taps, factor).ravel() for force in forces]))
    return np.column_stack(columns)


def decimated(signal: np.ndarray, taps: np.ndarray, factor: int) -> np.ndarray:
    """Return every ``factor``-th sample of a signal (n, ...) from the first on, low-passed by an odd number of taps."""
    samples = scipy.signal.upfirdn(taps, signal, 1, factor, axis=0)[taps.size // 2 // factor :]
    return np.asarray(samples[: -(-len(signal) // factor)])


@jit(**OPTIONS)
def _fill(
    x: np.ndarray, v: np.ndarray, levers: np.ndarray, slow: np.ndarray, taps: np.ndarray, factor: int,
    lanes: tuple[int, ...], bushings: np.ndarray, numbers: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Fill (ceil(n / factor), lanes) filtered forces in the motion x, v (n, 3), ends times levers (1, lanes) away.

    With displacements ``slow`` (ceil(n / factor) + 1, lanes) at the kept samples on top, or none (0, lanes).
    """
    bushing, lever, none = bushings[0], load(levers, 0, lanes), spread(0.0, lanes)
    count, n, half = len(lanes), x.shape[0], taps.size // 2
    stride = BLOCK * factor
    # Row r of a block is sample r - half of the motion, from the block's first on; none is beyond the ends.
    rows, done = np.zeros((stride - factor + taps.size, count)), 0
    for block in range(0, out.shape[0], BLOCK):
        first = block * factor - half
        for r in range(done - first, rows.shape[0]):
            force, i = none, first + r
            if i < n:
                place, speed = x[i, 0] + none, v[i, 0] + none
                if slow.shape[0]:
                    k = i // factor
                    drift = load(slow, k + 1, lanes) - load(slow, k, lanes)
                    place = place + load(slow, k, lanes) + (i - k * factor) / factor * drift
                    speed = speed + 1 / (factor * bushing.step) * drift
                a, b = lever * (x[i, 1] - x[i, 0]), lever * (x[i, 2] - x[i, 0])
                v_a, v_b = lever * (v[i, 1] - v[i, 0]), lever * (v[i, 2] - v[i, 0])
                force = force_at(
                    bushing, numbers, i * bushing.step, (place,), (speed,), (place + a,), (speed + v_a,),
                    (place + b,), (speed + v_b,), none, lanes,
                )[0]  # fmt: skip
            store(rows, r, force, lanes)
        done = first + rows.shape[0]
        for k in range(min(BLOCK, out.shape[0] - block)):
            start = k * factor
            last = start + taps.size - 1
            total = taps[half] * load(rows, start + half, lanes)
            for j in range(half):
                total = total + taps[j] * (load(rows, start + j, lanes) + load(rows, last - j, lanes))
            store(out, block + k, total, lanes)
        for r in range(rows.shape[0] - stride):
            store(rows, r, load(rows, r + stride, lanes), lanes)
