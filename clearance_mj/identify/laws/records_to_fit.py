"""Records that laws are fitted to: those that identify them, and as much of each as is informative."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..forces.restoring import RestoringForce
from ..records.prepared import PreparedRecord
from .measured_motion import becomes_quiet

__all__ = ["informative_records", "most_informative_parts"]

MAX_SECONDS = 40.0  # of all records together, to which laws are fitted
MIN_SECONDS = 4.0  # of each of them
MIN_RATE, MIN_RATIO = 2048.0, 8.0  # samples per second, also over the highest excited frequency
NEARLY = 0.5  # of the farthest motion


def informative_records(forces: Sequence[RestoringForce]) -> np.ndarray:
    """Return which records without probes (n_clearances, n_records) laws are fitted to: those that never fall by much.

    What has slid in a filling while the motion was large holds the shaft aside after it, where no accelerometer shows
    it: sweeps and hits mislead. They are taken where the others do not go nearly as far.

    Parameters
    ----------
    forces : sequence of RestoringForce
        Of each record.
    """
    motions = [force.displacement[:, force.valid] for force in forces]
    far = np.array([np.abs(x).max(axis=1) for x in motions])
    steady = np.array([not any(becomes_quiet(each, f.fs) for each in x) for f, x in zip(forces, motions)])
    enough = far[steady].max(axis=0, initial=0.0) >= NEARLY * far.max(axis=0)
    return np.asarray(steady | ~enough[:, None])


def most_informative_parts(records: Sequence[PreparedRecord]) -> list[PreparedRecord]:
    """Return the parts of records in which most moves, `MAX_SECONDS` in all, sampled no faster than laws need.

    Parameters
    ----------
    records : sequence of PreparedRecord
        All of them.
    """
    fraction = MAX_SECONDS / sum(record.duration for record in records)
    highest = max((record.band[1] for record in records if record.band), default=0.0)
    return [_loudest(record, fraction).slowed(max(MIN_RATE, MIN_RATIO * highest)) for record in records]


def _loudest(record: PreparedRecord, fraction: float) -> PreparedRecord:
    """Return a fraction of a record, the part in which most moves; all of one that is short anyway."""
    n = len(record.signals)
    size = max(int(fraction * n), int(MIN_SECONDS * record.fs))
    if size >= n:
        return record
    signals = record.signals[:, :-1].T if record.displacement is None else record.displacement
    if record.displacement is None:  # of several quantities
        signals = signals / np.maximum(np.sqrt(np.mean(signals**2, axis=1, keepdims=True)), 1e-300)
    power = np.concatenate(([0.0], np.cumsum(np.sum(signals**2, axis=0))))
    first = int(np.argmax(power[size:] - power[:-size]))
    return record.part(slice(first, first + size))
