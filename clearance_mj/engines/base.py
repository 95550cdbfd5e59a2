"""What an engine is, and the one way in which every engine is run.

An engine says how long a time step may be and starts a run; a run takes the excitation at the step's rate, block by
block, and returns its outputs at that rate. `simulate` does the rest for all of them: interpolation of the
excitation, anti-alias decimation of the outputs, and the response with its provenance.
"""

from __future__ import annotations

import collections
import dataclasses
import itertools
import math
import os
from abc import ABC, abstractmethod
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import ClassVar, NamedTuple

import numpy as np
from tqdm import tqdm

from .._version import __version__
from ..clearance.law import ConstantLaw, Law, LawTable
from ..errors import ClearanceError, ExcitationError, LawError, SimulationError
from ..rig import BASE_NODE, SHAKER_NODE, Grease, Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from ..signals.sampling import Decimator, Interpolator

__all__ = [
    "Engine",
    "Equations",
    "Run",
    "get_engine",
    "register",
    "simulate",
    "simulate_batch",
    "simulate_blocks",
    "simulate_each",
    "step_factor",
]

BLOCK = 512
"""Samples at the record's rate that are simulated between two looks from Python"""
READ = 8 * BLOCK
"""Samples of the excitation that are interpolated at once"""
AHEAD = 4
"""Cases for each thread of a batch that run, or wait to be taken, at once"""
MOST_STEPS = 1000
"""Steps per sample beyond which a law is taken for a mistake"""


class Run(ABC):
    """One simulation under way."""

    @abstractmethod
    def advance(self, drive) -> np.ndarray:
        """Simulate one block.

        Parameters
        ----------
        drive : ndarray, shape (n,)
            Base acceleration, m/s², or shaker force, N, one sample per step.

        Returns
        -------
        ndarray, shape (n, n_sensors + 3 n_bushings)
            Absolute accelerations, displacements, contact forces, grease forces.

        Raises
        ------
        SimulationError
            If the simulation diverges or its solver warns.
        """

    def equations(self) -> Equations:
        """Return the equations that the coordinates of consecutive steps satisfy, for whoever balances energies.

        Raises
        ------
        ClearanceError
            If the engine does not tell.
        """
        raise ClearanceError("the engine does not tell the equations of its steps, so no ledger can be kept of it")

    def snapshot(self) -> tuple[np.ndarray, ...]:
        """Return what is between two steps, to be copied before the next one.

        Returns
        -------
        tuple of ndarray
            Coordinates; then what the last step used: Bouc-Wen states and envelopes of the motion of every bushing, m,
            and speeds at which the contact of every bushing end began, m/s.

        Raises
        ------
        ClearanceError
            If the engine does not tell.
        """
        raise ClearanceError("the engine does not tell its state, so no ledger can be kept of it")


class Equations(NamedTuple):
    """What an engine's scheme makes of M q̈ + C q̇ + K q = b a - Pᵀ f, from step to step and exactly.

    M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = b a - Pᵀ f, with q₋, q, q₊ the coordinates before the last step,
    before this one and after it, a the drive and f the forces of the bushings at q. The scheme's own M, C and K, for
    which this holds, differ from the shaft's by terms that vanish with the step.
    """

    mass: np.ndarray
    """(n, n) M"""
    damping: np.ndarray
    """(n, n) C"""
    stiffness: np.ndarray
    """(n, n) K"""
    drive: np.ndarray
    """(n,) b"""
    points: np.ndarray
    """(3 n_bushings, n) P: displacement of the bushings' middles, then of their two ends each, per coordinate"""
    speed: np.ndarray
    """(3, n) the bushings' dampers see the velocity speed[0] q₋ + speed[1] q + speed[2] q₊"""


class Engine(ABC):
    """A way to simulate a rig. Subclasses are frozen dataclasses whose fields are the engine's settings."""

    name: ClassVar[str]

    @abstractmethod
    def largest_step(self, rig: Rig, law: Law) -> float:
        """Longest stable and accurate time step in s, safety factor included.

        Parameters
        ----------
        rig : Rig
            The rig.
        law : Law
            The clearance's law.
        """

    @abstractmethod
    def start(self, rig: Rig, law: Law, kind: str, step: float) -> Run:
        """Begin a simulation at rest.

        Parameters
        ----------
        rig : Rig
            The rig.
        law : Law
            The clearance's law.
        kind : str
            What drives it: "base" or "force".
        step : float
            Time step, s.
        """


