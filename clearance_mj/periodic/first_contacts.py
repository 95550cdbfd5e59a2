"""Where contact begins or ends along a branch of motions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from .continuation import Motion, NoConvergence, difference
from .solver import Solver

__all__ = ["grazing", "with_first_contacts"]

GRAZES = 2e-4  # of a gap
EXACT = 1e-7  # of a step: where contact begins


def with_first_contacts(solver: Solver, motions: Iterator[Motion], found: list[Motion]) -> Iterator[Motion]:
    """Yield motions that follow each other, and those where contact begins or ends, which are put into a list too."""
    before, away = None, 0.0
    try:
        for motion in motions:
            beyond = solver.depth(motion.omega, motion.z, motion.y)
            between = None
            if before is not None:
                if (away > 0) != (beyond > 0):
                    between = grazing(solver, before, motion)
                    found += [between] if between is not None else []
                yield before
                if between is not None and between is not before and between is not motion:
                    yield between
            before, away = motion, beyond
    except NoConvergence:
        if before is not None:
            yield before
        raise
    if before is not None:
        yield before


def grazing(solver: Solver, before: Motion, after: Motion) -> Motion | None:
    """Return the motion between two, of which one touches, that grazes a wall."""
    way = difference(before, after)
    length = float(np.linalg.norm(way))
    known = {share: (solver.depth(at.omega, at.z, at.y), at) for share, at in ((0.0, before), (1.0, after))}

    def depth(share: float) -> float:
        if share not in known:
            if (motion := solver.ahead(before, share * length, way / length)) is None:
                raise ArithmeticError
            known[share] = solver.depth(motion.omega, motion.z, motion.y), motion
        return known[share][0]

    try:
        return known[brentq(depth, 0.0, 1.0, xtol=EXACT)][1]
    except (ArithmeticError, KeyError):  # at a corner nothing lies in between
        nearest, motion = min(known.values(), key=lambda each: abs(each[0]))
        return motion if abs(nearest) < GRAZES * solver.system.size else None
