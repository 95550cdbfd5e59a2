"""The page of an identified bench: rig and law, how well they are known, what they miss."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .._version import __version__
from ..core.errors import RecordError
from ..core.files import to_json, write_text
from ..identify.forces.restoring import RestoringForce
from ..identify.laws.comparison import force_on
from ..identify.methods.bench import BenchFit
from ..io.dataset import Dataset
from ..statistics.intervals import Interval
from . import html
from .bench_figures import draw_forces, draw_misfit
from .tables import Column, Table
from .updated_rig import draw_parameters, draw_spectra
from .writer import ReportWriter

__all__ = ["write_bench", "write_page"]

STRONGEST = 12
"""correlations that are listed"""
TIED = 0.5
"""from which on"""


def write_bench(fit: BenchFit, dataset: Dataset, folder: Path, provenance: dict[str, Any]) -> None:
    """Write ``rig.toml``, ``law.json`` and ``identified.json``, the last two with what they come from."""
    fit.rig.copied(folder / "structure").save(folder / "rig.toml")
    write_text(folder / "law.json", to_json(fit.law.to_dict() | {"provenance": provenance}))
    about = {
        "version": __version__,
        "dataset": str(dataset.path),
        "rig": dataset.rig.name,
        "synthetic": _synthetic(dataset),
        "identified_from": [r.name for r in dataset.identify],
    }
    write_text(folder / "identified.json", to_json(about | fit.to_dict() | {"provenance": provenance}))


def write_page(fit: BenchFit, dataset: Dataset, folder: Path, shown: Path, progress: bool = False) -> None:
    """Write ``index.html``, ``figures/`` and ``tables/`` into a folder; ``shown`` is its name on the page."""
    writer = ReportWriter(folder, progress)
    sections = [
        html.Section("summary", "What was found", _summary(fit, dataset, shown)),
        html.Section("forces", "Restoring forces and walls", _forces(fit, dataset, writer)),
        html.Section("families", "Which law", _families(fit, writer)),
        html.Section("parameters", "What the records told", _parameters(fit, writer)),
        html.Section("misfit", "What rig and law miss", _misfit(fit, writer)),
    ]
    writer.close()
    write_text(folder / "index.html", html.page(f"Identified bench “{fit.rig.name}”", sections))


def _synthetic(dataset: Dataset) -> bool:
    return any("synthetic" in str(r.provenance).lower() for r in dataset.identify)


def _summary(fit: BenchFit, dataset: Dataset, shown: Path) -> str:
    sources = dict.fromkeys(str(r.provenance["source"]) for r in dataset.identify if "source" in r.provenance)
    best = fit.families[0]
    missed = [np.nanmedian(s.missed) for s in fit.misfit.stretches]
    sentence = (
        f"Likeliest: {best.name}, with {100 * best.weight:.3g} % of the weight of {len(fit.families)} families. "
        f"What its force misses of the piece that no fit saw is {best.held_out / best.misfit:.2g} times what it misses "
        "of the rest."
    )
    if missed:
        sentence += f" FRFs of the records are met within {min(missed):.2g} to {max(missed):.2g} dB, by level."
    return html.render(
        "bench_summary.html.j2", sentence=sentence, warnings=fit.warnings, folder=shown, gaps=_gaps(fit, dataset),
        synthetic=_synthetic(dataset),
        source="; ".join(sources) or "the dataset does not say", records=[r.name for r in dataset.identify],
    )  # fmt: skip


def _gaps(fit: BenchFit, dataset: Dataset) -> Table:
    rows = {r["name"]: r for r in fit.estimates.beside_priors()}
    cells = []
    for j, (bushing, told) in enumerate(zip(fit.rig.bushings, dataset.rig.bushings)):
        own = []
        for name in ("gap", "offset"):
            row = rows.get(f"bushings[{j}].{name}")
            limits = (1e6 * row["low"], 1e6 * row["high"]) if row else ()
            own += [1e6 * getattr(told, name), Interval(1e6 * getattr(bushing, name), *limits)]
        cells.append((f"{j + 1} ({bushing.where})", *own))
    columns = [Column("Bushing")]
    for name in ("Gap", "Offset"):
        columns += [Column("rig file", "µm", ".1f", name), Column("found", "µm", ".1f", name)]
    return Table("gaps", "Gaps and offsets, with 95 % intervals.", tuple(columns), tuple(cells))


def _forces(fit: BenchFit, dataset: Dataset, writer: ReportWriter) -> str:
    forces = _restoring_forces(fit, dataset)
    if not forces:
        return html.paragraph("No record to identify gives restoring forces on the found rig.", "note")
    return writer.figure(draw_forces(fit, forces))


def _restoring_forces(fit: BenchFit, dataset: Dataset) -> list[RestoringForce]:
    """On the found rig, of the records that allow it."""
    found = []
    for record in dataset.identify:
        try:
            found.append(force_on(fit.rig, fit.update, record))
        except RecordError:
            continue
    return found


def _families(fit: BenchFit, writer: ReportWriter) -> str:
    writer.csv("families", fit.to_dict()["families"])
    best = fit.families[0].log_evidence
    rows = tuple((f.contact, f.grease, f.weight, f.log_evidence - best, f.misfit, f.held_out) for f in fit.families)
    columns = (
        Column("Contact"), Column("Grease"), Column("Weight", "", ".3g"), Column("Log evidence", "less best", ".1f"),
        Column("Misfit", "", ".3g"), Column("Held-out misfit", "", ".3g"),
    )  # fmt: skip
    caption = (
        "Families of laws, likeliest first. Weight: probability among these, from the evidence in Laplace’s "
        "approximation. Misfit: of the restoring force, over 5 % of its local RMS, robust mean of all bushings; "
        "held out: of the piece of each record that no fit saw."
    )
    note = "The law is the likeliest; draws of rigs and laws take families by their weights."
    return html.table(Table("families", caption, columns, rows)) + html.paragraph(note, "note")


def _parameters(fit: BenchFit, writer: ReportWriter) -> str:
    found = fit.estimates.beside_priors()
    writer.csv("parameters", found)
    rows = tuple(
        (r["name"], r["unit"], r["before"], Interval(r["value"], r["low"], r["high"]), r["posterior_over_prior"])
        for r in found
    )
    columns = (
        Column("Parameter"), Column("Unit"), Column("Before", "", ".4g"), Column("Found", "95 %", ".4g"),
        Column("Std / prior std", "", ".2f"),
    )  # fmt: skip
    caption = "Parameters of the rig, then of every bushing’s law, SI units."
    only = fit.estimates.only_prior
    held = f"Only the prior holds {', '.join(only)}." if only else "The records told something of every parameter."
    widened = (
        f"Standard deviations of gaps, offsets and laws are widened by {fit.misfit.widening:.2f}, the RMS of what rig "
        "and law miss over its random error (Birge’s ratio)."
    )
    table = html.table(Table("parameters", caption, columns, rows))
    return (
        writer.figure(draw_parameters(fit.estimates))
        + html.paragraph(f"{html.formula(held)} {widened}")
        + f'<details id="values"><summary>All {len(rows)} parameters</summary>\n{table}</details>\n'
        + _correlations(fit)
    )


def _correlations(fit: BenchFit) -> str:
    names, matrix = fit.estimates.names, fit.estimates.correlation
    pairs = [(i, j) for i in range(len(names)) for j in range(i) if abs(matrix[i, j]) > TIED]
    pairs.sort(key=lambda pair: -abs(matrix[pair]))
    if not pairs:
        return ""
    rows = tuple((names[j], names[i], float(matrix[i, j])) for i, j in pairs[:STRONGEST])
    caption = f"The strongest correlations, of {len(pairs)} beyond ±{TIED:g}: the records tell such pairs together."
    columns = (Column("Parameter"), Column("With"), Column("Correlation", "", "+.2f"))
    table = html.table(Table("correlations", caption, columns, rows))
    return f'<details id="correlations"><summary>Correlations</summary>\n{table}</details>\n'


def _misfit(fit: BenchFit, writer: ReportWriter) -> str:
    frfs, decays = fit.misfit.rows(), fit.misfit.decay_rows()
    parts = [writer.figure(draw_spectra(fit.update)), writer.figure(draw_misfit(fit.misfit))]
    if frfs:
        writer.csv("misfit", frfs)
    parts += [html.paragraph(f"{words}.") for words in fit.misfit.warnings]
    if decays:
        writer.csv("decays", decays)
        parts.append(html.table(_decays(fit)))
    return "".join(parts)


def _decays(fit: BenchFit) -> Table:
    hits = fit.misfit.decays
    columns = [Column("Record"), Column("Hit at", "s", ".2f"), Column("Peak", fit.misfit.unit, ".3g")]
    columns += [Column(sensor, "dB", "+.1f", "Sensor") for sensor in fit.misfit.sensors]
    rows = [(d.record, d.start, d.peak, *(float(v) for v in d.missed[:, 0])) for d in hits]
    late = [(d.record, d.start + d.duration / 2, None, *(float(v) for v in d.missed[:, 1])) for d in hits]
    ordered = tuple(row for pair in zip(rows, late) for row in pair)
    caption = (
        "Decays after hits: RMS of the model over that of the record, in the first and in the second half of each; "
        "what changes between them is the decay. Noise of the sensors counts in the record alone."
    )
    return Table("decays", caption, tuple(columns), ordered)
