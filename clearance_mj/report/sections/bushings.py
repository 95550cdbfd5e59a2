"""Fitted parameters, motion and contact in the bushings, modes over level."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...study import Study
from .. import figures, frames
from ..html import render, table
from ..tables import REPEAT, Column, Table
from ..writer import ReportWriter
from . import section
from .parts import by_part

FAMILIES = (
    "Families of contact and grease that were compared at each clearance. Weight: probability of the family among "
    "them, with which they are mixed in the bands below. Misfit: what the law misses of the restoring force, over "
    "what a law is expected to miss."
)


@section("bushings", "Parameters, contact and modes", 60)
def bushings(study: Study, writer: ReportWriter) -> str:
    """Return parameters, contact and modes; writes their CSV, those of families and contact_limits if there are any."""
    parameters, families = frames.parameters(study), frames.families(study)
    writer.csv("parameters", parameters)
    if len(families):
        writer.csv("families", families)
    writer.csv("contact", frames.contact(study))
    shown = Table.of("parameters", "Fitted parameters; where no bushing is named, the same at all.", parameters, {
        "law": Column("Law"), "parameter": Column("Parameter"), "unit": Column("Unit"),
        "value": Column("Fitted", "", ".5g"), "standard_deviation": Column("± standard deviation", "", ".2g"),
        "relative_std_pct": Column("relative", "%", ".2g"), "rig_file": Column("Rig file", "", ".5g"),
    })  # fmt: skip
    compared = Table.of("families", FAMILIES, families.assign(bushing=families["bushing"] + 1), {
        "law": Column("Law"), "bushing": Column("Bushing"), "contact": Column("Contact"),
        "grease": Column("Grease"), "weight": Column("Weight", "", ".3f"), "misfit": Column("Misfit", "", ".2f"),
        "held_out": Column("of what no fit saw", "", ".2f"),
    })  # fmt: skip
    bands = [writer.figure(drawing) for drawing in figures.study_bands(study.main_part)]
    if len(limits := frames.contact_limits(study.main_part)):
        writer.csv("contact_limits", limits)
        caption = f"Share of the time in contact in record {study.main_record.name}, with 95 % limits of drawn laws."
        bands.append(table(Table.of("contact_limits", caption, limits, {
            "law": Column("Law"), "bushing": Column("Bushing"), "contact_pct": Column("Contact", "% time", ".2f"),
            "low_pct": Column("at least", "%", ".2f"), "high_pct": Column("at most", "%", ".2f"),
        })))  # fmt: skip

    def motion(part: Study) -> str:
        contact, over_level = (writer.figure(draw(part)) for draw in (figures.contact, figures.modes))
        return render("motion.html.j2", contact=contact, contact_table=contact_table(part), modes=over_level)

    return render("bushings.html.j2", parameters=shown, families=compared, bands=bands) + by_part(study, motion)


def contact_table(study: Study) -> Table:
    """Return motion over the gap, fraction of time in contact and peak force by level; means over a level's records."""
    rows = frames.contact(study)
    rows["rms"], rows["peak"] = (rows[f"displacement_{name}_m"] / rows["gap_m"] for name in ("rms", "peak"))
    rows["share"] = 100 * rows["contact_share"]
    means = rows.groupby(["level", "law", "engine", "bushing"])[["rms", "peak", "share", "contact_peak_n"]].mean()
    columns = [Column("Level", study.unit, "g"), Column("Law")]
    n = len(study.dataset.rig.bushings)
    for group in (f"Bushing {i + 1}" for i in range(n)):
        columns += [
            Column("RMS / gap", "", ".2f", group), Column("peak / gap", "", ".2f", group),
            Column("contact", "% time", ".1f", group), Column("peak force", "N", ".2f", group),
        ]  # fmt: skip
    body = []
    for level in study.levels:
        for law, engine in (("test", REPEAT[1]), *((law, study.main_engine) for law in study.methods)):
            keys: list[Any] = [(level, law, engine, i + 1) for i in range(n)]
            cells = [means.loc[key].tolist() if key in means.index else [np.nan] * 4 for key in keys]
            # The test's contact is not measured.
            body.append((level, law, *(x for row in cells for x in ([*row[:2], None, None] if law == "test" else row))))
    caption = (
        f"Motion and contact in the bushings, engine {study.main_engine}. RMS, peak and contact are means over a "
        "level’s records. A bushing is in contact while an end of it lies beyond its gap, counted at the simulation’s "
        "own steps. Probes at the bushings give the test’s motion, its contact is not measured. Gaps are those of the "
        "rig that a law is simulated on, for the test those of the rig file. The other engines are in "
        "tables/contact.csv."
    )
    return Table("contact", caption, tuple(columns), tuple(body))
