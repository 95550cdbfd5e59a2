"""Branches of periodic motions: Newton's method as corrector, pseudo-arclength continuation with tangent predictor.

The unknowns are scaled by a size that grows with the motion, the parameter by its value at the previous point. The
loops are those of `loops`, compiled for equations that are compiled, and plain for others.
"""

from __future__ import annotations

from abc import ABC
from bisect import bisect_left, insort
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np

from .loops import BEYOND, DEEP, GOES_ON, SHORTEST, STUCK, loops

__all__ = [
    "MAX_POINTS", "Continuation", "EndOfBranch", "Motions", "NoConvergence", "PeriodicMotion", "difference",
    "first_half", "meets", "until_closed",
]  # fmt: skip

TOLERANCE = 1e-9  # of Newton's method: residual over the size of the motion
BENT = 0.002  # distance of corrector from predictor, over the motion's size, that the step control aims at
LONGEST = 0.05  # longest step, relative to parameter and motion
MET, BESIDE = (1e-4, 0.1)  # distance at which a branch meets an earlier motion: over its size, over a step
MAX_POINTS = 20000
AT_ONCE = 16  # motions per call of a compiled loop


class NoConvergence(Exception):
    """Newton's method fails at or beyond a frequency, 1/s, its only argument."""


class EndOfBranch(Exception):
    """The branch is closed, halves its period or grows without bound, as its only argument says."""


@dataclass(frozen=True, eq=False)
class PeriodicMotion:
    """A periodic motion."""

    parameter: float  #: of the branch: angular frequency in 1/s, or a factor of level, loads or gaps
    z: np.ndarray  #: (r, K) harmonics of the coordinates, m
    y: np.ndarray  #: (n_rows, K) of the displacements outside the basis, m
    force: np.ndarray  #: (n_rows, K) of the clearances' forces beyond the linear fillings', N
    tangent: np.ndarray  #: (r K + 1,) direction of the branch, in metres over `scale` and 1/s over ω
    scale: float  #: m


class Motions(NamedTuple):
    """Motions of a branch, one after the other; each part as in `PeriodicMotion`, motions along its first axis."""

    parameter: np.ndarray
    z: np.ndarray
    y: np.ndarray
    force: np.ndarray
    tangent: np.ndarray
    scale: np.ndarray

    @classmethod
    def of(cls, motions: Sequence[PeriodicMotion]) -> Self:
        """Stack motions."""
        return cls(*(np.array([getattr(motion, name) for motion in motions]) for name in cls._fields))

    @classmethod
    def after(cls, motion: PeriodicMotion, most: int) -> Self:
        """Allocate so many motions, of which the first one is set."""
        return cls(*(np.repeat(part, most, axis=0) for part in cls.of([motion])))

    def motion(self, i: int) -> PeriodicMotion:
        """Return the motion at an index."""
        return PeriodicMotion(
            float(self.parameter[i]), self.z[i], self.y[i], self.force[i], self.tangent[i], float(self.scale[i])
        )


