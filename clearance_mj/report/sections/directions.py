"""FRF matrices and directional FRFs of a rig that was driven along y and along z."""

from __future__ import annotations

import pandas as pd

from ...study import Study
from ...study.matrices import FRFMatrices, matrices_of, matrix_rows
from .. import figures
from ..html import render
from ..tables import Column, Table
from ..writer import ReportWriter
from . import section

CAPTION = (
    "Whole FRF matrices, to y and to z, against the test’s first records of both directions. Normal and reverse: RMSE "
    "of the directional FRFs, means over the nodes. Reverse over normal: RMS of all reverse directional FRFs over that "
    "of the normal ones, nothing where y and z are alike."
)


@section("directions", "FRF matrices and directional FRFs", 35)
def directions(study: Study, writer: ReportWriter) -> str:
    """Return FRF matrices of each level and spin; writes frf_matrices.csv. Nothing of a rig in a plane."""
    if not study.dataset.rig.moves_across:
        return ""
    if not (results := matrices_of(study)):
        return "<p>The rig was not driven along y and along z at one level and spin.</p>\n"
    rows = pd.DataFrame(matrix_rows(study))
    writer.csv("frf_matrices", rows)
    shown = Table.of("frf_matrices", CAPTION, rows, {
        "spin_rpm": Column("Spin", "rev/min", ".4g"), "level": Column("Level", study.unit, "g"), "law": Column("Law"),
        "rmse_db": Column("RMSE", "dB", ".2f"), "frac": Column("FRAC", "", ".4f"), "csac": Column("CSAC", "", ".4f"),
        "csf": Column("CSF", "", ".4f"), "normal_db": Column("normal", "dB", ".2f", "RMSE, directional"),
        "reverse_db": Column("reverse", "dB", ".2f", "RMSE, directional"),
        "anisotropy": Column("model", "", ".3f", "Reverse over normal"),
        "anisotropy_test": Column("test", "", ".3f", "Reverse over normal"),
    })  # fmt: skip
    main = max(results, key=lambda each: each.level == study.main_part.main_level)
    ordered = sorted(results, key=lambda each: each is not main)
    drawn = [(_condition_words(each), each is main, _draw_figures(study, each, writer)) for each in ordered]
    return render("directions.html.j2", table_of_rows=shown, drawn=drawn)


def _draw_figures(study: Study, frf_matrices: FRFMatrices, writer: ReportWriter) -> list[str]:
    """Write the figures, the node nearest to a bushing first."""
    matrices = sorted(figures.frf_matrix(study, frf_matrices), key=lambda drawing: not drawing.sharp)
    return [writer.figure(drawing) for drawing in (figures.directional(study, frf_matrices), *matrices)]


def _condition_words(frf_matrices: FRFMatrices) -> str:
    unit = "N" if frf_matrices.kind == "force" else "m/s²"
    return f"Level {frf_matrices.level:g} {unit} RMS, {frf_matrices.spin_rpm:.4g} rev/min"