_ENGINES: dict[str, type[Engine]] = {}


def register(engine: type[Engine]) -> type[Engine]:
    """Make an engine known by its name; a class decorator.

    Parameters
    ----------
    engine : type
        Subclass of `Engine`.
    """
    _ENGINES[engine.name] = engine
    return engine


def get_engine(engine) -> Engine:
    """Return the engine of a name, with its default settings, or the engine itself.

    Parameters
    ----------
    engine : str or Engine
        Such as "links", or ``Links(links=40)``.

    Raises
    ------
    ClearanceError
        For an unknown name; the message lists the known ones.
    """
    if isinstance(engine, Engine):
        return engine
    if engine not in _ENGINES:
        raise ClearanceError(f'engine "{engine}" is unknown; known: {", ".join(sorted(_ENGINES))}')
    return _ENGINES[engine]()


def step_factor(fs: float, largest_step: float) -> int:
    """Steps per sample: the smallest whole number that keeps the step within ``largest_step``.

    Parameters
    ----------
    fs : float
        Sampling rate of the record, Hz.
    largest_step : float
        s.
    """
    return max(1, math.ceil(1 / (fs * largest_step) - 1e-9))


def simulate(rig: Rig, excitation: Excitation, law: Law, engine="links") -> Response:
    """Simulate a rig under an excitation.

    Parameters
    ----------
    rig : Rig
        The rig.
    excitation : Excitation
        Base acceleration or shaker force.
    law : Law
        Contact stiffness and damping (and grease) at each moment.
    engine : str or Engine
        "links", "modal", "modal-mj", or an engine with settings of its own.

    Returns
    -------
    Response
        At the excitation's sampling rate.

    Raises
    ------
    SimulationError
        If the simulation diverges or its solver warns; names rig, time and bushing.
    LawError
        If the law does not fit the rig or the engine.
    ExcitationError
        If the rig has no place for a force.
    """
    simulation = _Simulation(rig, excitation, law, get_engine(engine))
    output, done = np.empty((excitation.value.size, simulation.columns)), 0
    for _, block in simulation.outputs([excitation]):
        output[done : done + len(block)] = block
        done += len(block)
    return simulation.response(excitation.value, output)


def simulate_blocks(rig: Rig, excitation, law: Law, engine="links") -> Iterator[Response]:
    """Simulate a rig and hand over its response block by block: memory does not grow with the duration.

    Parameters
    ----------
    rig : Rig
        The rig.
    excitation : Excitation or iterable of Excitation
        One, or pieces of one that follow each other without a break, such as `excitation.random_blocks` makes.
    law : Law
        Contact stiffness and damping (and grease) at each moment.
    engine : str or Engine
        As in `simulate`.

    Yields
    ------
    Response
        Consecutive samples, to the last bit those of `simulate` under the whole excitation.

    Raises
    ------
    ClearanceError
        As `simulate`, and if the pieces differ in rate or kind, or there is none.
    """
    pieces = iter([excitation] if isinstance(excitation, Excitation) else excitation)
    first = next(pieces, None)
    if first is None:
        raise ExcitationError("there is no piece of an excitation")
    simulation = _Simulation(rig, first, law, get_engine(engine))
    for drive, block in simulation.outputs(itertools.chain([first], pieces)):
        yield simulation.response(drive, block)


