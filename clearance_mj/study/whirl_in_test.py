"""How a shaft moved in its bushings while it turned alone: as a record's probes show it, and as a model's would.

Both are counted from where the shaft rests while it stands still, in which probes read zero. What probes show of a
shaft that rolls slowly is their run-out, and is taken off the test's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..engines import get_engine
from ..engines.simulation import Simulation
from ..identify.records.in_test import in_test
from ..identify.records.run_out import SLOW, run_out, run_out_at
from ..io.dataset import Record
from ..model import Model
from ..rotors.whirling import Whirl
from ..signals.excitation import Excitation

__all__ = ["RUN_IN", "PlacedWhirl", "measured_whirl", "run_out_of", "simulated_whirl"]

RUN_IN = 1.5  # s, for which a model turns at the record's speed before the record begins


@dataclass(frozen=True, eq=False)
class PlacedWhirl:
    """The motion of a model's shaft from where it rests, and where that is."""

    motion: Whirl
    """from where the shaft rests"""
    rest: np.ndarray
    """(n_bushings, 2) m, from the bushings' middles, of the shaft that stands still"""
    contact_share: tuple[float, ...]
    """(n_bushings,) share of the time in contact"""


def run_out_of(records: Sequence[Record]) -> np.ndarray | None:
    """Return the run-out of the probes, see `run_out`, of the record that turns slowest at one speed.

    Parameters
    ----------
    records : sequence of Record
        Of one rig.

    Returns
    -------
    ndarray or None
        None if no record turns slowly enough beside the fastest.
    """
    steady = [
        (abs(spin.speed), record)
        for record in records
        if record.excitation_kind == "spin" and not record.missing_probes
        for spin in [record.tested_rig.spin]
        if spin and not spin.rate
    ]
    if not steady:
        return None
    speed, slow = min(steady, key=lambda item: item[0])
    turning, displacement = slow.turning(), slow.response().displacement
    if speed >= SLOW * max(other for other, _ in steady) or turning is None or displacement is None:
        return None
    return run_out(turning.angle, displacement)


def measured_whirl(record: Record, found: np.ndarray | None) -> Whirl:
    """Return the motion that the probes of a record show.

    Parameters
    ----------
    record : Record
        Of kind "spin", with both probes of every bushing.
    found : ndarray or None
        Run-out, which is taken off.
    """
    response, turning = record.response(), record.turning()
    assert turning is not None and response.displacement is not None
    moved = response.displacement
    if found is not None:
        moved = moved - run_out_at(turning.angle, found)
    position = moved.reshape(len(record.rig.bushings), 2, -1)
    return Whirl(record.tested_rig, record.fs, response.time, position, turning.speed, turning.angle)


def simulated_whirl(model: Model, record: Record, engine: str) -> PlacedWhirl:
    """Return the motion of a model that turns as a record's shaft did.

    A model at one speed turns for `RUN_IN` before the record begins, at which its shaft has the record's angle.

    Parameters
    ----------
    model : Model
        Rig and law.
    record : Record
        Of kind "spin".
    engine : str
        Name of the engine.
    """
    tested = in_test(model, record.tested_rig, record.turning())
    rig, spin = tested.rig, tested.rig.spin
    assert spin is not None
    lead = 0 if spin.rate else round(RUN_IN * record.fs)
    earlier = dataclasses.replace(spin, angle=spin.angle - spin.speed * lead / record.fs)
    rig = rig.replace(spin=earlier)
    quiet = Excitation(np.zeros(lead + record.size), record.fs, "base", None, {"generator": "rest"})
    simulation = Simulation(rig, quiet, tested.law, get_engine(engine))
    before = simulation.run.before()
    response = simulation.whole()
    n = len(rig.bushings)
    assert response.displacement is not None and response.spin is not None and before is not None
    rest = np.asarray(before)[len(rig.sensors) : len(rig.sensors) + 2 * n]
    position = (response.displacement - rest[:, None])[:, lead:].reshape(n, 2, -1)
    time = np.arange(record.size) / record.fs
    motion = Whirl(rig, record.fs, time, position, response.spin[lead:], spin.angle_at(time))
    offset = np.array([[b.offset_y, b.offset] for b in rig.bushings])
    share = response.contact_share
    return PlacedWhirl(
        motion, rest.reshape(n, 2) + offset, tuple(np.full(n, np.nan) if share is None else share.tolist())
    )
