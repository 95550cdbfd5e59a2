"""Impacts and largest values of models under random excitation, marched in blocks.

Contacts that begin, penetration and contact force are those of the engine's own steps: impacts are shorter than a
record's anti-alias filter rings. Accelerations pass that filter, as in a data acquisition system.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.special

from ..clearance.law import Law
from ..core.errors import ClearanceError, ExcitationError
from ..engines import Engine
from ..engines.simulation import Simulation
from ..engines.together import lane_groups, lanes_of
from ..rig import Bushing, Rig
from ..signals.excitation import Excitation
from ..signals.sampling import Decimator

__all__ = ["BlockMaxima", "ImpactRate", "groups_side_by_side", "impact_rate", "march"]

STEPS = 512  # samples of a record per block of a march
BATCHES = 20  # pieces of a record for the variance of the counts


class BlockMaxima(NamedTuple):
    """Largest values of one model in each of consecutive samples."""

    depth: np.ndarray
    """(n_bushings, n) m beyond the gap at the bushing's middle, negative in the gap"""
    contact_force: np.ndarray
    """(n_bushings, n) magnitude, N"""
    acceleration: np.ndarray
    """(n_sensors, n) magnitude, m/s²; some samples delayed, and as many fewer at first"""
    impacts: np.ndarray
    """(n_bushings, n) number of contacts that begin"""


@dataclass(frozen=True)
class ImpactRate:
    """Impacts per second of a bushing, with an interval."""

    value: float
    """1/s"""
    low: float
    """1/s, 5 % quantile"""
    high: float
    """1/s, 95 % quantile"""
    dispersion: float
    """variance of the counts of twentieths of the record over their mean: 1 for independent impacts"""


def impact_rate(impacts: np.ndarray, duration: float) -> ImpactRate:
    """Return the rate of impacts, which may be clustered.

    Counts of twentieths of the record have the variance φ times their mean, φ ≥ 1: as of N/φ independent events.
    The interval is that of a Poisson process with Jeffreys' prior, Gamma(N/φ + 1/2) over duration/φ.

    Parameters
    ----------
    impacts : ndarray, shape (n,)
        Contacts that begin in each of consecutive equal times.
    duration : float
        Total time, s.
    """
    size = len(impacts) // BATCHES
    counts = impacts[: size * BATCHES].reshape(BATCHES, size).sum(axis=1) if size else impacts
    total = float(impacts.sum())
    dispersion = max(1.0, float(counts.var(ddof=1) / counts.mean())) if total and counts.size > 1 else 1.0
    low, high = scipy.special.gammaincinv(total / dispersion + 0.5, [0.05, 0.95]) * dispersion / duration
    return ImpactRate(total / duration, 0.0 if not total else float(low), float(high), dispersion)


def march(
    cases: Sequence[tuple[Rig, Law]], pieces: Iterable[Excitation], engine: Engine, settling: float
) -> Iterator[list[BlockMaxima]]:
    """March models together under one excitation; yield a block of each, from the end of the settling on.

    Models of one step and size share the lanes of the modal engine, others are marched one by one.

    Parameters
    ----------
    cases : sequence of (Rig, Law)
        Up to 8; alike in sizes where there are several.
    pieces : iterable of Excitation
        Consecutive pieces of one excitation.
    engine : Engine
        Such as ``Modal()``.
    settling : float
        Time from the start that is left out, s.

    Raises
    ------
    ClearanceError
        As `simulate`; if a rig has no clearance; if models that are not alike are to be side by side.
    """
    if not all(rig.bushings for rig, _ in cases):
        raise ClearanceError("a rig without clearances has no impacts; give it bushings")
    pieces = iter(pieces)
    if (first := next(pieces, None)) is None:
        raise ExcitationError("there is no piece of an excitation")
    simulations = [Simulation(rig, first, law, engine) for rig, law in cases]
    advance, interpolator = _make_advance(simulations), simulations[0].interpolator
    watches, waiting = [_Reduction(simulation) for simulation in simulations], round(settling * first.fs)
    count = STEPS * interpolator.factor
    for piece in itertools.chain([first], pieces, [None]):
        fast = interpolator.flush() if piece is None else interpolator.push(piece.value.T)
        for start in range(0, fast.size, count):
            blocks = [watch.see(output) for watch, output in zip(watches, advance(fast[start : start + count]))]
            size = blocks[0].depth.shape[1]
            if waiting < size:
                yield [BlockMaxima(*(part[:, waiting:] for part in block)) for block in blocks]
            waiting = max(0, waiting - size)


def groups_side_by_side(cases: Sequence[tuple[Rig, Law]], noise: Excitation, engine: Engine) -> list[list[int]]:
    """Return groups of models that can be marched together: those of one step and size, on the modal engine.

    Parameters
    ----------
    cases : sequence of (Rig, Law)
        Models.
    noise : Excitation
        Excitation of the rate and kind under which they are marched.
    engine : Engine
        Such as ``Modal()``.
    """
    return lane_groups([Simulation(rig, noise, law, engine).run.batch_key() for rig, law in cases])


def _make_advance(simulations: Sequence[Simulation]) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that advances all of them by a block of steps, (n,), to outputs (n_models, n, columns)."""
    runs = [simulation.run for simulation in simulations]
    if len(runs) == 1:
        return lambda block: runs[0].advance(block)[None]
    if runs[0].batch_key() is None:
        raise ClearanceError("models side by side are those of the modal engine; march others one by one")
    if len({run.batch_key() for run in runs}) > 1:
        raise ClearanceError("models side by side need one time step and as many modes, sensors and clearances")
    return lanes_of(runs).advance


class _Reduction:
    """Reduction of the outputs of a simulation's steps to the largest values of each sample."""

    def __init__(self, simulation: Simulation) -> None:
        self.rig, self.factor = simulation.rig, simulation.interpolator.factor
        self.touched = np.zeros((1, len(self.rig.bushings)), bool)
        self.decimator = Decimator(len(self.rig.sensors), self.factor)

    def see(self, outputs: np.ndarray) -> BlockMaxima:
        """Reduce steps, (n, columns), of a whole number of samples."""
        n, rows = len(self.rig.bushings), self.rig.clearance_rows
        ends = len(self.rig.sensors) + self.rig.n_rows * np.arange(4)
        acceleration, displacement, contact, _, touch = np.split(outputs, ends, axis=1)
        force = np.stack([np.linalg.norm(contact[:, part], axis=1) for part in rows], axis=1)
        touches = touch[:, :n] > 0.5 if touch.shape[1] >= n else force > 0
        begins = touches & ~np.concatenate((self.touched, touches[:-1]))
        self.touched = touches[-1:]
        depth = np.stack([_penetration(b, displacement[:, part]) for b, part in zip(self.rig.bushings, rows)], axis=1)
        depth, force, begins = (each.reshape(-1, self.factor, n) for each in (depth, force, begins))
        acceleration = np.abs(self.decimator.push(acceleration))
        return BlockMaxima(depth.max(axis=1).T, force.max(axis=1).T, acceleration.T, begins.sum(axis=1).T)


def _penetration(bushing: Bushing, displacement: np.ndarray) -> np.ndarray:
    """Return the penetration (n,), m, of displacements (n, 1), or (n, 2) along probes; negative in the gap."""
    if displacement.shape[1] == 2:
        position = (displacement[:, 0] + 1j * displacement[:, 1]) * np.exp(1j * bushing.probe_angle)
        return np.abs(position + bushing.offset_y + 1j * bushing.offset) - bushing.gap
    lower, upper = bushing.walls
    return np.maximum(displacement[:, 0] - upper, lower - displacement[:, 0])
