"""What an item gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from clearance_mj.report.figures import Drawing
from clearance_mj.report.tables import Table

__all__ = ["Result"]


@dataclass(frozen=True, eq=False)
class Result:
    """A figure or a table of the article, computed again."""

    title: str
    """heading of its page"""
    article: str
    """what the article says"""
    method: str
    """what was done here"""
    shows: str
    """what came out, with its numbers"""
    differs: str
    """what differs from the article, and why"""
    drawings: Sequence[Drawing] = ()
    """each becomes NAME.png and NAME.svg, by its own name, which starts with the item's"""
    data: Mapping[str, Sequence[dict]] = field(default_factory=dict)
    """rows of each CSV file, by the name of the file without ".csv"; no timings: two runs give the same bytes"""
    tables: Sequence[Table] = ()
    """to read: published values beside ours"""
    knows: Mapping[str, str] = field(default_factory=dict)
    """what each model was allowed to know, by its name"""
