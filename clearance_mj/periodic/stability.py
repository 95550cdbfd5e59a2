"""Floquet multipliers of periodic motions, and location of folds and changes of stability along a branch.

R. Seydel, Practical Bifurcation and Stability Analysis, Springer 2010, chapter 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from ..core.errors import ExcitationError
from .condensed import grid, slopes
from .continuation import Continuation, PeriodicMotion, difference
from .floquet import monodromy
from .forces import Sampled, fill_forces

__all__ = [
    "BRANCH_POINT", "FIRST_CONTACT", "FOLD", "NEIMARK_SACKER", "PERIOD_DOUBLING", "TestedPoint", "changes", "floquet",
    "multipliers", "period_map", "samples_of_period", "unstable", "with_fold",
]  # fmt: skip

FOLD, PERIOD_DOUBLING, FIRST_CONTACT = "fold", "period doubling", "first contact"
NEIMARK_SACKER, BRANCH_POINT = "Neimark-Sacker", "branch point"
ROUNDING = 1e-5  # beyond 1: multipliers on the unit circle, such as those of springs whose sliders stand still
TURN = 0.5  # rad by which the stiffest contact may turn from sample to sample
MIN_SAMPLES = 256  # of a period
MAX_SAMPLES = 2**20  # of a period: some tenths of a second for one motion, and 40 MB for each of its histories
EXACT = 1e-6  # relative error in frequency of special points
HALVINGS = 40
RESOLVED = 1e-8  # of the parameter: smaller turns are those of Newton's method


def samples_of_period(solver: Any, omega: float) -> int:
    """Return the number of samples that resolves contacts over a period; ExcitationError if the period is too long."""
    stiffest = math.sqrt(solver.system.stiffest)
    finer = max(1.0, 2 * np.pi / (omega * solver.samples) * stiffest / TURN, MIN_SAMPLES / solver.samples)
    if not finer * solver.samples <= MAX_SAMPLES:
        raise ExcitationError(
            f"{omega / (2 * np.pi):g} Hz is too slow beside the stiffest contact at {stiffest:g} rad/s; "
            f"give frequencies from {stiffest / (TURN * MAX_SAMPLES):.2g} Hz on"
        )
    return int(solver.samples * 2 ** math.ceil(math.log2(finer)))


def multipliers(solver: Any, motion: PeriodicMotion) -> np.ndarray:
    """Return the Floquet multipliers of the modal model about a motion, the largest first.

    The memory of fillings and contacts adds multipliers, of which the smallest are left out.
    """
    omega = solver.frequency(motion)
    solver.walls_at(motion.parameter)
    values = floquet(solver, omega, solver.state(motion.parameter).spin, solver.all_points(motion))
    return solver.forced_multipliers(values)


def floquet(solver: Any, omega: float, spin: float, x: np.ndarray) -> np.ndarray:
    """Return the Floquet multipliers (2 n,) about the motion with harmonics x (n_rows, K), the largest first."""
    values = np.linalg.eigvals(period_map(solver, omega, spin, x))
    largest_first = np.argsort(-np.abs(values), kind="stable")
    return np.asarray(values[largest_first[: 2 * solver.system.driven.model.size]])


def period_map(solver: Any, omega: float, spin: float, x: np.ndarray) -> np.ndarray:
    """Return the monodromy matrix about a motion with harmonics x (n_rows, K)."""
    system, laws, samples = solver.system, solver.laws, samples_of_period(solver, omega)
    fine, derivatives = grid(solver.harmonics, samples), slopes(laws, samples, solver.harmonics)
    motion = Sampled(x @ fine.basis.T, omega * (x @ fine.rate.T), omega, spin)
    fill_forces(laws, motion, *fine[:3], True, np.empty_like(motion.place), derivatives)
    step = 2 * np.pi / (omega * samples)
    memory = np.concatenate((laws.memory, np.repeat(laws.remembers, 2) * laws.width[laws.memory.size :]))
    flow = system.driven.model.flow(step, spin)
    return np.asarray(monodromy(flow, np.ascontiguousarray(system.driven.points), step, memory, laws, derivatives))


def unstable(values: np.ndarray) -> int:
    """Return the number of multipliers outside of the unit circle."""
    return int(np.sum(np.abs(values) > 1 + ROUNDING))


class TestedPoint(NamedTuple):
    """A motion of a branch, with its multipliers and special kinds."""

    motion: PeriodicMotion
    multipliers: np.ndarray | None
    kind: str = ""
    folds: bool = False
    """True if the branch turns there"""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of special points that it is."""
        return tuple(kind for kind in (self.kind, FOLD * self.folds) if kind)


