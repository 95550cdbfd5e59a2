"""Several rigs and laws under one excitation, side by side in the lanes of the modal engine's loop.

For whoever compares many variants of one rig: a fit needs one simulation for every parameter and difference.
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
from .modal import Modal
from .simulation import Simulation

__all__ = ["simulate_and_keep", "simulate_together"]

LANES = (4, 8)  # cases that are simulated side by side; each number is compiled once
T = TypeVar("T")


def simulate_together(
    cases: Sequence[tuple[Rig, Law]], excitation: Excitation, engine: Modal | None = None, workers: int | None = None
) -> list[Response]:
    """Simulate rigs with laws, all under one excitation, by the modal engine.

    What `simulate` finds for each, to rounding, at a lower cost where there are many.

    Parameters
    ----------
    cases : sequence of (Rig, Law)
        Their clearances, sensors, structures and laws may differ in every number.
    excitation : Excitation
        Base acceleration or shaker force.
    engine : Modal, optional
        Engine with settings of its own.
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
    """Simulate as `simulate_together` and keep of each response what a function makes of it, in the same threads.

    Parameters
    ----------
    cases, excitation, engine, workers
        As in `simulate_together`.
    keep : callable
        Takes a response; the response is gone once it has returned.
    forces : bool
        Whether it looks at forces or contact of the bushings or provenance; without, rigs that do not turn have none.

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
    of_shape: dict[object, list[int]] = defaultdict(list)
    for i, simulation in enumerate(simulations):
        of_shape[_shared(simulation) or i].append(i)
    groups = [group[i : i + LANES[-1]] for group in of_shape.values() for i in range(0, len(group), LANES[-1])]

    drives = {factor: _drive(excitation, factor) for factor in {s.interpolator.factor for s in simulations}}

    def kept(group: Sequence[int]) -> list[T]:
        of_group = [simulations[i] for i in group]
        if _shared(of_group[0]) is None:
            return [keep(simulation.whole()) for simulation in of_group]
        responses = _side_by_side(of_group, drives[of_group[0].interpolator.factor], forces)
        return [keep(response) for response in responses]

    found: dict[int, T] = {}
    with ThreadPoolExecutor(workers_to_use(workers)) as pool:
        for group, of_group in zip(groups, pool.map(kept, groups)):
            found |= zip(group, of_group)
    return [found[i] for i in range(len(cases))]


def _drive(excitation: Excitation, factor: int) -> np.ndarray:
    """An excitation at the steps, with zeros for as long as the last sample's filter looks ahead."""
    value = excitation.value.T
    interpolator = Interpolator(factor, *value.shape[1:])
    return interpolator.push(np.concatenate((value, np.zeros((2 * interpolator.ahead, *value.shape[1:])))))


def _side_by_side(simulations: Sequence[Simulation], drive: np.ndarray, forces: bool) -> Iterator[Response]:
    """Responses of simulations of the same step and sizes; the lanes that are left over repeat the last one."""
    lanes = next(count for count in LANES if count >= len(simulations))
    first, runs = simulations[0], [simulation.run for simulation in simulations]
    runs += runs[-1:] * (lanes - len(runs))
    size = first.interpolator.factor, first.excitation.value.shape[-1]
    needed = forces or any(s.completion.forces for s in simulations)
    outputs = first.run.beside(runs).whole(drive, *size, needed)
    moves = any(simulation.completion.base_moves for simulation in simulations)
    motion = decimate(first.completion.push(drive), size[0])[: size[1]] if moves else None
    for simulation, output in zip(simulations, outputs):
        simulation.completion.add(output.T, motion)
    outputs.flags.writeable = False
    return (s.response(s.excitation.value.T, output.T) for s, output in zip(simulations, outputs))


def _shared(simulation: Simulation) -> object | None:
    """What it shares with others that can be side by side; None where it cannot be, or its channels are late."""
    return None if simulation.late else simulation.run.alike()
