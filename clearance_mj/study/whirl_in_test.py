"""Motion of a shaft in its bushings while it turned alone: as a record's probes show it, and as a model's would.

Both are counted from where the shaft rests while it stands still, in which probes read zero. What probes show of a
shaft that rolls slowly is their run-out, and is taken off the test's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.cache import ResultCache, code_outside
from ..engines import get_engine
from ..engines.simulation import Simulation
from ..identify.records.in_test import in_test
from ..identify.records.run_out import SLOW, run_out, run_out_at
from ..io.dataset import Record
from ..model import Model
from ..rotors.whirling import Whirl
from ..signals.excitation import Excitation
from . import stored

__all__ = [
    "RUN_IN", "PlacedWhirl", "measured_whirl", "run_out_of", "simulated_whirl", "slow_roll_of", "without_run_out",
]  # fmt: skip

RUN_IN = 1.5  # s, for which a model turns at the record's speed before the record begins


@dataclass(frozen=True, eq=False)
class PlacedWhirl:
    """The motion of a model's shaft from where it rests, and where that is, both along the axes of the probes."""

    motion: Whirl
    """from where the shaft rests"""
    rest: np.ndarray
    """(n_bushings, 2) m, from the bushings' middles, of the shaft that stands still"""
    contact_share: tuple[float, ...]
    """(n_bushings,) fraction of the time in contact"""


def slow_roll_of(records: Sequence[Record]) -> Record | None:
    """Return the record that turns slowest at one speed, in which the probes show their run-out.

    Parameters
    ----------
    records : sequence of Record
        Of one rig.

    Returns
    -------
    Record or None
        None if no record turns slowly enough compared with the fastest.
    """
    steady = [
        (abs(spin.speed), record)
        for record in records
        if record.excitation_kind == "spin" and not record.missing_probes
        for spin in [record.tested_rig.spin]
        if spin and not spin.rate
    ]
    speed, slow = min(steady, key=lambda item: item[0], default=(0.0, None))
    if slow is None or speed >= SLOW * max(other for other, _ in steady) or slow.turning() is None:
        return None
    return slow


def measured_whirl(record: Record) -> Whirl:
    """Return the motion that the probes of a record show, run-out and all.

    Parameters
    ----------
    record : Record
        Of kind "spin", with both probes of every bushing.
    """
    response, turning = record.response(), record.turning()
    assert turning is not None and response.displacement is not None
    position = response.displacement.reshape(len(record.rig.bushings), 2, -1)
    return Whirl(record.tested_rig, record.fs, response.time, position, turning.speed, turning.angle)


def run_out_of(slow: Whirl) -> np.ndarray:
    """Return the run-out of the probes, see `run_out`, of the motion that they show of a slow turning.

    Parameters
    ----------
    slow : Whirl
        Of the record that `slow_roll_of` returns, measured or simulated.
    """
    assert slow.angle is not None
    return run_out(slow.angle, slow.position.reshape(-1, slow.angle.size))


def without_run_out(motion: Whirl, displacement: np.ndarray) -> Whirl:
    """Return a motion less what a slow turning shows over the shaft's angle.

    Parameters
    ----------
    motion : Whirl
        Of the same probes.
    displacement : ndarray
        As `run_out_of` returns it.
    """
    assert motion.angle is not None
    shown = run_out_at(motion.angle, displacement).reshape(motion.position.shape)
    return dataclasses.replace(motion, position=motion.position - shown)


def simulated_whirl(name: str, model: Model, record: Record, engine: str, cache: ResultCache | None) -> PlacedWhirl:
    """Return the whirl of a model that turns as a record's shaft did.

    A model at one speed turns for `RUN_IN` before the record begins, at which its shaft has the record's angle.

    Parameters
    ----------
    name : str
        Name of the law.
    model : Model
        Rig and law.
    record : Record
        Of kind "spin".
    engine : str
        Name of the engine.
    cache : ResultCache or None
        Where the motion is kept for the next study.
    """
    tested = in_test(model, record.tested_rig, record.turning())
    spin, used = tested.rig.spin, get_engine(engine)
    assert spin is not None
    lead = 0 if spin.rate else round(RUN_IN * record.fs)
    rig = tested.rig.replace(spin=dataclasses.replace(spin, angle=spin.angle - spin.speed * lead / record.fs))
    n = len(rig.bushings)

    def compute() -> dict[str, np.ndarray]:
        quiet = Excitation(np.zeros(lead + record.size), record.fs, "base", None, {"generator": "rest"})
        simulation = Simulation(rig, quiet, tested.law, used)
        standing = rig.replace(spin=None, unbalances=(), orders=())
        still = used.start(standing, tested.law, "base", simulation.step).before()
        rest_position = np.zeros(len(rig.sensors) + 2 * n) if still is None else still
        response = simulation.whole()
        assert response.displacement is not None and response.spin is not None
        contact_share = np.full(n, np.nan) if response.contact_share is None else response.contact_share
        arrays = {"displacement": response.displacement[:, lead:], "spin": response.spin[lead:], "share": contact_share}
        return arrays | {"rest": rest_position[len(rig.sensors) :][: 2 * n]}

    inputs = [*dataclasses.replace(tested, rig=rig).content(), engine, dataclasses.asdict(used), lead]
    inputs += [record.fs, record.size, *code_outside(used)]
    arrays = stored.arrays(cache, f"{name}_{engine}_{record.name}", inputs, compute)
    position = (arrays["displacement"] - arrays["rest"][:, None]).reshape(n, 2, -1)
    time = np.arange(record.size) / record.fs
    offset = np.array([(b.offset_y + 1j * b.offset) * np.exp(-1j * b.probe_angle) for b in rig.bushings])
    rest_position = arrays["rest"].reshape(n, 2) + np.column_stack((offset.real, offset.imag))
    motion = Whirl(rig, record.fs, time, position, arrays["spin"], spin.angle_at(time))
    return PlacedWhirl(motion, rest_position, tuple(arrays["share"].tolist()))
