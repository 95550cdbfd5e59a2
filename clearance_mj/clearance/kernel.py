"""The one compiled kernel of clearances: engines, energy balances and identification take their steps with it.

In every step a loop calls for each bushing `grease_step` and `follow_law`, and `contact_step` for each of its two ends.

Loops give displacements from rest. Where the shaft does not rest in the bushing's middle, grease models and amplitude
laws are given its distance from there: that is what thins the film. At rest the grease's springs are in equilibrium
with the shaft's static load, so that only what they change by moves it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, Protocol, get_type_hints

import numpy as np

from ..core.errors import LawError
from ..core.jit import jit
from ..rig import Bushing as OfRig
from ..rig import Grease
from .follower import end_values, impact_speed, lasting, signed_penetration
from .grease import GreaseModel
from .greases.bouc_wen import BoucWen
from .lanes import signed
from .pointers import at, call_law
from .table import LawTable

__all__ = [
    "Clearance", "clearance_records", "contact_step", "follow_law", "grease_step", "greases_of", "joined",
    "one_each", "side_by_side", "tabulate",
]  # fmt: skip


class Bushing:
    """Record of what compiled loops know of a bushing."""

    gap: float  # m
    lower: float  # displacements from rest at which the walls are met, m; infinite without a wall
    upper: float
    offset: float  # m from the bushing's middle to the shaft at rest
    preload: float  # of the grease's springs at rest, N
    held: float  # by them at rest, J
    step: float  # s
    decay: float  # of the envelope in a step
    by_amplitude: bool  # the law's abscissa is the envelope, m, instead of time, s
    adhesion: bool  # the contact may pull
    rows: int  # of the law's table
    abscissa: int  # where it begins in the numbers
    table: int  # where the contact's parameters begin, row after row
    width: int  # how many they are in a row
    grease: int  # where the grease's parameters begin
    contact_law: int  # addresses of the models' functions
    contact_energy: int
    grease_law: int
    grease_energy: int


class State:
    """Record of what a bushing remembers."""

    displacement: float  # of the last step, m
    envelope: float  # of the motion, m
    impact: int  # where the memories of both ends' contacts begin, as in `follower`, m/s
    grease: int  # where the state of the grease begins
    contact: int  # where the contact's parameters begin that hold now
    out: int  # where models write their two answers


BUSHING, STATE = (np.dtype(list(get_type_hints(kind).items()), align=True) for kind in (Bushing, State))
"""The records as arrays have them"""


class Clearance(NamedTuple):
    """A rig's bushings in records, and the numbers, of any number, that belong to them.

    Loops take it apart before they begin: compiled code counts references to arrays that it takes out of tuples.
    """

    bushings: np.ndarray  # (n_bushings,) `Bushing`
    states: np.ndarray  # (n_bushings,) `State`, changed in place
    numbers: np.ndarray  # (n,) speeds of impact of all ends, then what the records point at; changed in place


class WithBushings(Protocol):
    """A rig, or what else has bushings."""

    @property
    def bushings(self) -> Sequence[OfRig]:
        """Bushings."""


class WithTable(Protocol):
    """A law."""

    @property
    def grease(self) -> Any:
        """Grease of the bushings, or None."""

    def table(self, n_bushings: int) -> LawTable:
        """As `Law.table`."""


def greases_of(rig: WithBushings, law: WithTable) -> list[GreaseModel]:
    """Return the grease model of each bushing: the law's, if it has one, or else the rig's."""
    return one_each([b.grease for b in rig.bushings] if law.grease is None else law.grease, len(rig.bushings))


def one_each(greases: Sequence[Grease | GreaseModel], n: int) -> list[GreaseModel]:
    """Return the model of each of n bushings, of what a rig or a law gives for all or each."""
    if len(greases) not in (1, n):
        raise LawError(f"the law holds grease for {len(greases)} bushings, the rig has {n}; give one or {n}")
    models = [g if isinstance(g, GreaseModel) else BoucWen(g) for g in greases]
    return models * n if len(models) == 1 else models


def clearance_records(rig: WithBushings, law: WithTable, step: float) -> Clearance:
    """Put together what compiled loops with a step, s, know of a rig's bushings, at rest."""
    n = len(rig.bushings)
    table, bushings, states = law.table(n), np.zeros(n, BUSHING), np.zeros(n, STATE)
    numbers: list[float] = [0.0] * 2 * n
    place = tabulate(bushings, table, step, numbers)
    for j, bushing in enumerate(rig.bushings):
        bushings["gap"][j], bushings["offset"][j] = bushing.gap, bushing.offset
        bushings["lower"][j], bushings["upper"][j] = bushing.walls
    states["impact"] = 2 * np.arange(n)
    for j, model in enumerate(greases_of(rig, law)):
        bushings["grease_law"][j], bushings["grease_energy"][j] = model.addresses()
        bushings["grease"][j] = place(model.parameters())
        bushings["preload"][j], bushings["held"][j] = model.at_rest(rig.bushings[j].offset)
        bushings["table"][j] = place(table.parameters[:, j].ravel())
        states["grease"][j] = place([0.0] * model.states())
        states["contact"][j] = place(table.parameters[0, j])
        states["out"][j] = place([0.0, 0.0])
    return Clearance(bushings, states, np.array(numbers, dtype=float))


