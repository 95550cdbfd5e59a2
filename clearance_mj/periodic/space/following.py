"""What a branch of motions in space is to a user: what sensors and clearances do, and where contact begins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from ..branch import Branch, SpecialPoint
from ..continuation import Motion, NoConvergence, difference
from ..following import expanded, of_folds, place
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
        motion = known[share]
        if motion is None:
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
    system, count = solver.system, 2 * len(solver.system.rig.bushings)
    rig, structure = system.rig, system.driven.model
    force = complex_amplitudes(np.array([point.motion.force for point in points]))
    moved = complex_amplitudes(x)
    turning = 1j * np.arange(moved.shape[-1]) * omega[:, None]
    modes = np.empty((len(points), moved.shape[-1], structure.size), dtype=complex)
    shares = np.array([solver.share(point.motion) for point in points])
    for i, (w, turns) in enumerate(zip(omega, spin)):
        on_modes = system.driven.force(turns, 1.0, shares[i]) - force[i].T @ structure.at_points
        modes[i] = solver.dynamics.modes(w, turns, on_modes)
    acceleration = np.einsum("sm,nhm->nsh", structure.at_sensors, modes) * (turning**2)[:, None, :]
    excitation = np.zeros((len(points), moved.shape[-1]), dtype=complex)
    excitation[:, 1 : levels.size + 1] = np.outer(shares, levels)
    if system.kind == "base":
        acceleration += structure.sensors_on_base[:, None] * excitation[:, None]
    along = np.array([sensor.unit_direction for sensor in rig.sensors]).reshape(-1, 3)
    at = structure.directed([sensor.position for sensor in rig.sensors], along)
    ends = force[:, count:].reshape(len(points), count // 2, 2, 2, -1).sum(axis=2).reshape(len(points), count, -1)
    spring, damper = (np.repeat(each, 2)[:, None] for each in (system.laws.spring, system.laws.damper))
    held = force[:, :count] + (spring + damper * turning[:, None, :]) * moved[:, :count]
    known = [point.multipliers for point in points]
    at_folds = of_folds(np.array([point.motion.omega for point in points]), [point.kind for point in points])
    strength = float(abs(levels[np.flatnonzero(levels)[0]])) if levels.any() else 0.0
    special = tuple(
        SpecialPoint(point.kind, float(omega[i] / (2 * np.pi)), strength, i)
        for i, point in enumerate(points)
        if point.kind and i not in at_folds
    )
    return Branch(
        system.model, system.kind, over, 1, system.modes, solver.samples, omega / (2 * np.pi),
        np.outer(shares, levels), acceleration, np.einsum("sm,nhm->nsh", at, modes), moved[:, :count],
        moved[:, count:], ends, held, np.array(known) if known[0] is not None else None, special, ended,
        tuple(rig.sensor_labels), tuple(rig.probe_labels), spin,
    )  # fmt: skip
