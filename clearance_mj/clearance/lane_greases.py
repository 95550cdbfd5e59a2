"""Greases of several rigs side by side: their laws work on all lanes at once where they are written so that they can.

A law can if it is made of + - * /, abs and the functions of lanes.py, without branches; other laws are called lane by
lane, by `kernel.grease_step`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numba.core.errors import NumbaError

from ..core.jit import jit
from .grease import GreaseModel
from .kernel import Clearance
from .lanes import load, register_law, rows, store
from .pointers import address, call_law

__all__ = ["LaneGreases", "grease_in_lanes", "lane_greases", "law_in_lanes"]

OFFSET, PRELOAD, DISPLACEMENT, OUT, PARAMETERS = 0, 1, 2, 3, 5
"""rows of a bushing's numbers; the states follow the parameters"""


class LaneGreases(NamedTuple):
    """Greases as compiled loops with lanes know them, at rest; ``numbers`` are changed in place."""

    law: np.ndarray  # (n_bushings,) addresses; 0 where the law is called lane by lane
    first: np.ndarray  # (n_bushings,) row of the numbers in which a bushing's begin
    states: np.ndarray  # (n_bushings,) row in which its states begin
    numbers: np.ndarray  # (rows, lanes)


def lane_greases(
    models: Sequence[Sequence[GreaseModel]], offsets: np.ndarray, parts: Sequence[Clearance] = ()
) -> LaneGreases:
    """Put together the greases (lanes, n_bushings) of bushings with offsets (lanes, n_bushings), m.

    ``parts`` are the records of as many rigs, in whose states they begin; without, they begin at 0.
    """
    lanes, n = offsets.shape
    law, first, states, numbers = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64), np.zeros(n, np.int64), []
    row = 0
    for j, of_lanes in enumerate(zip(*models)):
        law[j] = 0 if lanes == 1 else _law(of_lanes)
        if law[j]:
            parameters = np.transpose([model.parameters() for model in of_lanes])
            rest = [model.at_rest(offset)[0] for model, offset in zip(of_lanes, offsets[:, j])]
            block = np.zeros((PARAMETERS + len(parameters) + of_lanes[0].states(), lanes))
            block[OFFSET], block[PRELOAD], block[PARAMETERS : PARAMETERS + len(parameters)] = (
                offsets[:, j], rest, parameters
            )  # fmt: skip
            for lane, (part, model) in enumerate(zip(parts, of_lanes)):
                state = part.states[j]
                block[DISPLACEMENT, lane] = state["displacement"]
                block[PARAMETERS + len(parameters) :, lane] = part.numbers[state["grease"] :][: model.states()]
            first[j], states[j] = row, row + PARAMETERS + len(parameters)
            row += len(block)
            numbers.append(block)
    return LaneGreases(law, first, states, np.concatenate([np.zeros((0, lanes)), *numbers]))


def _law(models: Sequence[GreaseModel]) -> int:
    """Address of the one law of models that work on all lanes at once, or 0."""
    kinds = {(type(model), len(model.parameters()), model.states()) for model in models}
    return 0 if len(kinds) > 1 else law_in_lanes(models[0].law, register_law(len(models)))


def law_in_lanes(law: Callable[..., None], signature: Any) -> int:
    """Return the address of a law that works on all lanes at once, or 0 if it is not written so that it can."""
    if (law, signature) not in _BY_LANE:
        try:
            return address(law, signature)
        except NumbaError:
            _BY_LANE.add((law, signature))
    return 0


_BY_LANE: set[tuple[Callable[..., None], Any]] = set()
"""laws, and signatures of registers, that are called lane by lane"""


@jit(inline="always")
def grease_in_lanes(
    greases: LaneGreases,
    j: int,
    x: np.ndarray,
    step: float,
    lanes: tuple[int, ...],
    elastic: np.ndarray,
    viscous: np.ndarray,
) -> None:
    """Move the greases of bushing j to row j of x; fill that of their elastic forces and dampings."""
    law, firsts, states, numbers = greases
    first, here = firsts[j], load(x, j, lanes)
    dx = here - load(numbers, first + DISPLACEMENT, lanes)
    store(numbers, first + DISPLACEMENT, here, lanes)
    parameters, memory = rows(numbers, first + PARAMETERS, lanes), rows(numbers, states[j], lanes)
    place, out = here + load(numbers, first + OFFSET, lanes), rows(numbers, first + OUT, lanes)
    call_law(law[j], parameters, memory, place, dx, step, out)
    store(elastic, j, load(numbers, first + OUT, lanes) - load(numbers, first + PRELOAD, lanes), lanes)
    store(viscous, j, load(numbers, first + OUT + 1, lanes), lanes)
