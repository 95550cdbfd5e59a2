"""Motion and contact in the bushings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .study import FLOOR, excitation_unit, main_engine
from .table import Column, Table

if TYPE_CHECKING:
    from ...study import Study

__all__ = ["contact_rows", "contact_table"]


def contact_rows(study: Study) -> list[dict]:
    """Motion and contact in every bushing: a row per record, law, engine and bushing; law "test" is what probes saw.

    Parameters
    ----------
    study : Study
        The study.
    """
    gaps = [b.gap for b in study.dataset.rig.bushings]
    rows = []
    for record in study.dataset.validate:
        displacement = record.response().displacement
        if displacement is not None:
            rms, peak = displacement.std(axis=1), np.abs(displacement).max(axis=1)
            head = {"level": record.level, "record": record.name, "law": "test", "engine": FLOOR["engine"]}
            rows += _bushings(head, gaps, rms, peak, [np.nan] * len(gaps), [np.nan] * len(gaps))
    for c in study.cases:
        keys = ("displacement_rms", "displacement_peak", "contact_share", "contact_peak")
        head = {"level": c.record.level, "record": c.record.name, "law": c.law, "engine": c.engine}
        rows += _bushings(head, gaps, *(c.statistics[key] for key in keys))
    return rows


def contact_table(study: Study) -> Table:
    """Motion over the gap, share of the time in contact and peak force by level; means over a level's records.

    Parameters
    ----------
    study : Study
        The study.
    """
    rows, engine = contact_rows(study), main_engine(study)
    n_bushings = len(study.dataset.rig.bushings)
    columns = [Column("Level", excitation_unit(study), "g"), Column("Law")]
    for i in range(n_bushings):
        group = f"Bushing {i + 1}"
        columns += [
            Column("RMS / gap", "", ".2f", group),
            Column("peak / gap", "", ".2f", group),
            Column("contact", "% time", ".1f", group),
            Column("peak force", "N", ".2f", group),
        ]
    body = []
    for level in study.levels:
        for law, on in (("test", FLOOR["engine"]), *((k.name, engine) for k in study.laws)):
            cells = []
            for i in range(n_bushings):
                found = [r for r in rows if _is(r, level=level, law=law, engine=on, bushing=i + 1)]
                cells += _contact_cells(found, law == "test")
            body.append((level, law, *cells))
    caption = (
        f"Motion and contact in the bushings, engine {engine}. RMS, peak and contact are means over a level’s "
        "records; probes at the bushings give the test’s motion, its contact is not measured. "
        "The other engines are in tables/contact.csv."
    )
    return Table("contact", caption, tuple(columns), tuple(body))


def _bushings(head, gaps, *columns) -> list[dict]:
    names = ("gap_m", "displacement_rms_m", "displacement_peak_m", "contact_share", "contact_peak_n")
    return [head | {"bushing": i + 1} | dict(zip(names, map(float, row))) for i, row in enumerate(zip(gaps, *columns))]


def _contact_cells(found, measured) -> list:
    rms = _mean(r["displacement_rms_m"] / r["gap_m"] for r in found)
    peak = _mean(r["displacement_peak_m"] / r["gap_m"] for r in found)
    if measured:
        return [rms, peak, None, None]
    share, force = (_mean(r[key] for r in found) for key in ("contact_share", "contact_peak_n"))
    return [rms, peak, 100 * share, force]


def _mean(values) -> float:
    """Mean of the finite values; nan if there is none."""
    finite = [v for v in values if np.isfinite(v)]
    return float(np.mean(finite)) if finite else np.nan


def _is(row, **values) -> bool:
    return all(row[key] == value for key, value in values.items())
