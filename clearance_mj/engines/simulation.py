"""Simulation of a rig by any engine.

An engine takes the excitation at its time step and returns outputs at that rate. This module adds interpolation of the
excitation, anti-alias decimation of the outputs, and the response with its provenance.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from tqdm import tqdm

from ..clearance.law import ConstantLaw, Law
from ..clearance.modelled import Modelled, rig_and_law
from ..core.errors import ClearanceError, ExcitationError, LawError
from ..core.kinds import checks_kinds
from ..core.tasks import DELAY
from ..rig import Grease, Rig
from ..rig.extremes import computable
from ..signals.excitation import Excitation
from ..signals.response import Response
from ..signals.sampling import Decimator, Interpolator
from ..structure import find_truncation
from ..version import __version__
from .base import Engine, default_engine, diverged, get_engine, step_factor
from .completing import Completion
from .late import DelayedChannels

__all__ = ["Simulation", "simulate", "simulate_blocks"]

BLOCK = 512  # samples at the record's rate per call of an engine
INTERPOLATED = 8 * BLOCK  # samples of the excitation per interpolation
MAX_STEPS = 1000  # steps per sample beyond which a law counts as a mistake


def simulate(
    model: Rig | Modelled, excitation: Excitation, law: Law | None = None, engine: str | Engine | None = None,
    progress: bool = False,
) -> Response:  # fmt: skip
    """Simulate a model, or a rig with a law, under an excitation.

    Parameters
    ----------
    model : Model or Rig
        The model or rig.
    excitation : Excitation
        Base acceleration or shaker force.
    law : Law, optional
        Contact and filling of a rig at each moment; without one, its datasheet values. A model has its law.
    engine : str or Engine, optional
        Name of the engine, "links" or "modal", or an engine with its settings; by default that of
        `default_engine`.
    progress : bool
        Show a progress bar, over the seconds of the record, if it takes long.

    Returns
    -------
    Response
        Response at the excitation's sampling rate.

    Raises
    ------
    SimulationError
        If the simulation diverges or its solver warns; names rig, time and bushing.
    LawError
        If the law does not fit the rig or the engine.
    ExcitationError
        If the rig has no position for a force.
    """
    rig, law = rig_and_law(model, law)
    simulation = Simulation(rig, excitation, law, get_engine(engine or default_engine(rig)))
    seconds = round(excitation.value.shape[-1] / excitation.fs, 1)
    with tqdm(total=seconds, desc="simulating", unit="s", delay=DELAY, disable=not progress) as bar:
        return simulation.whole(lambda share: bar.update(round(share * seconds, 1) - bar.n))


def simulate_blocks(
    model: Rig | Modelled, excitation: Excitation | Iterable[Excitation], law: Law | None = None,
    engine: str | Engine | None = None,
) -> Iterator[Response]:  # fmt: skip
    """Simulate a model and yield its response block by block: memory does not grow with the duration.

    Parameters
    ----------
    model : Model or Rig
        The model or rig.
    excitation : Excitation or iterable of Excitation
        One excitation or consecutive pieces of one, such as `excitation.random_blocks` makes.
    law : Law, optional
        Contact and filling of a rig, as in `simulate`.
    engine : str or Engine, optional
        Name or settings of the engine, as in `simulate`.

    Yields
    ------
    Response
        Consecutive samples, to the last bit those of `simulate` under the whole excitation.

    Raises
    ------
    ClearanceError
        As `simulate`, and if the pieces differ in rate or kind, or there is none.
    """
    pieces = iter(excitation if isinstance(excitation, Iterable) else [excitation])
    first = next(pieces, None)
    if first is None:
        raise ExcitationError("there is no piece of an excitation")
    rig, law = rig_and_law(model, law)
    simulation = Simulation(rig, first, law, get_engine(engine or default_engine(rig)))
    for excited, block in simulation.outputs(itertools.chain([first], pieces)):
        yield simulation.response(excited, block)


def _model_choices(rig: Rig) -> dict[str, Any]:
    """Return the model's choices for the provenance: bending theory of each shaft, truncation at each clearance."""
    shafts = rig.structure.shafts if rig.structure else ()
    choices: dict[str, Any] = {"bending_theory": [shaft.bending_theory for shaft in shafts]} if shafts else {}
    if truncations := find_truncation(rig):
        choices["truncation"] = [dataclasses.asdict(at) for at in truncations]
    return choices


