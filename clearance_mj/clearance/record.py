"""The record of a clearance with one coordinate or two, for compiled loops.

A record is constant: addresses of the laws of wall, filling and contact, and the rows of ``numbers`` with their
parameters and state. A row has one number for each of the cases side by side (see lanes.py), which share the records.
Laws that cannot work on all lanes at once have their numbers lane after lane instead, and are called lane by lane.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Protocol, get_type_hints

import numpy as np
from numba.core.errors import NumbaError

from ..core.errors import LawError
from ..rig import Bushing as OfRig
from ..rig import Grease
from ..rig.dimensions import shaft_radius
from .grease import GreaseModel
from .greases.bouc_wen import BoucWen
from .greases.oil_film import film_bearing
from .pointers import address
from .registers import contact_law_of, filling_law_of, wall_law_of
from .table import LawTable

__all__ = [
    "BUSHING", "END_MEMORY", "Clearance", "clearance_records", "fillings_of", "one_each", "shared_kinds",
    "side_by_side",
]  # fmt: skip

END_MEMORY = 6
"""Rows of an end's state: the impact speed, with the sign of the wall of one coordinate; then of two the
direction along y and z, the bristles' deflection, and the displacement along y and z"""


class ClearanceRecord:
    """Record of what compiled loops know of a clearance. Whole numbers without a unit are first rows of numbers."""

    coordinates: int  # 1 or 2
    touching: int  # coordinates of its contact: 2 for a rubbing one of one coordinate, the first along the sliding
    step: float  # s
    limit: int  # m, displacement beyond which a simulation has diverged
    place: int  # displacement in the last step, m, for each coordinate
    was: int  # that of a step before, for energies
    offset: int  # m from the middle to the unloaded shaft
    preload: int  # of the filling's springs there, N
    static_energy: int  # their energy there, J
    envelope: int  # of the motion, m
    decay: int  # its factor per step
    by_amplitude: bool  # the law's abscissa is the envelope, m, instead of time, s
    abscissa: int  # of the law's table, row after row
    period: int  # s, of time as the abscissa; 0 without repetition
    rows: int  # number of them
    table: int  # the contact's parameters, row after row
    width: int  # numbers in a row
    contact: int  # current parameters
    contact_was: int  # those of a step before, for energies
    contact_law: int  # address, as below
    contact_energy: int
    contact_by_lane: bool
    adhesion: bool  # the contact may pull
    filling: int  # the filling's parameters
    filling_size: int  # number of them
    memory: int  # its state
    memory_was: int  # of a step before, for energies
    states: int  # numbers of the state
    filling_law: int
    filling_energy: int
    filling_by_lane: bool
    is_circulatory: bool  # its elastic force is due to turning and stores no energy
    wall: int  # the wall's parameters; for one coordinate without friction its positions, m
    wall_size: int  # number of them
    reach: int  # m from the middle, radius without contact
    wall_law: int
    wall_by_lane: bool
    rubs: bool  # True with friction, whose numbers begin at `friction`:
    friction: int  # coefficient, bristles N/m and N s/m of one end, static excess, s/m, radius m
    ends: int  # state of both ends, `END_MEMORY` rows each
    depths: int  # of both ends in the last step, m, for energies
    out: int  # results of laws, 6 rows
    room: int  # 6 rows for arguments gathered from the lanes, and 6 numbers for a result


BUSHING = np.dtype(list(get_type_hints(ClearanceRecord).items()), align=True)
_BLOCK_SIZES = {"filling": "filling_size", "memory": "states", "memory_was": "states", "contact": "width",
           "contact_was": "width", "wall": "wall_size"}  # fmt: skip
"""Fields of laws' parameters and states, and those of their lengths"""


class Clearance(NamedTuple):
    """A rig's clearances as records, and their numbers.

    Loops unpack it before they begin: compiled code counts references to arrays that it takes out of tuples.
    """

    bushings: np.ndarray  # (n_bushings,) `ClearanceRecord`
    numbers: np.ndarray  # (rows times lanes,) changed in place


class WithBushings(Protocol):
    """A rig, or another object with bushings."""

    @property
    def bushings(self) -> Sequence[OfRig]:
        """Bushings."""


class WithTable(Protocol):
    """A law."""

    @property
    def grease(self) -> Any:
        """Grease of the bushings, or None."""

    def table(self, n_bushings: int) -> LawTable:
        """Return a table as `Law.table` does."""


def fillings_of(rig: WithBushings, law: WithTable) -> list[GreaseModel]:
    """Return the filling of each clearance: the law's grease, if it has one, or else the rig's film or grease."""
    n = len(rig.bushings)
    return one_each([_rig_filling(rig, j) for j in range(n)] if law.grease is None else law.grease, n)


def _rig_filling(rig: Any, j: int) -> Grease | GreaseModel:
    bushing = rig.bushings[j]
    return bushing.grease if bushing.film is None else film_bearing(bushing, shaft_radius(rig, j))


def one_each(greases: Sequence[Grease | GreaseModel], n: int) -> list[GreaseModel]:
    """Return the model of each of n bushings, given one for all or one for each."""
    if len(greases) not in (1, n):
        raise LawError(f"the law holds grease for {len(greases)} bushings, the rig has {n}; give one or {n}")
    models = [g if isinstance(g, GreaseModel) else BoucWen(g) for g in greases]
    return models * n if len(models) == 1 else models