def tabulate(
    bushings: np.ndarray, table: LawTable, step: float, numbers: list[float]
) -> Callable[[Iterable[float]], int]:
    """Write what a law's table says into records of bushings; return what adds more numbers and says where they are."""

    def place(values: Iterable[float]) -> int:
        start = len(numbers)
        numbers.extend(values)
        return start

    bushings["step"] = step
    bushings["decay"] = np.exp(-step / table.release) if table.by_amplitude else 0.0
    bushings["rows"], _, bushings["width"] = table.parameters.shape
    bushings["abscissa"] = place(table.abscissa)
    for name in ("by_amplitude", "adhesion", "contact_law", "contact_energy"):
        bushings[name] = getattr(table, name)
    return place


def side_by_side(parts: Sequence[Clearance]) -> Clearance:
    """Return copies of the records of several rigs as those of one, rig after rig."""
    return Clearance(*joined(parts, ("abscissa", "table", "grease"), ("impact", "grease", "contact", "out")))


def joined(
    parts: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], of_bushings: Sequence[str], of_states: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return copies of records and numbers, part after part; the fields that are named say where numbers begin."""
    bushings, states, numbers = (np.concatenate(arrays) for arrays in zip(*parts))
    start = np.repeat(np.cumsum([0, *(part[2].size for part in parts[:-1])]), [part[0].size for part in parts])
    for records, names in ((bushings, of_bushings), (states, of_states)):
        for name in names:
            records[name] += start
    return bushings, states, numbers


@jit(inline="always")
def grease_step(bushing: Bushing, state: State, numbers: np.ndarray, x: float) -> tuple[float, float]:
    """Move the grease of a bushing to x, m; return its elastic force above that at rest, N, and its damping, N s/m.

    ``state`` and ``numbers`` are changed in place, here and below.
    """
    dx = x - state.displacement
    state.displacement = x
    parameters, memory, out = at(numbers, bushing.grease), at(numbers, state.grease), at(numbers, state.out)
    call_law(bushing.grease_law, parameters, memory, x + bushing.offset, dx, bushing.step, out)
    return out[0] - bushing.preload, out[1]


@jit(inline="always")
def follow_law(bushing: Bushing, state: State, numbers: np.ndarray, x: float, time: float) -> None:
    """Find the contact's parameters at a time, s: linear between the law's rows, the ends hold beyond."""
    last = bushing.rows - 1
    if last == 0:
        return
    state.envelope = max(abs(x + bushing.offset), state.envelope * bushing.decay)
    now, abscissa = state.envelope if bushing.by_amplitude else time, at(numbers, bushing.abscissa)
    row, after, share = 0, last, 0.0
    if now >= abscissa[last]:
        row = last
    elif now > abscissa[0]:
        while after - row > 1:  # numpy.searchsorted would count references
            middle = (row + after) // 2
            if abscissa[middle] <= now:
                row = middle
            else:
                after = middle
        share = (now - abscissa[row]) / (abscissa[row + 1] - abscissa[row])
    values, table = at(numbers, state.contact), at(numbers, bushing.table + row * bushing.width)
    for i in range(bushing.width):
        values[i] = table[i]
        if share > 0.0:
            values[i] += share * (table[bushing.width + i] - table[i])


@jit(inline="always")
def contact_step(
    bushing: Bushing, state: State, numbers: np.ndarray, end: int, x: float, speed: float, in_gap: bool
) -> tuple[float, float, float]:
    """Follow the contact of end 0 or 1; return signed penetration, m, stiffness, N/m, and damping, N s/m.

    A contact begins when the gap is used up, which fixes its impact speed, and is over in the gap. Each end, at x and
    with a speed of its own, carries half of the bushing's stiffness and damping. ``in_gap``: return what a penetration
    of 0 would meet also in the gap, instead of zeros, for a solver that looks for contacts itself.
    """
    g, memory = signed_penetration(x, bushing.lower, bushing.upper), at(numbers, state.impact + end)
    if g == 0.0 and not in_gap:
        memory[0] = 0.0
        return 0.0, 0.0, 0.0
    inwards = signed(speed, g)
    if lasting(memory[0], g) == 0.0:  # a branch that is predicted is shorter here than lanes' chain of selections
        memory[0] = signed(impact_speed(0.0, g, inwards), g)
    parameters, out = at(numbers, state.contact), at(numbers, state.out)
    k, c = end_values(bushing.contact_law, parameters, out, abs(g), inwards, abs(memory[0]))
    return g, k, c
