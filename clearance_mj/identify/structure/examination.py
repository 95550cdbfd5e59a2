"""The linear rig out of records, with what its file lacks or has grossly wrong: whichever explains the records better.

What the file lacks (`with_found_structure`) and gross faults of channels and dimensions (`diagnose`) are rivals: a
missing mass is made good by a wrong density, a wrong length by a clamp that gives. Both are compared by the same cost.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...core.kinds import checks_kinds
from ...io.dataset import Dataset
from ...rig import Rig
from ..records.prepared import PreparedRecord, prepare
from .faults.assessment import Assessment
from .faults.diagnosis import Diagnosis, diagnose, misfit_alone
from .faults.of_records import require_one_rig
from .rig_update import RigUpdate
from .selection import with_found_structure
from .updating import update_from

__all__ = ["examine", "update_rig"]


@checks_kinds
def update_rig(dataset: Dataset, as_drawn: bool = False, progress: bool = False) -> RigUpdate:
    """Update a rig to its records to identify, with unknown forces in its clearances.

    Parameters
    ----------
    dataset : Dataset
        Rig and records; records with role "validate" are never opened.
    as_drawn : bool
        Believe the structure that the rig file draws, and update its numbers alone.
    progress : bool
        Show progress bars.

    Returns
    -------
    RigUpdate
        The updated rig with what its file lacks, all its open parameters with posterior and prior, and what it misses.

    Raises
    ------
    RecordError
        If there are no more sensors than clearances, a channel cannot be used, or records are of several rigs.
    """
    records = prepare(dataset)
    return update_from(dataset.rig, records) if as_drawn else examine(dataset.rig, records, progress)[0]


def examine(rig: Rig, records: Sequence[PreparedRecord], progress: bool = False) -> tuple[RigUpdate, Diagnosis]:
    """Update a rig to prepared records, find what its file lacks and what is grossly wrong.

    Parameters
    ----------
    rig : Rig
        The rig file's.
    records : sequence of PreparedRecord
        Probes take part if all records have them.
    progress : bool
        Show progress bars.

    Returns
    -------
    RigUpdate
        With what the records want beside the structure as drawn, unless a gross fault explains them better.
    Diagnosis
        Of gross faults.

    Raises
    ------
    RecordError
        As `update_rig`.
    """
    require_one_rig(rig, records)
    drawn = update_from(rig, records)
    found = with_found_structure(drawn, progress)
    before, after = Assessment(drawn), Assessment(found)
    if not found.structure.accepted or not after.unexplained:
        return found, diagnose(found)
    diagnosis = diagnose(drawn)
    if diagnosis.faults and Assessment(diagnosis.update).cost < after.cost:
        return drawn, diagnosis
    # Where one channel alone stands out, and still does, it is that channel: no structure acts on one alone.
    return (drawn, diagnosis) if before.sound else (found, misfit_alone(found))
