"""Floquet's multipliers of periodic motions, and where the branch folds or its stability changes.

R. Seydel, Practical Bifurcation and Stability Analysis, Springer 2010, chapter 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ._floquet import monodromy
from ._forces import along
from .condensed import grid, slopes
from .continuation import Motion, Solver, difference

__all__ = ["BRANCH_POINT", "FOLD", "NEIMARK_SACKER", "PERIOD_DOUBLING", "multipliers", "special_motions", "unstable"]

FOLD, PERIOD_DOUBLING = "fold", "period doubling"
NEIMARK_SACKER, BRANCH_POINT = "Neimark-Sacker", "branch point"
ROUNDING = 1e-5
"""of 1: multipliers that do not leave the unit circle, such as those of springs whose sliders stand still"""
TURN = 0.5
"""rad by which the stiffest contact may turn from sample to sample"""
EXACT = 1e-6
"""of the frequency: how closely special points are located"""
HALVINGS = 40


def multipliers(solver: Solver, motion: Motion) -> np.ndarray:
    """Return Floquet's multipliers (2 n,) of the modal model about a motion, the largest first.

    What greases and contacts remember adds multipliers, of which the smallest are left out.
    """
    system = solver.system
    turn = 2 * np.pi / (motion.omega * solver.samples) * math.sqrt(system.stiffest)
    samples = solver.samples * 2 ** max(0, math.ceil(math.log2(turn / TURN))) if turn else solver.samples
    fine = grid(solver.harmonics, samples)
    room = slopes(system.laws, solver.points, samples, solver.harmonics)
    x = system.linear.basis @ motion.z + motion.y
    place, speed = x @ fine.basis.T, motion.omega * (x @ fine.rate.T)
    force = np.empty_like(place)
    along(system.laws, place, speed, motion.omega, fine.basis, fine.rate, fine.project, True, force, room)
    step = 2 * np.pi / (motion.omega * samples)
    points = np.ascontiguousarray(system.poles.model.at_points)
    found = np.linalg.eigvals(monodromy(system.poles.flow(step), points, step, system.laws.memory, room))
    return found[np.argsort(-np.abs(found), kind="stable")][: 2 * points.shape[1]]


def unstable(values: np.ndarray) -> int:
    """Return how many multipliers are outside of the unit circle."""
    return int(np.sum(np.abs(values) > 1 + ROUNDING))


@dataclass(frozen=True, eq=False)
class Located:
    """A motion of a branch, and what is special about it."""

    motion: Motion
    multipliers: np.ndarray | None
    kind: str = ""


def special_motions(solver: Solver, before: Located, after: Located) -> Iterator[Located]:
    """Yield where the branch folds or its stability changes between two neighbours, in their order.

    Stability is looked at if the neighbours know their multipliers.
    """
    way = difference(before.motion, after.motion)
    length = float(np.linalg.norm(way))

    def at(share: float) -> Located | None:
        motion = solver.ahead(before.motion, share * length, way / length, fresh=True)
        if motion is None:
            return None
        return Located(motion, None if before.multipliers is None else multipliers(solver, motion))

    found: list[tuple[float, Located]] = []
    if before.motion.tangent[-1] * after.motion.tangent[-1] < 0:
        rising = before.motion.tangent[-1] > 0
        _, place, inside = _bisected(at, lambda each: (each.motion.tangent[-1] > 0) == rising, 0.0, before, after)
        found.append((place, replace(inside, kind=FOLD)))
    low, last = 0.0, before
    while after.multipliers is not None and last.multipliers is not None:
        count = unstable(last.multipliers)
        if unstable(after.multipliers) == count:
            break
        inner, place, beyond = _bisected(
            at, lambda each: each.multipliers is not None and unstable(each.multipliers) == count, low, last, after
        )
        found.append((place, replace(beyond, kind=_crossing(inner, beyond))))
        low, last = place, beyond
    yield from (each for _, each in sorted(found, key=lambda pair: pair[0]))


def _bisected(
    at: Callable[[float], Located | None], alike: Callable[[Located], bool], low: float, first: Located, last: Located
) -> tuple[Located, float, Located]:
    """Motions on both sides of a change, close together, and how far the second one is along the way."""
    high = 1.0
    for _ in range(HALVINGS):
        if high - low < EXACT and abs(first.motion.omega / last.motion.omega - 1) < EXACT:
            break
        middle = (low + high) / 2
        found = at(middle)
        if found is None:
            break
        if alike(found):
            low, first = middle, found
        else:
            high, last = middle, found
    return first, high, last


def _crossing(inner: Located, beyond: Located) -> str:
    """What the multiplier that crosses the unit circle between two motions says."""
    assert inner.multipliers is not None and beyond.multipliers is not None
    more = max(inner, beyond, key=lambda each: unstable(each.multipliers))  # type: ignore[arg-type]
    assert more.multipliers is not None
    outside = more.multipliers[: unstable(more.multipliers)]
    crossing = outside[np.argmin(np.abs(outside))]
    if abs(crossing.imag) > 1e-6 * abs(crossing):
        return NEIMARK_SACKER
    return PERIOD_DOUBLING if crossing.real < 0 else BRANCH_POINT