class _Simulation:
    """A run between interpolation and decimation, and what its response says of it."""

    def __init__(self, rig, excitation, law, engine):
        if excitation.kind == "force" and rig.shaker.position is None:
            raise ExcitationError(f"rig {rig.name!r} has no shaker.position, so a force cannot be applied")
        self.rig, self.excitation, self.engine = rig, excitation, engine
        self.columns = len(rig.sensors) + 3 * len(rig.bushings)
        factor = _affordable(rig, law, engine, excitation.fs)
        self.step = 1 / (excitation.fs * factor)
        self.run = engine.start(rig, law, excitation.kind, self.step)
        self.interpolator, self.decimator = Interpolator(factor), Decimator(self.columns, factor)
        self.provenance = {
            "engine": engine.name,
            "settings": dataclasses.asdict(engine),
            "step": self.step,
            "rig": rig.to_dict(),
            "law": law.to_dict(),
            "excitation": dict(excitation.description),
            "version": __version__,
        }

    def outputs(self, excitations):
        """Yield excitation and outputs, (n,) and (n, columns), of consecutive samples at the record's rate."""
        waiting, steps, count = np.empty(0), 0, BLOCK * self.interpolator.factor
        for drive in self._drives(excitations):
            waiting, fast = np.append(waiting, drive), self.interpolator.push(drive)
            for start in range(0, fast.size, count):
                outputs = self.run.advance(fast[start : start + count])
                if not np.isfinite(outputs).all():
                    failed = steps + np.argmin(np.isfinite(outputs).all(axis=1))
                    raise diverged(self.rig, self.engine, failed * self.step, 0)
                steps += len(outputs)
                block = self.decimator.push(outputs)
                if len(block):
                    yield waiting[: len(block)], block
                    waiting = waiting[len(block) :]

    def _drives(self, excitations):
        """Yield blocks of the excitation, then zeros: the filters of the last samples look ahead."""
        for piece in excitations:
            if (piece.fs, piece.kind) != (self.excitation.fs, self.excitation.kind):
                raise ExcitationError(
                    f"a piece of the excitation is {piece.kind} at {piece.fs:g} Hz, the first one "
                    f"{self.excitation.kind} at {self.excitation.fs:g} Hz"
                )
            for start in range(0, piece.value.size, READ):
                yield piece.value[start : start + READ]
        yield np.zeros(2 * self.interpolator.ahead)

    def response(self, excitation, output) -> Response:
        """Return the response that so many samples of excitation and outputs make."""
        n_sensors, n_bushings = len(self.rig.sensors), len(self.rig.bushings)
        acceleration, *rest = np.split(output.T, n_sensors + n_bushings * np.arange(3))
        kind, band = self.excitation.kind, self.excitation.band
        labels = tuple(self.rig.sensor_labels)
        reference = f"{BASE_NODE if kind == 'base' else SHAKER_NODE}:+Z"
        sampled = (self.excitation.fs, excitation, acceleration, *rest)
        return Response(*sampled, kind, band, labels, reference, self.provenance)


def simulate_batch(rig, excitations, laws, engine="links", workers=None, progress=None) -> list[Response]:
    """Simulate many cases at once and keep every response; otherwise `simulate_each`.

    Parameters
    ----------
    rig, excitations, laws, engine, workers, progress
        As in `simulate_each`.

    Returns
    -------
    list of Response
        In the order of the cases.

    Raises
    ------
    ClearanceError
        As in `simulate_each`.
    """
    return list(simulate_each(rig, excitations, laws, engine, workers, progress))


def simulate_each(rig, excitations, laws, engine="links", workers=None, progress=None) -> Iterator[Response]:
    """Simulate many cases at once and hand over one response after the other; results do not depend on the threads.

    Only a few cases run ahead of the one that is taken, so memory does not grow with their number.

    Parameters
    ----------
    rig : Rig or sequence of Rig
        One for all or one for each case.
    excitations : Excitation or sequence of Excitation
        One for all or one for each case.
    laws : Law or sequence of Law
        One for all or one for each case.
    engine : str or Engine
        As in `simulate`.
    workers : int, optional
        Threads; compiled loops release the interpreter lock. Default: one for each processor.
    progress : str, optional
        Show a progress bar with this name.

    Yields
    ------
    Response
        In the order of the cases.

    Raises
    ------
    ClearanceError
        If the sequences differ in length, and whatever `simulate` raises.
    """
    engine, workers = get_engine(engine), workers or os.cpu_count()
    cases = _cases(rig, excitations, laws)
    waiting, ahead = iter(cases), collections.deque()
    with ThreadPoolExecutor(workers) as pool:
        try:
            for _ in tqdm(cases, desc=progress, unit="run", disable=progress is None):
                room = AHEAD * workers - len(ahead)
                ahead.extend(pool.submit(simulate, *case, engine) for case in itertools.islice(waiting, room))
                yield ahead.popleft().result()
        finally:
            for job in ahead:  # after an error or an interrupt, do not begin what is still queued
                job.cancel()


