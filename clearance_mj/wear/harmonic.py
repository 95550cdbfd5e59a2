"""Rubbing of periodic vibrations in the plane under a sine, by harmonic balance, from gap to gap on one branch.

A vibration at new gaps is continued from the one before along the straight line between both, in pieces over which the
motion changes little, so that it stays on the branch. Where that fails for the shortest piece, or where the vibration
has become unstable, the branch has ended: the machine then jumps, and the next vibration is computed by marching in
time from there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import ExcitationError
from ..engines.base import step_factor
from ..engines.modal import Modal
from ..model import Model
from ..periodic.condensed import condensed
from ..periodic.continuation import NoConvergence, PeriodicMotion
from ..periodic.excitation import excitation_kind
from ..periodic.forces import Sampled, fill_forces
from ..periodic.resolution import resolution
from ..periodic.solver import Solver
from ..periodic.stability import multipliers, samples_of_period, unstable
from ..periodic.vibrations import complex_amplitudes
from ..signals.excitation import stepped_sine
from .growth import clearances_of, with_clearances
from .marched import Marched, MarchedSource, Marching, ModalState, mean_rubbing
from .operation import Operation, Source, Vibration
from .rubbing import footprints, in_space, rubbing

__all__ = ["Sine"]

LONGEST, SHORTEST = 0.02, 1e-5  # pieces of the continuation, by the largest relative change of a gap
NEAR = 0.3  # largest change of the motion in a piece, over its size
PERIODS = 300  # of the excitation, marched after a jump until the vibration is steady
SWEPT = 600  # periods of a sweep
ROUNDS = 10  # largest number of such marches, until it is periodic
COUNTED = 32  # further periods, over which rubbing is averaged
SAMPLES, LEAST_RATE = 32, 2000.0  # per period, and least per second, of an excitation in space


@dataclass(frozen=True)
class Sine(Operation):
    """A machine under a sine: in the plane by harmonic balance, in space marched in time."""

    frequency: float
    """Hz"""
    amplitude: float
    """m/s² of the base or N of the shaker"""
    kind: str | None = None
    """ "base" or "force"; None: as the rig's shaker"""
    swept_from: float | None = None
    """Hz, start of a slow sweep to the frequency before the wear begins, in the plane; None: it begins with the
    vibration that grows out of rest with the amplitude"""
    n_harmonics: int = 21
    """of the motion"""
    n_samples: int | None = None
    """of a period; None: the power of two from 12 for each harmonic on"""
    n_modes: int = 8
    """of the Ritz basis"""

    def __post_init__(self) -> None:
        ExcitationError.require_positive(" Hz", frequency=self.frequency, swept_from=self.swept_from)
        ExcitationError.require_positive(" m/s² or N", amplitude=self.amplitude)
        if self.kind not in (None, "base", "force"):
            raise ExcitationError(f'kind must be "base" or "force", got {self.kind!r}')

    def source(self, model: Model) -> Source:
        """Return the source of a model's vibrations; see `Operation.source`."""
        footprints(model.rig)
        if model.rig.moves_across:
            return MarchedSource(self.in_time(model), model)
        return SineSource(self, model)

    def in_time(self, model: Model) -> Marched:
        """Return the same operation given in time.

        Parameters
        ----------
        model : Model
            Model with the shaker.
        """
        fs, kind = max(SAMPLES * self.frequency, LEAST_RATE), excitation_kind(model.rig, self.kind)
        excitation = stepped_sine((PERIODS + COUNTED) / self.frequency, fs, self.frequency, self.amplitude, kind)
        return Marched(excitation, PERIODS / self.frequency, Modal(modes=self.n_modes))

    def to_dict(self) -> dict[str, Any]:
        """Return the operation as plain data."""
        return {"operation": "sine", **vars(self)}


class _Periodic(NamedTuple):
    """A periodic vibration, from which the next one is continued."""

    solver: Solver
    motion: PeriodicMotion

    @property
    def x(self) -> np.ndarray:
        """(n_points, K) harmonics of the clearances' points, m."""
        return self.solver.all_points(self.motion)


