"""Gains of the updated models over constant parameters: as the article prints them, from its tables, and ours."""

from collections.abc import Sequence

import pandas as pd

from clearance_mj.report import frames
from clearance_mj.report.tables import Column, Table
from clearance_mj.statistics.intervals import Interval
from clearance_mj.study import Study

from .models import name_of
from .published import IMPROVEMENTS
from .published import improvements as recomputed
from .result import to_table


def improvements(study: Study, quantities: Sequence[str]) -> tuple[pd.DataFrame, Table]:
    """Return changes in percent of the initial model's value, at every level and as a table for the middle one.

    Of the quantities whose names begin with one of those given. Ours are over the best constants (over the datasheet
    where these were not identified), means over both records of a level, with 95 % intervals.
    """
    rows = [
        {"law": f"article updated, {basis}", "over": "article initial", "quantity": quantity, "change_pct": change}
        for basis, changes in (("as printed", IMPROVEMENTS), ("recomputed", recomputed()))
        for quantity, change in changes.items()
    ]
    gains = pd.concat([pd.DataFrame(rows), frames.improvements(study)], ignore_index=True)
    gains = gains[gains["quantity"].str.startswith(tuple(quantities))]
    base = study.base_law
    after = study.methods[study.methods.index(base) + 1 :]
    shown = gains[(gains["level"] == study.main_level) & gains["law"].isin(after) | gains["level"].isna()]
    cells = {
        (r.law, r.quantity): Interval(r.change_pct, r.change_pct_low, r.change_pct_high) for r in shown.itertuples()
    }
    laws = shown["law"].unique()
    columns = [Column("Quantity"), *(Column(name_of(law), "%", "+.1f") for law in laws)]
    body = [(q, *(cells.get((law, q)) for law in laws)) for q in gains["quantity"].unique()]
    caption = (
        f"Change from the initial to the updated model in percent of the initial value; ours over {name_of(base)} at "
        f"{study.main_level:g} m/s², engine {study.engines[0]}, with 95 % intervals. The article's changes of MAC, "
        "FRAC, CSAC and CSF are relative to the new value."
    )
    return gains, to_table("improvements", caption, columns, body)
