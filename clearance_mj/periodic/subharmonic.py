"""Vibrations with twice the period, which leave a branch where its period doubles."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from .branch import Branch, SpecialPoint
from .continuation import EndOfBranch, Motion
from .following import follow, place, resumed
from .solver import Solver
from .stability import BRANCH_POINT, PERIOD_DOUBLING

__all__ = ["follow_doubled", "until_halved"]

AWAY = (1e-2, 3e-3, 3e-2, 1e-1)
"""Shares of the doubled motion that change their sign from period to period, with which it is begun in this order."""
MAX_SHIFT = 0.02  # relative distance in frequency of the first doubled motion from the doubling
FALLEN = 1e-2  # ratio of the sign-changing part after a step to that before it, of a step onto the undoubled vibration
RESTARTS = 4  # after such steps
HALVED = 5e-3  # share of the sign-changing part that counts as none, after there was twice as much
SAME_POINT = 1e-3  # relative distance in frequency of a doubled branch's end from where its multiplier passes 1


@checks_kinds
def follow_doubled(branch: Branch, point: SpecialPoint, stability: bool = True, progress: bool = False) -> Branch:
    """Leave a branch at a period doubling and follow the vibration that takes two of its periods.

    It differs from the branch's own by a motion that changes its sign from period to period, and grows from nothing.
    With either sign it is the same vibration, one period later, so only one branch leaves. It begins at the doubling
    and ends where the period is halved again, as its ``ended`` says, or where it leaves the range of the branch. It
    has twice the harmonics and samples, and period doublings that can be left in their turn.

    Parameters
    ----------
    branch : Branch
        With the doubling.
    point : SpecialPoint
        One of ``branch.special``, of kind "period doubling".
    stability : bool
        Find Floquet's multipliers of every point, and locate where the stability changes.
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
        was found beside it.

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
    if (motion := _beside(solver, branch, point.index, values)) is None:
        raise ClearanceError(
            f"beside the period doubling at {point.frequency:.6g} Hz no doubled vibration was found; follow the branch "
            "with more harmonics"
        )
    motions = until_halved(solver, motion, values.min(), values.max())
    return _without_ends(follow(solver, motions, stability, progress))


def _beside(solver: Solver, branch: Branch, index: int, values: np.ndarray) -> Motion | None:
    """Return the motion next to a doubling that has a little of the motion that changes its sign."""
    shape = (len(solver.system.owner), 2 * solver.harmonics + 1)
    changing = np.flatnonzero(np.broadcast_to(_changing(solver.harmonics), shape))

    def derivative(value: float, z: np.ndarray, y: np.ndarray) -> np.ndarray:
        return solver.derivative(value, z, y)[np.ix_(changing, changing)]

    for value, z, y in _doublings(branch, index, values, derivative):
        row = np.zeros(solver.size + 1)
        row[changing] = np.linalg.svd(derivative(value, z, y))[2][-1]
        scale = float(np.linalg.norm(z))
        for away in AWAY:
            found = solver.solve(value, z + away * scale * row[:-1].reshape(shape), y, row, scale)
            if found is not None and abs(found.omega / value - 1) < MAX_SHIFT:
                return found
    return None


def _doublings(
    branch: Branch, index: int, values: np.ndarray, derivative: Callable[..., np.ndarray]
) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """Yield where the balance doubles next to a point: frequency or level, z and y; at last the point itself.

    The balance doubles where its derivative by motions that change their sign is singular: the nearer to where the
    multiplier passes -1 the more harmonics there are.
    """

    def state(i: int) -> tuple[float, np.ndarray, np.ndarray]:
        _, _, z, y = resumed(branch, i, 2)
        return float(values[i]), z, y

    near = [i for i in range(len(values)) if abs(values[i] / values[index] - 1) < MAX_SHIFT]
    known = {i: np.linalg.slogdet(derivative(*state(i))) for i in near}
    crossings = [i for i in near if i + 1 in known and known[i].sign != known[i + 1].sign]
    for i in sorted(crossings, key=lambda each: abs(each + 0.5 - index)):
        share = 1 / (1 + np.exp(known[i + 1].logabsdet - known[i].logabsdet))
        (value, z, y), (value_2, z_2, y_2) = state(i), state(i + 1)
        yield value + share * (value_2 - value), z + share * (z_2 - z), y + share * (y_2 - y)
    yield state(index)


def until_halved(solver: Solver, motion: Motion, low: float, high: float) -> Iterator[Motion]:
    """Yield a motion and those along its tangent until one comes again after half its period, or leaves a range.

    There the part that changes its sign from half to half passes zero, and the branch would go back along itself.

    Raises
    ------
    EndOfBranch
        Then.
    NoConvergence
        Where Newton's method finds no next motion; what was yielded stays.
    """
    changing = _changing(solver.harmonics)
    before: Motion | None = None
    largest = 0.0
    for each in _beside_halved(solver, motion, low, high):
        share = float(np.linalg.norm(changing * each.z) / np.linalg.norm(each.z))
        largest = max(largest, share)
        if share < min(HALVED, largest / 2):  # with contacts the rest may take endless short steps
            yield each
            raise EndOfBranch(f"its period is halved at {place(solver, each.omega)}")
        if before is not None and np.sum(changing * before.z * each.z) < 0:
            last = _last(solver, before, each)
            yield last
            raise EndOfBranch(f"its period is halved at {place(solver, last.omega)}")
        yield each
        before = each


def _beside_halved(solver: Solver, motion: Motion, low: float, high: float) -> Iterator[Motion]:
    """Yield a motion and those along its tangent; where a step falls onto the halved period, go on with short ones.

    If they fall as well, the period is halved there: with contacts the doubled part may end with a jump.
    """
    changing = _changing(solver.harmonics)
    yield motion
    for _ in range(RESTARTS):
        for each in itertools.islice(solver.onwards(motion, low, high), 1, None):
            if np.linalg.norm(changing * each.z) < FALLEN * np.linalg.norm(changing * motion.z):
                break
            yield each
            motion = each
        else:
            return
    raise EndOfBranch(f"its period is halved at {place(solver, motion.omega)}")


def _last(solver: Solver, before: Motion, after: Motion) -> Motion:
    """Return the motion with hardly any of what changes its sign, between two that have it with either sign."""
    changing = _changing(solver.harmonics)
    row = np.append((changing * before.z).ravel(), 0.0)
    there, beyond = np.linalg.norm(row), (row[:-1] / np.linalg.norm(row)) @ after.z.ravel()
    row /= there
    share = there / (there - beyond)
    z = before.z + share * (after.z - before.z)
    omega = before.omega + share * (after.omega - before.omega)
    scale = before.scale
    for away in AWAY:
        if away * scale < there:
            found = solver.solve(omega, z * ~changing + away * scale * row[:-1].reshape(z.shape), after.y, row, scale)
            if found is not None and abs(found.omega / omega - 1) < MAX_SHIFT:
                return replace(found, tangent=-found.tangent)
    return before


def _changing(harmonics: int) -> np.ndarray:
    """(K,) whether a real harmonic changes its sign after half a period."""
    return (np.arange(2 * harmonics + 1) + 1) // 2 % 2 == 1


def _without_ends(branch: Branch) -> Branch:
    """A doubled branch without the branch points at its ends, where the undoubled vibration goes on."""
    ends = branch.frequency[[0, -1]]
    kept = tuple(
        point for point in branch.special
        if point.kind != BRANCH_POINT or np.abs(ends / point.frequency - 1).min() > SAME_POINT
    )  # fmt: skip
    return replace(branch, special=kept)