class SineSource(Source):
    """Periodic vibrations of a planar model under a sine."""

    def __init__(self, operation: Sine, model: Model):
        self.operation = operation
        self.kind = excitation_kind(model.rig, operation.kind)
        self.harmonics, self.counts = resolution(operation.n_harmonics, operation.n_samples, 1, operation.n_modes)
        self.omega = 2 * np.pi * operation.frequency
        self._solver(model)  # raises an error for laws and rigs without periodic vibrations

    def _solver(self, model: Model) -> Solver:
        levels = [complex(self.operation.amplitude)]
        system = condensed(model, self.kind, levels, self.harmonics, self.operation.n_modes)
        return Solver(system, self.harmonics, self.counts[-1])

    def first(self, model: Model) -> Vibration:
        """Return the vibration that grows out of rest with the level; the one it settles on where that is unstable.

        With ``swept_from`` the vibration at the end of the sweep.
        """
        if self.operation.swept_from is not None:
            return self._settle(model, self._sweep(model, self.operation.swept_from))
        solver = self._solver(model)
        try:
            periodic = _Periodic(solver, solver.first(self.omega))
        except NoConvergence:
            return self._settle(model, None)
        if _is_unstable(periodic):
            return self._settle(model, _modal_state(periodic))
        return _with_rubbing(periodic)

    def follow(self, before: Vibration, at: Model, to: Model) -> Vibration | None:
        """Return the vibration at other gaps on the branch of one before; see `Source.follow`."""
        if not isinstance(before.state, _Periodic):
            return self._settle(to, before.state, 1)
        start, stop = clearances_of(at.rig), clearances_of(to.rig)
        length = float(np.max(np.abs(stop - start) / start[:, :1]))
        current, fraction = before.state, 0.0
        piece = 1.0 if length <= LONGEST else LONGEST / length
        while fraction < 1.0:
            target = min(1.0, fraction + piece)
            model = to if target == 1.0 else with_clearances(at, start + target * (stop - start))
            if (periodic := self._solve_near(current.x, model)) is None:
                piece /= 2
                if piece * length < SHORTEST:
                    return None
                continue
            current, fraction, piece = periodic, target, min(2 * piece, LONGEST / max(length, LONGEST))
        return None if _is_unstable(current) else _with_rubbing(current)

    def _solve_near(self, x: np.ndarray, model: Model) -> _Periodic | None:
        """Solve for a model's vibration near another one, whose points have harmonics x (n_points, K)."""
        solver = self._solver(model)
        basis = solver.system.basis
        z = basis.T @ x
        row, scale = np.append(np.zeros(solver.size), 1.0), max(float(np.linalg.norm(z)), solver.least)
        if (motion := solver.solve(self.omega, z, x - basis @ z, row, scale)) is None:
            return None
        periodic = _Periodic(solver, motion)
        return periodic if np.linalg.norm(periodic.x - x) <= NEAR * np.linalg.norm(x) else None

    def leap(self, before: Vibration, model: Model) -> Vibration:
        """Return the vibration to which the last one of a branch falls; see `Source.leap`."""
        state = before.state
        return self._settle(model, _modal_state(state) if isinstance(state, _Periodic) else state)

    def _sweep(self, model: Model, start: float) -> ModalState:
        """Return the state after a linear sweep of the frequency, in Hz, at the begin of a period."""
        stop, engine = self.operation.frequency, Modal(modes=self.operation.n_modes)
        duration = SWEPT / ((start + stop) / 2)
        fs = self.counts[-1] * max(start, stop)
        factor = step_factor(fs, engine.largest_step(model.rig, model.law))
        count = int(np.ceil(duration * fs * factor / SWEPT)) * SWEPT
        march = Marching(model, engine, self.kind, duration / count, None)
        for times in np.array_split(duration / count * np.arange(count), SWEPT):
            phase = 2 * np.pi * (start * times + (stop - start) * times**2 / (2 * duration))
            march.advance(self.operation.amplitude * np.cos(phase))
        return march.state

    def _settle(self, model: Model, state: ModalState | None, rounds: int = ROUNDS) -> Vibration:
        """March many periods to the steady vibration: periodic if it is and is stable, or else as marched."""
        samples, engine = self.counts[-1], Modal(modes=self.operation.n_modes)
        fs = samples * self.operation.frequency
        factor = step_factor(fs, engine.largest_step(model.rig, model.law))
        march = Marching(model, engine, self.kind, 1 / (fs * factor), state)
        steps = samples * factor
        period = self.operation.amplitude * np.cos(2 * np.pi * np.arange(steps) / steps)
        for _ in range(rounds):  # past the end of a branch a vibration lingers near it
            for _ in range(PERIODS):
                march.advance(period)
            counted = [march.advance(period) for _ in range(COUNTED)]
            periodic = self._solve_near(counted[-1].points[::factor].T @ self._solver(model).grid.project.T, model)
            if periodic and not _is_unstable(periodic):
                return _with_rubbing(periodic)
        return mean_rubbing([piece.rubbing for piece in counted], march.state)


def _is_unstable(periodic: _Periodic) -> bool:
    return unstable(multipliers(periodic.solver, periodic.motion)) > 0


def _with_rubbing(periodic: _Periodic) -> Vibration:
    """Compute the rubbing over a period, sampled as finely as its contacts need."""
    solver, omega, count = periodic.solver, periodic.motion.parameter, len(periodic.solver.system.rig.bushings)
    fine = Solver(solver.system, solver.harmonics, samples_of_period(solver, omega))
    basis, rate, project = fine.grid[:3]
    motion = Sampled(periodic.x @ basis.T, omega * (periodic.x @ rate.T), omega, 0.0)
    force = np.empty_like(motion.place)
    fill_forces(solver.laws, motion, basis, rate, project, False, force, fine.slopes)
    rig, ends, speed = solver.system.rig, motion.place[count:], motion.speed
    offsets = np.repeat([bushing.offset for bushing in rig.bushings], 2)[:, None]
    normal = np.where(ends + offsets > 0, 1.0, -1.0) * force[count:]
    power = rubbing(rig, in_space(rig, ends), in_space(rig, speed[count:]), normal)
    return Vibration(power, np.zeros(count), periodic, "periodic")


def _modal_state(periodic: _Periodic) -> ModalState:
    """Return modal coordinates at the beginning of a period, from the modal response to excitation and forces."""
    driven, omega = periodic.solver.system.driven, periodic.motion.parameter
    (force,) = complex_amplitudes(periodic.motion.force[None])
    modes = driven.modes(omega, 0.0, driven.force(0.0, 1.0, 1.0) - force.T @ driven.points).T
    i_omega = 1j * omega * np.arange(modes.shape[1])
    q, v = modes.real.sum(axis=1), (modes * i_omega).real.sum(axis=1)
    return ModalState(q, v, q.copy(), np.empty(0))
