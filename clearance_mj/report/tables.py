"""Tables to read, tables as CSV, and the measures of agreement that they hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd

from ..core.files import replacing

__all__ = ["MEASURES", "OVERALL", "REPEAT", "AgreementMeasure", "Column", "Table", "long_table", "write_csv"]

REPEAT = ("repeat", "rig")
"""Law and engine in the rows of a study that compare the second record of a level with the first"""


@dataclass(frozen=True)
class AgreementMeasure:
    """A measure of the agreement of FRFs."""

    key: str  #: name in a comparison's summary
    label: str  #: name in tables
    unit: str  #: of its values
    form: str  #: format of its numbers
    perfect: float  #: its value for equal FRFs


MEASURES = (
    AgreementMeasure("rmse_db", "RMSE", "dB", ".2f", 0.0),
    AgreementMeasure("frac", "FRAC", "", ".4f", 1.0),
    AgreementMeasure("csac", "CSAC", "", ".4f", 1.0),
    AgreementMeasure("csf", "CSF", "", ".4f", 1.0),
    AgreementMeasure("mre", "MRE", "", ".3f", 0.0),
)  # Of a sensor
OVERALL = (
    *MEASURES,
    AgreementMeasure("relative_error", "frequency error", "", ".2%", 0.0),
    AgreementMeasure("mac", "MAC", "", ".4f", 1.0),
)  # Of all sensors, and of the modes


@dataclass(frozen=True)
class Column:
    """A column of a table to read."""

    label: str  #: heading
    unit: str = ""  #: of its numbers
    form: str = ""  #: format of its numbers, such as ".2f"; empty for words
    group: str = ""  #: heading that it shares with its neighbours


@dataclass(frozen=True)
class Table:
    """A table to read: nan where a value could not be had, None where there is nothing to have.

    Cells are words, numbers, or numbers with an `Interval`.
    """

    name: str  #: also the name of its file
    caption: str  #: what it shows, in words
    columns: tuple[Column, ...]  #: headings
    rows: tuple[tuple, ...]  #: one cell for each column

    @classmethod
    def of(cls, name: str, caption: str, frame: pd.DataFrame, columns: Mapping[str, Column]) -> Self:
        """Return columns of a data frame as a table; ``columns`` are headings by the names of the frame's columns."""
        cells = frame[list(columns)].astype(object)
        return cls(name, caption, tuple(columns.values()), tuple(cells.itertuples(index=False, name=None)))


def long_table(name: str, rows: Sequence, axis: str, along: np.ndarray, **columns: np.ndarray) -> pd.DataFrame:
    """Return arrays (n_rows, n_along) as a table with a line for each of ``rows`` and value ``along`` an axis."""
    labels = {name: np.repeat(rows, along.size), axis: np.tile(along, len(rows))}
    return pd.DataFrame(labels | {key: values.ravel() for key, values in columns.items()})


def write_csv(path: Path, rows: pd.DataFrame | Iterable[dict]) -> None:
    """Write rows as CSV with every digit; a row may lack a column, columns come in the order of first appearance."""
    frame = rows if isinstance(rows, pd.DataFrame) else _frame(list(rows))
    with replacing(path) as temporary:
        frame.to_csv(temporary, index=False, na_rep="nan", lineterminator="\n")


def _frame(rows: list[dict]) -> pd.DataFrame:
    """Rows with nothing where a column is lacking."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    return pd.DataFrame([{key: row.get(key, "") for key in columns} for row in rows], columns=columns, dtype=object)
