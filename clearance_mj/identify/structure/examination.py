"""The linear rig out of records, with what its file lacks or has grossly wrong: whichever explains the records better.

What the file lacks (`with_found_structure`) and gross faults of channels and dimensions (`diagnose`) are rivals: a
missing mass is made good by a wrong density, a wrong length by a clamp that gives. Both are compared by the same cost.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...rig import Rig
from ..records.prepared import PreparedRecord
from .faults.assessment import Assessment
from .faults.diagnosis import Diagnosis, diagnose
from .rig_update import RigUpdate
from .selection import with_found_structure
from .updating import update_from

__all__ = ["examine"]


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
    drawn = update_from(rig, records)
    found = with_found_structure(drawn, progress)
    if found.structure.accepted and Assessment(found).unexplained:
        diagnosis = diagnose(drawn)
        if diagnosis.faults and Assessment(diagnosis.update).cost < Assessment(found).cost:
            return drawn, diagnosis
    return found, diagnose(found)
