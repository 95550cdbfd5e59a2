"""What a branch of motions is to a user: special points located, everything that sensors and clearances do."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError
from ..linear import LinearModel
from ..rig.sensing import accelerated, sensor_points
from .branch import Branch, SpecialPoint
from .condensed import condensed
from .continuation import CameBack, Motion, NoConvergence, Solver
from .stability import BRANCH_POINT, FIRST_CONTACT, FOLD, Located, changes, multipliers, with_fold
from .vibrations import complex_amplitudes

__all__ = ["branch_of", "expanded", "farthest", "follow", "of_folds", "place", "resumed", "strongest", "watched"]

SAME_FOLD = 1e-3  # relative distance in frequency of a fold from where its multiplier passes 1


def follow(
    solver: Any, motions: Iterator[Motion], stability: bool, progress: bool = False, touching: Collection[Motion] = ()
) -> Branch:
    """Return the branch of motions that follow each other, with what is special about them.

    ``touching`` are those of the motions at which contact begins, known once they come.

    Raises
    ------
    ClearanceError
        If not even the first motion was found.
    """
    points: list[Located] = []
    ended, recent = "", 0
    try:
        for motion in tqdm(motions, desc="branch", unit="point", disable=not progress):
            kind = FIRST_CONTACT if motion in touching else ""
            point = Located(motion, multipliers(solver, motion) if stability else None, kind)
            if not points:
                points.append(point)
                continue
            before = points[-1].motion
            points += [*changes(solver, points[-1], point), point]
            points[recent:] = with_fold(solver, points[recent:])
            recent = next(i for i, each in enumerate(points) if each.motion is before)
    except NoConvergence as end:
        at = place(solver, end.args[0])
        if not points:
            raise ClearanceError(
                f"rig {solver.system.rig.name!r}: no periodic vibration was found at {at}; begin at another frequency, "
                "or with more harmonics and samples"
            ) from None
        ended = f"no further periodic vibration was found beyond {at}"
    except CameBack as end:
        ended = str(end)
    return expanded(solver, points, ended)


def watched(
    motions: Iterator[Motion], watch: Callable[[float], None] | None, unit: float = 2 * np.pi
) -> Iterator[Motion]:
    """Motions as they come, whose parameters in units are told to ``watch``: by default frequencies in Hz."""
    for motion in motions:
        if watch is not None:
            watch(motion.omega / unit)
        yield motion


def resumed(branch: Branch, index: int, times: int = 1) -> tuple[Solver, float, np.ndarray, np.ndarray]:
    """Return what finds motions near a point of a branch, and where it is: ω, z and y of a `Motion`.

    Parameters
    ----------
    branch : Branch
        The branch.
    index : int
        Index of a point on the branch.
    times : int
        Largest number of its periods that a motion may last.
    """
    harmonics = times * (branch.acceleration.shape[-1] - 1)
    levels = list(branch.level[index])
    periods = times * branch.periods
    system = condensed(branch.model, branch.kind, levels, harmonics, branch.n_modes, periods)
    x = np.concatenate((branch.clearance_displacement[index], branch.end_displacement[index]))
    spread = np.zeros((len(x), 2 * harmonics + 1))
    spread[:, 0] = x[:, 0].real
    spread[:, 2 * times - 1 :: 2 * times], spread[:, 2 * times :: 2 * times] = x[:, 1:].real, -x[:, 1:].imag
    z = system.linear.basis.T @ spread
    omega = 2 * np.pi * branch.frequency[index] / periods
    return Solver(system, harmonics, times * branch.n_samples), omega, z, spread - system.linear.basis @ z


def farthest(found: Callable[[int], Branch], samples: Sequence[int]) -> Branch:
    """Return the branch with the fewest samples with which it does not end early, else the one that goes farthest.

    Raises
    ------
    ClearanceError
        If not even the first motion was found with any of them.
    """
    branches: list[Branch] = []
    for count in samples:
        try:
            branches.append(found(count))
        except ClearanceError:
            if not branches and count == samples[-1]:
                raise
            continue
        if not branches[-1].ended:
            return branches[-1]
    return max(branches, key=lambda branch: float(np.ptp(branch.parameter[[0, -1]])))


@functools.singledispatch
def place(solver: Any, parameter: float) -> str:
    """Return where a solver's parameter is in words, such as frequency and level."""
    system = solver.system
    omega, share = (parameter, 1.0) if solver.at is None else (solver.at, parameter)
    unit = "m/s²" if system.kind == "base" else "N"
    level = share * abs(strongest(system.linear.excitation))
    return f"{omega * system.periods / (2 * np.pi):.6g} Hz and level {level:g} {unit}"


