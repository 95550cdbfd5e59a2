"""Forces of several laws in one measured motion, side by side in the lanes of a register, filtered and decimated."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.signal

from ...clearance import ContactLaw
from ...clearance.cycle import fill_forces
from ...clearance.kernel import clearance_records, greases_of
from ...clearance.lane_contacts import LaneContacts, contact_in_lanes, lane_contacts, penetration_in_lanes
from ...clearance.lane_greases import LaneGreases, grease_in_lanes, lane_greases
from ...clearance.lanes import larger, load, spread, store
from ...core.jit import OPTIONS, jit
from ...rig import Bushing, Rig

__all__ = ["LANES", "Path", "decimated", "law_forces"]

LANES = 8  # laws at a time
BLOCK = 64  # samples that are filtered together: what lies between stays in the processor's cache


class Path(NamedTuple):
    """Motion of one bushing from rest, at a fine rate."""

    x: np.ndarray  #: (n, 3) displacements of the middle and both ends, m
    v: np.ndarray  #: (n, 3) velocities, m/s
    step: float  #: s
    length: float  #: m, between both ends; 0 of a point

    def lever(self, length: float) -> float:
        """Return how far from the middle the ends of a bushing of another length are, over these ends' distance."""
        return length / self.length if self.length else 1.0

    def at_ends(self, length: float) -> np.ndarray:
        """Return displacements (n, 2) at both ends of a bushing of another length: a shaft is straight in it."""
        return self.x[:, :1] + self.lever(length) * (self.x[:, 1:] - self.x[:, :1])


def law_forces(
    paths: Sequence[Path], taps: np.ndarray, factor: int, rig: Rig, cases: Sequence[tuple[Bushing, ContactLaw]],
    slow: Sequence[np.ndarray] = (),
) -> np.ndarray:  # fmt: skip
    """Return the forces (n, n_cases), N, of laws of one bushing in measured motions, one motion after the other.

    ``taps``: of the low-pass, odd in number and symmetric; every ``factor``-th sample is kept, the first included. All
    cases are of the same models of contact and filling; those whose laws work lane by lane only are computed one after
    the other. ``rig`` is any. ``slow``: displacements (n, n_cases) at the samples kept of each motion, which come on
    top of it at all points; periodic in the motion's duration.
    """
    parts = [
        _some(paths, taps, factor, rig, [*cases[i : i + LANES]], [x[:, i : i + LANES] for x in slow])
        for i in range(0, len(cases), LANES)
    ]
    return np.concatenate(parts, axis=1)


