"""A `Branch` of a sequence of motions: special points located, responses of sensors and clearances expanded."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError
from ..rig.sensing import acceleration_mask, sensor_points
from .axes import SHARES, level_axis
from .branch import Branch, SpecialPoint
from .condensed import UNBALANCE, condensed
from .continuation import AT_ONCE, EndOfBranch, NoConvergence, PeriodicMotion, until_closed
from .solver import Solver
from .stability import BRANCH_POINT, FIRST_CONTACT, TestedPoint, changes, multipliers, with_fold
from .vibrations import complex_amplitudes

__all__ = ["expanded", "farthest", "follow", "of_folds", "place", "resumed", "solver_of", "strongest", "watched"]

WORDS = {"gap": ", gaps {0.gap:.6g} times those of the rig", "load": ", loads {0.load:.6g} times those of the rig",
         "spin": " and a speed of {0.spin:.6g} rad/s"}  # fmt: skip
"""Phrases for the parameters other than frequency and level."""
ENDLESS, STANDS_STILL = 1e4, 1e-5  # growth over the first vibration; change of the parameter in `AT_ONCE` points
SAME_FOLD = 1e-3  # relative distance in frequency of a fold from where its multiplier passes 1


def follow(
    solver: Any, motions: Iterator[PeriodicMotion], stability: bool, progress: bool = False,
    touching: Collection[PeriodicMotion] = (),
) -> Branch:  # fmt: skip
    """Return the branch of consecutive motions, with its special points.

    ``touching`` are the motions at which contact begins; the iterator fills them in.

    Raises
    ------
    ClearanceError
        If not even the first motion converges.
    """
    points: list[TestedPoint] = []
    ended, recent = "", 0
    try:
        closing = until_closed(solver, bounded(solver, motions))
        for motion in tqdm(closing, desc="branch", unit="point", disable=not progress):
            kind = FIRST_CONTACT if motion in touching else ""
            point = TestedPoint(motion, multipliers(solver, motion) if stability else None, kind)
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
                "or with other numbers of harmonics and more samples"
            ) from None
        ended = f"no further periodic vibration was found beyond {at}"
    except EndOfBranch as end:
        ended = str(end)
    return expanded(solver, points, ended)


def bounded(solver: Any, motions: Iterator[PeriodicMotion]) -> Iterator[PeriodicMotion]:
    """Yield motions until they grow without end at one value of the parameter.

    Raises
    ------
    EndOfBranch
        Then: nothing damps a resonance there.
    """
    last: deque[float] = deque(maxlen=AT_ONCE)
    first = 0.0
    for motion in motions:
        yield motion
        first = first or motion.scale
        stands_still = len(last) == AT_ONCE and abs(motion.parameter / last[0] - 1) < STANDS_STILL
        if stands_still and motion.scale > ENDLESS * first:
            raise EndOfBranch(f"its vibration grows without bound towards {place(solver, motion.parameter)}")
        last.append(motion.parameter)


def watched(
    motions: Iterator[PeriodicMotion], watch: Callable[[float], None] | None, unit: float = 2 * np.pi
) -> Iterator[PeriodicMotion]:
    """Yield the motions and report their parameters over ``unit`` to ``watch``: by default frequencies in Hz."""
    for motion in motions:
        if watch is not None:
            watch(motion.parameter / unit)
        yield motion


def resumed(branch: Branch, index: int, times: int = 1) -> tuple[Solver, float, np.ndarray, np.ndarray]:
    """Return a solver over the frequency near a point of a branch, and the point: ω, z, y of a `PeriodicMotion`.

    Parameters
    ----------
    branch : Branch
        The branch.
    index : int
        Index of a point on the branch.
    times : int
        Largest number of the branch's periods in one period of a motion.
    """
    harmonics = times * (branch.acceleration.shape[-1] - 1)
    solver = solver_of(branch, list(branch.level[index]), harmonics, times * branch.periods, times * branch.n_samples)
    system = solver.system
    omega = 2 * np.pi * branch.frequency[index] * (system.order or 1.0) / system.periods
    if branch.over != "frequency":
        parameter = float(branch.parameter[index])
        solver.take("omega", solver.at._replace(**{branch.over: 1.0 if branch.over == "level" else parameter}))
        solver.raise_over(branch.over, omega)
    x = np.concatenate((branch.clearance_displacement[index], branch.end_displacement[index]))
    spread = np.zeros((len(system.basis), 2 * harmonics + 1))
    known = spread[: len(x)]  # displacements along slots follow
    known[:, 0], known[:, 2 * times - 1 :: 2 * times] = x[:, 0].real, x[:, 1:].real
    known[:, 2 * times :: 2 * times] = -x[:, 1:].imag
    return solver, omega, *system.split(spread)


def solver_of(branch: Branch, levels: Sequence[complex], harmonics: int, periods: int, samples: int) -> Solver:
    """Return a solver for motions of a branch's model under its excitation at levels of its harmonics."""
    spin = 0.0 if branch.spin is None else float(np.abs(branch.spin).max())
    system = condensed(branch.model, branch.kind, levels, harmonics, branch.n_modes, periods, spin)
    return Solver(system, harmonics, samples, 0.0 if system.order else spin)


