"""Periodic motions one after the other: Newton's method at one, pseudo-arclength continuation along many.

Unknowns are those of the equations over a size that grows with the motion, and the parameter over that of the point
before. The loops are those of `loops`, compiled for equations that are compiled, and plain for others.
"""

from __future__ import annotations

from abc import ABC
from bisect import bisect_left, insort
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from .loops import BEYOND, DEEP, GOES_ON, SHORTEST, STUCK, loops

__all__ = [
    "MAX_POINTS", "EndOfBranch", "Follower", "Motion", "Motions", "NoConvergence", "difference", "meets", "until_again",
]  # fmt: skip

TOLERANCE = 1e-9  # of Newton's method: what the equations may leave, over the size of the motion
BENT = 0.002  # distance of a motion from its prediction by the tangent, over its size, that steps aim at
LONGEST = 0.05  # step, as a share of parameter and motion
MET, BESIDE = 1e-4, 0.1  # distance of a branch from an earlier motion that it meets: over its size, over a step
MAX_POINTS = 20000
AT_ONCE = 16  # motions that a compiled loop finds before they are looked at


class NoConvergence(Exception):
    """No motion was found at or beyond a frequency, 1/s, its only argument."""


class EndOfBranch(Exception):
    """The branch is closed, halves its period or grows without bound, as its only argument says."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A periodic motion."""

    omega: float  #: value of the branch's parameter: 1/s, or a share where that is level, loads or gaps
    z: np.ndarray  #: (r, K) harmonics of the coordinates, m
    y: np.ndarray  #: (n_rows, K) of the rows beside them, m
    force: np.ndarray  #: (n_rows, K) of the clearances' forces beyond the linear fillings', N
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

    @classmethod
    def after(cls, motion: Motion, most: int) -> Self:
        """Return room for so many motions, of which the first one is there."""
        room = cls(*(np.empty((most, *np.shape(getattr(motion, name)))) for name in cls._fields))
        for all_of_them, name in zip(room, cls._fields):
            all_of_them[0] = getattr(motion, name)
        return room

    def one(self, i: int) -> Motion:
        """Return one of them."""
        return Motion(float(self.omega[i]), self.z[i], self.y[i], self.force[i], self.tangent[i], float(self.scale[i]))


class Follower(ABC):
    """Newton's method and continuation for as many equations in as many unknowns and a parameter.

    What is computed in Python has ``_left`` and is what its equations are of; what is compiled has loops of its own.
    """

    size: int  #: how many unknowns
    least: float  #: m: smaller motions are measured by it
    jacobian: np.ndarray  #: (size + 1, size + 1) derivatives by the unknowns and the parameter; the last row is room
    tolerance = TOLERANCE  #: of the motion: what the equations may leave
    bent = BENT  #: distance of a motion from its prediction by the tangent, over its size, that steps aim at
    longest = LONGEST  #: step, as a share of parameter and motion
    loops = loops(lambda of, *at: of._left(*at), lambda of, parameter, z, y: -np.inf, False)

    @property
    def equations(self) -> Any:
        """What the loops' equations are of."""
        return self

    def solve(self, omega: float, z: np.ndarray, y: np.ndarray, row: np.ndarray, scale: float) -> Motion | None:
        """Return the motion near a guess on the plane across ``row`` through it; None if Newton's method fails."""
        found, *motion = self.loops.solve(self.equations, float(omega), z, y, row, float(scale))
        return Motion(*motion) if found else None

    def solved_at(self, parameter: float, z: np.ndarray, y: np.ndarray, scale: float) -> Motion:
        """Return the motion at one value of the parameter, near a guess; NoConvergence where there is none."""
        if (found := self.solve(parameter, z, y, np.append(np.zeros(self.size), 1.0), scale)) is None:
            raise NoConvergence(parameter)
        return found

    def ahead(self, motion: Motion, step: float, tangent: np.ndarray | None = None) -> Motion | None:
        """Return the motion a step away along a tangent, its own if none is given."""
        direction = motion.tangent if tangent is None else tangent
        start = motion.omega, motion.z, motion.y, motion.scale
        found, *there, _ = self.loops.ahead(self.equations, *start, direction, float(step))
        return Motion(*there) if found else None

    def across_wall(self, motion: Motion) -> Motion | None:
        """Return a motion beyond a corner at which none lies ahead."""
        return None

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
        for motions, why in self.pieces(motion, low, high, most, step):
            for i in range(len(motions.omega) - (why == BEYOND)):
                motion = motions.one(i)
                yield motion
            if why == BEYOND:
                after = motions.one(-1)
                yield self._at(high if after.omega > high else low, motion, after)
                return
        raise NoConvergence(motion.omega)

    def pieces(
        self, motion: Motion, low: float, high: float, most: int, step: float, wanted: float = np.inf,
        deep: float = np.inf,
    ) -> Iterator[tuple[Motions, int]]:  # fmt: skip
        """Yield motions after one, some at once, and why there are no more of them, as `loops` says it."""
        left = most
        while left > 0:
            room = Motions.after(motion, min(left, AT_ONCE) + 1)
            count, step, why = self.loops.onwards(self.equations, *room, step, low, high, wanted, deep)
            if count > 1:
                found = Motions(*(each[1:count] for each in room))
                motion, left = found.one(-1), left - count + 1
                yield found, why
            if why in (BEYOND, DEEP):
                return
            if why == STUCK:
                if step < SHORTEST:
                    return
                if (beyond := self.across_wall(motion)) is None:
                    step /= 2
                    continue
                motion, left = beyond, left - 1
                yield Motions.of([beyond]), GOES_ON

    def _at(self, omega: float, before: Motion, after: Motion) -> Motion:
        """Return the motion at a frequency between two neighbours."""
        share = (omega - before.omega) / (after.omega - before.omega)
        found = self.solved_at(omega, before.z + share * (after.z - before.z), after.y, after.scale)
        return replace(found, tangent=found.tangent * np.sign(found.tangent @ after.tangent))


def meets(follower: Follower, before: Motion, after: Motion, other: Motion, beside: float = BESIDE) -> bool:
    """Return whether another motion lies on the branch between two neighbours."""
    way, gone = difference(before, after), difference(before, other)
    length = float(np.linalg.norm(way))
    share = float(gone @ way) / length**2
    if not (0 <= share <= 1 and np.linalg.norm(gone - share * way) < beside * length):
        return False
    near = follower.ahead(before, share * length, way / length)
    return near is not None and bool(np.linalg.norm(difference(near, other)) < MET)


def until_again(follower: Follower, motions: Iterator[Motion]) -> Iterator[Motion]:
    """Yield motions until one of them comes again with the same direction: the branch is closed.

    Raises
    ------
    EndOfBranch
        Then.
    """
    known: list[tuple[float, int, Motion]] = []  # by their parameter
    before: Motion | None = None
    for i, motion in enumerate(motions):
        if before is not None:
            low, high = sorted((before.omega, motion.omega))
            for _, j, other in known[bisect_left(known, (low,)) : bisect_left(known, (high,))]:
                direction = other.tangent @ difference(before, motion)
                if j < i - 2 and direction > 0 and meets(follower, before, motion, other):
                    yield other
                    raise EndOfBranch("it comes back to " + ("where it was" if j else "its beginning"))
            insort(known, (before.omega, i - 1, before))
        yield motion
        before = motion


def difference(a: Motion, b: Motion) -> np.ndarray:
    """Return the way from one motion to another, in the units of the first."""
    return np.append((b.z - a.z).ravel() / a.scale, b.omega / a.omega - 1)
