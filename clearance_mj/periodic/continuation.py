"""Periodic motions one after the other: Newton's method at one, pseudo-arclength continuation along many.

E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods, SIAM 2003. Unknowns are the coordinates'
harmonics over a size that grows with the motion, and the frequency over that of the point before.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from .condensed import Condensed, grid, slopes
from .harmonic_balance import balance

__all__ = ["CameBack", "Follower", "Motion", "Motions", "NoConvergence", "Solver", "difference"]

TOLERANCE = 1e-9  # of Newton's method: what the balance may leave, over the size of the motion
ITERATIONS = 25  # of Newton's method
SLOW = 0.1  # ratio of two successive residuals above which the derivative is computed again
SMALLEST_DAMPING = 1 / 32  # share of a Newton step below which it is given up
BENT = 0.002  # distance of a motion from its prediction by the tangent, over its size, that steps aim at
LONGEST = 0.05  # step, as a share of frequency and motion
SHORTEST = 1e-8
SHARPEST = 0.3  # cosine of the largest angle between two tangents
SHARP_CORNER = 1e-4  # step below which the branch has a corner, as where a contact begins
CORNERS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)  # steps tried around a corner
BEFORE_CONTACT = 0.9  # share of the smallest gap that the first motion of a branch over level fills
MAX_POINTS = 20000


class NoConvergence(Exception):
    """No motion was found at or beyond a frequency, 1/s, its only argument."""


class CameBack(Exception):
    """The branch came back to where it began or to half its period, as its only argument says."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A periodic motion."""

    omega: float  #: 1/s; where the level is the branch's parameter, its share
    z: np.ndarray  #: (r, K) harmonics of the coordinates, m
    y: np.ndarray  #: (n_points, K) of the points beside them, m
    force: np.ndarray  #: (n_points, K) of the clearances' forces beyond the linear grease's, N
    tangent: np.ndarray  #: (r K + 1,) direction of the branch, in metres over `scale` and 1/s over ω
    scale: float  #: m


class Motions(NamedTuple):
    """Motions of a branch, one after the other; each part as in `Motion`, with all motions along its first axis."""

    omega: np.ndarray
    z: np.ndarray
    y: np.ndarray
    force: np.ndarray
    tangent: np.ndarray
    scale: np.ndarray

    @classmethod
    def of(cls, motions: Sequence[Motion]) -> Self:
        """Return some motions."""
        return cls(*(np.array([getattr(motion, name) for motion in motions]) for name in cls._fields))

    def one(self, i: int) -> Motion:
        """Return one of them."""
        return Motion(float(self.omega[i]), self.z[i], self.y[i], self.force[i], self.tangent[i], float(self.scale[i]))


