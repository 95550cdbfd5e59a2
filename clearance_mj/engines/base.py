"""The interface of engines: a bound of the time step, and runs that take the excitation in blocks."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..clearance.law import Law
from ..core.deprecation import old_names
from ..core.errors import ClearanceError, SimulationError
from ..core.validation import Registered, register
from ..rig import Rig
from ..rig.dimensions import directed_points
from ..rig.instruments import Kinds

__all__ = [
    "Engine", "SeveralRuns", "SimulationRun", "diverged", "get_engine", "in_columns", "location", "register",
    "step_factor",
]  # fmt: skip

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__, {"Run": "clearance_mj.engines.base.SimulationRun"})


class SeveralRuns(ABC):
    """Runs that are advanced together from their start under one excitation. Made by `SimulationRun.combine`."""

    @abstractmethod
    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; return the columns of `SimulationRun.advance` for each run: (n_runs, n, columns)."""

    def whole(self, excitation: np.ndarray, factor: int, samples: int, forces: bool = True) -> np.ndarray:
        """Simulate an excitation; return the columns of `SimulationRun.advance`, decimated: (n_runs, columns, samples).

        Every sample spans ``factor`` steps; the excitation includes the steps that the last sample's filter looks
        ahead. Without ``forces`` their columns and those that follow may be left out.
        """
        raise ClearanceError("the engine hands its runs over in blocks; use simulate_batch")


class SimulationRun(ABC):
    """A running simulation, advanced block by block."""

    def batch_key(self) -> object | None:
        """Return a key that is equal for runs that can be advanced together; None if this one cannot be."""
        return None

    def combine(self, runs: Sequence[SimulationRun]) -> SeveralRuns:
        """Combine runs that are `alike`, of which this is one."""
        raise ClearanceError("the engine advances one run at a time; use modal")

    @abstractmethod
    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block of the excitation, (n,) or (n, n_inputs) in m/s² or N, one sample per step.

        Returns absolute accelerations, displacements, contact forces, grease forces: (n, n_sensors + 3 n_rows); and
        n_bushings columns more, 1 where an end of the bushing lies beyond its gap and 0 elsewhere, if the engine knows.
        Raises `SimulationError` if the simulation diverges or its solver warns.
        """

    def before(self) -> np.ndarray | None:
        """Return the columns of `advance` at rest before the start, (columns,); None if that is zeros."""
        return None

    def balanced(self, excitation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate one block; return the columns of `advance`, and its steps' energies, (n, columns) of `energies`."""
        raise ClearanceError("the engine does not tell its energies, so they cannot be balanced; use modal or links")


MAX_COUNT = 2**53  # steps per sample, beyond which a double does not hold every integer
_ENGINES: dict[str, type[Engine]] = {}


@dataclass(frozen=True)
class Engine(Registered, ABC):
    """Base of simulation engines. Fields of a subclass are the engine's settings."""

    known, refusal, called = _ENGINES, ClearanceError, "engine {name}"
    at_once: ClassVar[int] = 1
    """number of cases that batches hand over together; if more than one, those of one `SimulationRun.batch_key` run as
    one program, and ``advance`` of `SimulationRun.combine` takes an excitation (n, n_inputs) of each"""

    @abstractmethod
    def largest_step(self, rig: Rig, law: Law) -> float:
        """Return the longest stable and accurate time step in s, safety factor included.

        Parameters
        ----------
        rig : Rig
            The rig.
        law : Law
            The clearance's law.
        """

    @abstractmethod
    def start(self, rig: Rig, law: Law, kind: Kinds, step: float) -> SimulationRun:
        """Begin a simulation at rest.

        Parameters
        ----------
        rig : Rig
            The rig.
        law : Law
            The clearance's law.
        kind : str or tuple of str
            Kind of the excitation, "base" or "force"; of several inputs, of each.
        step : float
            Time step, s.
        """


def default_engine(rig: Rig) -> str:
    """Return the name of a rig's default engine, "links" for shafts in one plane.

    Parameters
    ----------
    rig : Rig
        The rig; one in space, or whose points name directions, is simulated by its modes.
    """
    from .linkage import cannot_be_linked

    directed = directed_points(rig) or any(load.torque for load in rig.loads)
    return "modal" if rig.moves_across or directed or cannot_be_linked(rig) else "links"


def get_engine(engine: str | Engine) -> Engine:
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


def in_columns(excitation: np.ndarray) -> np.ndarray:
    """Return inputs (n,) or (n, n_inputs) as a contiguous array (n, n_inputs) for compiled loops."""
    return np.ascontiguousarray(excitation if excitation.ndim == 2 else excitation[:, None])


def step_factor(fs: float, largest_step: float) -> int:
    """Return the steps per sample at fs, Hz: the smallest whole number with a step of at most ``largest_step``, s."""
    rate = fs * largest_step
    return max(1, math.ceil(1 / rate - 1e-9)) if rate > 1 / MAX_COUNT else MAX_COUNT


def location(rig: Rig, bushing: int) -> str:
    """Return the place of a bushing for messages; "at the tip" for a rig without bushings."""
    return f"at bushings[{bushing}] ({rig.bushings[bushing].where})" if rig.bushings else "at the tip"


def diverged(rig: Rig, engine: Engine, time: float, bushing: int) -> SimulationError:
    """Return the error of a simulation that diverged at a bushing at a time, s."""
    return SimulationError(
        f"rig {rig.name!r}: the {engine.name} simulation diverged at t = {time:.6f} s {location(rig, bushing)}; "
        "the law is too stiff or too strongly damped for the time step, or the excitation is far out of range"
    )
