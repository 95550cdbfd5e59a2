"""Location of the motions at which contact begins or ends along a branch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from .continuation import NoConvergence, PeriodicMotion, difference
from .solver import Solver

__all__ = ["grazing", "with_first_contacts"]

GRAZES = 2e-4  # of a gap
EXACT = 1e-7  # of a step: accuracy of the beginning of contact


def with_first_contacts(
    solver: Solver, motions: Iterator[PeriodicMotion], contacts: list[PeriodicMotion]
) -> Iterator[PeriodicMotion]:
    """Yield consecutive motions, and those where contact begins or ends, which are appended to a list, too."""
    before, depth_before = None, 0.0
    try:
        for motion in motions:
            depth = solver.depth(motion.parameter, motion.z, motion.y)
            between = None
            if before is not None:
                if (depth_before > 0) != (depth > 0):
                    between = grazing(solver, before, motion)
                    contacts += [between] if between is not None else []
                yield before
                if between is not None and between is not before and between is not motion:
                    yield between
            before, depth_before = motion, depth
    except NoConvergence:
        if before is not None:
            yield before
        raise
    if before is not None:
        yield before


def grazing(solver: Solver, before: PeriodicMotion, after: PeriodicMotion) -> PeriodicMotion | None:
    """Return the motion that grazes a wall, between one with contact and one without."""
    chord = difference(before, after)
    length = float(np.linalg.norm(chord))
    known = {share: (solver.depth(at.parameter, at.z, at.y), at) for share, at in ((0.0, before), (1.0, after))}

    def depth(fraction: float) -> float:
        if fraction not in known:
            if (motion := solver.ahead(before, fraction * length, chord / length)) is None:
                raise ArithmeticError
            known[fraction] = solver.depth(motion.parameter, motion.z, motion.y), motion
        return known[fraction][0]

    try:
        return known[brentq(depth, 0.0, 1.0, xtol=EXACT)][1]
    except (ArithmeticError, KeyError):  # at a corner nothing lies in between
        nearest, motion = min(known.values(), key=lambda each: abs(each[0]))
        return motion if abs(nearest) < GRAZES * solver.system.size else None
