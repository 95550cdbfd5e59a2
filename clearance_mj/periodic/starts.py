"""The first motion of a branch over frequency, by several methods in turn until one leads on.

From rest over the level; with fewer harmonics, whose motion is the guess for more; over the level at a nearby
frequency, then along frequency; and by the modal engine's time integration from rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

import numpy as np

from ..clearance.law import TimeLaw
from ..core.errors import RigError, SimulationError
from ..engines.modal import Modal, ModalRun
from ..rig.spinning import Spin
from .condensed import UNBALANCE, Condensed
from .continuation import NoConvergence, PeriodicMotion
from .solver import Solver

__all__ = ["Start", "marched"]

LEADS_ON, BEGINNING = 0.1, 100
"""Fraction of the range, or number of motions, after which a branch leads on: one that ends sooner begins anew."""
FARTHER = 2.0  # a branch that reaches so many times as far is preferred to an earlier one, if none leads on
MOST = 500  # motions over the level within which another method must converge
NEXT_FREQUENCY = 1e-5  # relative distance of a frequency that replaces the first one, as at an undamped resonance
NEARBY = (NEXT_FREQUENCY, 1e-2, -1e-2, 2e-2, 5e-2, -5e-2)  # relative distances of frequencies to begin at
REPEATS = 1e-5  # relative difference below which two states are equal
MIN_PERIODS, MAX_PERIODS, MAX_STEPS = 20, 400, 2_000_000  # until a march must repeat


@dataclass(frozen=True)
class Start:
    """The first motion of a branch from one frequency to another, 1/s."""

    solver: Solver
    start: float
    stop: float
    with_harmonics: Callable[[int], Solver]  #: returns the same solver with so many harmonics

    def motions(self) -> Iterator[PeriodicMotion]:
        """Yield the first branch that leads on or leaves the range elsewhere; else the one that reaches farthest.

        Raises
        ------
        NoConvergence
            Where it ends; the motions yielded before stay valid.
        """
        best: tuple[list[PeriodicMotion], NoConvergence | None, Iterator[PeriodicMotion]] = [], None, iter(())
        for branch in self._branches():
            head, error = self._take_head(branch)
            if head and not error and not math.isclose(head[-1].parameter, self.start, rel_tol=2 * NEXT_FREQUENCY):
                best = head, None, branch
                break
            if not best[0] or self._reach(head) > FARTHER * self._reach(best[0]):
                best = head, error, branch
        head, error, branch = best
        yield from head
        if error:
            raise error
        yield from branch

    def _take_head(self, branch: Iterator[PeriodicMotion]) -> tuple[list[PeriodicMotion], NoConvergence | None]:
        """Return a branch's motions until it leads on, and the error that ended them if one did."""
        head: list[PeriodicMotion] = []
        try:
            for motion in branch:
                head.append(motion)
                if len(head) == BEGINNING or self._reach(head[-1:]) > LEADS_ON * abs(self.stop - self.start):
                    break
        except NoConvergence as end:
            return head, end
        return head, None

    def _reach(self, motions: Sequence[PeriodicMotion]) -> float:
        return max((abs(motion.parameter - self.start) for motion in motions), default=0.0)

    def _branches(self) -> Iterator[Iterator[PeriodicMotion]]:
        """Yield the branch from each method's first motion in turn; it raises NoConvergence where there is none."""
        yield self._onwards(partial(self.solver.first, self.start))
        yield self._onwards(self._solve_fewer_harmonics)
        yield from map(self._follow_from_nearby, NEARBY)
        yield self._onwards(self._solve_after_march)

    @property
    def _ends(self) -> tuple[float, float]:
        return min(self.start, self.stop), max(self.start, self.stop)

    def _onwards(self, first: Callable[[], PeriodicMotion]) -> Iterator[PeriodicMotion]:
        yield from self.solver.within(first(), *self._ends, self.stop > self.start)

    def _solve_fewer_harmonics(self) -> PeriodicMotion:
        """Return the motion that grows out of rest with the fewest harmonics, refined with ever more."""
        fewest, most = self.solver.system.levels.size, self.solver.harmonics
        motion: PeriodicMotion | None = None
        for count in (2**i - 1 for i in range(1, most.bit_length() + 1)):  # 1, 3, 7, ...
            if fewest <= count < most:
                solver = self.with_harmonics(count)
                with suppress(NoConvergence):
                    motion = _refine(solver, motion, self.start) if motion else solver.first(self.start, MOST)
        if motion is None:
            raise NoConvergence(self.start)
        return _refine(self.solver, motion, self.start)

    def _follow_from_nearby(self, distance: float) -> Iterator[PeriodicMotion]:
        """Yield a branch that grows out of rest at a nearby frequency, from the first frequency on."""
        solver, (low, high), up = self.solver, self._ends, self.stop > self.start
        near = self.start * (1 + (distance if up else -distance))
        if not (near < high if up else near > low):
            raise NoConvergence(self.start)
        motion = solver.first(near, MOST)
        if distance == NEXT_FREQUENCY:
            yield from solver.within(motion, low, high, up)
            return
        to_start = list(solver.within(motion, min(near, self.start), max(near, self.start), near < self.start, MOST))
        if not math.isclose(to_start[-1].parameter, self.start, rel_tol=1e-9):
            raise NoConvergence(self.start)
        if distance < 0:
            yield from solver.onwards(to_start[-1], low, high)
            return
        yield from (replace(each, tangent=-each.tangent) for each in reversed(to_start[1:]))
        yield from solver.within(motion, low, high, up)

    def _solve_after_march(self) -> PeriodicMotion:
        """Return the motion to which the modal engine's time integration from rest converges."""
        solver = self.solver
        try:
            place = marched(solver.system, self.start, solver.samples)
        except (RigError, SimulationError):  # gears take no base, nor rotating excitations alone
            raise NoConvergence(self.start) from None
        z, y = solver.system.split(place @ solver.grid.project.T)
        return solver.solved_at(self.start, z, y, solver.scale_of(z))


