"""The page of a followed record: gap, stiffness and damping over time, alarms; histories as CSV and NetCDF."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..clearance.law import Law
from ..core.files import replacing, to_json, write_text
from ..identify import Twin
from ..io.dataset import Record
from ..version import __version__
from . import html
from .style import Drawing
from .tables import Column, Table, write_csv
from .writer import ReportWriter

__all__ = ["draw", "write_twin"]


def draw(twin: Twin) -> Drawing:
    """Draw what is tracked over time with its 95 % bands and the alarms, a column for each clearance."""
    names = f"{', '.join(twin.quantities[:-1])} and {twin.quantities[-1]}".capitalize()
    caption = (
        f"{names} of the clearances of rig “{twin.rig.name}” along record “{twin.record}”, each value from what was "
        "measured by then, with 95 % bands, above what laws miss of the force; vertical lines: alarms."
    )
    return Drawing("twin", twin.plot(), caption, f"{names} over time with bands and alarms.")


def write_twin(
    twin: Twin, record: Record, law: Law | None, folder: Path, made_from: Mapping[str, Any]
) -> dict[str, Any]:
    """Write ``index.html``, figure, ``twin.csv``, ``twin.nc`` and ``twin.json``; return what the last one holds.

    The last two say what they were made from.
    """
    write_csv(folder / "twin.csv", twin.rows())
    with replacing(folder / "twin.nc") as temporary:
        histories = twin.to_xarray().assign_attrs(provenance=json.dumps(made_from))
        histories.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
    last = [row for row in twin.rows() if row["time_s"] == twin.time[-1]]
    result = {
        "version": __version__, "record": twin.record, "provenance": record.provenance,
        "made_from": made_from, "window": twin.window,
        "rig": twin.rig.to_dict(), "law": law.to_dict() if law else None, "depth": twin.depth.tolist(),
        "alarms": [a.to_dict() for a in twin.alarms], "last": last, "warnings": list(twin.warnings),
    }  # fmt: skip
    write_text(folder / "twin.json", to_json(result))
    writer = ReportWriter(folder)
    summary = html.sentences([*twin.words(), *twin.warnings])
    sections = [
        html.PageSection("summary", "What the record shows", summary + writer.figure(draw(twin))),
        html.PageSection("alarms", "Alarms", _alarm_table(twin)),
    ]
    writer.page(f"Twin of rig “{twin.rig.name}”", sections, html.examples(twin.rig))
    return result


def _alarm_table(twin: Twin) -> str:
    if not twin.alarms:
        return html.paragraph("No quantity changed by more than what its windows explain.")
    columns = (
        Column("At", "s", ".2f"), Column("Bushing"), Column("Quantity"), Column("Likely since", "s", ".2f"),
        Column("Before", "SI", ".4g"), Column("After", "SI", ".4g"), Column("Change", "%", "+.1f"),
    )  # fmt: skip
    rows = tuple(
        (a.time, str(a.bushing + 1), a.quantity, a.since, a.before, a.after, 100 * (a.after / a.before - 1))
        for a in twin.alarms
    )
    return html.table(Table("alarms", "Changes beyond what the windows’ covariances explain.", columns, rows))
