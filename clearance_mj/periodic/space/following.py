"""What a branch of motions in space is to a user: what sensors and clearances do, and where contact begins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from ..branch import Branch
from ..continuation import Motion, NoConvergence, difference
from ..following import branch_of, expanded, place
from ..stability import Located
from ..vibrations import complex_amplitudes
from .condensed import UNBALANCE
from .solver import RoundSolver
from .stability import all_points

__all__ = ["expand", "with_first_contacts"]

GRAZES = 2e-4  # of a gap
EXACT = 1e-7  # of a step: where contact begins


def with_first_contacts(solver: RoundSolver, motions: Iterator[Motion], found: list[Motion]) -> Iterator[Motion]:
    """Yield motions that follow each other, and those where contact begins or ends, which are put into a list too."""
    before, away = None, 0.0
    try:
        for motion in motions:
            beyond = solver.depth(motion.z, motion.y)
            between = None
            if before is not None:
                if (away > 0) != (beyond > 0):
                    between = _grazing(solver, before, away, motion, beyond)
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


def _grazing(solver: RoundSolver, before: Motion, away: float, after: Motion, beyond: float) -> Motion | None:
    """Return the motion between two, of which one touches, that grazes a wall."""
    way = difference(before, after)
    length = float(np.linalg.norm(way))
    known: dict[float, Motion | None] = {0.0: before, 1.0: after}

    def depth(share: float) -> float:
        if share not in known:
            known[share] = solver.ahead(before, share * length, way / length)
        if (motion := known[share]) is None:
            raise ArithmeticError
        return solver.depth(motion.z, motion.y)

    try:
        return known[brentq(depth, 0.0, 1.0, xtol=EXACT)]
    except (ArithmeticError, KeyError):  # at a corner nothing lies in between
        inner, least = (before, away) if away <= 0 else (after, beyond)
        return inner if abs(least) < GRAZES * solver.system.size else None


@place.register
def _round_place(solver: RoundSolver, parameter: float) -> str:
    omega = solver.at if solver.raised else parameter
    if solver.system.kind == UNBALANCE:
        return f"a speed of {omega:.6g} rad/s"
    level = abs(solver.system.levels[np.flatnonzero(solver.system.levels)[0]])
    return f"{omega / (2 * np.pi):.6g} Hz and level {level:g} {'m/s²' if solver.system.kind == 'base' else 'N'}"


@expanded.register
def _round_expanded(solver: RoundSolver, points: list[Located], ended: str) -> Branch:
    omega = np.array([solver.frequency(point.motion) for point in points])
    spin = np.array([solver.spin_of(each) for each in omega])
    x = np.array([all_points(solver, point.motion) for point in points])
    return expand(solver, points, ended, omega, spin, x, solver.system.levels)


def expand(
    solver: RoundSolver, points: list[Located], ended: str, omega: np.ndarray, spin: np.ndarray, x: np.ndarray,
    levels: np.ndarray, over: str = "frequency",
) -> Branch:  # fmt: skip
    """Return the branch of motions of frequencies and spins (n,), 1/s, and points' harmonics (n, 2 n_points, K), m."""
    driven, moved = solver.system.driven, complex_amplitudes(x)
    force = complex_amplitudes(np.array([point.motion.force for point in points]))
    shares = np.array([solver.share(point.motion) for point in points])
    modes = np.empty((len(points), driven.model.size, moved.shape[-1]), dtype=complex)
    for i, (w, turns) in enumerate(zip(omega, spin)):
        on_modes = driven.force(turns, 1.0, shares[i]) - force[i].T @ driven.model.at_points
        modes[i] = driven.modes(w, turns, on_modes).T
    level = np.outer(shares, levels)
    excitation = np.zeros((len(points), moved.shape[-1]), dtype=complex)
    excitation[:, 1 : levels.size + 1] = level
    return branch_of(
        solver, driven.model, points, ended, omega, excitation, level, modes, force, moved, over, spin=spin
    )
