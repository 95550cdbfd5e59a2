"""What a better law gains over another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...statistics import repeatability
from ...statistics.intervals import Interval, ratio
from .study import N_MODES, excitation_unit, main_engine
from .table import Column, Table

if TYPE_CHECKING:
    from ...study import Study

__all__ = ["IMPROVED", "base_law", "improvement_rows", "improvement_table"]

IMPROVED = {
    **{f"MAC, mode {mode}": f"mode_{mode}_mac" for mode in range(1, N_MODES + 1)},
    "frequency error": "relative_error",
    "MRE": "mre",
    "RMSE": "rmse_db",
    "FRAC": "frac",
    "CSAC": "csac_per_sensor",
    "CSF": "csf_per_sensor",
}
"""Quantities that a better law improves, and their names in `Study.rows`"""


def improvement_rows(study: Study) -> list[dict]:
    """Change from the base law to another in percent of the former: a row per level, law and quantity.

    Parameters
    ----------
    study : Study
        The study; every law beside the base is compared with it, on the main engine.
    """
    rows, base, engine = [], base_law(study), main_engine(study)
    found = {(r["level"], r["law"]): r for r in study.rows() if r["engine"] == engine}
    for (level, law), row in found.items():
        if law == base:
            continue
        for quantity, key in IMPROVED.items():
            change = ratio(*(repeatability.interval_of(r, key) for r in (row, found[level, base])))
            low, value, high = (100 * (x - 1) for x in (change.low, change.value, change.high))
            row_of = {"level": level, "law": law, "over": base, "quantity": quantity, "change_pct": value}
            rows.append(row_of | {"change_pct_low": low, "change_pct_high": high})
    return rows


def improvement_table(study: Study, level: float) -> Table:
    """Improvement of the laws that follow the base law over it.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    base, names = base_law(study), [k.name for k in study.laws]
    laws = names[names.index(base) + 1 :]
    columns = (Column("Quantity"), *(Column(law, "%", "+.1f", f"over {base}") for law in laws))
    cells = {
        (r["law"], r["quantity"]): Interval(r["change_pct"], r["change_pct_low"], r["change_pct_high"])
        for r in improvement_rows(study)
        if r["level"] == level
    }
    body = tuple((quantity, *(cells.get((law, quantity)) for law in laws)) for quantity in IMPROVED)
    caption = (
        f"Change from law “{base}” to those that follow it, in percent of its value, at {level:g} "
        f"{excitation_unit(study)} RMS, engine {main_engine(study)}. Less is better for errors, more for MAC, FRAC, "
        "CSAC and CSF. Other levels: tables/improvements.csv."
    )
    return Table(f"improvements_level_{level:g}", caption, columns, body)


def base_law(study: Study) -> str:
    """What the other laws are compared with: the best constants, else the first law.

    Parameters
    ----------
    study : Study
        The study.
    """
    names = [k.name for k in study.laws]
    return "constant" if "constant" in names else names[0]
