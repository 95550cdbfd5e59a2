"""Marches of the modal engine that tell how both ends of every clearance move and press, piece by piece."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.errors import RigError
from ..engines.energies import OF_CLEARANCE, OF_END, OF_RIG, Kept, columns_of
from ..engines.modal import Modal, ModalRun
from ..engines.modal_loop import PER_INERTIA, RATE, SPIN
from ..model import Model
from .rubbing import in_space, rubbing

__all__ = ["Marching", "ModalState", "Piece"]


class ModalState(NamedTuple):
    """Where a marched vibration is."""

    q: np.ndarray  #: (n,) modal coordinates
    v: np.ndarray  #: (n,) their velocities before the next kick, 1/s
    q_before: np.ndarray  #: (n,) a step ago
    turning: np.ndarray  #: (5,) as of `modal_loop`


class Piece(NamedTuple):
    """What a march found in consecutive steps."""

    points: np.ndarray  #: (m, 3 n_rows) displacements of the clearances' middles, then of both ends of each, m
    rubbing: np.ndarray  #: (n_bushings, 2, MOMENTS) of both ends, W


class Marching:
    """A march from one piece of the excitation, at the step's rate, to the next.

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
        Where another march of the same structure ended; None: it begins at rest.

    Raises
    ------
    RigError
        If the spin changes.
    """

    def __init__(self, model: Model, engine: Modal, kind: str, step: float, state: ModalState | None):
        self.rig, self.step, self.run = model.rig, step, ModalRun(engine, model.rig, model.law, kind, step)
        self.motion = self.run.motion
        if self.motion.turning[[RATE, PER_INERTIA]].any():
            raise RigError(
                f"rig {self.rig.name!r}: wear over hours needs a steady spin; leave out its rate and inertia"
            )
        if state is not None:
            for own, other in zip(self.motion, state):
                own[:] = other

    @property
    def state(self) -> ModalState:
        """Where the march is."""
        return ModalState(*map(np.array, self.motion))

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
        size, n, at_rows = excitation.size, len(self.rig.bushings), self.run.linear.at_rows
        kept = Kept(np.empty((size, columns_of(n))), np.empty((size, len(at_rows))), np.empty((0, 0)))
        before, spin = at_rows @ self.motion.q_before, self.motion.turning[SPIN]
        self.run.alone.advance(excitation, kept)
        x = np.vstack((before, kept.rows, at_rows @ self.motion.q))[:, : 3 * self.rig.n_rows]
        ends, speed = x[1:-1, self.rig.n_rows :].T, (x[2:] - x[:-2])[:, self.rig.n_rows :].T / (2 * self.step)
        of_ends = kept.energies[:, len(OF_RIG) + n * len(OF_CLEARANCE) :].reshape(size, 2 * n, len(OF_END))
        normal = of_ends[:, :, OF_END.index("push")].T
        place, moving = in_space(self.rig, ends), in_space(self.rig, speed)
        return Piece(x[1:-1], rubbing(self.rig, place, moving, normal, spin))
