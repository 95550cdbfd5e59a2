"""Rubbing of any vibration, marched in time by the modal engine: random excitations, records, turning shafts."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..clearance.law import TimeLaw
from ..core.errors import ExcitationError, LawError, RigError
from ..engines.base import step_factor
from ..engines.energies import OF_CLEARANCE, OF_END, OF_RIG, StepRecords, columns_of
from ..engines.modal import Modal, ModalRun
from ..engines.modal_loop import PER_INERTIA, RATE, SPIN
from ..model import Model
from ..signals.excitation import Excitation
from ..signals.sampling import interpolate
from .operation import Operation, Source, Vibration
from .rubbing import footprints, in_space, rubbing

__all__ = ["Marched", "MarchedSource", "MarchedSteps", "Marching", "ModalState", "mean_rubbing"]

# Marches of the modal engine that return motion and normal force of both ends of every clearance, piece by piece.


class ModalState(NamedTuple):
    """State of a marched vibration."""

    q: np.ndarray  #: (n,) modal coordinates
    v: np.ndarray  #: (n,) their velocities before the next kick, 1/s
    q_before: np.ndarray  #: (n,) coordinates a step ago
    turning: np.ndarray  #: (5,) as of `modal_loop`


class MarchedSteps(NamedTuple):
    """Result of a march over consecutive steps."""

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
        Final state of another march of the same structure; None: it begins at rest.

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
            for array, other in zip(self.motion, state):
                array[: other.size] = other  # a motion of harmonic balance has no rotation

    @property
    def state(self) -> ModalState:
        """State of the march."""
        return ModalState(*map(np.array, self.motion))

    def advance(self, excitation: np.ndarray) -> MarchedSteps:
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
        kept = StepRecords(np.empty((size, columns_of(n))), np.empty((size, len(at_rows))), np.empty((0, 0)))
        before, spin = at_rows @ self.motion.q_before, self.motion.turning[SPIN]
        self.run.alone.advance(excitation, kept)
        x = np.vstack((before, kept.rows, at_rows @ self.motion.q))[:, : 3 * self.rig.n_rows]
        ends, speed = x[1:-1, self.rig.n_rows :].T, (x[2:] - x[:-2])[:, self.rig.n_rows :].T / (2 * self.step)
        of_ends = kept.energies[:, len(OF_RIG) + n * len(OF_CLEARANCE) :].reshape(size, 2 * n, len(OF_END))
        normal = of_ends[:, :, OF_END.index("push")].T
        place, moving = in_space(self.rig, ends), in_space(self.rig, speed)
        return MarchedSteps(x[1:-1], rubbing(self.rig, place, moving, normal, spin))


SETTLING = 0.25  # default fraction of the excitation in which the vibration before decays
BATCHES = 8  # pieces of a record, for the standard error of its rubbing


@dataclass(frozen=True)
class Marched(Operation):
    """A machine under an excitation over time, or under gravity, spin and unbalances alone."""

    excitation: Excitation
    """over which rubbing is averaged; `excitation.still` for self-excited motion"""
    settle: float | None = None
    """time at its beginning that is left out, s, in which the previous vibration decays; None: a quarter"""
    engine: Modal = field(default_factory=Modal)
    """settings of the modal engine"""

    def __post_init__(self) -> None:
        if len(self.excitation.kinds) > 1:
            raise ExcitationError("wear over hours is marched under one input; give an excitation of one")
        duration = self.excitation.value.size / self.excitation.fs
        if self.settle is not None and not 0 <= self.settle < duration:
            raise ExcitationError(f"settle must be from 0 s up to the excitation's {duration:g} s, got {self.settle!r}")

    def source(self, model: Model) -> Source:
        """Return the source of a model's vibrations; see `Operation.source`."""
        return MarchedSource(self, model)

    def to_dict(self) -> dict[str, Any]:
        """Return the operation as plain data."""
        value, fs = self.excitation.value, self.excitation.fs
        return {
            "operation": "marched", "kind": self.excitation.kind, "rms": float(np.sqrt(np.mean(value**2))), "fs": fs,
            "duration": value.size / fs, "settle": self.settle, "excitation": dict(self.excitation.description),
            "samples": hashlib.sha256(value.tobytes()).hexdigest()[:16], "engine": vars(self.engine),
        }  # fmt: skip


class MarchedSource(Source):
    """Vibrations marched from gap to gap, each from the final state of the previous one."""

    def __init__(self, operation: Marched, model: Model):
        if isinstance(model.law, TimeLaw):
            raise LawError("a law over time says nothing of hours; give a ConstantLaw, an AmplitudeLaw or a ContactLaw")
        footprints(model.rig)
        if operation.excitation.kind == "force" and model.rig.shaker.position is None:
            raise ExcitationError(f"rig {model.rig.name!r} has no shaker.position, so a force cannot be applied")
        self.operation = operation
        self.fast: dict[int, np.ndarray] = {}
        self.rests = not operation.excitation.value.any() and not model.rig.unbalances

    def first(self, model: Model) -> Vibration:
        """Return the vibration that begins at rest; see `Source.first`."""
        return self._march(model, None)

    def follow(self, before: Vibration, at: Model, to: Model) -> Vibration:
        """Return the vibration after another one; see `Source.follow`."""
        return self._march(to, None if self.rests else before.state)

    def leap(self, before: Vibration, model: Model) -> Vibration:
        """Return the vibration after another one; see `Source.leap`."""
        return self._march(model, None if self.rests else before.state)

    def _march(self, model: Model, state: ModalState | None) -> Vibration:
        excitation, engine = self.operation.excitation, self.operation.engine
        factor = step_factor(excitation.fs, engine.largest_step(model.rig, model.law))
        if factor not in self.fast:
            self.fast[factor] = interpolate(excitation.value, factor)
        fast, step, settle = self.fast[factor], 1 / (excitation.fs * factor), self.operation.settle
        skipped = int(SETTLING * fast.size if settle is None else round(settle / step))
        march = Marching(model, engine, excitation.kind, step, state)
        if skipped:
            march.advance(fast[:skipped])
        pieces = np.array_split(fast[skipped:], min(BATCHES, fast.size - skipped))
        return mean_rubbing([march.advance(piece).rubbing for piece in pieces], march.state)


def mean_rubbing(rubbings: list[np.ndarray], state: ModalState) -> Vibration:
    """Return the mean of rubbings (n_bushings, 2, MOMENTS) of pieces of a march, with its standard error.

    Parameters
    ----------
    each : list of ndarray
        Rubbings of pieces of equal length.
    state : ModalState
        Final state of the march.
    """
    powers = np.array([rubbing[..., 0].sum(axis=-1) for rubbing in rubbings])
    error = powers.std(axis=0, ddof=1) / np.sqrt(len(rubbings)) if len(rubbings) > 1 else np.zeros(powers.shape[1])
    return Vibration(np.mean(rubbings, axis=0), error, state, "marched")