class Follower(ABC):
    """Newton's method and continuation for as many equations in as many unknowns and a parameter."""

    size: int  #: how many unknowns
    least: float  #: m: smaller motions are measured by it
    jacobian: np.ndarray  #: (size + 1, size + 1) derivatives by the unknowns and the parameter; the last row is room
    tolerance = TOLERANCE  #: of the motion: what the equations may leave
    bent = BENT  #: distance of a motion from its prediction by the tangent, over its size, that steps aim at
    longest = LONGEST  #: step, as a share of parameter and motion

    @abstractmethod
    def _left(self, parameter: float, z: np.ndarray, y: np.ndarray, want: bool) -> tuple[np.ndarray, ...]:
        """Return what is left of the equations, forces, and what y should be; fill ``jacobian`` if wanted."""

    def solve(self, omega: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float) -> Motion | None:
        """Return the motion near a guess on the plane across ``row`` through it; None if Newton's method fails.

        The tangent is found with the last derivative that served to find the motion.
        """
        pace, old, right = omega, np.inf, np.zeros(self.size + 1)
        left, force, beside, *_ = self._left(omega, z, y, True)
        factors, coupling = self._factors(row, scale, pace), self.coupling()
        for _ in range(ITERATIONS):
            now = self._norm(left, beside - y, scale)
            if now < self.tolerance:
                return self._motion(omega, z, y, force, factors, scale, pace)
            if now > SLOW * old and old < np.inf:
                self._left(omega, z, y, True)
                factors, coupling = self._factors(row, scale, pace), self.coupling()
            most = max(now, coupling * float(np.linalg.norm(beside - y)) / scale)
            right[:-1] = left.ravel()
            step = self._solved(factors, right) / -scale
            share = 1.0
            while True:
                ahead = omega + share * step[-1] * pace
                moved = z + share * scale * step[:-1].reshape(z.shape)
                if ahead > 0:
                    found = self._left(ahead, moved, beside, False)
                    then = self._norm(found[0], found[2] - beside, scale)
                    if then < (1 - share / 4) * most or then < self.tolerance:
                        break
                share /= 2
                if share < SMALLEST_DAMPING:
                    return None
            omega, z, y, old = ahead, moved, beside, now
            left, force, beside, *_ = found
        return None

    def solved_at(self, parameter: float, z: np.ndarray, y: np.ndarray, scale: float) -> Motion:
        """Return the motion at one value of the parameter, near a guess; NoConvergence where there is none."""
        if (found := self.solve(parameter, z, y, np.append(np.zeros(self.size), 1.0), scale)) is None:
            raise NoConvergence(parameter)
        return found

    def coupling(self) -> float:
        """Return how many times a change of y may be left of the equations for the unknowns once y is substituted."""
        return 0.0

    def _norm(self, left: np.ndarray, moved: np.ndarray, scale: float) -> float:
        found = math.sqrt(np.vdot(left, left) + np.vdot(moved, moved)) / scale
        return found if math.isfinite(found) else np.inf

    def _factors(self, row: np.ndarray, scale: float, pace: float) -> tuple[np.ndarray, np.ndarray]:
        matrix = self.jacobian.copy()
        matrix[:-1, -1] *= pace / scale
        matrix[-1] = row
        factors, pivots, _ = dgetrf(matrix.T, overwrite_a=True)
        return factors, pivots

    def _solved(self, factors: tuple[np.ndarray, np.ndarray], right: np.ndarray) -> np.ndarray:
        return dgetrs(*factors, right, trans=1)[0]

    def _motion(
        self, omega: float, z: np.ndarray, y: np.ndarray, force: np.ndarray, factors: tuple[np.ndarray, np.ndarray],
        scale: float, pace: float,
    ) -> Motion:  # fmt: skip
        ahead = self._solved(factors, np.append(np.zeros(self.size), 1.0))
        own = max(float(np.linalg.norm(z)), self.least)
        tangent = np.append(ahead[:-1] * scale / own, ahead[-1] * pace / omega)
        return Motion(omega, z, y, force, tangent / np.linalg.norm(tangent), own)

    def ahead(self, motion: Motion, step: float, tangent: np.ndarray | None = None) -> Motion | None:
        """Return the motion a step away along a tangent, its own if none is given."""
        direction = motion.tangent if tangent is None else tangent
        omega = motion.omega * (1 + step * direction[-1])
        if not omega > 0:
            return None
        z = motion.z + step * motion.scale * direction[:-1].reshape(motion.z.shape)
        row = direction * np.append(np.ones(self.size), 1 + step * direction[-1])
        found = self.solve(omega, z, motion.y, row, motion.scale)
        return found and self._turned(found, motion, step)

    def _around_corner(self, motion: Motion) -> Motion | None:
        """Return a motion that is larger or smaller, as the branch goes, at any frequency.

        Where a contact begins with a jump the branch may turn back so sharply that no motion lies ahead.
        """
        direction = motion.tangent.copy()
        direction[-1] = 0.0
        if not direction.any():
            return None
        direction /= np.linalg.norm(direction)
        return next((found for step in CORNERS if (found := self.ahead(motion, step, direction))), None)

    def _turned(self, found: Motion, before: Motion, step: float) -> Motion:
        sign = np.sign(found.tangent @ difference(before, found)) * np.sign(step) or 1.0
        return replace(found, tangent=sign * found.tangent)

    def within(
        self, motion: Motion, low: float, high: float, up: bool = True, most: int = MAX_POINTS
    ) -> Iterator[Motion]:  # fmt: skip
        """Yield a motion and those that follow it, upwards first or downwards, until they leave a range.

        Raises
        ------
        NoConvergence
            Where Newton's method finds no next motion; what was yielded stays.
        """
        up_or_down = np.sign(motion.tangent[-1] * (1 if up else -1) or 1.0)
        yield from self.onwards(replace(motion, tangent=up_or_down * motion.tangent), low, high, most)

    def onwards(
        self, motion: Motion, low: float, high: float, most: int = MAX_POINTS, step: float = 1e-3
    ) -> Iterator[Motion]:  # fmt: skip
        """Yield a motion and those that follow it along its tangent, until they leave a range.

        ``step`` is the first one, as a share of parameter and motion.

        Raises
        ------
        NoConvergence
            Where Newton's method finds no next motion; what was yielded stays.
        """
        yield motion
        for _ in range(most):
            found = self.ahead(motion, step)
            if found is None and step < SHARP_CORNER:
                found = self._around_corner(motion)
            if found is None or not (found.tangent @ motion.tangent > SHARPEST or step < SHARP_CORNER):
                step /= 2
                if step < SHORTEST:
                    raise NoConvergence(motion.omega)
                continue
            if not low <= found.omega <= high:
                yield self._at(high if found.omega > high else low, motion, found)
                return
            bent = float(np.linalg.norm(difference(motion, found) - step * motion.tangent))
            motion = found
            yield motion
            step = min(step * min(max(np.sqrt(self.bent / max(bent, 1e-12)), 0.3), 2.0), self.longest)
        raise NoConvergence(motion.omega)

    def _at(self, omega: float, before: Motion, after: Motion) -> Motion:
        """Return the motion at a frequency between two neighbours."""
        share = (omega - before.omega) / (after.omega - before.omega)
        found = self.solved_at(omega, before.z + share * (after.z - before.z), after.y, after.scale)
        return replace(found, tangent=found.tangent * np.sign(found.tangent @ after.tangent))


