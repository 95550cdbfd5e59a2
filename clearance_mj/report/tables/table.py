"""A table to read, and rows that go into a CSV file."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass

from ...files import replacing

__all__ = ["Column", "Table", "write_csv"]


@dataclass(frozen=True)
class Column:
    """A column of a table to read."""

    label: str
    """heading"""
    unit: str = ""
    """of its numbers"""
    form: str = ""
    """format of its numbers, such as ".2f"; empty for words"""
    group: str = ""
    """heading that it shares with its neighbours"""


@dataclass(frozen=True)
class Table:
    """A table to read: nan where a value could not be had, None where there is nothing to have.

    Cells are words, numbers, or numbers with an `Interval`.
    """

    name: str
    """also the name of its file"""
    caption: str
    """what it shows, in words"""
    columns: tuple[Column, ...]
    """headings"""
    rows: tuple[tuple, ...]
    """one cell for each column"""


def write_csv(path, rows: Iterable[dict]):
    """Write rows as CSV with every digit; a row may lack a column.

    Parameters
    ----------
    path : Path
        The file.
    rows : iterable of dict
        Their keys, in the order of their first appearance, are the columns.
    """
    rows = list(rows)
    header = list(dict.fromkeys(key for row in rows for key in row))
    with replacing(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, header, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
