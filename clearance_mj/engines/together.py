"""Simulations of several rigs and laws under one excitation, in the lanes of the modal engine's loop.

For comparisons of many variants of one rig: a fit needs one simulation for every parameter and difference.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from ..clearance.law import Law
from ..core.tasks import workers_to_use
from ..rig import Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from ..signals.sampling import Interpolator, decimate
from .base import SeveralRuns, SimulationRun
from .modal import Modal
from .simulation import Simulation

__all__ = ["lane_groups", "lanes_of", "simulate_and_keep", "simulate_together"]

LANES = (4, 8)  # numbers of cases that are simulated in lanes; each is compiled once
T = TypeVar("T")


def simulate_together(
    cases: Sequence[tuple[Rig, Law]], excitation: Excitation, engine: Modal | None = None, workers: int | None = None
) -> list[Response]:
    """Simulate rigs with laws, all under one excitation, by the modal engine.

    The responses are those of `simulate`, to rounding, at a lower cost for many cases.

    Parameters
    ----------
    cases : sequence of (Rig, Law)
        Their clearances, sensors, structures and laws may differ in every number.
    excitation : Excitation
        Base acceleration or shaker force.
    engine : Modal, optional
        Engine with its settings.
    workers : int, optional
        Threads. Default: one for each processor.

    Returns
    -------
    list of Response
        Responses in the order of the cases.

    Raises
    ------
    ClearanceError
        Whatever `simulate` raises.
    """
    return simulate_and_keep(cases, excitation, lambda response: response, engine, workers)


def simulate_and_keep(
    cases: Sequence[tuple[Rig, Law]], excitation: Excitation, keep: Callable[[Response], T],
    engine: Modal | None = None, workers: int | None = None, forces: bool = True,
) -> list[T]:  # fmt: skip
    """Simulate as `simulate_together` and return a function's value for each response, called in the same threads.

    Parameters
    ----------
    cases, excitation, engine, workers
        As in `simulate_together`.
    keep : callable
        Takes a response; the response is discarded once it has returned.
    forces : bool
        True if it uses forces or contact of the bushings or provenance; else rigs that do not turn have none.

    Returns
    -------
    list
        Values that ``keep`` returned, in the order of the cases.

    Raises
    ------
    ClearanceError
        Whatever `simulate` raises.
    """
    simulations = [Simulation(rig, excitation, law, engine or Modal()) for rig, law in cases]
    groups = lane_groups([_lane_key(simulation) for simulation in simulations])
    drives = {factor: _drive(excitation, factor) for factor in {s.interpolator.factor for s in simulations}}

    def kept(group: Sequence[int]) -> list[T]:
        members = [simulations[i] for i in group]
        if _lane_key(members[0]) is None:
            return [keep(simulation.whole()) for simulation in members]
        responses = _simulate_in_lanes(members, drives[members[0].interpolator.factor], forces)
        return [keep(response) for response in responses]

    results: dict[int, T] = {}
    with ThreadPoolExecutor(workers_to_use(workers)) as pool:
        for group, of_group in zip(groups, pool.map(kept, groups)):
            results |= zip(group, of_group)
    return [results[i] for i in range(len(cases))]


def lane_groups(shared: Sequence[object | None]) -> list[list[int]]:
    """Return groups of runs, by index, that can share lanes, each of at most as many as there are lanes.

    Parameters
    ----------
    shared : sequence
        Key of each that is equal for runs that can share lanes, such as `SimulationRun.batch_key`; None: with none.
    """
    alike: dict[object, list[int]] = defaultdict(list)
    for i, key in enumerate(shared):
        alike[key or i].append(i)
    return [group[i : i + LANES[-1]] for group in alike.values() for i in range(0, len(group), LANES[-1])]


def lanes_of(runs: Sequence[SimulationRun]) -> SeveralRuns:
    """Combine runs that are alike in lanes; spare lanes repeat the last run.

    Parameters
    ----------
    runs : sequence of Run
        Runs of one group of `lane_groups`.
    """
    lanes = next(count for count in LANES if count >= len(runs))
    return runs[0].combine([*runs, *[runs[-1]] * (lanes - len(runs))])


def _drive(excitation: Excitation, factor: int) -> np.ndarray:
    """Return an excitation at the steps, with zeros for the look-ahead of the last sample's filter."""
    value = excitation.value.T
    interpolator = Interpolator(factor, *value.shape[1:])
    return interpolator.push(np.concatenate((value, np.zeros((2 * interpolator.ahead, *value.shape[1:])))))


def _simulate_in_lanes(simulations: Sequence[Simulation], drive: np.ndarray, forces: bool) -> Iterator[Response]:
    """Return the responses of simulations of the same step and sizes, run in lanes."""
    first, runs = simulations[0], [simulation.run for simulation in simulations]
    size = first.interpolator.factor, first.excitation.value.shape[-1]
    needed = forces or any(s.completion.forces for s in simulations)
    outputs = lanes_of(runs).whole(drive, *size, needed)
    moves = any(simulation.completion.base_moves for simulation in simulations)
    motion = decimate(first.completion.push(drive), size[0])[: size[1]] if moves else None
    for simulation, output in zip(simulations, outputs):
        simulation.completion.add(output.T, motion)
    outputs.flags.writeable = False
    return (s.response(s.excitation.value.T, output.T) for s, output in zip(simulations, outputs))


def _lane_key(simulation: Simulation) -> object | None:
    """Return the key of simulations that can share lanes; None if it cannot, or its channels are delayed."""
    return None if simulation.late else simulation.run.batch_key()
