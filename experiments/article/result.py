"""What an item gives."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import pandas as pd

from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table


@dataclass(frozen=True, eq=False)
class Result:
    """A figure or a table of the article, computed again."""

    method: str
    """what was done here"""
    shows: str
    """what came out, with its numbers"""
    drawings: Sequence[Drawing] = ()
    """each becomes NAME.png and NAME.svg, by its own name, which starts with the item's"""
    data: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    """each becomes a CSV file, by its name without ".csv"; no timings: two runs give the same bytes"""
    tables: Sequence[Table] = ()
    """to read: published values beside ours"""
    prior_information: Mapping[str, str] = field(default_factory=dict)
    """of each model, by its name"""
    details: Sequence[Table] = ()
    """further tables, of the index page alone"""


def to_table(name: str, caption: str, columns: Iterable[Column], rows: pd.DataFrame | Iterable[Sequence]) -> Table:
    """Return a table to read: the columns of a frame, or of rows, under headings in the same order."""
    if isinstance(rows, pd.DataFrame):
        rows = rows.astype(object).itertuples(index=False, name=None)
    return Table(name, caption, tuple(columns), tuple(tuple(None if v is pd.NA else v for v in row) for row in rows))


def rounded(frame: pd.DataFrame, digits: int) -> pd.DataFrame:
    """Return a frame of numbers with so many significant digits."""
    return frame.map(lambda value: float(f"{value:.{digits}g}"))
