"""The article's published Tables 1 and 2, which the report shows beside its own."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

__all__ = ["ARTICLE_MODELS", "FOLDERS", "PRINTED", "Article", "load_article"]

FOLDERS = (Path(__file__).parent / "article_data", Path(__file__).parents[2] / "data" / "article")
"""Where the tables may be: in an installed package, in the source tree"""
ARTICLE_MODELS = ("initial", "updated")
"""The article's models: constant parameters, and parameters identified over time"""
PRINTED = {
    **{f"MAC, mode {i}": pct for i, pct in enumerate((42.92, 31.08, 38.97, 50.74), 1)},
    **{"MRE": -27.67, "RMSE": -63.41, "FRAC": 15.79, "CSAC": 6.65, "CSF": 12.37},
}
"""Improvements of the updated over the initial model in the article's text, %; its conclusion has 6.55 for CSAC"""

_TABLE1, _TABLE2 = "table1_natural_frequency.csv", "table2_frf_errors.csv"
_TABLE2_NAMES = ("mre", "rmse", "frac", "csac", "csf")


@dataclass(frozen=True)
class Article:
    """The published numbers, as printed."""

    modes: dict[int, dict[str, float]]
    """Table 1 by mode: test_hz, and initial_ and updated_ hz, re_pct, mac"""
    sensors: dict[str, dict[str, float]]
    """Table 2 by sensor "1" to "8" and "mean": initial_ and updated_ mre, rmse, frac, csac, csf"""

    def improvements(self) -> dict[str, float]:
        """Change from the initial to the updated model in percent of the initial model's value, from the tables."""
        mean, modes = self.sensors["mean"], self.modes.values()
        initial, updated = (sum(row[f"{model}_re_pct"] for row in modes) for model in ARTICLE_MODELS)
        macs = {f"MAC, mode {i}": _change(row["initial_mac"], row["updated_mac"]) for i, row in self.modes.items()}
        errors = {name.upper(): _change(mean[f"initial_{name}"], mean[f"updated_{name}"]) for name in _TABLE2_NAMES}
        return macs | {"frequency error": _change(initial, updated)} | errors


def _change(old, new) -> float:
    return 100 * (new / old - 1)


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
