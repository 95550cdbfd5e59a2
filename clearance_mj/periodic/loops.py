"""Newton's method and pseudo-arclength continuation: one source of compiled and of plain loops.

Source: E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods, SIAM 2003.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..core.equations import factorise, solved
from ..core.jit import STRICT, jit

__all__ = ["BEYOND", "CORNERS", "DEEP", "GOES_ON", "SHORTEST", "STUCK", "Loops", "bordered", "loops"]

ITERATIONS = 25  # of Newton's method
SLOW = 0.1  # ratio of two successive residuals above which the derivative is computed again
SMALLEST_DAMPING = 1 / 32  # share of a Newton step below which it is given up
LONGER = 2.0  # times as long are steps beyond the parameter up to which motions are wanted
SHORTEST = 1e-8
SHARPEST = 0.3  # cosine of the largest angle between two tangents
SHARP_CORNER = 1e-4  # step below which the branch has a corner, as where a contact begins
CORNERS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)  # steps tried around a corner
GOES_ON, BEYOND, STUCK, DEEP = 0, 1, 2, 3  # why a loop returns


@jit(**STRICT)
def _size(values: np.ndarray) -> float:
    return np.sqrt(np.sum(values * values))


@jit(**STRICT)
def _distance(left: np.ndarray, moved: np.ndarray, scale: float) -> float:
    """What is left of the equations, and of the substitution beside them, over a size; infinite if unknown."""
    found = np.sqrt(np.sum(left * left) + np.sum(moved * moved)) / scale
    return found if np.isfinite(found) else np.inf


@jit(**STRICT)
def bordered(jacobian: np.ndarray, row: np.ndarray, pace: float, pivots: np.ndarray) -> tuple[np.ndarray, float]:
    """Return factors of derivatives whose last column is taken times a pace, with a last row; and their norm."""
    matrix, n, norm = jacobian.copy(), row.size - 1, 0.0
    for i in range(n):
        matrix[i, n] *= pace
        norm = max(norm, np.sum(np.abs(matrix[i, :n])))
    matrix[n] = row
    factorise(matrix, pivots)
    return matrix, norm


class Loops(NamedTuple):
    """Newton's method and continuation for equations of one kind."""

    solve: Callable[..., Any]
    ahead: Callable[..., Any]
    onwards: Callable[..., Any]


