"""The page of a followed record: gap, stiffness and damping over time, alarms; histories as CSV and NetCDF."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..clearance.law import Law
from ..core.drawing import ALARM
from ..core.files import replacing, to_json, write_text
from ..identify import Twin
from ..io.dataset import Record
from ..version import __version__
from . import html
from .style import COLOURS, FONT, Drawing, canvas, tidy
from .tables import Column, Table, write_csv
from .writer import ReportWriter

__all__ = ["draw", "write_twin"]

SHOWN = {"gap": (1e3, "Gap (mm)"), "stiffness": (1e-3, "Stiffness (N/mm)"), "damping": (1.0, "Damping (N s/m)")}
"""factor to the unit on the axis, and its label"""


def draw(found: Twin) -> Drawing:
    """Draw gap, stiffness and damping over time with their 95 % bands and the alarms, a column for each clearance."""
    n = found.depth.size
    figure = canvas(6.2)
    axes = figure.subplots(len(SHOWN), n, sharex=True, sharey="row", squeeze=False)
    for row, (quantity, (factor, label)) in zip(axes, SHOWN.items()):
        for j, ax in enumerate(row):
            _panel(ax, found, quantity, j, factor)
            title = f"bushing {j + 1}" if quantity == "gap" else ""
            tidy(ax, title, label if j == 0 else "", "Time (s)" if quantity == "damping" else "")
    handles = [
        Line2D([], [], color=COLOURS[0], lw=1.2, label="most likely"),
        Patch(facecolor=COLOURS[0], alpha=0.25, lw=0, label="95 % band"),
    ]
    if found.alarms:
        handles.append(Line2D([], [], color=ALARM, lw=1.0, label="alarm"))
        handles.append(Line2D([], [], color=ALARM, lw=1.0, ls=":", label="alarm of another quantity"))
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=FONT - 0.5, frameon=False)
    caption = (
        f"Gap, contact stiffness and contact damping of the clearances of rig “{found.rig.name}” along record "
        f"“{found.record}”, each value from what was measured by then, with 95 % bands; vertical lines: alarms."
    )
    return Drawing("twin", figure, caption, "Gap, stiffness and damping over time with bands and alarms.")


def _panel(ax: Axes, found: Twin, quantity: str, bushing: int, factor: float) -> None:
    value, (low, high) = (factor * part for part in (found.value(quantity), found.band(quantity)))
    ax.fill_between(found.time, low[:, bushing], high[:, bushing], color=COLOURS[0], alpha=0.25, lw=0)
    ax.plot(found.time, value[:, bushing], color=COLOURS[0], lw=1.2)
    known = value[np.isfinite(value)]
    if known.size:  # bands of a clearance that hardly touches would hide all others
        ax.set_ylim(0.8 * known.min(), 1.2 * known.max())
    for alarm in found.alarms:
        if alarm.bushing == bushing:
            ax.axvline(alarm.time, color=ALARM, lw=1.0, ls="-" if alarm.quantity == quantity else ":")


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
    summary = "".join(html.paragraph(html.formula(f"{words}.")) for words in (*found.words(), *found.warnings))
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