def _affordable(rig, law, engine, fs):
    """Steps per sample; refused where they would be too many, with what makes them so."""
    factor = step_factor(fs, engine.largest_step(rig, law))
    if factor <= MOST_STEPS:
        return factor
    table = law.table(len(rig.bushings))
    needs = f"rig {rig.name!r}: the {engine.name} engine needs {factor} steps per sample, more than {MOST_STEPS}"
    shaft = (
        step_factor(fs, engine.largest_step(rig, ConstantLaw(0.0, 0.0, grease=Grease(0.0)))) if rig.bushings else factor
    )
    if shaft > factor / 2:
        raise ClearanceError(
            f"{needs}: its shaft is too stiff, or too finely divided, for a record of {fs:g} samples/s"
        )
    hardest = int(np.argmax(table.k.max(axis=0) + table.c.max(axis=0)))
    raise LawError(
        f"{needs}, for its law at bushings[{hardest}] (k up to {table.k[:, hardest].max():g} N/m, c up to "
        f"{table.c[:, hardest].max():g} N s/m); a contact is rarely stiffer than 1e7 N/m"
    )


def check_setting(engine: Engine, name: str, condition: bool, rule: str):
    """Refuse an engine's setting.

    Parameters
    ----------
    engine : Engine
        The engine.
    name : str
        The field.
    condition : bool
        Whether it is acceptable.
    rule : str
        What would be.
    """
    if not condition:
        raise ClearanceError(f"engine {engine.name}: {name} {rule}, got {getattr(engine, name)!r}")


def _cases(*columns):
    rows = [column if isinstance(column, list | tuple) else None for column in columns]
    lengths = {len(row) for row in rows if row is not None}
    if len(lengths) > 1:
        raise ClearanceError(
            f"rigs, excitations and laws differ in number: {sorted(lengths)}; give one or equally many"
        )
    n = lengths.pop() if lengths else 1
    return list(zip(*(row if row is not None else [column] * n for row, column in zip(rows, columns))))


def place(rig: Rig, bushing: int) -> str:
    """Where something happened, for messages.

    Parameters
    ----------
    rig : Rig
        The rig.
    bushing : int
        Index of the bushing; a rig without bushings is looked at at its tip.
    """
    return f"at bushings[{bushing}] (x = {rig.bushings[bushing].position:g} m)" if rig.bushings else "at the tip"


def diverged(rig: Rig, engine: Engine, time: float, bushing: int) -> SimulationError:
    """The error of a simulation whose motion at a bushing is not a number or beyond any shaft.

    Parameters
    ----------
    rig : Rig
        The rig.
    engine : Engine
        The engine.
    time : float
        s.
    bushing : int
        Index of the bushing.
    """
    return SimulationError(
        f"rig {rig.name!r}: the {engine.name} simulation diverged at t = {time:.6f} s {place(rig, bushing)}; "
        "the law is too stiff or too strongly damped for the time step, or the excitation is far out of range"
    )


def stiffest_contact(rig: Rig, table: LawTable) -> np.ndarray:
    """Largest contact stiffness of each bushing that a law reaches; of a Hertz contact, at one gap of penetration.

    Parameters
    ----------
    rig : Rig
        The rig.
    table : LawTable
        The law.

    Returns
    -------
    ndarray, shape (n_bushings,)
        N/m.
    """
    gaps = np.array([b.gap for b in rig.bushings])
    return table.exponent * table.k.max(axis=0, initial=0.0) * gaps ** (table.exponent - 1)


def needs_no_adhesion(table, engine: Engine):
    """Refuse a law with adhesion on an engine whose contacts cannot pull.

    Parameters
    ----------
    table : LawTable
        The law.
    engine : Engine
        The engine.
    """
    if np.any(table.adhesion):
        raise LawError(f"the {engine.name} engine cannot simulate adhesion: MuJoCo's contacts never pull; use modal")