def _some(
    paths: Sequence[Path], taps: np.ndarray, factor: int, rig: Rig, cases: list[tuple[Bushing, ContactLaw]],
    slow: list[np.ndarray],
) -> np.ndarray:  # fmt: skip
    count, rest = len(cases), LANES - len(cases)
    rigs, laws = [rig.replace(bushings=(bushing,)) for bushing, _ in cases], [law for _, law in cases]
    offsets = np.array([[bushing.offset] for bushing, _ in cases + cases[:1] * rest])
    models = [greases_of(*case) for case in zip(rigs, laws)]
    greases = lane_greases(models + models[:1] * rest, offsets)
    records = [clearance_records(*case, paths[0].step) for case in zip(rigs, laws)]  # the contacts know no step
    contacts = lane_contacts([[type(laws[0].contact[0])]] * LANES, records + records[:1] * rest)
    if not (greases.law[0] and contacts.law[0]):
        with_slow = [_with_slow(paths, factor, [x[:, i] for x in slow]) for i in range(count)]
        return np.transpose([_one(each, taps, factor, *case) for each, case in zip(with_slow, zip(rigs, laws))])
    lengths = [bushing.length for bushing, _ in cases + cases[:1] * rest]
    found = [np.empty((-(-len(path.x) // factor), LANES)) for path in paths]
    still = np.zeros((0, LANES))
    for path, out, x in itertools.zip_longest(paths, found, slow):
        moved = still if x is None else np.pad(np.vstack((x, x[:1])), ((0, 0), (0, rest)), mode="edge")
        at_rest = [part._replace(numbers=part.numbers.copy()) for part in (greases, contacts)]
        levers = np.array([[path.lever(length) for length in lengths]])
        _fill(path.x, path.v, levers, path.step, moved, taps, factor, tuple(range(LANES)), *at_rest, out)
    return np.concatenate(found)[:, :count]


def _with_slow(paths: Sequence[Path], factor: int, slow: Sequence[np.ndarray]) -> Sequence[Path]:
    """Motions with a slow one (n,) on top of each, if there is any."""
    if not slow:
        return paths
    found = []
    for path, x in zip(paths, slow):
        at, kept = np.arange(len(path.x)), factor * np.arange(x.size)
        moved = np.interp(at, kept, x, period=factor * x.size)
        found.append(path._replace(x=path.x + moved[:, None], v=path.v + np.gradient(moved, path.step)[:, None]))
    return found


def _one(paths: Sequence[Path], taps: np.ndarray, factor: int, rig: Rig, law: ContactLaw) -> np.ndarray:
    """Forces (n,) of a law that does not work in lanes."""
    found = []
    for path in paths:
        force = np.zeros((1, len(path.x)))
        lever = path.lever(rig.bushings[0].length)
        spread_out = (each[:, :1] + (each - each[:, :1]) * (1.0, lever, lever) for each in (path.x, path.v))
        x, v = (np.ascontiguousarray(each.T[None]) for each in spread_out)
        fill_forces(x, v, clearance_records(rig, law, path.step), force)
        found.append(decimated(force[0], taps, factor))
    return np.concatenate(found)


def decimated(signal: np.ndarray, taps: np.ndarray, factor: int) -> np.ndarray:
    """Return every ``factor``-th sample of a signal (n, ...) from the first on, low-passed by an odd number of taps."""
    kept = scipy.signal.upfirdn(taps, signal, 1, factor, axis=0)[taps.size // 2 // factor :]
    return np.asarray(kept[: -(-len(signal) // factor)])


@jit(**OPTIONS)
def _fill(
    x: np.ndarray, v: np.ndarray, levers: np.ndarray, step: float, slow: np.ndarray, taps: np.ndarray, factor: int,
    lanes: tuple[int, ...], greases: LaneGreases, contacts: LaneContacts, out: np.ndarray,
) -> None:  # fmt: skip
    """Fill (ceil(n / factor), lanes) filtered forces in the motion x, v (n, 3), ends times levers (1, lanes) away.

    With displacements ``slow`` (ceil(n / factor) + 1, lanes) at the kept samples on top, or none (0, lanes).
    """
    count, n, half = len(lanes), x.shape[0], taps.size // 2
    place, speed, depth = np.zeros((3, count)), np.zeros((3, count)), np.zeros((3, count))
    elastic, viscous, side = np.zeros((3, count)), np.zeros((3, count)), np.ones((3, count))
    stride = BLOCK * factor
    # Row r of a block is sample r - half of the motion, from the block's first on; none is beyond the ends.
    rows, done = np.zeros((stride - factor + taps.size, count)), 0
    for block in range(0, out.shape[0], BLOCK):
        first = block * factor - half
        for r in range(done - first, rows.shape[0]):
            force = spread(0.0, lanes)
            i = first + r
            if i < n:
                moved, drift = spread(0.0, lanes), spread(0.0, lanes)
                if slow.shape[0]:
                    k = i // factor
                    drift = load(slow, k + 1, lanes) - load(slow, k, lanes)
                    moved = load(slow, k, lanes) + (i - k * factor) / factor * drift
                    drift = 1 / (factor * step) * drift
                store(place, 0, x[i, 0] + moved, lanes)
                grease_in_lanes(greases, 0, place, step, lanes, elastic, viscous)
                force = load(elastic, 0, lanes) + (v[i, 0] + drift) * load(viscous, 0, lanes)
                for end in range(2):
                    p = end + 1
                    lever = load(levers, 0, lanes)
                    store(place, p, x[i, 0] + lever * (x[i, p] - x[i, 0]) + moved, lanes)
                    if penetration_in_lanes(contacts, 0, end, place, p, lanes, depth):
                        quick = v[i, 0] + lever * (v[i, p] - v[i, 0]) + drift
                        store(speed, p, quick, lanes)
                        contact_in_lanes(contacts, 0, end, depth, speed, p, lanes, elastic, viscous, side)
                        towards = load(side, p, lanes)
                        push = load(elastic, p, lanes) + quick * load(viscous, p, lanes)
                        force = force + towards * larger(towards * push, 0.0)
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
