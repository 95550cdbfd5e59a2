"""How to make the records and the report again."""

from __future__ import annotations

import shlex

from ...study import Study
from ..html import render
from ..writer import ReportWriter
from . import section


@section("reproduce", "How to reproduce", 80)
def reproduce(study: Study, writer: ReportWriter) -> str:
    """Return the commands."""
    path = shlex.quote(str(study.dataset.path or "DATASET"))
    provenances = [r.provenance for r in study.dataset.records]
    makers = dict.fromkeys(str(p["command"]) for p in provenances if "command" in p)
    study_command = f"clearance-mj study {path} --engines {','.join(study.engines)} --out results/study"
    commands = [*(f"{maker} {path}" for maker in makers), study_command]
    return render("reproduce.html.j2", commands=commands, makes_records=bool(makers))