def farthest(follow_with: Callable[[int], Branch], samples: Sequence[int]) -> Branch:
    """Return the branch with the fewest samples with which it does not end early, else the one that goes farthest.

    Raises
    ------
    ClearanceError
        If not even the first motion converges with any of them.
    """
    branches: list[Branch] = []
    for count in samples:
        try:
            branches.append(follow_with(count))
        except ClearanceError:
            if not branches and count == samples[-1]:
                raise
            continue
        if not branches[-1].ended:
            return branches[-1]
    return max(branches, key=lambda branch: float(np.ptp(branch.parameter[[0, -1]])))


def place(solver: Any, parameter: float) -> str:
    """Return a phrase for a solver's parameter, such as frequency and level."""
    system, at = solver.system, solver.state(parameter)
    if system.kind in (UNBALANCE, "whirl"):
        return f"a speed of {at.spin:.6g} rad/s{WORDS.get(solver.over, '').format(at)}"
    unit = level_axis(system.kind).unit
    return (
        f"{at.omega * system.periods / (2 * np.pi):.6g} Hz and level "
        f"{at.level * abs(strongest(system.levels)):g} {unit}{WORDS.get(solver.over, '').format(at)}"
    )


def strongest(levels: np.ndarray) -> complex:
    """Return the first amplitude that is not zero."""
    return complex(levels[np.flatnonzero(levels)[0]])


def expanded(solver: Any, points: list[TestedPoint], ended: str) -> Branch:
    """Expand motions at the clearances to the quantities of a branch."""
    system, motions = solver.system, [point.motion for point in points]
    driven, rig, d = system.driven, system.rig, system.rig.bushing_of_row.size
    states = [solver.state(motion.parameter) for motion in motions]
    omega = np.array([solver.frequency(motion) for motion in motions])
    spin, factors = np.array([at.spin for at in states]), np.array([at.level for at in states])
    x = complex_amplitudes(np.array([solver.all_points(motion) for motion in motions]))
    force = complex_amplitudes(np.array([motion.force for motion in motions]))
    modes = np.empty((len(points), driven.model.size, x.shape[-1]), dtype=complex)
    for i, at in enumerate(states):
        on_modes = driven.force(at.spin, at.load, at.level) - force[i].T @ driven.points
        modes[i] = driven.modes(omega[i], at.spin, on_modes).T
    levels = system.levels if system.levels.size else np.zeros(1)
    level, excitation = np.outer(factors, levels), np.zeros((len(points), x.shape[-1]), dtype=complex)
    excitation[:, system.periods : system.periods * levels.size + 1 : system.periods] = level
    i_omega, model = 1j * np.arange(x.shape[2]) * omega[:, None, None], driven.model
    acceleration = np.einsum("sm,nmh->nsh", model.at_sensors, modes) * i_omega**2 * acceleration_mask(rig)[:, None]
    if system.kind == "base":
        acceleration += model.sensors_on_base[:, None] * excitation[:, None]
    directions = np.array([sensor.unit_direction for sensor in rig.sensors]).reshape(-1, 3)
    at_sensors = model.directed(sensor_points(rig), directions)
    first, second = d + rig.end_rows.T
    at_folds = of_folds(points)
    frequency = omega * system.periods / (system.order or 1.0) / (2 * np.pi)
    special = tuple(
        SpecialPoint(kind, float(frequency[i]), abs(strongest(level[i])) if level[i].any() else 0.0, i)
        for i, point in enumerate(points)
        for kind in point.kinds
        if i not in at_folds
    )
    known = [point.multipliers for point in points if point.multipliers is not None]
    return Branch(
        system.model, system.kind, solver.over_name, system.periods, system.modes, solver.samples, frequency, level,
        acceleration, np.einsum("sm,nmh->nsh", at_sensors, modes), x[:, :d], x[:, d : 3 * d],
        force[:, first] + force[:, second], system.fillings(omega, x, force),
        np.array(known) if known else None, special, ended, tuple(rig.sensor_labels),
        tuple(rig.probe_labels if rig.moves_across else rig.clearance_labels), spin if rig.moves_across else None,
        np.array([getattr(at, solver.over) for at in states]) if solver.over in SHARES else None,
    )  # fmt: skip


def of_folds(points: list[TestedPoint]) -> set[int]:
    """Return the indices of changes of stability that belong to folds, where the multiplier passes 1 up to rounding."""
    omega, at_folds = [point.motion.parameter for point in points], set[int]()
    for fold in (i for i, point in enumerate(points) if point.folds):
        near = [
            i for i, point in enumerate(points)
            if point.kind == BRANCH_POINT and i not in at_folds and abs(omega[i] / omega[fold] - 1) < SAME_FOLD
        ]  # fmt: skip
        at_folds.update(sorted(near, key=lambda i: abs(i - fold))[:1])
    return at_folds