def marched(system: Condensed, omega: float, samples: int) -> np.ndarray:
    """Return the last period of a march from rest, (n_rows, samples) displacements of the clearances' points, m.

    It ends once the motion repeats, or after some hundred periods.

    Parameters
    ----------
    system : Condensed
        The rig, its law and the excitation.
    omega : float
        Frequency of the motion's first harmonic, 1/s.
    samples : int
        Number of samples of a period.

    Raises
    ------
    NoConvergence
        If it takes too many steps, as for a shaft of almost no mass.
    SimulationError
        If it diverges.
    """
    rig, kind, law, amplitudes = system.rig, system.kind, system.model.law, system.levels
    if kind == UNBALANCE:
        level = abs(amplitudes[0])
        unbalances = tuple(replace(each, moment=each.moment * level) for each in rig.unbalances)
        orders = tuple(
            replace(each, force=each.force and each.force * level, torque=each.torque and each.torque * level)
            for each in rig.orders
        )
        if isinstance(law, TimeLaw):  # in step with what turns
            stretch = 2 * np.pi / (omega * system.laws.span)
            law = replace(law, t=law.t * stretch, period=stretch * (law.period or 0.0))
        rig = rig.replace(spin=Spin(omega / system.order), unbalances=unbalances, orders=orders)
        kind, amplitudes = "spin", 0 * amplitudes
    engine, period = Modal(modes=system.modes), 2 * np.pi / omega
    finer = math.ceil(period / samples / engine.largest_step(rig, law))
    run = cast(ModalRun, engine.start(rig, law, kind, period / samples / finer))
    at_points = system.driven.points
    if MIN_PERIODS * samples * finer > MAX_STEPS:
        raise NoConvergence(omega)
    angle = 2 * np.pi * np.arange(samples * finer) / (samples * finer)
    turning = np.exp(1j * np.outer(np.arange(1, amplitudes.size + 1), angle))
    drive = np.ascontiguousarray((amplitudes @ turning).real)
    before = np.full(2 * len(run.motion.q), np.nan)
    for _ in range(min(MAX_STEPS // drive.size, MAX_PERIODS)):
        run.advance(drive)
        state = np.concatenate((run.motion.q * omega, run.motion.v))
        if np.linalg.norm(state - before) < REPEATS * np.linalg.norm(state):
            break
        before = state
    place = np.empty((len(at_points), samples))
    for i, part in enumerate(drive.reshape(samples, finer)):
        place[:, i] = at_points @ run.motion.q
        run.advance(part)
    return place


def _refine(solver: Solver, motion: PeriodicMotion, omega: float) -> PeriodicMotion:
    """Return a solver's motion near one with fewer harmonics."""
    more = (0, 0), (0, 2 * solver.harmonics + 1 - motion.z.shape[1])
    return solver.solved_at(omega, np.pad(motion.z, more), np.pad(motion.y, more), motion.scale)