def changes(solver: Continuation, before: TestedPoint, after: TestedPoint) -> Iterator[TestedPoint]:
    """Yield the changes of stability between two neighbours with multipliers, in order."""
    at = _interpolator(solver, before, after)
    low, last = 0.0, before
    while last.multipliers is not None and after.multipliers is not None:
        count = unstable(last.multipliers)
        if unstable(after.multipliers) == count:
            return
        inner, low, beyond = _bisect(at, count, low, last, after)
        yield beyond._replace(kind=_bifurcation_kind(inner, beyond))
        last = beyond


def with_fold(solver: Continuation, points: list[TestedPoint]) -> list[TestedPoint]:
    """Return neighbours with the motion among them at which the frequency turns, if it does."""
    omega = [point.motion.parameter for point in points]
    middle = max(range(len(points)), key=lambda i: abs(omega[i] - (omega[0] + omega[-1]) / 2))
    depth = min(abs(omega[middle] / omega[end] - 1) for end in (0, -1))
    if middle in (0, len(points) - 1) or points[middle].folds or depth < RESOLVED:
        return points
    if points[middle].kind == FIRST_CONTACT:  # the branch turns where it leaves the gap
        return [*points[:middle], points[middle]._replace(folds=True), *points[middle + 1 :]]
    at, sign = _interpolator(solver, points[0], points[-1]), 1.0 if omega[middle] > omega[0] else -1.0

    def missed(fraction: float) -> float:
        near = at(fraction, False)
        return 1.0 if near is None else -sign * near.motion.parameter / omega[0]

    fold = at(float(minimize_scalar(missed, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-5}).x))
    if fold is None or sign * (fold.motion.parameter - omega[middle]) < 0:
        return [*points[:middle], points[middle]._replace(kind="", folds=True), *points[middle + 1 :]]
    chord = difference(points[0].motion, points[-1].motion)
    projections = [difference(points[0].motion, point.motion) @ chord for point in points]
    place = int(np.searchsorted(projections, difference(points[0].motion, fold.motion) @ chord))
    return [*points[:place], fold._replace(folds=True), *points[place:]]


def _interpolator(solver: Continuation, before: TestedPoint, after: TestedPoint) -> Callable[..., TestedPoint | None]:
    """Return a function for the motion at a fraction of the chord between two, with multipliers if they have some."""
    chord = difference(before.motion, after.motion)
    length = float(np.linalg.norm(chord))

    def at(fraction: float, stability: bool = True) -> TestedPoint | None:
        if (motion := solver.ahead(before.motion, fraction * length, chord / length)) is None:
            return None
        with_multipliers = stability and before.multipliers is not None
        return TestedPoint(motion, multipliers(solver, motion) if with_multipliers else None)

    return at


def _bisect(
    at: Callable[..., TestedPoint | None], count: int, low: float, first: TestedPoint, last: TestedPoint
) -> tuple[TestedPoint, float, TestedPoint]:
    """Bisect for the next change of the unstable count: return the motions before and after, and the latter's place."""
    high = 1.0
    for _ in range(HALVINGS):
        if high - low < EXACT and abs(first.motion.parameter / last.motion.parameter - 1) < EXACT:
            break
        middle = (low + high) / 2
        if (halfway := at(middle)) is None:
            break
        if halfway.multipliers is not None and unstable(halfway.multipliers) == count:
            low, first = middle, halfway
        else:
            high, last = middle, halfway
    return first, high, last


def _bifurcation_kind(inner: TestedPoint, beyond: TestedPoint) -> str:
    """Return the kind of bifurcation, by the multiplier that crosses the unit circle between two motions."""
    less_stable = max((each.multipliers for each in (inner, beyond) if each.multipliers is not None), key=unstable)
    outside = less_stable[: unstable(less_stable)]
    crossing = outside[np.argmin(np.abs(outside))]
    if abs(crossing.imag) > 1e-6 * abs(crossing):
        return NEIMARK_SACKER
    return PERIOD_DOUBLING if crossing.real < 0 else BRANCH_POINT