class Simulation:
    """A run between interpolation and decimation, with the provenance of its response."""

    @checks_kinds
    def __init__(self, rig: Rig, excitation: Excitation, law: Law, engine: Engine):
        if len(excitation.kinds) not in (1, len(rig.inputs)):
            raise ExcitationError(
                f"rig {rig.name!r} has {len(rig.inputs)} inputs, the excitation {len(excitation.kinds)}; give one "
                "signal for each (excitation.together), or one for the first alone"
            )
        for shaker, kind in zip(rig.inputs, excitation.kinds):
            if kind == "force" and shaker.position is None:
                raise ExcitationError(f"rig {rig.name!r} has no shaker.position, so a force cannot be applied")
            if refusal := rig.linear.refusal(kind):
                raise ExcitationError(f"rig {rig.name!r}: {refusal}")
        self.rig, self.law, self.excitation, self.engine, self.block = rig, law, excitation, engine, BLOCK
        self.steps = 0
        self.columns = len(rig.sensors) + sum(count for _, count in _column_blocks(rig))
        with computable(rig.name, rig.to_dict):
            factor = _steps_per_sample(rig, law, engine, excitation.fs)
            self.step = 1 / (excitation.fs * factor)
            self.run = engine.start(rig, law, excitation.kinds, self.step)
        self.completion = Completion(rig, excitation.kinds, self.step)
        rest = self.run.before()
        if rest is not None:
            self.completion.add(rest[None], None)
        past = 0.0 if rest is None else rest
        self.interpolator = Interpolator(factor, *excitation.value.shape[:-1])
        self.decimator = Decimator(self.columns, factor, past)
        of_probes = (rig.bushings[j].probe_delay for j in rig.bushing_of_row)
        late = [*(s.delay for s in rig.sensors), *of_probes]
        delays = np.pad(late, (0, self.columns - len(late))) - rig.shaker.delay
        self.late = DelayedChannels(delays / self.step, factor, past) if delays.any() else None

    @functools.cached_property
    def provenance(self) -> dict[str, Any]:
        """Inputs of the run; plain data."""
        return {
            "engine": self.engine.name,
            "settings": dataclasses.asdict(self.engine),
            "step": self.step,
            "rig": self.rig.to_dict(),
            "law": self.law.to_dict(),
            "excitation": dict(self.excitation.description),
            "version": __version__,
        } | _model_choices(self.rig)

    def whole(self, watch: Callable[[float], object] = lambda share: None) -> Response:
        """Return the response to the whole excitation; ``watch`` is called after every block with the fraction done."""
        output, done = np.empty((self.excitation.value.shape[-1], self.columns)), 0
        for _, block in self.outputs([self.excitation]):
            output[done : done + len(block)] = block
            done += len(block)
            watch(done / len(output))
        return self.response(self.excitation.value.T, output)

    def outputs(self, excitations: Iterable[Excitation]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield excitation, (n,) or (n, n_inputs), and outputs (n, columns) of consecutive samples."""
        waiting = np.empty((0, *self.excitation.value.shape[:-1]))
        count = self.block * self.interpolator.factor
        for excitation in self._blocks(excitations):
            waiting, fast = np.concatenate((waiting, excitation)), self.interpolator.push(excitation)
            for start in range(0, len(fast), count):
                part = fast[start : start + count]
                block = self.sampled(part, self.run.advance(part))
                if len(block):
                    yield waiting[: len(block)], block
                    waiting = waiting[len(block) :]

    def sampled(self, excitation: np.ndarray, outputs: np.ndarray) -> np.ndarray:
        """Return samples (m, columns) of consecutive steps, from their excitation and the columns of `Run.advance`.

        Raises
        ------
        SimulationError
            If the simulation has diverged.
        """
        if not np.isfinite(outputs).all():
            failed = self.steps + np.argmin(np.isfinite(outputs).all(axis=1))
            raise diverged(self.rig, self.engine, failed * self.step, 0)
        self.steps += len(outputs)
        if missing := self.columns - outputs.shape[1]:  # an engine need not report contact
            outputs = np.pad(outputs, ((0, 0), (0, missing)), constant_values=np.nan)
        base = self.completion.push(excitation) if self.completion.base_moves else None
        self.completion.add(outputs, base)
        return self.decimator.push(self.late.push(outputs) if self.late else outputs)

    def _blocks(self, excitations: Iterable[Excitation]) -> Iterator[np.ndarray]:
        """Yield blocks of the excitation, then zeros: the filters of the last samples look ahead."""
        for piece in excitations:
            if (piece.fs, piece.kinds) != (self.excitation.fs, self.excitation.kinds):
                raise ExcitationError(
                    f"a piece of the excitation is {piece.kind} at {piece.fs:g} Hz, the first one "
                    f"{self.excitation.kind} at {self.excitation.fs:g} Hz"
                )
            for start in range(0, piece.value.shape[-1], INTERPOLATED):
                yield piece.value.T[start : start + INTERPOLATED]
        yield np.zeros((self.ahead, *self.excitation.value.shape[:-1]))

    @property
    def ahead(self) -> int:
        """Number of samples that the filters look ahead."""
        return 2 * self.interpolator.ahead + (self.late.ahead // self.interpolator.factor if self.late else 0)

    def response(self, excitation: np.ndarray, output: np.ndarray) -> Response:
        """Return the response of samples of the excitation, (n,) or (n, n_inputs), and the columns of `Run.advance`.

        The columns of forces and contact may be missing: then it has no provenance either.
        """
        names, counts = zip(*_column_blocks(self.rig))
        channels, *rows = np.split(output.T, len(self.rig.sensors) + np.cumsum((0, *counts[:-1])))
        parts = dict(zip(names, rows))
        complete = output.shape[1] == self.columns
        known, touches = names[:3] if complete else names[:1], parts["contact_share"]
        # The filter does not change a mean: decimated, the steps in contact are the same fraction of the time.
        contact_share = np.clip(touches.mean(axis=1), 0.0, 1.0) if complete and not np.isnan(touches).any() else None
        kinds = self.excitation.kinds
        references = tuple(each.label(kind) for each, kind in zip(self.rig.inputs, kinds))
        return Response(
            self.excitation.fs, excitation.T, channels, **{name: parts[name] for name in known},
            kind=self.excitation.kind, kinds=kinds, band=self.excitation.band, responses=tuple(self.rig.sensor_labels),
            reference=references[0], references=references, provenance=self.provenance if complete else {},
            contact_share=contact_share, spin=parts["spin"][0] if complete and self.rig.spin else None,
            quantities=tuple(sensor.quantity for sensor in self.rig.sensors), coordinates=tuple(self.rig.probe_labels),
        )  # fmt: skip


def _column_blocks(rig: Rig) -> list[tuple[str, int]]:
    """Return names and numbers of columns of an engine's outputs other than the sensors."""
    blocks = [(name, rig.n_rows) for name in ("displacement", "contact_force", "grease_force")]
    return [*blocks, ("contact_share", len(rig.bushings)), *([("spin", 1)] if rig.spin else [])]


def _steps_per_sample(rig: Rig, law: Law, engine: Engine, fs: float) -> int:
    """Return the steps per sample; an error names the cause if they are too many."""
    factor = step_factor(fs, engine.largest_step(rig, law))
    if factor <= MAX_STEPS:
        return factor
    needs = f"rig {rig.name!r}: the {engine.name} engine needs {factor} steps per sample, more than {MAX_STEPS}"
    free = ConstantLaw(0.0, 0.0, grease=Grease(0.0))
    if not rig.bushings or step_factor(fs, engine.largest_step(rig, free)) > factor / 2:
        raise ClearanceError(
            f"{needs}: its shaft is too stiff, or too finely divided, for a record of {fs:g} samples/s"
        )
    k, c = law.largest([b.gap for b in rig.bushings])
    hardest = int(np.argmax(k + c))
    raise LawError(
        f"{needs}, for its law at bushings[{hardest}] (k up to {k[hardest]:g} N/m, c up to {c[hardest]:g} N s/m); "
        "a contact is rarely stiffer than 1e9 N/m"
    )