def loops(left: Callable[..., Any], deepest: Callable[..., Any], compiled: bool) -> Loops:
    """Return the loops for equations.

    Parameters
    ----------
    left : callable
        Takes what the equations are of, a parameter, z, y and whether derivatives are wanted; returns what is left of
        the equations, forces and what y should be, and fills the ``jacobian``.
    deepest : callable
        Takes what the equations are of, a parameter, z and y; returns how deep the motion is in a wall, m.
    compiled : bool
        Whether both are, and so the loops can be.
    """
    # Each stands once in the next one, where it is put: to pass so many arrays takes long to compile.
    made, inner = (jit(**STRICT), jit(**STRICT, inline="always")) if compiled else [lambda function: function] * 2

    @inner
    def solve(of: Any, parameter: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float) -> Any:
        """Return whether a motion was found on the plane across ``row`` through a guess, and its parts.

        The tangent is found with the last derivative that served to find the motion.
        """
        n, pace, old = row.size - 1, parameter, np.inf
        right, pivots = np.zeros(n + 1), np.empty(n + 1, np.int64)
        off, force, beside, factors, coupling, now = z, y, y, np.zeros((0, 0)), 0.0, np.inf
        for iteration in range(ITERATIONS):
            if iteration > 0:
                now = _distance(off, beside - y, scale)
            if iteration == 0 or (now >= of.tolerance and now > SLOW * old and old < np.inf):
                off, force, beside = left(of, parameter, z, y, True)
                factors, coupling = bordered(of.jacobian, row, pace / scale, pivots)
                now = _distance(off, beside - y, scale)
            if now < of.tolerance:
                right[:n], right[n] = 0.0, 1.0
                tangent, own = solved(factors, pivots, right), max(_size(z), of.least)
                tangent[:n] *= scale / own
                tangent[n] *= pace / parameter
                return True, parameter, z, y, force, tangent / _size(tangent), own
            # A change of y may be left of the equations for the unknowns once y is substituted.
            most = max(now, coupling * _size(beside - y) / scale)
            right[:n], right[n] = off.ravel(), 0.0
            step = solved(factors, pivots, right) / -scale
            share, ahead, moved, further = 1.0, parameter, z, beside
            while True:
                ahead = parameter + share * step[n] * pace
                moved = z + share * scale * step[:n].copy().reshape(z.shape)
                if ahead > 0.0:
                    off, force, further = left(of, ahead, moved, beside, False)
                    then = _distance(off, further - beside, scale)
                    if then < (1.0 - share / 4.0) * most or then < of.tolerance:
                        break
                share /= 2.0
                if share < SMALLEST_DAMPING:
                    return False, parameter, z, y, force, right, scale
            parameter, z, y, old = ahead, moved, beside, now
            beside = further
        return False, parameter, z, y, force, right, scale

    @inner
    def ahead(
        of: Any, parameter: float, z: np.ndarray, y: np.ndarray, scale: float, direction: np.ndarray, step: float
    ) -> Any:
        """Return what `solve` does of the motion a step away along a direction, and the way to there."""
        n, longer = direction.size - 1, 1.0 + step * direction[-1]
        row, way = direction.copy(), np.empty(direction.size)
        row[n] *= longer
        if longer <= 0.0:
            return False, parameter, z, y, y, row, scale, way
        guess = z + step * scale * direction[:n].copy().reshape(z.shape)
        found, at, there, beside, force, tangent, own = solve(of, parameter * longer, guess, y, row, scale)
        way[:n] = (there - z).ravel() / scale
        way[n] = at / parameter - 1.0
        if np.dot(tangent, way) * step < 0.0:
            tangent = -tangent
        return found, at, there, beside, force, tangent, own, way

    @made
    def onwards(
        of: Any, parameter: np.ndarray, z: np.ndarray, y: np.ndarray, force: np.ndarray, tangent: np.ndarray,
        scale: np.ndarray, step: float, low: float, high: float, wanted: float, deep: float,
    ) -> Any:  # fmt: skip
        """Fill motions after the first one of all arrays; return how many there are, the next step, and why it ends.

        They end beyond a range of the parameter, where none is found, or where one beyond what is ``wanted`` rises and
        is deeper than ``deep`` in a wall.
        """
        count, n = 1, tangent.shape[1] - 1
        while count < parameter.size:
            i = count - 1
            direction, length = tangent[i].copy(), step
            at, there, beside, acting, next_one, own, way = (
                parameter[i],
                z[i],
                y[i],
                y[i],
                direction,
                scale[i],
                direction,
            )
            found = False
            for attempt in range(len(CORNERS) + 1):
                if attempt > 0:  # where a contact begins with a jump, along the motion alone
                    direction[n], length = 0.0, CORNERS[attempt - 1]
                    direction /= _size(direction)
                found, at, there, beside, acting, next_one, own, way = ahead(
                    of, parameter[i], z[i], y[i], scale[i], direction, length
                )
                if found or step >= SHARP_CORNER or _size(direction[:n]) == 0.0:
                    break
            if not found and step < SHARP_CORNER:
                return count, step, STUCK
            if not found or not (np.dot(next_one, tangent[i]) > SHARPEST or step < SHARP_CORNER):
                step /= 2.0
                if step < SHORTEST:
                    return count, step, STUCK
                continue
            parameter[count], z[count], y[count], force[count] = at, there, beside, acting
            tangent[count], scale[count] = next_one, own
            count += 1
            if not low <= at <= high:
                return count, step, BEYOND
            if at > wanted and next_one[n] > 0.0 and deepest(of, at, there, beside) > deep:
                return count, step, DEEP
            off = way - step * tangent[i]
            longer = LONGER if at > wanted else 1.0
            bent = longer * np.sqrt(of.bent / max(_size(off), 1e-12))
            step = min(step * min(max(bent, 0.3), 2.0), longer * of.longest)
        return count, step, GOES_ON

    plain = loops(left, deepest, False) if compiled else Loops(solve, ahead, onwards)
    return plain._replace(onwards=onwards)
