"""A branch of which one motion is known, all around: closed, or from one end to the other."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .continuation import CameBack, Motion, NoConvergence, Solver, difference
from .following import place
from .subharmonic import until_halved
from .vibrations import turned

__all__ = ["all_around"]

CLOSED = 1e-4  # relative distance at which a branch meets its beginning
ROUND, BACKWARDS = "it comes back to its beginning", "it turns back along itself"


def all_around(solver: Solver, motion: Motion, low: float, high: float) -> Iterator[Motion]:
    """Yield the motions of the branch on which one is, from one end to the other.

    Raises
    ------
    CameBack
        At the end, if the branch is closed or does not end at an end of the range.
    """
    forth, why = _until_end(solver, motion, low, high)
    back, whence = ([], "") if why == ROUND else _until_end(solver, _backwards(motion), low, high)
    if whence == ROUND:
        forth, why = [], ROUND
    yield from (_backwards(each) for each in reversed(back[1:] if forth else back))
    yield from forth
    if why == ROUND:
        raise CameBack(why)
    if why or whence:
        raise CameBack("; ".join([*([why] if why else []), *([f"before its first point {whence}"] if whence else [])]))


def _until_end(solver: Solver, motion: Motion, low: float, high: float) -> tuple[list[Motion], str]:
    """Motions from one on along its tangent, and why they end, "" at an end of the range."""
    found: list[Motion] = []
    try:
        for each in _until_closed(solver, until_halved(solver, motion, low, high)):
            found.append(each)
    except CameBack as end:
        if str(end) != BACKWARDS:
            return found, str(end)
        way = np.cumsum([np.linalg.norm(difference(a, b)) for a, b in itertools.pairwise(found)])
        found = found[: int(np.searchsorted(way, way[-1] / 2)) + 1]
        return found, f"{BACKWARDS} at {place(solver, found[-1].omega)}"
    except NoConvergence as end:
        return found, f"no further periodic vibration was found beyond {place(solver, end.args[0])}"
    return found, ""


def _until_closed(solver: Solver, motions: Iterator[Motion]) -> Iterator[Motion]:
    """Yield motions until the first one comes again, some periods of the excitation later.

    Raises
    ------
    CameBack
        Then.
    """
    first = before = next(motions)
    yield first
    copies = [_shifted(first, k / solver.system.periods) for k in range(solver.system.periods)]
    for i, motion in enumerate(motions):
        way = difference(before, motion)
        for copy in copies if i else ():
            gone = difference(before, copy)
            share = float(gone @ way / (way @ way))
            if 0 <= share <= 1 and np.linalg.norm(gone - share * way) < np.linalg.norm(way):
                near = solver.ahead(before, share * float(np.linalg.norm(way)), way / np.linalg.norm(way))
                if near is not None and np.linalg.norm(difference(near, copy)) < CLOSED:
                    if copy.tangent @ way < 0:  # as at a corner where a contact is lost
                        raise CameBack(BACKWARDS)
                    yield copy
                    raise CameBack(ROUND)
        yield motion
        before = motion


def _shifted(motion: Motion, share: float) -> Motion:
    """A motion a share of its period later."""
    way = motion.tangent[:-1].reshape(motion.z.shape)
    z, y, force, way = (turned(each, 2 * np.pi * share) for each in (motion.z, motion.y, motion.force, way))
    return replace(motion, z=z, y=y, force=force, tangent=np.append(way.ravel(), motion.tangent[-1]))


def _backwards(motion: Motion) -> Motion:
    return replace(motion, tangent=-motion.tangent)