class Solver(Follower):
    """Harmonic balance of one condensed rig with so many harmonics and samples."""

    def __init__(self, system: Condensed, harmonics: int, samples: int):
        self.system, self.harmonics, self.samples = system, harmonics, samples
        self.grid = grid(harmonics, samples)
        self.rows = system.linear.residues.shape[1]
        self.least = 1e-3 * system.size
        self.size = system.linear.basis.shape[1] * (2 * harmonics + 1)
        self.slopes = slopes(system.laws, self.rows, samples, harmonics)
        self.jacobian = np.zeros((self.size + 1, self.size + 1))
        self.at: float | None = None  # the frequency, 1/s, at which the level is the parameter in its place
        self.driven = np.zeros(self.size)  # what z is by the excitation alone, then

    def frequency(self, motion: Motion) -> float:
        """Return the angular frequency of a motion's first harmonic, 1/s."""
        return motion.omega if self.at is None else self.at

    def share(self, motion: Motion) -> float:
        """Return the share of the excitation's level at which a motion is."""
        return 1.0 if self.at is None else motion.omega

    def ends(self, motion: Motion) -> np.ndarray:
        """Return the displacements (2 n_bushings, N) of both ends of every bushing along a period, m."""
        place = (self.system.linear.basis @ motion.z + motion.y) @ self.grid.basis.T
        return place[len(self.system.rig.bushings) :]

    def touches(self, motion: Motion) -> bool:
        """Return whether an end is beyond a wall at any sample of a period."""
        lower, upper = np.repeat([bushing.walls for bushing in self.system.rig.bushings], 2, axis=0).T
        ends = self.ends(motion)
        return bool(np.any(ends.max(axis=1) > upper) or np.any(ends.min(axis=1) < lower))

    def _left(self, parameter: float, z: np.ndarray, y: np.ndarray, want: bool) -> tuple[np.ndarray, ...]:
        """What is left of the balance, and its derivatives, at a frequency, or at a share of the level."""
        linear, laws = self.system.linear, self.system.laws
        if self.at is None:
            return balance(linear, self.grid, laws, self.slopes, parameter, z, y, want, self.jacobian)
        linear = linear._replace(excitation=parameter * linear.excitation)
        found = balance(linear, self.grid, laws, self.slopes, self.at, z, y, want, self.jacobian)
        if want:
            self.jacobian[:-1, -1] = -self.driven
        return found

    def derivative(self, parameter: float, z: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the derivative (size, size) of what is left of the balance by the unknowns."""
        self._left(parameter, z, y, True)
        return self.jacobian[:-1, :-1]

    def over_level(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Make the share of the level the parameter, at a frequency; return what rest leaves, and what lies beside."""
        still = np.zeros((self.system.linear.basis.shape[1], 2 * self.harmonics + 1))
        self.at = None
        left, _, moved, _ = self._left(omega, still, np.zeros((self.rows, still.shape[1])), False)
        self.at, self.driven = omega, -left.ravel()
        return left, moved

    def growing(self, omega: float, most: float = math.inf) -> Motion:
        """Return a motion in the gap at a frequency, the share of the level being the parameter from now on.

        Parameters
        ----------
        omega : float
            1/s.
        most : float
            Largest share of the level that it may be at.

        Raises
        ------
        NoConvergence
            If there is none.
        """
        left, moved = self.over_level(omega)
        farthest = np.abs((self.system.linear.basis @ -left + moved) @ self.grid.basis.T).max()
        least = min(most, BEFORE_CONTACT * self.system.size / farthest)
        scale = max(least * float(np.linalg.norm(left)), self.least)
        return self.solved_at(least, -least * left, least * moved, scale)

    def first(self, omega: float) -> Motion:
        """Return the motion at a frequency that begins in the gap and grows with the level of the excitation.

        Raises
        ------
        NoConvergence
            If it does not reach the level.
        """
        try:
            motion = self.growing(omega, 1.0)
            if motion.omega < 1.0:
                *_, motion = self.within(motion, 1e-3 * motion.omega, 1.0)  # folds may lead below where it began
                if abs(motion.omega - 1.0) > 1e-9:
                    raise NoConvergence(omega)
        except NoConvergence:
            raise NoConvergence(omega) from None
        finally:
            self.at = None
        return self.solved_at(omega, motion.z, motion.y, motion.scale)

    def branch(self, start: float, stop: float) -> Iterator[Motion]:
        """Yield motions from a frequency, 1/s, on until the branch leaves the range between it and another one.

        Raises
        ------
        NoConvergence
            Where Newton's method finds no next motion; what was yielded stays.
        """
        yield from self.within(self.first(start), min(start, stop), max(start, stop), stop > start)


def difference(a: Motion, b: Motion) -> np.ndarray:
    """Return the way from one motion to another, in the units of the first."""
    return np.append((b.z - a.z).ravel() / a.scale, b.omega / a.omega - 1)
