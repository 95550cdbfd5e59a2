"""Vibrations with twice the period, which branch off at period doublings."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from .branch import Branch, SpecialPoint
from .continuation import EndOfBranch, PeriodicMotion
from .following import follow, place, resumed
from .solver import Solver
from .stability import BRANCH_POINT, PERIOD_DOUBLING

__all__ = ["follow_doubled", "until_halved"]

AWAY = (1e-2, 3e-3, 3e-2, 1e-1)
"""Amplitudes of the antiperiodic part, over the motion, with which a doubled branch is started in this order."""
MAX_SHIFT = 0.02  # relative distance in frequency of the first doubled motion from the doubling
FALLEN = 1e-2  # ratio of the antiperiodic part after a step to that before, if it fell onto the undoubled motion
RESTARTS = 4  # after such steps
HALVED = 5e-3  # ratio of the antiperiodic part to the motion that counts as none, after it was twice as large
SAME_POINT = 1e-3  # relative distance in frequency of a doubled branch's end from where its multiplier passes 1


@checks_kinds
def follow_doubled(branch: Branch, point: SpecialPoint, stability: bool = True, progress: bool = False) -> Branch:
    """Follow the period-doubled vibration that branches off at a period doubling.

    It differs from the branch's vibration by an antiperiodic motion, with opposite signs in successive periods, which
    grows from nothing. Either sign is the same vibration, one period later, so only one branch leaves. It begins
    at the doubling and ends where the period is halved again, as its ``ended`` says, or where it leaves the range of
    the branch. It has twice the harmonics and samples, and may have further period doublings.

    Parameters
    ----------
    branch : Branch
        Branch with the doubling.
    point : SpecialPoint
        One of ``branch.special``, of kind "period doubling".
    stability : bool
        Compute the Floquet multipliers of every point, and locate where the stability changes.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        Its ``periods`` are twice those of the branch.

    Raises
    ------
    ClearanceError
        If the branch was followed without stability, the point is no period doubling of it, or no doubled vibration
        converges near it.

    Notes
    -----
    R. Seydel, Practical Bifurcation and Stability Analysis, Springer 2010, section 7.4.
    """
    if branch.multipliers is None:
        raise ClearanceError("branch was followed without stability, so it knows no period doubling; ask for it")
    if point not in branch.special or point.kind != PERIOD_DOUBLING:
        known = [f"{each.frequency:.6g} Hz" for each in branch.special if each.kind == PERIOD_DOUBLING]
        raise ClearanceError(
            f"point must be a period doubling of the branch, which has {', '.join(known) or 'none'}, got {point}"
        )
    solver, omega, *_ = resumed(branch, point.index, 2)
    values = branch.parameter
    if branch.over == "frequency":
        values = values * omega / branch.frequency[point.index]
    elif branch.over == "level":
        values = values / values[point.index]
    if (motion := _first_doubled(solver, branch, point.index, values)) is None:
        raise ClearanceError(
            f"beside the period doubling at {point.frequency:.6g} Hz no doubled vibration was found; follow the branch "
            "with more harmonics"
        )
    motions = until_halved(solver, motion, values.min(), values.max())
    return _drop_end_points(follow(solver, motions, stability, progress))


def _first_doubled(solver: Solver, branch: Branch, index: int, values: np.ndarray) -> PeriodicMotion | None:
    """Return the motion next to a doubling that has a small antiperiodic part."""
    shape = (len(solver.system.owner), 2 * solver.harmonics + 1)
    antiperiodic = np.flatnonzero(np.broadcast_to(_antiperiodic(solver.harmonics), shape))

    def derivative(value: float, z: np.ndarray, y: np.ndarray) -> np.ndarray:
        return solver.derivative(value, z, y)[np.ix_(antiperiodic, antiperiodic)]

    for value, z, y in _singular_points(branch, index, values, derivative):
        row = np.zeros(solver.size + 1)
        row[antiperiodic] = np.linalg.svd(derivative(value, z, y))[2][-1]
        scale = float(np.linalg.norm(z))
        for amplitude in AWAY:
            motion = solver.solve(value, z + amplitude * scale * row[:-1].reshape(shape), y, row, scale)
            if motion is not None and abs(motion.parameter / value - 1) < MAX_SHIFT:
                return motion
    return None


def _singular_points(
    branch: Branch, index: int, values: np.ndarray, derivative: Callable[..., np.ndarray]
) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """Yield doublings of the balance next to a point: frequency or level, z and y; at last the point itself.

    The balance doubles where its derivative by antiperiodic motions is singular: the more harmonics, the nearer to
    where the multiplier passes -1.
    """

    def state(i: int) -> tuple[float, np.ndarray, np.ndarray]:
        _, _, z, y = resumed(branch, i, 2)
        return float(values[i]), z, y

    near = [i for i in range(len(values)) if abs(values[i] / values[index] - 1) < MAX_SHIFT]
    determinants = {i: np.linalg.slogdet(derivative(*state(i))) for i in near}
    crossings = [i for i in near if i + 1 in determinants and determinants[i].sign != determinants[i + 1].sign]
    for i in sorted(crossings, key=lambda each: abs(each + 0.5 - index)):
        fraction = 1 / (1 + np.exp(determinants[i + 1].logabsdet - determinants[i].logabsdet))
        (value, z, y), (value_2, z_2, y_2) = state(i), state(i + 1)
        yield value + fraction * (value_2 - value), z + fraction * (z_2 - z), y + fraction * (y_2 - y)
    yield state(index)


def until_halved(solver: Solver, motion: PeriodicMotion, low: float, high: float) -> Iterator[PeriodicMotion]:
    """Yield a motion and those along its tangent until the period is halved, or they leave a range.

    At a halving the antiperiodic part passes zero, and the branch would go back along itself.

    Raises
    ------
    EndOfBranch
        Then.
    NoConvergence
        Where Newton's method fails; the motions yielded before stay valid.
    """
    antiperiodic = _antiperiodic(solver.harmonics)
    before: PeriodicMotion | None = None
    largest = 0.0
    for each in _restart_after_falls(solver, motion, low, high):
        ratio = float(np.linalg.norm(antiperiodic * each.z) / np.linalg.norm(each.z))
        largest = max(largest, ratio)
        if ratio < min(HALVED, largest / 2):  # with contacts the remaining way may take endless short steps
            yield each
            raise EndOfBranch(f"its period is halved at {place(solver, each.parameter)}")
        if before is not None and np.sum(antiperiodic * before.z * each.z) < 0:
            last = _last_doubled(solver, before, each)
            yield last
            raise EndOfBranch(f"its period is halved at {place(solver, last.parameter)}")
        yield each
        before = each


def _restart_after_falls(solver: Solver, motion: PeriodicMotion, low: float, high: float) -> Iterator[PeriodicMotion]:
    """Yield a motion and those along its tangent; restart with short steps after one onto the halved period.

    If they fall as well, the period is halved there: with contacts the antiperiodic part may end with a jump.
    """
    antiperiodic = _antiperiodic(solver.harmonics)
    yield motion
    for _ in range(RESTARTS):
        for each in itertools.islice(solver.onwards(motion, low, high), 1, None):
            if np.linalg.norm(antiperiodic * each.z) < FALLEN * np.linalg.norm(antiperiodic * motion.z):
                break
            yield each
            motion = each
        else:
            return
    raise EndOfBranch(f"its period is halved at {place(solver, motion.parameter)}")


def _last_doubled(solver: Solver, before: PeriodicMotion, after: PeriodicMotion) -> PeriodicMotion:
    """Return the motion with hardly any antiperiodic part, between two with opposite signs of it."""
    odd = _antiperiodic(solver.harmonics)
    row = np.append((odd * before.z).ravel(), 0.0)
    size, beyond = np.linalg.norm(row), (row[:-1] / np.linalg.norm(row)) @ after.z.ravel()
    row /= size
    fraction = size / (size - beyond)
    z = before.z + fraction * (after.z - before.z)
    omega = before.parameter + fraction * (after.parameter - before.parameter)
    scale = before.scale
    for part in AWAY:
        if part * scale < size:
            halved = solver.solve(omega, z * ~odd + part * scale * row[:-1].reshape(z.shape), after.y, row, scale)
            if halved is not None and abs(halved.parameter / omega - 1) < MAX_SHIFT:
                return replace(halved, tangent=-halved.tangent)
    return before


def _antiperiodic(harmonics: int) -> np.ndarray:
    """Return True (K,) for real harmonics that change their sign after half a period."""
    return (np.arange(2 * harmonics + 1) + 1) // 2 % 2 == 1


def _drop_end_points(branch: Branch) -> Branch:
    """Return a doubled branch without the branch points at its ends, where the undoubled vibration goes on."""
    ends = branch.frequency[[0, -1]]
    special = tuple(
        point for point in branch.special
        if point.kind != BRANCH_POINT or np.abs(ends / point.frequency - 1).min() > SAME_POINT
    )  # fmt: skip
    return replace(branch, special=special)