class Continuation(ABC):
    """Newton's method and continuation for as many equations as unknowns, and a parameter.

    A follower in Python has ``_residual`` and is the argument of its equations; a compiled one has other loops.
    """

    size: int  #: number of unknowns
    least: float  #: m: scale of smaller motions
    jacobian: np.ndarray  #: (size + 1, size + 1) derivatives by unknowns and parameter; the last row is overwritten
    tolerance = TOLERANCE  #: residual over the size of the motion
    bent = BENT  #: distance of corrector from predictor, over the motion's size, that the step control aims at
    longest = LONGEST  #: longest step, relative to parameter and motion
    loops = loops(lambda of, *at: of._residual(*at), lambda of, parameter, z, y: -np.inf, False)

    @property
    def equations(self) -> Any:
        """First argument of the loops' equations."""
        return self

    def scale_of(self, z: np.ndarray) -> float:
        """Return the size of a motion's unknowns, m, by which they are scaled."""
        return max(float(np.linalg.norm(z)), self.least)

    def solve(self, omega: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float) -> PeriodicMotion | None:
        """Return the motion near a guess in the plane through it normal to ``row``; None if Newton's method fails."""
        converged, *motion = self.loops.solve(self.equations, float(omega), z, y, row, float(scale))
        return PeriodicMotion(*motion) if converged else None

    def solved_at(self, parameter: float, z: np.ndarray, y: np.ndarray, scale: float) -> PeriodicMotion:
        """Return the motion at one value of the parameter, near a guess; NoConvergence where there is none."""
        if (motion := self.solve(parameter, z, y, np.append(np.zeros(self.size), 1.0), scale)) is None:
            raise NoConvergence(parameter)
        return motion

    def ahead(self, motion: PeriodicMotion, step: float, tangent: np.ndarray | None = None) -> PeriodicMotion | None:
        """Predict along a tangent, that of the motion if none is given, and correct; None if Newton's method fails."""
        direction = motion.tangent if tangent is None else tangent
        start = motion.parameter, motion.z, motion.y, motion.scale
        converged, *corrected, _ = self.loops.ahead(self.equations, *start, direction, float(step))
        return PeriodicMotion(*corrected) if converged else None

    def across_wall(self, motion: PeriodicMotion) -> PeriodicMotion | None:
        """Return a motion beyond a corner at which the corrector fails."""
        return None

    def within(
        self, motion: PeriodicMotion, low: float, high: float, up: bool = True, most: int = MAX_POINTS
    ) -> Iterator[PeriodicMotion]:  # fmt: skip
        """Yield a motion and those that follow it, upwards first or downwards, until they leave a range.

        Raises
        ------
        NoConvergence
            Where Newton's method fails; the motions yielded before stay valid.
        """
        up_or_down = np.sign(motion.tangent[-1] * (1 if up else -1) or 1.0)
        yield from self.onwards(replace(motion, tangent=up_or_down * motion.tangent), low, high, most)

    def onwards(
        self, motion: PeriodicMotion, low: float, high: float, most: int = MAX_POINTS, step: float = 1e-3
    ) -> Iterator[PeriodicMotion]:  # fmt: skip
        """Yield a motion and those that follow it along its tangent, until they leave a range.

        ``step`` is the first one, relative to parameter and motion.

        Raises
        ------
        NoConvergence
            Where Newton's method fails; the motions yielded before stay valid.
        """
        yield motion
        for motions, why in self.pieces(motion, low, high, most, step):
            for i in range(len(motions.parameter) - (why == BEYOND)):
                motion = motions.motion(i)
                yield motion
            if why == BEYOND:
                after = motions.motion(-1)
                yield self._solve_between(high if after.parameter > high else low, motion, after)
                return
        raise NoConvergence(motion.parameter)

    def pieces(
        self, motion: PeriodicMotion, low: float, high: float, most: int, step: float, wanted: float = np.inf,
        deep: float = np.inf,
    ) -> Iterator[tuple[Motions, int]]:  # fmt: skip
        """Yield the motions after one in blocks, each with the status of `loops` that says why it ends."""
        remaining = most
        while remaining > 0:
            block = Motions.after(motion, min(remaining, AT_ONCE) + 1)
            count, step, why = self.loops.onwards(self.equations, *block, step, low, high, wanted, deep)
            if count > 1:
                motions = Motions(*(each[1:count] for each in block))
                motion, remaining = motions.motion(-1), remaining - count + 1
                yield motions, why
            if why in (BEYOND, DEEP):
                return
            if why == STUCK:
                if step < SHORTEST:
                    return
                if (beyond := self.across_wall(motion)) is None:
                    step /= 2
                    continue
                motion, remaining = beyond, remaining - 1
                yield Motions.of([beyond]), GOES_ON

    def _solve_between(self, omega: float, before: PeriodicMotion, after: PeriodicMotion) -> PeriodicMotion:
        """Return the motion at a frequency between two neighbours."""
        fraction = (omega - before.parameter) / (after.parameter - before.parameter)
        motion = self.solved_at(omega, before.z + fraction * (after.z - before.z), after.y, after.scale)
        return replace(motion, tangent=motion.tangent * np.sign(motion.tangent @ after.tangent))


def meets(
    follower: Continuation, before: PeriodicMotion, after: PeriodicMotion, other: PeriodicMotion, beside: float = BESIDE
) -> bool:
    """Return True if another motion lies on the branch between two neighbours."""
    chord, offset = difference(before, after), difference(before, other)
    length = float(np.linalg.norm(chord))
    fraction = float(offset @ chord) / length**2
    if not (0 <= fraction <= 1 and np.linalg.norm(offset - fraction * chord) < beside * length):
        return False
    near = follower.ahead(before, fraction * length, chord / length)
    return near is not None and bool(np.linalg.norm(difference(near, other)) < MET)


def until_closed(follower: Continuation, motions: Iterator[PeriodicMotion]) -> Iterator[PeriodicMotion]:
    """Yield motions until one of them recurs with the same direction: the branch is closed.

    Raises
    ------
    EndOfBranch
        Then.
    """
    known: list[tuple[float, int, PeriodicMotion]] = []  # by their parameter
    before: PeriodicMotion | None = None
    for i, motion in enumerate(motions):
        if before is not None:
            low, high = sorted((before.parameter, motion.parameter))
            for _, j, other in known[bisect_left(known, (low,)) : bisect_left(known, (high,))]:
                direction = other.tangent @ difference(before, motion)
                if j < i - 2 and direction > 0 and meets(follower, before, motion, other):
                    yield other
                    raise EndOfBranch("it comes back to " + ("where it was" if j else "its beginning"))
            insort(known, (before.parameter, i - 1, before))
        yield motion
        before = motion


def first_half(motions: list[PeriodicMotion]) -> list[PeriodicMotion]:
    """Return the motions of a branch that returns along itself, up to the middle of its arc length."""
    arc_length = np.cumsum([np.linalg.norm(difference(a, b)) for a, b in pairwise(motions)])
    return motions[: int(np.searchsorted(arc_length, arc_length[-1] / 2)) + 1]


def difference(a: PeriodicMotion, b: PeriodicMotion) -> np.ndarray:
    """Return the vector from one motion to another, in the units of the first."""
    return np.append((b.z - a.z).ravel() / a.scale, b.parameter / a.parameter - 1)
