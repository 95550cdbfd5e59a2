"""Marches of the modal engine that tell how both ends of every bushing move and press, piece by piece."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np

from ..clearance.kernel import clearance_records
from ..core.errors import RigError
from ..engines.base import diverged
from ..engines.energy_loop import BushingEnergies, bushing_energies
from ..engines.modal import Modal, ModalRun
from ..engines.modal_space import SpatialRun
from ..engines.round_energies import OF_BUSHING, OF_END, OF_RIG
from ..engines.round_scheme import SPIN
from ..model import Model
from .rubbing import planar_rubbing, round_rubbing
from .stepping import march_planar, march_round

__all__ = ["Marching", "ModalState", "Piece", "start_march"]


class ModalState(NamedTuple):
    """Where a marched vibration is."""

    q: np.ndarray  #: (n,) modal coordinates
    v: np.ndarray  #: (n,) their velocities before the next kick, 1/s
    q_before: np.ndarray  #: (n,) a step ago
    turning: np.ndarray  #: (2,) spin, rad/s, and angle, rad; (0,) in the plane


class Piece(NamedTuple):
    """What a march found in consecutive steps."""

    points: np.ndarray  #: (m, ...) displacements of the bushings' middles, then of both ends of each, m
    rubbing: np.ndarray  #: (n_bushings, 2, MOMENTS) of both ends, W


class Marching(ABC):
    """A march from one piece of the excitation, at the step's rate, to the next."""

    def __init__(self, model: Model, engine: Modal, step: float):
        self.rig, self.engine, self.step, self.steps = model.rig, engine, step, 0

    @property
    @abstractmethod
    def state(self) -> ModalState:
        """Where the march is."""

    @abstractmethod
    def advance(self, excitation: np.ndarray) -> Piece:
        """March under the next samples (m,) of the excitation.

        Parameters
        ----------
        excitation : ndarray, shape (m,)
            m/s² or N, one for each step.

        Raises
        ------
        SimulationError
            If the march diverges.
        """

    def _went(self, failed: int, size: int) -> None:
        if failed >= 0:
            raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, 0)
        self.steps += size


def start_march(model: Model, engine: Modal, kind: str, step: float, state: ModalState | None) -> Marching:
    """Begin a march from a state, or from rest where it is None.

    Parameters
    ----------
    model : Model
        Rig and law.
    engine : Modal
        Settings of the modal engine.
    kind : str
        Kind of the excitation, "base" or "force".
    step : float
        s.
    state : ModalState, optional
        Where another march of the same structure ended.
    """
    made = _InSpace if model.rig.moves_across else _InPlane
    return made(model, engine, kind, step, state)


class _InPlane(Marching):
    def __init__(self, model: Model, engine: Modal, kind: str, step: float, state: ModalState | None):
        super().__init__(model, engine, step)
        run = ModalRun(engine, model.rig, model.law, kind, step)
        self.motion, self.parts, self.scheme = run.alone.motion, run.alone.parts, run.equations()
        self.room = np.empty((run.alone.columns, 1, 1))
        self.clearance, self.driving = clearance_records(model.rig, model.law, step), run.alone.driving
        if run.rest:
            run.rest.begin(self.clearance)
        if state is not None:
            self.motion.q[:, 0], self.motion.v[:, 0], self.motion.q_before[:, 0] = state[:3]

    @property
    def state(self) -> ModalState:
        q, v, q_before = (np.array(part[:, 0]) for part in self.motion)
        return ModalState(q, v, q_before, np.empty(0))

    def advance(self, excitation: np.ndarray) -> Piece:
        size, n, scheme, motion = excitation.size, len(self.rig.bushings), self.scheme, self.motion
        q, impact = np.empty((size + 2, len(motion.q))), np.empty((size, 2 * n))
        q[0], q[1] = motion.q_before[:, 0], motion.q[:, 0]
        self._went(
            march_planar(self.steps, self.driving(excitation), self.step, *self.parts, self.room, q[2:], impact), size
        )
        x = q @ scheme.points.T
        seen = (q[:-2] * scheme.speed[0] + q[1:-1] * scheme.speed[1] + q[2:] * scheme.speed[2]) @ scheme.points.T
        found = BushingEnergies(*np.zeros((6, size, n)), *np.zeros((2, size, 2 * n)))
        bushing_energies(self.steps - size, x, seen, impact, self.clearance, found)
        place, speed = x[1:-1, n:].T, (x[2:, n:] - x[:-2, n:]).T / (2 * self.step)
        lower, upper = np.repeat([b.walls for b in self.rig.bushings], 2, axis=0).T[:, :, None]
        side = (place > upper).astype(float) - (place < lower)
        return Piece(x[1:-1], planar_rubbing(self.rig, place, speed, side * found.push.T))


class _InSpace(Marching):
    def __init__(self, model: Model, engine: Modal, kind: str, step: float, state: ModalState | None):
        super().__init__(model, engine, step)
        self.run = SpatialRun(engine, model.rig, model.law, kind, step, engine.modes)
        if self.run.drive[0] or self.run.drive[2]:
            raise RigError(
                f"rig {self.rig.name!r}: wear over hours needs a steady spin; leave out its rate and inertia"
            )
        self.room = np.empty((self.run.columns, 9))
        if state is not None:
            for own, other in zip(self.run.motion, state):
                own[:] = other
        self.coupling = self.run.coupling(float(self.run.motion.turning[SPIN]))

    @property
    def state(self) -> ModalState:
        return ModalState(*map(np.array, self.run.motion))

    def advance(self, excitation: np.ndarray) -> Piece:
        run, size, n = self.run, excitation.size, len(self.rig.bushings)
        q, spin = np.empty((size + 2, run.motion.q.size)), np.empty(size)
        q[0], q[1] = run.motion.q_before, run.motion.q
        works = np.empty((size, len(OF_RIG) + n * (len(OF_BUSHING) + 2 * len(OF_END))))
        failed = march_round(
            self.steps, excitation[:, None], self.step, run.shaft, self.coupling, run.drive, run.motion, run.clearance,
            self.room, works, q[2:], spin,
        )  # fmt: skip
        self._went(failed, size)
        x = np.einsum("tm,pdm->tpd", q, run.shaft.at_points)
        place, speed = x[1:-1, n:], (x[2:, n:] - x[:-2, n:]) / (2 * self.step)
        of_ends = works[:, len(OF_RIG) + n * len(OF_BUSHING) :].reshape(size, 2 * n, len(OF_END))
        normal = of_ends[:, :, OF_END.index("push")].T
        rubbing = round_rubbing(self.rig, np.moveaxis(place, 0, -1), np.moveaxis(speed, 0, -1), normal, spin)
        return Piece(x[1:-1], rubbing)
