"""FRFs and their agreement over frequency, level by level: the main one open, the others folded away."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...study import Study
from .. import figures
from ..html import heading, render
from ..style import Drawing
from ..writer import ReportWriter
from . import section
from .parts import by_part

Draw = Callable[[Study, float], Drawing | None]


@section("frf", "Frequency response functions", 30)
def frf(study: Study, writer: ReportWriter) -> str:
    """Return FRFs over level, and those of each level."""

    def write(part: Study) -> str:
        over_level = heading("waterfall", "Over level") + writer.figure(figures.study_waterfall(part))
        return over_level + _levels(part, writer, "frf", (figures.frf_bushings, figures.frf_others))

    return by_part(study, write)


@section("correlation", "Agreement over frequency", 40)
def correlation(study: Study, writer: ReportWriter) -> str:
    """Return CSAC and CSF of each level."""
    draw = (figures.correlation, figures.csac_sensors, figures.csf_sensors)
    return by_part(study, lambda part: _levels(part, writer, "correlation", draw))


def _levels(study: Study, writer: ReportWriter, kind: str, draw: Sequence[Draw]) -> str:
    others = [level for level in study.levels if level != study.main_level]
    drawn = {level: [writer.figure(figure(study, level)) for figure in draw] for level in (study.main_level, *others)}
    return render("by_level.html.j2", study=study, kind=kind, drawn=drawn)
