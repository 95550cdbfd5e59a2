"""Contacts of several rigs side by side: their laws work on all lanes at once where they are written so that they can.

As those of greases, see lane_greases.py; laws that follow time or amplitude are followed lane by lane, by `kernel`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.jit import jit
from .contact import ContactModel
from .follower import end_values, impact_speed, signed_penetration
from .kernel import Clearance
from .lane_greases import law_in_lanes
from .lanes import any_below, load, register_contact_law, rows, signed, store, where_above

__all__ = ["LaneContacts", "contact_in_lanes", "lane_contacts", "penetration_in_lanes"]

LOWER, UPPER, OUT, IMPACT, PARAMETERS = 0, 1, 2, 4, 6
"""rows of a bushing's numbers: its walls, what a law answers, the memories of both ends' contacts"""


class LaneContacts(NamedTuple):
    """Contacts as compiled loops with lanes know them, at rest; ``numbers`` are changed in place."""

    law: np.ndarray  # (n_bushings,) addresses; 0 where the law is called lane by lane
    first: np.ndarray  # (n_bushings,) row of the numbers in which a bushing's begin
    numbers: np.ndarray  # (rows, lanes)


def lane_contacts(kinds: Sequence[Sequence[type[ContactModel]]], parts: Sequence[Clearance]) -> LaneContacts:
    """Put together the contacts of kinds (lanes, n_bushings) that stand in the records of as many rigs."""
    lanes, n = len(parts), len(parts[0].bushings)
    law, first, numbers, row = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64), [np.zeros((0, lanes))], 0
    for j, of_lanes in enumerate(zip(*kinds)):
        records = [part.bushings[j] for part in parts]
        like = {(kind.law, record["width"], record["rows"] == 1) for kind, record in zip(of_lanes, records)}
        if lanes == 1 or len(like) > 1 or records[0]["rows"] > 1:
            continue
        law[j] = law_in_lanes(of_lanes[0].law, register_contact_law(lanes))
        block = np.zeros((PARAMETERS + records[0]["width"], lanes))
        for lane, (record, part) in enumerate(zip(records, parts)):
            start = record["table"]
            block[[LOWER, UPPER], lane] = record["lower"], record["upper"]
            block[PARAMETERS:, lane] = part.numbers[start : start + record["width"]]
            block[IMPACT : IMPACT + 2, lane] = part.numbers[part.states[j]["impact"] :][:2]
        first[j], row = row, row + len(block)
        numbers.append(block)
    return LaneContacts(law, first, np.concatenate(numbers))


@jit(inline="always")
def penetration_in_lanes(
    contacts: LaneContacts, j: int, end: int, x: np.ndarray, p: int, lanes: tuple[int, ...], depth: np.ndarray
) -> bool:
    """Fill row p of depth with the signed penetrations of an end of bushing j, at row p of x; say whether any is."""
    _, firsts, numbers = contacts
    first, here = firsts[j], load(x, p, lanes)
    g = signed_penetration(here, load(numbers, first + LOWER, lanes), load(numbers, first + UPPER, lanes))
    store(depth, p, g, lanes)
    if any_below(0.0 - abs(g), 0.0):
        return True
    store(numbers, first + IMPACT + end, 0.0 * here, lanes)
    return False


@jit(inline="always")
def contact_in_lanes(
    contacts: LaneContacts, j: int, end: int, depth: np.ndarray, speed: np.ndarray, p: int, lanes: tuple[int, ...],
    elastic: np.ndarray, viscous: np.ndarray, side: np.ndarray,
) -> None:  # fmt: skip
    """Follow the contacts of an end of bushing j, as `contact_step` does: row p of signed penetrations and speeds.

    Row p of its elastic force, damping and side is filled; those of lanes in the gap are zeros.
    """
    law, firsts, numbers = contacts
    first, g = firsts[j], load(depth, p, lanes)
    inwards = signed(load(speed, p, lanes), g)
    impact = impact_speed(load(numbers, first + IMPACT + end, lanes), g, inwards)
    store(numbers, first + IMPACT + end, signed(impact, g), lanes)
    parameters, out = rows(numbers, first + PARAMETERS, lanes), rows(numbers, first + OUT, lanes)
    k, c = end_values(law[j], parameters, out, abs(g), inwards, impact)
    store(elastic, p, k * g, lanes)
    store(viscous, p, where_above(c, abs(g)), lanes)
    store(side, p, signed(0.0 * g + 1.0, g), lanes)
