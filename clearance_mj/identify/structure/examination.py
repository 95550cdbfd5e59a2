"""The linear rig from records, with missing parts or gross faults of its file: whichever explains the records better.

Missing parts (`with_accepted_parts`) and gross faults of channels and dimensions (`diagnose`) are rivals: a missing
mass is compensated by a wrong density, a wrong length by a compliant clamp. Both are compared by the same cost.
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
from .selection import with_accepted_parts
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
        The updated rig with parts missing in its file, its open parameters with posterior and prior, and its misfit.

    Raises
    ------
    RecordError
        If there are no more sensors than clearances, a channel cannot be used, or records are of several rigs.
    """
    records = prepare(dataset)
    return update_from(dataset.rig, records) if as_drawn else examine(dataset.rig, records, progress)[0]


def examine(rig: Rig, records: Sequence[PreparedRecord], progress: bool = False) -> tuple[RigUpdate, Diagnosis]:
    """Update a rig to prepared records, find parts missing in its file and gross faults.

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
        With the parts that records show beyond the structure as drawn, unless a gross fault explains them better.
    Diagnosis
        Of gross faults.

    Raises
    ------
    RecordError
        As `update_rig`.
    """
    require_one_rig(rig, records)
    drawn = update_from(rig, records)
    with_parts = with_accepted_parts(drawn, progress)
    before, after = Assessment(drawn), Assessment(with_parts)
    if not with_parts.structure.accepted or not after.unexplained:
        return with_parts, diagnose(with_parts)
    diagnosis = diagnose(drawn)
    if diagnosis.faults and Assessment(diagnosis.update).cost < after.cost:
        return drawn, diagnosis
    # Where one channel alone stands out, and still does, it is that channel: no structure acts on one alone.
    return (drawn, diagnosis) if before.sound else (with_parts, misfit_alone(with_parts))