def strongest(excitation: np.ndarray) -> complex:
    """The first amplitude that is not zero."""
    return complex(excitation[np.flatnonzero(excitation)[0]])


@functools.singledispatch
def expanded(solver: Any, points: list[Located], ended: str) -> Branch:
    """Expand motions at the clearances to everything that a branch knows."""
    system = solver.system
    linear, motions = system.linear, [point.motion for point in points]
    omega = np.array([solver.frequency(motion) for motion in motions])
    excitation = np.outer([solver.share(motion) for motion in motions], linear.excitation)
    x = complex_amplitudes(np.array([linear.basis @ motion.z + motion.y for motion in motions]))
    force = complex_amplitudes(np.array([motion.force for motion in motions]))
    highest = int(np.flatnonzero(linear.excitation)[-1])
    level = excitation[:, system.periods : highest + 1 : system.periods]
    modes = system.modes_of(omega, excitation, force)
    over = "frequency" if solver.at is None else "level"
    return branch_of(
        solver, system.in_gap, points, ended, omega, excitation, level, modes, force, x, over, system.periods
    )


def branch_of(
    solver: Any, model: LinearModel, points: list[Located], ended: str, omega: np.ndarray, excitation: np.ndarray,
    level: np.ndarray, modes: np.ndarray, force: np.ndarray, x: np.ndarray, over: str, periods: int = 1,
    spin: np.ndarray | None = None,
) -> Branch:  # fmt: skip
    """Return the branch of motions of frequencies (n,), 1/s, whose complex amplitudes (n, ..., H + 1) are given.

    Those of the excitation, of the modes, and of forces and displacements of the points, N and m. ``level`` are the
    excitation's own harmonics (n, n_levels).
    """
    system, rig = solver.system, solver.system.rig
    d = rig.n_coordinates
    count, turning = d * len(rig.bushings), 1j * np.arange(modes.shape[2]) * omega[:, None, None]
    acceleration = np.einsum("sm,nmh->nsh", model.at_sensors, modes) * turning**2 * accelerated(rig)[:, None]
    if system.kind == "base":
        acceleration += model.sensors_on_base[:, None] * excitation[:, None]
    along = np.array([sensor.unit_direction for sensor in rig.sensors]).reshape(-1, 3)
    at = model.directed(sensor_points(rig), along)
    ends = force[:, count:].reshape(len(omega), -1, 2, d, modes.shape[2]).sum(axis=2)
    spring, damper = (np.repeat(each, d)[:, None] for each in (system.laws.spring, system.laws.damper))
    held = force[:, :count] + (spring + damper * turning) * x[:, :count]
    at_folds = of_folds(np.array([point.motion.omega for point in points]), [point.kind for point in points])
    frequency = periods * omega / (2 * np.pi)
    special = tuple(
        SpecialPoint(point.kind, float(frequency[i]), abs(strongest(level[i])) if level[i].any() else 0.0, i)
        for i, point in enumerate(points)
        if point.kind and i not in at_folds
    )
    known = [point.multipliers for point in points if point.multipliers is not None]
    return Branch(
        system.model, system.kind, over, periods, system.modes, solver.samples, frequency, level, acceleration,
        np.einsum("sm,nmh->nsh", at, modes), x[:, :count], x[:, count:], ends.reshape(len(omega), count, -1), held,
        np.array(known) if known else None, special, ended, tuple(rig.sensor_labels),
        tuple(rig.probe_labels if d == 2 else rig.clearance_labels), spin,
    )  # fmt: skip


def of_folds(omega: np.ndarray, kinds: list[str]) -> set[int]:
    """Which changes of stability are those of folds, whose multiplier passes 1 there but for rounding of both."""
    found: set[int] = set()
    for fold in (i for i, kind in enumerate(kinds) if kind == FOLD):
        near = [
            i for i, kind in enumerate(kinds)
            if kind == BRANCH_POINT and i not in found and abs(omega[i] / omega[fold] - 1) < SAME_FOLD
        ]  # fmt: skip
        found.update(sorted(near, key=lambda i: abs(i - fold))[:1])
    return found
