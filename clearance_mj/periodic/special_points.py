"""Special points of branches as equations for a continuation over a second parameter.

Motions at all frequencies and values of the second parameter are a surface; on it a test function g is 0 at a special
motion: the distance of a multiplier from the unit circle, of an end from its wall, or, at folds, g of a bordered system
[J b; cᵀ 0] [v; g] = [0; 1] with the derivative J of the balance (W. J. F. Govaerts, Numerical Methods for Bifurcations
of Dynamical Equilibria, SIAM 2000, chapter 4). Its slopes are differences in the tangent plane of the surface, which is
vertical where the surface folds. Where contacts open and close J changes in steps, and g may jump past 0.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from .condensed import Condensed
from .continuation import Continuation, NoConvergence, PeriodicMotion, difference
from .onset import rest_and_growth
from .solver import Solver
from .stability import BRANCH_POINT, FIRST_CONTACT, FOLD, PERIOD_DOUBLING, floquet

__all__ = ["SpecialMotions", "WhirlOnsets"]

NEARBY = 1e-6  # relative step of the balance's difference quotient by the parameter
DIFFERENCE = 3e-4  # half of the step of difference quotients of g: above the steps in which multipliers change
WEIGHTS = {FOLD: 1e-7, FIRST_CONTACT: 1.0}
"""Weight of g relative to the balance; folds are located again within the steps of J"""
OF_MULTIPLIERS = 1e-3  # weight: contacts between samples move them in steps of 1e-6
APART = (0.05, 0.01, 0.002)  # relative steps of the parameter beyond a jump of g
REACH = (0.01, 0.03, 0.1)  # relative distances from the guess within which g changes its sign there
EXACT = 1e-6  # of these distances


class SpecialMotions(Continuation):
    """Newton's method and continuation of a branch's special motion over a second parameter.

    Unknown are the harmonics of the coordinates and the frequency, in metres; ``solver_at`` returns the solver over
    frequency at a value of the parameter.
    """

    def __init__(self, kind: str, solver_at: Callable[[float], Solver], omega: float, z: np.ndarray, y: np.ndarray):
        self.kind, self.solver_at, self.shape = kind, solver_at, z.shape
        solver = solver_at(1.0)
        self.size, self.least, self.unit = solver.size + 1, solver.least, solver.scale_of(z)
        self.reference, self.direction = omega / self.unit, np.append(np.zeros(self.size), 1.0)
        self.jacobian = np.zeros((self.size + 1, self.size + 1))
        self.plane = np.zeros((self.size + 1, 2))
        self.plane[-1, 1] = 1.0
        if kind == FOLD:
            u, _, v = np.linalg.svd(solver.derivative(omega, z, y))
            self.plane[:-2, 0], self.aim = v[-1], np.array([u[:, -1], v[-1]])
        else:
            self.plane[-2, 0], self.aim = 1.0, np.array(0.0)
        if kind not in WEIGHTS:
            values = floquet(solver, omega, solver.state(omega).spin, solver.system.basis @ z + y)
            target = {PERIOD_DOUBLING: -1.0, BRANCH_POINT: 1.0}.get(kind)
            pairs = values[np.abs(values.imag) > 1e-6]
            near = pairs[np.abs(np.abs(pairs) - 1).argmin()] if target is None else target
            self.aim = np.array(near, dtype=complex)

    def parts(self, parameter: float, unknown: np.ndarray) -> tuple[Solver, float, np.ndarray]:
        """Return the solver, frequency, 1/s, and harmonics of the coordinates, m."""
        return self.solver_at(parameter), float(unknown[-1]) * self.reference, unknown[:-1].reshape(self.shape)

    def start(self, omega: float, z: np.ndarray, y: np.ndarray) -> PeriodicMotion | None:
        """Return the special motion near a guess, where the parameter is 1; None if there is none."""
        unknown = np.append(z.ravel(), omega / self.reference)
        row, scale = np.append(np.zeros(self.size), 1.0), float(np.linalg.norm(unknown))
        guess = PeriodicMotion(1.0, unknown, y, y, row, scale)
        return self.solve(1.0, unknown, y, row, scale) or self._locate(guess)

    def _residual(self, parameter: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        solver, omega, z_m = self.parts(parameter, z)
        if not omega > 0:
            return np.full(self.size, np.inf), y, y
        residual, force, y_new = solver._residual(omega, z_m, y, diff)
        weight = WEIGHTS.get(self.kind, OF_MULTIPLIERS) * self.unit
        if diff:
            full, n, scale = self.jacobian, residual.size, self.scale_of(z)
            full[:n, : n + 1] = solver.jacobian[:n]
            full[:n, n] *= self.reference
            if self.kind == FOLD:
                self.aim = self._fold_test(full[:n, :n])[1]
            elif self.kind not in WEIGHTS:
                self.aim = np.array(self._multiplier(solver, omega, z_m, y_new))
        g = self._test_function(solver, omega, z_m, y_new)
        if diff:
            nearby, *_ = self.parts(parameter * (1 + NEARBY), z)
            full[:n, n + 1] = (nearby._residual(omega, z_m, y, False)[0] - residual).ravel() / (NEARBY * parameter)
            sizes = np.append(np.full(n + 1, scale), parameter)
            self._align_plane(full[:n] * sizes / scale)
            full[n] = weight * (self.plane @ self._slopes(parameter, z, y, scale)) / sizes
        return np.append(residual, weight * g), force, y_new

    def _align_plane(self, slopes: np.ndarray) -> None:
        """Turn the plane so that it is tangent to the surface, along which the derivatives of the balance are 0."""
        rhs = np.zeros((self.size + 1, 2))
        rhs[-2:] = np.eye(2)
        self.plane = np.linalg.qr(np.linalg.solve(np.vstack((slopes, self.plane.T)), rhs))[0]

    def _slopes(self, parameter: float, z: np.ndarray, y: np.ndarray, scale: float) -> np.ndarray:
        """Return derivatives (2,) of g along the plane's directions, over size and parameter."""

        def value(step: np.ndarray) -> float:
            solver, omega, z_m = self.parts(parameter * (1 + step[-1]), z + scale * step[:-1])
            return self._test_function(solver, omega, z_m, solver._residual(omega, z_m, y, False)[2])

        steps = DIFFERENCE * self.plane.T
        return np.array([value(way) - value(-way) for way in steps]) / (2 * DIFFERENCE)

    def _multiplier(self, solver: Solver, omega: float, z: np.ndarray, y: np.ndarray) -> complex:
        """Return the multiplier nearest to the last one."""
        values = floquet(solver, omega, solver.state(omega).spin, solver.system.basis @ z + y)
        return complex(values[np.abs(values - self.aim).argmin()])

    def _fold_test(self, j: np.ndarray) -> tuple[float, np.ndarray]:
        """Return g of the bordered Jacobian, and approximate singular vectors."""
        n = len(j)
        matrix, rhs = np.zeros((n + 1, n + 1)), np.append(np.zeros(n), 1.0)
        matrix[:n, :n], matrix[:n, n], matrix[n, :n] = j, *self.aim
        v, w = np.linalg.solve(matrix, rhs), np.linalg.solve(matrix.T, rhs)
        return float(v[n]), np.array([each[:n] / np.linalg.norm(each[:n]) for each in (w, v)])

    def _test_function(self, solver: Solver, omega: float, z: np.ndarray, y: np.ndarray) -> float:
        """Return the test function g of a motion."""
        if self.kind == FIRST_CONTACT:
            return solver.depth(omega, z, y) / self.unit
        if self.kind != FOLD:
            return float(np.abs(self._multiplier(solver, omega, z, y))) - 1
        return self._fold_test(solver.derivative(omega, z, y))[0]

    def across_wall(self, motion: PeriodicMotion) -> PeriodicMotion | None:
        """Return the special motion at a parameter a little further on, where g changes its sign along the branch."""
        self._residual(motion.parameter, motion.z, motion.y, True)  # the plane is that of the last guess
        motion = replace(motion, tangent=self.direction)
        for distance in APART if motion.tangent[-1] else ():
            at = float(np.clip(motion.parameter * (1 + np.sign(motion.tangent[-1]) * distance), 1.0, 2.0))
            step = (at / motion.parameter - 1) / motion.tangent[-1]
            z = motion.z + step * motion.scale * motion.tangent[:-1]
            if at != motion.parameter and (special := self._locate(replace(motion, parameter=at, z=z))):
                chord = difference(motion, special)
                return replace(special, tangent=chord / np.linalg.norm(chord))
        return None

    def _solve_between(self, omega: float, before: PeriodicMotion, after: PeriodicMotion) -> PeriodicMotion:
        with suppress(NoConvergence):
            return super()._solve_between(omega, before, after)
        fraction = (omega - before.parameter) / (after.parameter - before.parameter)
        guess = replace(after, parameter=omega, z=before.z + fraction * (after.z - before.z))
        if (special := self._locate(guess)) is None:
            raise NoConvergence(omega)
        return special

    def frequency(self, motion: PeriodicMotion) -> float:
        """Return a motion's frequency, 1/s; of a fold its extremum, which g does not resolve within the steps of J."""
        if self.kind == FOLD:
            self._residual(motion.parameter, motion.z, motion.y, True)
            motion = self._locate(motion) or motion
        return float(motion.z[-1]) * self.reference

    def _locate(self, guess: PeriodicMotion) -> PeriodicMotion | None:
        """Return the motion near a guess where g changes its sign along the branch or, for folds, frequency turns."""
        solver, omega, z = self.parts(guess.parameter, guess.z)
        direction = (self.plane @ np.array([-self.plane[-1, 1], self.plane[-1, 0]]))[:-1]
        direction /= np.linalg.norm(direction)

        def motion(t: float) -> PeriodicMotion:
            at, start = omega * (1 + t * direction[-1]), z + t * guess.scale * direction[:-1].reshape(z.shape)
            if (solution := solver.solve(at, start, guess.y, direction, guess.scale)) is None:
                raise NoConvergence(at)
            return solution

        def measured(t: float) -> float:
            solution = motion(t)
            return self._test_function(solver, solution.parameter, solution.z, solution.y)

        for reach in REACH:
            with suppress(NoConvergence, ValueError):  # no motion, or the same sign at both ends
                t = _turn(motion, reach) if self.kind == FOLD else brentq(measured, -reach, reach, xtol=EXACT * reach)
                special = motion(t)
                unknown = np.append(special.z.ravel(), special.parameter / self.reference)
                scale = self.scale_of(unknown)
                return PeriodicMotion(guess.parameter, unknown, special.y, special.force, guess.tangent, scale)
        return None


