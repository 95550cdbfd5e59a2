"""Rubbing of periodic vibrations in the plane under a sine, by harmonic balance, from gap to gap on one branch.

A vibration at new gaps is sought from the one before on the straight way between both, in pieces over which the motion
changes little, so that no other branch is taken for it. Where none is found, however short the piece, or where it has
become unstable, the branch has ended: the machine then jumps, and where to is found by marching in time from there.
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
from ..periodic.continuation import Motion, NoConvergence
from ..periodic.excitation import excitation_kind
from ..periodic.forces import Sampled, fill_forces
from ..periodic.resolution import resolution
from ..periodic.solver import Solver
from ..periodic.stability import multipliers, samples_of_period, unstable
from ..periodic.vibrations import complex_amplitudes
from ..signals.excitation import stepped_sine
from .growth import clearances_of, with_clearances
from .marched import Marched, MarchedSource, Marching, ModalState, averaged
from .operation import Operation, Source, Vibration
from .rubbing import footprints, in_space, rubbing

__all__ = ["Sine"]

LONGEST, SHORTEST = 0.02, 1e-5  # pieces of the way, by the largest relative change of a gap
NEAR = 0.3  # largest change of the motion in a piece, over its size
PERIODS = 300  # of the excitation that are marched after a jump, until the vibration is steady
SWEPT = 600  # periods of a sweep
ROUNDS = 10  # of as many at most, until it is periodic
COUNTED = 32  # of them after that, over which rubbing is averaged
SAMPLES, LEAST_RATE = 32, 2000.0  # of a period, and in a second, of an excitation in space


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
    """Hz, from which the frequency is swept slowly to its value before the wear begins, in the plane; None: it begins
    with the vibration that grows out of rest with the amplitude"""
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
        """Return what finds the vibrations of a model; see `Operation.source`."""
        footprints(model.rig)
        if model.rig.moves_across:
            return MarchedSource(self.in_time(model), model)
        return SineSource(self, model)

    def in_time(self, model: Model) -> Marched:
        """Return the same operation given in time.

        Parameters
        ----------
        model : Model
            Whose shaker it is.
        """
        fs, kind = max(SAMPLES * self.frequency, LEAST_RATE), excitation_kind(model.rig, self.kind)
        duration = (PERIODS + COUNTED) / self.frequency
        made = stepped_sine(duration, fs, self.frequency, self.amplitude, kind)
        return Marched(made, PERIODS / self.frequency, Modal(modes=self.n_modes))

    def to_dict(self) -> dict[str, Any]:
        """Return how the machine runs as plain data."""
        return {"operation": "sine", **vars(self)}


class _Periodic(NamedTuple):
    """A periodic vibration, as the next one needs it."""

    solver: Solver
    motion: Motion

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
        self._solver(model)  # refuses laws and rigs of which no periodic vibration is known

    def _solver(self, model: Model) -> Solver:
        levels = [complex(self.operation.amplitude)]
        system = condensed(model, self.kind, levels, self.harmonics, self.operation.n_modes)
        return Solver(system, self.harmonics, self.counts[-1])

    def first(self, model: Model) -> Vibration:
        """Return the vibration that grows out of rest with the level; the one it settles on where that is unstable.

        Or the one that a sweep of the frequency leads to.
        """
        if self.operation.swept_from is not None:
            return self._settled(model, self._swept(model, self.operation.swept_from))
        solver = self._solver(model)
        try:
            found = _Periodic(solver, solver.first(self.omega))
        except NoConvergence:
            return self._settled(model, None)
        if _is_unstable(found):
            return self._settled(model, _modal_state(found))
        return _vibration(found)

    def follow(self, before: Vibration, at: Model, to: Model) -> Vibration | None:
        """Return the vibration at other gaps on the branch of one before; see `Source.follow`."""
        if not isinstance(before.state, _Periodic):
            return self._settled(to, before.state, 1)
        start, stop = clearances_of(at.rig), clearances_of(to.rig)
        length = float(np.max(np.abs(stop - start) / start[:, :1]))
        now, share = before.state, 0.0
        piece = 1.0 if length <= LONGEST else LONGEST / length
        while share < 1.0:
            ahead = min(1.0, share + piece)
            model = to if ahead == 1.0 else with_clearances(at, start + ahead * (stop - start))
            if (found := self._near(now.x, model)) is None:
                piece /= 2
                if piece * length < SHORTEST:
                    return None
                continue
            now, share, piece = found, ahead, min(2 * piece, LONGEST / max(length, LONGEST))
        return None if _is_unstable(now) else _vibration(now)

    def _near(self, x: np.ndarray, model: Model) -> _Periodic | None:
        """The vibration of a model near another one, whose points have harmonics x (n_points, K)."""
        solver = self._solver(model)
        basis = solver.system.basis
        z = basis.T @ x
        row, scale = np.append(np.zeros(solver.size), 1.0), max(float(np.linalg.norm(z)), solver.least)
        if (motion := solver.solve(self.omega, z, x - basis @ z, row, scale)) is None:
            return None
        found = _Periodic(solver, motion)
        return found if np.linalg.norm(found.x - x) <= NEAR * np.linalg.norm(x) else None

    def leap(self, before: Vibration, model: Model) -> Vibration:
        """Return the vibration to which the last one of a branch falls; see `Source.leap`."""
        state = before.state
        return self._settled(model, _modal_state(state) if isinstance(state, _Periodic) else state)

    def _swept(self, model: Model, start: float) -> ModalState:
        """Where the machine is after a linear sweep of the frequency, in Hz, at the begin of a period."""
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

    def _settled(self, model: Model, state: ModalState | None, rounds: int = ROUNDS) -> Vibration:
        """The vibration that is steady after many periods: periodic if it is one and stable, or else as marched."""
        samples, engine = self.counts[-1], Modal(modes=self.operation.n_modes)
        fs = samples * self.operation.frequency
        factor = step_factor(fs, engine.largest_step(model.rig, model.law))
        march = Marching(model, engine, self.kind, 1 / (fs * factor), state)
        steps = samples * factor
        period = self.operation.amplitude * np.cos(2 * np.pi * np.arange(steps) / steps)
        for _ in range(rounds):  # past the end of a branch a vibration lingers where that was
            for _ in range(PERIODS):
                march.advance(period)
            counted = [march.advance(period) for _ in range(COUNTED)]
            found = self._near(counted[-1].points[::factor].T @ self._solver(model).grid.project.T, model)
            if found and not _is_unstable(found):
                return _vibration(found)
        return averaged([piece.rubbing for piece in counted], march.state)


def _is_unstable(found: _Periodic) -> bool:
    return unstable(multipliers(found.solver, found.motion)) > 0


def _vibration(found: _Periodic) -> Vibration:
    """Rubbing over a period, sampled as finely as its contacts need."""
    solver, omega, count = found.solver, found.motion.omega, len(found.solver.system.rig.bushings)
    fine = Solver(solver.system, solver.harmonics, samples_of_period(solver, omega))
    basis, rate, project = fine.grid[:3]
    motion = Sampled(found.x @ basis.T, omega * (found.x @ rate.T), omega, 0.0)
    force = np.empty_like(motion.place)
    fill_forces(solver.laws, motion, basis, rate, project, False, force, fine.slopes)
    rig, ends, speed = solver.system.rig, motion.place[count:], motion.speed
    offsets = np.repeat([bushing.offset for bushing in rig.bushings], 2)[:, None]
    normal = np.where(ends + offsets > 0, 1.0, -1.0) * force[count:]
    rubbed = rubbing(rig, in_space(rig, ends), in_space(rig, speed[count:]), normal)
    return Vibration(rubbed, np.zeros(count), found, "periodic")


def _modal_state(found: _Periodic) -> ModalState:
    """Modal coordinates at the beginning of a period, of the poles' answer to excitation and forces."""
    driven, omega = found.solver.system.driven, found.motion.omega
    (force,) = complex_amplitudes(found.motion.force[None])
    of_modes = driven.modes(omega, 0.0, driven.force(0.0, 1.0, 1.0) - force.T @ driven.points).T
    turning = 1j * omega * np.arange(of_modes.shape[1])
    q, v = of_modes.real.sum(axis=1), (of_modes * turning).real.sum(axis=1)
    return ModalState(q, v, q.copy(), np.empty(0))
