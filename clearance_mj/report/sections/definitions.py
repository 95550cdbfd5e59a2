"""Definitions of what is measured and compared."""

from __future__ import annotations

from ...study import RESOLUTION, Study
from ..html import render
from ..writer import ReportWriter
from . import section


@section("definitions", "Definitions", 70)
def definitions(study: Study, writer: ReportWriter) -> str:
    """Return the definitions."""
    return render("definitions.html.j2", resolution=f"{RESOLUTION:g}", in_space=study.dataset.rig.is_spatial)
