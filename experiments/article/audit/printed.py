"""The article's tables as printed."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

from clearance_mj.errors import RecordError
from clearance_mj.report.article import FOLDERS

__all__ = ["Printed", "load_tables"]

_FILES = {
    1: "table1_natural_frequency.csv",
    2: "table2_frf_errors.csv",
    3: "table3_72kmh.csv",
    4: "table4_120kmh.csv",
    5: "table5_120kmh_peaks.csv",
}


@dataclass(frozen=True)
class Printed:
    """A table by row and column, numbers with the digits they are printed with."""

    path: Path
    """its file"""
    rows: dict[str, dict[str, str]]
    """cells by row and column"""

    @classmethod
    def load(cls, path: Path) -> Printed:
        """Read a table, whose first column names its rows.

        Parameters
        ----------
        path : Path
            A CSV file.

        Raises
        ------
        RecordError
            If it is none.
        """
        try:
            with path.open(newline="", encoding="utf-8") as file:
                header, *rows = csv.reader(file)
        except (OSError, ValueError, csv.Error) as error:
            raise RecordError(f"{path}: cannot be read as a table: {error}") from None
        return cls(path, {row[0]: dict(zip(header[1:], row[1:])) for row in rows if row})

    def text(self, row: str, column: str) -> str:
        """Return a cell.

        Parameters
        ----------
        row, column : str
            Where.

        Raises
        ------
        RecordError
            If there is none.
        """
        try:
            return self.rows[row][column]
        except KeyError:
            raise RecordError(f"{self.path}: has no {column} of {row}") from None

    def number(self, row: str, column: str) -> Decimal:
        """Return a number with the digits it is printed with.

        Parameters
        ----------
        row, column : str
            Where.

        Raises
        ------
        RecordError
            If the cell has none, or one of which changes cannot be computed.
        """
        text = self.text(row, column)
        try:
            value = Decimal(text)
        except InvalidOperation:
            raise RecordError(f"{self.path}: {column} of {row} is {text!r}, not a number") from None
        if not value.is_normal() or abs(value.adjusted()) > 6:
            raise RecordError(f"{self.path}: {column} of {row} is {text}; changes need sizes from 1e-6 to 1e6")
        return value

    def column(self, name: str, rows: Iterable[str]) -> list[Decimal]:
        """Return the numbers of a column.

        Parameters
        ----------
        name : str
            Of the column.
        rows : iterable of str
            Of which rows.
        """
        return [self.number(row, name) for row in rows]

    def row(self, index: int) -> str:
        """Name of a row by its place, for rows whose name is itself in question.

        Parameters
        ----------
        index : int
            From 0.

        Raises
        ------
        RecordError
            If there are fewer rows.
        """
        if index >= len(self.rows):
            raise RecordError(f"{self.path}: has {len(self.rows)} rows, {index + 1} are needed")
        return list(self.rows)[index]


def load_tables(folder=None) -> dict[int, Printed]:
    """Load Tables 1 to 5, by number.

    Parameters
    ----------
    folder : str or Path, optional
        Where they are, as CSV files; default: the published ones.

    Raises
    ------
    RecordError
        If one is missing or cannot be read.
    """
    return {number: Printed.load(_table_file(folder, name)) for number, name in _FILES.items()}


def _table_file(folder, name) -> Path:
    folders = FOLDERS if folder is None else (Path(folder),)
    found = [path for path in (f / name for f in folders) if path.is_file()]
    if not found:
        raise RecordError(f"{folders[0] / name}: the article's table is not there")
    return found[0]
