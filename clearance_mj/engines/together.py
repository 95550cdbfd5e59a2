"""Several rigs and laws under one excitation, side by side in the lanes of the modal engine's loop.

For whoever compares many variants of one rig: a fit needs one simulation for every parameter and difference.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import cast

import numpy as np

from ..clearance.law import Law
from ..rig import Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .modal import Modal, ModalRun, SideBySide
from .simulation import Simulation

__all__ = ["simulate_together"]

LANES = (4, 8)
"""cases that are simulated side by side; each number is compiled once"""


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
        With settings of its own.
    workers : int, optional
        Threads. Default: one for each processor.

    Returns
    -------
    list of Response
        In the order of the cases.

    Raises
    ------
    ClearanceError
        Whatever `simulate` raises.
    """
    simulations = [Simulation(rig, excitation, law, engine or Modal()) for rig, law in cases]
    alike: dict[object, list[int]] = defaultdict(list)
    for i, simulation in enumerate(simulations):
        alike[simulation.step, tuple(part.shape for part in _run(simulation).shaft)].append(i)
    groups = [group[i : i + LANES[-1]] for group in alike.values() for i in range(0, len(group), LANES[-1])]
    found: dict[int, Response] = {}
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        for group, responses in zip(groups, pool.map(_side_by_side, ([simulations[i] for i in g] for g in groups))):
            found |= zip(group, responses)
    return [found[i] for i in range(len(cases))]


def _side_by_side(simulations: Sequence[Simulation]) -> list[Response]:
    """Responses of simulations of the same step and sizes; the lanes that are left over repeat the last one."""
    if len(simulations) == 1:
        return [simulations[0].whole()]
    lanes = next(count for count in LANES if count >= len(simulations))
    first, runs = simulations[0], [_run(simulation) for simulation in simulations]
    value, interpolator = first.excitation.value, first.interpolator
    fast = interpolator.push(np.append(value, np.zeros(2 * interpolator.ahead)))
    together = SideBySide(runs + runs[-1:] * (lanes - len(runs)))
    outputs = together.whole(fast, interpolator.factor, value.size)
    outputs.flags.writeable = False
    return [s.response(s.excitation.value, output.T) for s, output in zip(simulations, outputs)]


def _run(simulation: Simulation) -> ModalRun:
    return cast(ModalRun, simulation.run)
