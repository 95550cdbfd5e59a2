"""About the study: rig, prior information of each law, records, engines; definitions, steps to reproduce it."""

from __future__ import annotations

import platform
import shlex
from importlib.metadata import PackageNotFoundError, version

from ...study import RESOLUTION, Study
from ...version import __version__
from .. import frames
from ..figures import rig_drawing
from ..html import render
from ..tables import Column, Table
from ..writer import ReportWriter
from . import section

PACKAGES = ("mujoco-core", "numpy", "scipy", "numba", "matplotlib")
LAWS = (
    "Laws: what each model was allowed to know, and the rig on which it is simulated. A rig that was identified "
    "has the sensors’ gains and places that were found, so its model predicts what they read."
)
ENGINES = (
    "Time step that each engine chose, from the highest frequency of its model. Safety: share of the stability limit "
    "2/ω; resolution: phase in rad that the fastest mode or contact may turn in a step."
)


@section("about", "What this is", 10)
def about(study: Study, writer: ReportWriter) -> str:
    """Return rig, laws and records; writes laws.csv, records.csv and engines.csv."""
    laws, records, engines = frames.laws(study), frames.records(study), frames.engines(study)
    writer.csv("laws", laws)
    writer.csv("records", records)
    writer.csv("engines", engines)
    return render(
        "about.html.j2", study=study, drawing=writer.figure(rig_drawing(study.dataset.rig)), versions=_versions(),
        laws=Table.of("laws", LAWS, laws, {
            "law": Column("Law"), "given": Column("Was given"), "simulated_on": Column("Is simulated on"),
        }),
        records=Table.of("records", "Records: what each was used for.", records, {
            "record": Column("Record"), "role": Column("Used to"), "excitation": Column("Excitation"),
            "level": Column("Level", "RMS", "g"), "unit": Column("Unit"), "duration_s": Column("Duration", "s", "g"),
            "fs_hz": Column("Rate", "Hz", "g"), "seed": Column("Seed"),
        }),
        engines=Table.of(
            "engines", ENGINES,
            engines.assign(step_us=1e6 * engines["step_min_s"], rate_khz=1e-3 / engines["step_min_s"]), {
            "engine": Column("Engine"), "settings": Column("Settings"), "law": Column("Law"),
            "step_us": Column("Time step", "µs", ".3g"), "rate_khz": Column("Rate", "kHz", ".1f"),
        }),
    )  # fmt: skip


@section("definitions", "Definitions", 70)
def definitions(study: Study, writer: ReportWriter) -> str:
    """Return the definitions."""
    return render("definitions.html.j2", resolution=f"{RESOLUTION:g}", in_space=study.dataset.rig.moves_across)


@section("reproduce", "How to reproduce", 80)
def reproduce(study: Study, writer: ReportWriter) -> str:
    """Return the commands."""
    path = shlex.quote(str(study.dataset.path or "DATASET"))
    makers = dict.fromkeys(str(p["command"]) for p in [r.provenance for r in study.dataset.records] if "command" in p)
    study_command = f"clearance-mj study {path} --engines {','.join(study.engines)} --out results/study"
    commands = [*(f"{maker} {path}" for maker in makers), study_command]
    return render("reproduce.html.j2", commands=commands, makes_records=bool(makers))


def _versions() -> str:
    versions = [f"clearance-mj {__version__}", f"Python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            versions.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return ", ".join(versions)