def clearance_records(rig: WithBushings, law: WithTable, step: float) -> Clearance:
    """Return the records of a rig's clearances for compiled loops with a step, s, at rest without load."""
    n = len(rig.bushings)
    table, records, numbers = law.table(n), np.zeros(n, BUSHING), list[float]()

    def place(values: Iterable[float]) -> int:
        start = len(numbers)
        numbers.extend(values)
        return start

    abscissa = place(table.abscissa)
    records["step"], records["abscissa"] = step, abscissa
    records["rows"], _, records["width"] = table.parameters.shape
    for name in ("by_amplitude", "adhesion", "contact_law", "contact_energy"):
        records[name] = getattr(table, name)
    for j, (bushing, model) in enumerate(zip(rig.bushings, fillings_of(rig, law))):
        record, size = records[j], bushing.n_coordinates
        offset = (bushing.offset_y, bushing.offset)[-size:]
        preload, energy = model.at_rest(offset)
        decay = np.exp(-step / table.release) if table.by_amplitude else 0.0
        wall, rubbing = bushing.wall_model, bushing.friction is not None
        touching = 2 if rubbing else size
        wall_numbers = bushing.walls if touching == 1 else wall.parameters(bushing.gap)
        blocks = {
            "limit": [1e3 * bushing.gap + 1.0], "place": [0.0] * size, "was": [0.0] * size, "offset": offset,
            "preload": preload, "static_energy": [energy], "envelope": [0.0], "decay": [float(decay)],
            "period": [table.period],
            "table": table.parameters[:, j].ravel(), "contact": table.parameters[0, j],
            "contact_was": table.parameters[0, j], "filling": model.parameters(),
            "memory": [0.0] * model.states(size), "memory_was": [0.0] * model.states(size), "wall": wall_numbers,
            "reach": [wall.reach(bushing.gap)], "friction": _friction_numbers(rig, j) if rubbing else (),
            "ends": [0.0] * (2 * END_MEMORY), "depths": [0.0] * 2, "out": [0.0] * 6, "room": [0.0] * 12,
        }  # fmt: skip
        for name, values in blocks.items():
            record[name] = place(values)
        record["coordinates"], record["touching"], record["rubs"] = size, touching, rubbing
        record["filling_size"], record["states"] = len(blocks["filling"]), len(blocks["memory"])
        record["filling_law"], record["filling_energy"] = model.addresses(size)
        record["wall_size"], record["is_circulatory"] = len(wall_numbers), model.is_circulatory
        record["wall_law"] = address(type(wall).law, wall_law_of(1)) if touching == 2 else 0
    return Clearance(records, np.array(numbers, dtype=float))


def _friction_numbers(rig: Any, j: int) -> tuple[float, ...]:
    bushing = rig.bushings[j]
    friction = bushing.friction
    per_speed = 1 / friction.stribeck_speed if friction.stribeck_speed else 0.0
    bristles = (friction.stiffness or bushing.contact.stiffness) / 2
    excess = friction.static_ratio - 1
    radius = shaft_radius(rig, j) if friction.along is None else 0.0  # sliding along an axis does not turn
    return friction.coefficient, bristles, friction.damping / 2, excess, per_speed, radius


def shared_kinds(rig: WithBushings, law: WithTable) -> tuple[Any, ...]:
    """Return a key of the laws that cases must share for records side by side."""
    table = law.table(len(rig.bushings))
    of_clearances = [
        (type(b.wall_model), b.n_coordinates, b.friction is None, type(model), len(model.parameters()), kind, adhesion)
        for b, model, kind, adhesion in zip(rig.bushings, fillings_of(rig, law), table.kinds, table.adhesion.tolist())
    ]
    return *of_clearances, table.parameters.shape, table.by_amplitude


def side_by_side(parts: Sequence[Clearance], laws: Sequence[tuple[Any, ...]]) -> Clearance:
    """Return copies of the records of several cases as those of one with as many lanes.

    ``laws``: of every clearance the functions of wall, filling and contact, `laws_of`.
    """
    count, records = len(parts), parts[0].bushings.copy()
    if count == 1:
        return Clearance(records, parts[0].numbers.copy())
    numbers = np.stack([part.numbers for part in parts], axis=-1)
    for record, (wall, filling, contact) in zip(records, laws):
        kinds = {
            "wall": (wall, wall_law_of(count), record["touching"] == 1),
            "filling": (filling, filling_law_of(int(record["coordinates"]), count), False),
            "contact": (contact, contact_law_of(count), False),
        }
        for name, (law, signature, unused) in kinds.items():
            law_address = 0 if unused else law_in_lanes(law, signature)
            by_lane = not unused and (law_address == 0 or (name == "contact" and record["rows"] > 1))
            record[f"{name}_by_lane"] = by_lane
            if not by_lane:
                record[f"{name}_law"] = law_address
        for name, size in _BLOCK_SIZES.items():
            if record[f"{name.split('_')[0].replace('memory', 'filling')}_by_lane"]:
                rows = slice(record[name], record[name] + record[size])
                numbers[rows] = numbers[rows].T.reshape(record[size], count)
        if record["contact_by_lane"]:
            rows = slice(record["table"], record["table"] + record["rows"] * record["width"])
            numbers[rows] = numbers[rows].T.reshape(-1, count)
    return Clearance(records, numbers.ravel())


def laws_of(rig: WithBushings, law: WithTable) -> list[tuple[Any, ...]]:
    """Return the functions of wall, filling and contact of every clearance."""
    kinds = law.table(len(rig.bushings)).kinds
    return [(b.wall_model.law, m.law, kind.law) for b, m, kind in zip(rig.bushings, fillings_of(rig, law), kinds)]


def law_in_lanes(law: Any, signature: Any) -> int:
    """Return the address of a law compiled for all lanes at once, or 0 if it cannot be."""
    if (law, signature) not in _NOT_VECTORISED:
        try:
            return address(law, signature)
        except NumbaError:
            _NOT_VECTORISED.add((law, signature))
    return 0


_NOT_VECTORISED: set[tuple[Any, Any]] = set()
"""laws, and signatures of registers, that must be called lane by lane"""
