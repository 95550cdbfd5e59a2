"""Definitions of what is measured and compared."""

from __future__ import annotations

from ...study import Study
from ..html import render
from ..writer import ReportWriter
from . import section


@section("definitions", "Definitions", 70)
def definitions(study: Study, writer: ReportWriter) -> str:
    """Return the definitions."""
    frequency = study.test(study.main_record).frequency
    return render("definitions.html.j2", resolution=f"{frequency[1] - frequency[0]:g}")
