"""What a better model gains: the article's claims beside ours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...statistics import repeatability
from ...statistics.intervals import Interval, ratio
from ..article import PRINTED, Article
from .study import N_MODES, excitation_unit, main_engine
from .table import Column, Table

if TYPE_CHECKING:
    from ...study import Study

__all__ = ["improvement_rows", "improvement_table"]

_IMPROVED = {
    **{f"MAC, mode {mode}": f"mode_{mode}_mac" for mode in range(1, N_MODES + 1)},
    "frequency error": "relative_error",
    "MRE": "mre",
    "RMSE": "rmse_db",
    "FRAC": "frac",
    "CSAC": "csac_per_sensor",
    "CSF": "csf_per_sensor",
}
"""Quantities of which the article claims improvements, in its order, and where a study has them"""


def improvement_rows(study: Study, article: Article | None = None) -> list[dict]:
    """Change from a model to a better one in percent of the former: a row per level, law over another, and quantity.

    Parameters
    ----------
    study : Study
        The study; every law beside the base is compared with it, on the main engine.
    article : Article, optional
        Its updated over its initial model goes in front, as printed and as its own tables give it.
    """
    rows, base, engine = [], _base_law(study), main_engine(study)
    for basis, changes in (("printed", PRINTED), ("recomputed", article.improvements())) if article else ():
        head = {"level": "", "law": f"article updated, {basis}", "over": "article initial"}
        rows += [head | {"quantity": quantity, "change_pct": change} for quantity, change in changes.items()]
    found = {(r["level"], r["law"]): r for r in study.rows() if r["engine"] == engine}
    for (level, law), row in found.items():
        if law == base:
            continue
        for quantity, key in _IMPROVED.items():
            change = ratio(*(repeatability.interval_of(r, key) for r in (row, found[level, base])))
            low, value, high = (100 * (x - 1) for x in (change.low, change.value, change.high))
            row_of = {"level": level, "law": law, "over": base, "quantity": quantity, "change_pct": value}
            rows.append(row_of | {"change_pct_low": low, "change_pct_high": high})
    return rows


def improvement_table(study: Study, level: float, article: Article | None = None) -> Table:
    """Improvement of the better models over constant parameters, the article's beside ours.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    article : Article, optional
        Its numbers go in front.
    """
    rows, base, names = improvement_rows(study, article), _base_law(study), [k.name for k in study.laws]
    lesser = names[: names.index(base)]
    laws = list(dict.fromkeys(r["law"] for r in rows if r["level"] in (level, "") and r["law"] not in lesser))
    columns = [Column("Quantity")]
    for law in laws:
        group = "article" if law.startswith("article") else f"this rig, over {base}"
        columns.append(Column(law.removeprefix("article updated, "), "%", "+.1f", group))
    cells = {(r["law"], r["quantity"]): _change(r) for r in rows if r["level"] in (level, "")}
    body = tuple((quantity, *(cells.get((law, quantity)) for law in laws)) for quantity in _IMPROVED)
    caption = (
        f"Change from the initial to the updated model, in percent of the initial model’s value, at {level:g} "
        f"{excitation_unit(study)} RMS, engine {main_engine(study)}. Less is better for errors, more for MAC, FRAC, "
        "CSAC and CSF. Other levels: tables/improvements.csv."
    )
    return Table(f"improvements_level_{level:g}", caption, tuple(columns), body)


def _base_law(study) -> str:
    """What stands for the article's initial model: the best constants, else the first law."""
    names = [k.name for k in study.laws]
    return "constant" if "constant" in names else names[0]


def _change(row) -> Interval:
    return Interval(row["change_pct"], row.get("change_pct_low", np.nan), row.get("change_pct_high", np.nan))