def _turn(motion: Callable[[float], PeriodicMotion], reach: float) -> float:
    """Return the arc length at which the frequency turns within a distance; ValueError if it does not."""
    low, middle, high = (motion(t).parameter for t in (-reach, 0.0, reach))
    if (middle - low) * (high - middle) > 0:
        raise ValueError("it rises or falls")
    sign = np.sign(2 * middle - low - high)

    def opposite(t: float) -> float:
        return -sign * motion(t).parameter / middle

    return float(minimize_scalar(opposite, bounds=(-reach, reach), method="bounded", options={"xatol": 1e-5}).x)


class WhirlOnsets(Continuation):
    """Newton's method and continuation of the speed, rad/s, at which rest gives way to whirl."""

    size, least, direction = 1, 1e-3, np.array([0.0, 1.0])

    def __init__(self, system_at: Callable[[float], Condensed]):
        self.system_at, self.jacobian = system_at, np.zeros((2, 2))

    def growth(self, parameter: float, speed: float) -> complex:
        """Return the eigenvalue with the largest real part: growth rate and frequency, 1/s."""
        return rest_and_growth(self.system_at(parameter), speed).value

    def _residual(self, parameter: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        try:
            if diff:
                for i, (p, speed) in enumerate(((0.0, 1.0), (1.0, 0.0))):
                    ahead, behind = (
                        self.growth(parameter * (1 + e * p), z[0] * (1 + e * speed)).real
                        for e in (DIFFERENCE, -DIFFERENCE)
                    )
                    self.jacobian[0, i] = (ahead - behind) / (2 * DIFFERENCE * (parameter if p else z[0]))
            return np.array([self.growth(parameter, z[0]).real]), y, y
        except NoConvergence:
            return np.full(1, np.inf), y, y
