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


def draw(found: Twin) -> Drawing:
    """Draw what is tracked over time with its 95 % bands and the alarms, a column for each clearance."""
    what = f"{', '.join(found.quantities[:-1])} and {found.quantities[-1]}".capitalize()
    caption = (
        f"{what} of the clearances of rig “{found.rig.name}” along record “{found.record}”, each value from what was "
        "measured by then, with 95 % bands, above what laws miss of the force; vertical lines: alarms."
    )
    return Drawing("twin", found.plot(), caption, f"{what} over time with bands and alarms.")


def write_twin(
    found: Twin, record: Record, law: Law | None, folder: Path, made_from: Mapping[str, Any]
) -> dict[str, Any]:
    """Write ``index.html``, figure, ``twin.csv``, ``twin.nc`` and ``twin.json``; return what the last one holds.

    The last two say what they were made from.
    """
    write_csv(folder / "twin.csv", found.rows())
    with replacing(folder / "twin.nc") as temporary:
        histories = found.to_xarray().assign_attrs(provenance=json.dumps(made_from))
        histories.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
    last = [row for row in found.rows() if row["time_s"] == found.time[-1]]
    result = {
        "version": __version__, "record": found.record, "provenance": record.provenance,
        "made_from": made_from, "window": found.window,
        "rig": found.rig.to_dict(), "law": law.to_dict() if law else None, "depth": found.depth.tolist(),
        "alarms": [a.to_dict() for a in found.alarms], "last": last,
        "warnings": list(found.warnings),
    }  # fmt: skip
    write_text(folder / "twin.json", to_json(result))
    writer = ReportWriter(folder)
    summary = html.sentences([*found.words(), *found.warnings])
    sections = [
        html.Section("summary", "What the record shows", summary + writer.figure(draw(found))),
        html.Section("alarms", "Alarms", _alarms(found)),
    ]
    writer.page(f"Twin of rig “{found.rig.name}”", sections, html.examples(found.rig))
    return result


def _alarms(found: Twin) -> str:
    if not found.alarms:
        return html.paragraph("No quantity changed by more than what its windows explain.")
    columns = (
        Column("At", "s", ".2f"), Column("Bushing"), Column("Quantity"), Column("Likely since", "s", ".2f"),
        Column("Before", "SI", ".4g"), Column("After", "SI", ".4g"), Column("Change", "%", "+.1f"),
    )  # fmt: skip
    rows = tuple(
        (a.time, str(a.bushing + 1), a.quantity, a.since, a.before, a.after, 100 * (a.after / a.before - 1))
        for a in found.alarms
    )
    return html.table(Table("alarms", "Changes beyond what the windows’ covariances explain.", columns, rows))
