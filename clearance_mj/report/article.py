"""The article's published Tables 1 and 2, which the report shows beside its own."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

__all__ = ["ARTICLE_MODELS", "FOLDERS", "Article", "load_article"]

FOLDERS = (Path(__file__).parent / "article_data", Path(__file__).parents[2] / "data" / "article")
"""Where the tables may be: in an installed package, in the source tree"""
ARTICLE_MODELS = ("initial", "updated")
"""The article's models: constant parameters, and parameters identified over time"""

_TABLE1, _TABLE2 = "table1_natural_frequency.csv", "table2_frf_errors.csv"


@dataclass(frozen=True)
class Article:
    """The published numbers, as printed."""

    modes: dict[int, dict[str, float]]
    """Table 1 by mode: test_hz, and initial_ and updated_ hz, re_pct, mac"""
    sensors: dict[str, dict[str, float]]
    """Table 2 by sensor "1" to "8" and "mean": initial_ and updated_ mre, rmse, frac, csac, csf"""


def load_article(folders=FOLDERS) -> Article | None:
    """Load the article's tables.

    Parameters
    ----------
    folders : sequence of Path
        Where to look; the first that holds both tables is taken.

    Returns
    -------
    Article or None
        None if no folder holds them.
    """
    for folder in folders:
        if (folder / _TABLE1).is_file() and (folder / _TABLE2).is_file():
            modes, sensors = _read(folder / _TABLE1), _read(folder / _TABLE2)
            return Article({int(mode): row for mode, row in modes.items()}, sensors)
    return None


def _read(path) -> dict[str, dict[str, float]]:
    """Rows by their first column; every other column is a number."""
    with path.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return {row[0]: dict(zip(header[1:], map(float, row[1:]))) for row in rows}
