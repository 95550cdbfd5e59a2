"""Rubbing of any vibration, marched in time by the modal engine: random excitations, records, shafts that turn."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..clearance.law import TimeLaw
from ..core.errors import ExcitationError, LawError
from ..engines.base import step_factor
from ..engines.modal import Modal
from ..model import Model
from ..signals.excitation import Excitation
from ..signals.sampling import interpolate
from .marching import Marching, ModalState
from .operation import Operation, Source, Vibration
from .rubbing import footprints

__all__ = ["Marched", "MarchedSource", "averaged"]

SETTLING = 0.25  # of the excitation, by default: what is left of the vibration before
BATCHES = 8  # pieces of a record whose rubbings tell its error


@dataclass(frozen=True)
class Marched(Operation):
    """A machine under an excitation that is given in time, or under gravity, spin and unbalances alone."""

    excitation: Excitation
    """over which rubbing is averaged; `excitation.still` for what moves by itself"""
    settle: float | None = None
    """s at its beginning that are left out, in which the vibration of the gap before dies; None: a quarter"""
    engine: Modal = field(default_factory=Modal)
    """settings of the modal engine, by which it is marched"""

    def __post_init__(self) -> None:
        if len(self.excitation.kinds) > 1:
            raise ExcitationError("wear over hours is marched under one input; give an excitation of one")
        duration = self.excitation.value.size / self.excitation.fs
        if self.settle is not None and not 0 <= self.settle < duration:
            raise ExcitationError(f"settle must be from 0 s up to the excitation's {duration:g} s, got {self.settle!r}")

    def source(self, model: Model) -> Source:
        """Return what marches a model; see `Operation.source`."""
        return MarchedSource(self, model)

    def to_dict(self) -> dict[str, Any]:
        """Return how the machine runs as plain data."""
        value, fs = self.excitation.value, self.excitation.fs
        return {
            "operation": "marched", "kind": self.excitation.kind, "rms": float(np.sqrt(np.mean(value**2))), "fs": fs,
            "duration": value.size / fs, "settle": self.settle, "excitation": dict(self.excitation.description),
            "samples": hashlib.sha256(value.tobytes()).hexdigest()[:16], "engine": vars(self.engine),
        }  # fmt: skip


class MarchedSource(Source):
    """Marches a model from gap to gap, each time from where the vibration before ended."""

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
        return averaged([march.advance(piece).rubbing for piece in pieces], march.state)


def averaged(each: list[np.ndarray], state: ModalState) -> Vibration:
    """Return the mean of rubbings (n_bushings, 2, MOMENTS) of pieces of a march, with its standard error.

    Parameters
    ----------
    each : list of ndarray
        Of pieces that are equally long.
    state : ModalState
        Where the march ended.
    """
    powers = np.array([rubbing[..., 0].sum(axis=-1) for rubbing in each])
    error = powers.std(axis=0, ddof=1) / np.sqrt(len(each)) if len(each) > 1 else np.zeros(powers.shape[1])
    return Vibration(np.mean(each, axis=0), error, state, "marched")
