"""Newton's method and pseudo-arclength continuation: one source for compiled and plain loops.

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
SLOW = 0.1  # ratio of two successive residuals above which the Jacobian is computed again
SMALLEST_DAMPING = 1 / 32  # fraction of a Newton step below which the corrector fails
LONGER = 2.0  # factor of steps beyond the largest requested parameter
SHORTEST = 1e-8
SHARPEST = 0.3  # cosine of the largest angle between two tangents
SHARP_CORNER = 1e-4  # step below which the branch has a corner, as where a contact begins
CORNERS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)  # steps tried around a corner
GOES_ON, BEYOND, STUCK, DEEP = 0, 1, 2, 3  # status of a loop that returns


@jit(**STRICT)
def _norm(values: np.ndarray) -> float:
    return np.sqrt(np.sum(values * values))


@jit(**STRICT)
def _error(residual: np.ndarray, change: np.ndarray, scale: float) -> float:
    """Return the norm of residual and substitution's change over a size; infinite if it is not finite."""
    error = np.sqrt(np.sum(residual * residual) + np.sum(change * change)) / scale
    return error if np.isfinite(error) else np.inf


@jit(**STRICT)
def bordered(jacobian: np.ndarray, row: np.ndarray, factor: float, pivots: np.ndarray) -> tuple[np.ndarray, float]:
    """Return factors of the Jacobian bordered by a row, its last column multiplied by ``factor``; and its norm."""
    matrix, n, norm = jacobian.copy(), row.size - 1, 0.0
    for i in range(n):
        matrix[i, n] *= factor
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
        Takes the equations' object, a parameter, z, y and True for derivatives; returns the residual, forces and the
        next y, and fills the ``jacobian``.
    deepest : callable
        Takes the equations' object, a parameter, z and y; returns the largest penetration of the motion, m.
    compiled : bool
        True if both are compiled, so that the loops can be.
    """
    # Each is inlined once in the next one: to pass so many arrays takes long to compile.
    outer, inner = (jit(**STRICT), jit(**STRICT, inline="always")) if compiled else [lambda function: function] * 2

    @inner
    def solve(of: Any, parameter: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float) -> Any:
        """Correct a guess in the plane normal to ``row``: return True if that converges, and the motion's fields.

        The tangent is computed with the last Jacobian of the corrector.
        """
        n, unit, previous = row.size - 1, parameter, np.inf
        rhs, pivots = np.zeros(n + 1), np.empty(n + 1, np.int64)
        residual, force, y_new, factors, coupling, error = z, y, y, np.zeros((0, 0)), 0.0, np.inf
        for iteration in range(ITERATIONS):
            if iteration > 0:
                error = _error(residual, y_new - y, scale)
            if iteration == 0 or (error >= of.tolerance and error > SLOW * previous and previous < np.inf):
                residual, force, y_new = left(of, parameter, z, y, True)
                factors, coupling = bordered(of.jacobian, row, unit / scale, pivots)
                error = _error(residual, y_new - y, scale)
            if error < of.tolerance:
                rhs[:n], rhs[n] = 0.0, 1.0
                tangent, size = solved(factors, pivots, rhs), max(_norm(z), of.least)
                tangent[:n] *= scale / size
                tangent[n] *= unit / parameter
                return True, parameter, z, y, force, tangent / _norm(tangent), size
            # A change of y may remain in the residual once y is substituted.
            limit = max(error, coupling * _norm(y_new - y) / scale)
            rhs[:n], rhs[n] = residual.ravel(), 0.0
            step = solved(factors, pivots, rhs) / -scale
            damping, trial, z_trial, y_trial = 1.0, parameter, z, y_new
            while True:
                trial = parameter + damping * step[n] * unit
                z_trial = z + damping * scale * step[:n].copy().reshape(z.shape)
                if trial > 0.0:
                    residual, force, y_trial = left(of, trial, z_trial, y_new, False)
                    new_error = _error(residual, y_trial - y_new, scale)
                    if new_error < (1.0 - damping / 4.0) * limit or new_error < of.tolerance:
                        break
                damping /= 2.0
                if damping < SMALLEST_DAMPING:
                    return False, parameter, z, y, force, rhs, scale
            parameter, z, y, previous = trial, z_trial, y_new, error
            y_new = y_trial
        return False, parameter, z, y, force, rhs, scale

    @inner
    def ahead(
        of: Any, parameter: float, z: np.ndarray, y: np.ndarray, scale: float, direction: np.ndarray, step: float
    ) -> Any:
        """Predict a step along a direction and correct: return the result of `solve`, and the step taken."""
        n, factor = direction.size - 1, 1.0 + step * direction[-1]
        row, chord = direction.copy(), np.empty(direction.size)
        row[n] *= factor
        if factor <= 0.0:
            return False, parameter, z, y, y, row, scale, chord
        guess = z + step * scale * direction[:n].copy().reshape(z.shape)
        converged, at, z_new, y_new, force, tangent, size = solve(of, parameter * factor, guess, y, row, scale)
        chord[:n] = (z_new - z).ravel() / scale
        chord[n] = at / parameter - 1.0
        if np.dot(tangent, chord) * step < 0.0:
            tangent = -tangent
        return converged, at, z_new, y_new, force, tangent, size, chord

    @outer
    def onwards(
        of: Any, parameter: np.ndarray, z: np.ndarray, y: np.ndarray, force: np.ndarray, tangent: np.ndarray,
        scale: np.ndarray, step: float, low: float, high: float, wanted: float, deep: float,
    ) -> Any:  # fmt: skip
        """Fill motions after the first one of all arrays; return their number, the next step length, and the status.

        They end beyond a range of the parameter, where the corrector fails, or where one beyond the parameter
        ``wanted`` rises and penetrates a wall deeper than ``deep``.
        """
        count, n = 1, tangent.shape[1] - 1
        while count < parameter.size:
            i = count - 1
            direction, length = tangent[i].copy(), step
            at, z_new, y_new, acting = parameter[i], z[i], y[i], y[i]
            next_one, size, chord, converged = direction, scale[i], direction, False
            for attempt in range(len(CORNERS) + 1):
                if attempt > 0:  # where a contact begins with a jump, along the motion alone
                    direction[n], length = 0.0, CORNERS[attempt - 1]
                    direction /= _norm(direction)
                converged, at, z_new, y_new, acting, next_one, size, chord = ahead(
                    of, parameter[i], z[i], y[i], scale[i], direction, length
                )
                if converged or step >= SHARP_CORNER or _norm(direction[:n]) == 0.0:
                    break
            if not converged and step < SHARP_CORNER:
                return count, step, STUCK
            if not converged or not (np.dot(next_one, tangent[i]) > SHARPEST or step < SHARP_CORNER):
                step /= 2.0
                if step < SHORTEST:
                    return count, step, STUCK
                continue
            parameter[count], z[count], y[count], force[count] = at, z_new, y_new, acting
            tangent[count], scale[count] = next_one, size
            count += 1
            if not low <= at <= high:
                return count, step, BEYOND
            if at > wanted and next_one[n] > 0.0 and deepest(of, at, z_new, y_new) > deep:
                return count, step, DEEP
            bend = chord - step * tangent[i]
            longer = LONGER if at > wanted else 1.0
            stretch = longer * np.sqrt(of.bent / max(_norm(bend), 1e-12))
            step = min(step * min(max(stretch, 0.3), 2.0), longer * of.longest)
        return count, step, GOES_ON

    plain = loops(left, deepest, False) if compiled else Loops(solve, ahead, onwards)
    return plain._replace(onwards=onwards)
