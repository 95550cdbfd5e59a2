"""Contradictions between records and the rig that a method takes for exact, so that no fault of either is missed."""

from __future__ import annotations

from collections.abc import Sequence

from ....core.errors import RecordError
from ....rig import Rig
from ...records.prepared import PreparedRecord
from ..rig_update import RigUpdate
from ..updating import rig_file_misfit, update_from
from .assessment import Assessment
from .diagnosis import diagnose

__all__ = ["contradictions_of_rig", "contradictions_of_update"]

MAX_MISFIT = 0.1  # of a channel's level, missed by a rig as it is; by rigs that records were simulated with, up to 0.06


def contradictions_of_rig(rig: Rig, records: Sequence[PreparedRecord]) -> tuple[str, ...]:
    """Return the contradictions of a rig file, in words, and their likeliest cause; none: there are none, or none show.

    Parameters
    ----------
    rig : Rig
        The rig as its file has it.
    records : sequence of PreparedRecord
        Records of the rig.
    """
    try:
        misfit = rig_file_misfit(rig, records).max()
    except RecordError:
        return ()  # records that cannot be read or compared are reported elsewhere
    if misfit < MAX_MISFIT:
        return ()
    return diagnose(update_from(rig, records)).words or (
        f"the rig file, which this method takes for exact, misses a channel by {100 * misfit:.0f} % of its level; "
        "method bench, or update-rig, corrects it",
    )


def contradictions_of_update(update: RigUpdate) -> tuple[str, ...]:
    """Return the contradictions of a rig even as updated, in words, and their likeliest cause; none: there are none."""
    return diagnose(update).words if Assessment(update).unexplained else ()
