"""Orbits and run-ups of test and laws compared, of records of a shaft's turning alone."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd

from ...study import Study
from ...study.turning import TurningComparison
from .. import figures
from ..html import render
from ..tables import Column, Table
from ..writer import ReportWriter
from . import section

ORBITS = (
    "Orbits at constant speed, means over the records of a speed. Error: RMS over a turn of the difference of the "
    "orbits about their middles over the RMS radius of the test’s. Middle: how far the middles are apart over the gap. "
    "1X: radius of the circle that goes with the shaft, forward, and against it, backward."
)
RUN_UPS = (
    "Run-ups, means over the records: error of the 1X motion, amplitude and phase together, over the RMS of the test’s "
    "forward amplitude; where that is largest; and where the shaft begins to touch its bushing, of the test with the "
    "wall that the law has (– : it never begins)."
)
NOTHING = "No record to validate shows orbits: of a shaft that turns alone, with both probes of every bushing."
KEYS = ["spin_rpm", "bushing", "law"]
WAYS, SIDES = ("forward", "backward"), ("test", "model")


@section("turning", "Orbits and run-ups", 45)
def turning(study: Study, writer: ReportWriter) -> str:
    """Return orbits and run-ups; writes orbits.csv and run_ups.csv. Nothing of a rig in a plane."""
    if not study.dataset.rig.moves_across:
        return ""
    motions = TurningComparison(study)
    if not motions.groups:
        return f"<p>{NOTHING}</p>\n"
    orbits, run_ups = (pd.DataFrame(rows) for rows in (motions.orbit_rows(), motions.run_up_rows()))
    writer.csv("orbits", orbits)
    writer.csv("run_ups", run_ups)
    n, draw_run_up = len(study.dataset.rig.bushings), (figures.run_ups_of_bushing, figures.cascades)
    run_up_figures = itertools.product(motions.run_ups.values(), range(n), draw_run_up)
    return render(
        "turning.html.j2", sentences=orbit_sentences(orbits, study), run_out=motions.run_out is not None,
        orbits=orbit_table(orbits) if len(orbits) else None, run_ups=run_up_table(run_ups) if len(run_ups) else None,
        of_orbits=[writer.figure(figures.orbits_of_bushing(motions, j)) for j in range(n)] if len(orbits) else [],
        of_run_ups=[writer.figure(draw(motions, j, records)) for records, j, draw in run_up_figures],
    )  # fmt: skip


def orbit_table(rows: pd.DataFrame) -> Table:
    """Return errors and 1X amplitudes at each speed."""
    means = _means(rows)
    for way, side in itertools.product(WAYS, SIDES):
        means[f"{way}_{side}"] = 1e6 * means[f"{way}_{side}_m"]
    means["contact"] = 100 * means["contact_share"]
    return Table.of("orbits", ORBITS, means, {
        "spin_rpm": Column("Spin", "rev/min", ".4g"), "bushing": Column("Bushing", "", "g"), "law": Column("Law"),
        "error": Column("Error", "", ".3f"), "middle_over_gap": Column("Middle / gap", "", ".4f"),
        **{f"{way}_{side}": Column(side, "µm", ".3g", f"1X {way}") for way, side in itertools.product(WAYS, SIDES)},
        "contact": Column("Contact", "% time", ".1f"),
    })  # fmt: skip


def run_up_table(rows: pd.DataFrame) -> Table:
    """Return errors of run-ups, and speeds at which the shaft moves most and begins to touch."""
    return Table.of("run_ups", RUN_UPS, _means(rows), {
        "bushing": Column("Bushing", "", "g"), "law": Column("Law"),
        **{f"{way}_error": Column(way, "", ".3f", "Error") for way in WAYS},
        **{f"peak_{side}_rpm": Column(side, "rev/min", ".0f", "Largest 1X") for side in SIDES},
        **{f"onset_{side}_rpm": Column(side, "rev/min", ".0f", "Contact begins") for side in SIDES},
    })  # fmt: skip


def _means(rows: pd.DataFrame) -> pd.DataFrame:
    """Return means over records, in the order of the rows."""
    return rows.groupby(KEYS, sort=False).mean(numeric_only=True).reset_index()


def orbit_sentences(rows: pd.DataFrame, study: Study) -> str:
    """Return in words how far the best law's orbits are from the test's, and the repeat's."""
    if rows.empty:
        return ""
    law = rows[rows["law"] == study.best_law]["error"]
    repeat = rows[rows["law"] == "repeat"]["error"]
    repeatability = f"; the rig repeats itself within {100 * np.median(repeat):.3g} %" if len(repeat) else ""
    return (
        f"At constant speed, law “{study.best_law}” misses the orbits by {100 * np.median(law):.3g} % of their radius "
        f"in the median, {100 * law.min():.3g} to {100 * law.max():.3g} %{repeatability}."
    )
