"""The page of an identified model: its rattle map, the accuracy of its parameters, its misfit."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import escape

from ..estimate.estimates import Estimates
from ..identify.forces.restoring import RestoringForce
from ..identify.laws.comparison import FamilyFit
from ..identify.laws.law_misfit import LawMisfit
from ..identify.registry import Identified
from ..identify.structure.priors import parameter_words, unsaid_words
from ..identify.structure.rig_update import RigUpdate
from ..io.dataset import Dataset, Record
from ..statistics.intervals import Interval
from . import html
from .contact import contact_drawings
from .identification_figures import draw_forces, draw_misfit
from .rattling import rattling_section
from .structure_section import structure_section
from .tables import Column, Table
from .updated_rig import draw_parameters, draw_spectra
from .writer import ReportWriter

__all__ = ["write_identification"]

LISTED = 12  # strongest correlations that are listed
PRIOR_WORDS = "of the rig file, within its tolerance, or usual of the law’s family"
CORRELATED = 0.5  # size of a correlation from which on it is listed


def write_identification(
    fit: Identified, dataset: Dataset, folder: Path, shown: Path, workers: int | None = 1, progress: bool = False
) -> None:
    """Write ``index.html``, ``figures/`` and ``tables/``.

    Parameters
    ----------
    fit : Identified
        Result of any method.
    dataset : Dataset
        Records from which it was identified.
    folder : Path
        Folder that is written to.
    shown : Path
        Name of the folder on the page.
    workers : int, optional
        Processes of the rattle map; None: one for each core, where the calling script may be imported by them.
    progress : bool
        Show a progress bar.
    """
    writer, pages = ReportWriter(folder, progress), dict(fit.pages)
    forces = pages.pop("forces")() if "forces" in pages else []
    sections = [
        html.PageSection("rattling", "Does it rattle?", rattling_section(fit, dataset, writer, workers)),
        html.PageSection("summary", "What was found", _summary_html(fit, dataset, shown)),
    ]
    if forces:
        drawn = writer.figure(draw_forces(fit, forces))
        sections.append(html.PageSection("forces", "Restoring forces and walls", drawn))
    if fit.estimates:
        sections.append(html.PageSection("parameters", "How well it is known", _parameter_section(fit, writer)))
    for name, data in pages.items():
        title, write = PAGES[name]
        sections.append(html.PageSection(name, title, write(fit, data, forces, writer)))
    writer.page(f"Identified model of rig “{fit.rig.name}”", sections)


def _summary_html(fit: Identified, dataset: Dataset, shown: Path) -> str:
    return html.render(
        "identification.html.j2", warnings=fit.warnings, folder=shlex.quote(str(shown)), gaps=_gap_table(fit, dataset),
        synthetic=dataset.is_synthetic, source=dataset.source,
        records=[r.name for r in dataset.identify], model=_law_table(fit),
    )  # fmt: skip


def _law_table(fit: Identified) -> Table:
    """Return the table of the identified law, bushing by bushing."""
    shown = fit.model._overview()
    head, *rows = shown.table
    kept = [i for i, name in enumerate(head) if not name.startswith(("gap", "offset"))]
    columns = tuple(Column(head[i][:1].upper() + head[i][1:]) for i in kept)
    caption = f"The law that was found ({shown.facts['law']}). Contact and filling in rig.toml are the datasheet’s."
    return Table("law", caption, columns, tuple(tuple(row[i] for i in kept) for row in rows))


def _gap_table(fit: Identified, dataset: Dataset) -> Table:
    rows = {r["name"]: r for r in fit.estimates.beside_priors()} if fit.estimates else {}
    cells = []
    for j, (bushing, before) in enumerate(zip(fit.rig.bushings, dataset.rig.bushings)):
        intervals = []
        for name in ("gap", "offset"):
            row = rows.get(f"bushings[{j}].{name}")
            limits = (1e6 * row["low"], 1e6 * row["high"]) if row else ()
            is_unseen = name == "gap" and j in fit.unseen_gaps
            shown = "not seen" if is_unseen else Interval(1e6 * getattr(bushing, name), *limits)
            intervals += [1e6 * getattr(before, name), shown]
        cells.append((f"{j + 1} ({bushing.where})", *intervals))
    columns = [Column("Bushing")]
    for name in ("Gap", "Offset"):
        columns += [Column("rig file", "µm", ".1f", name), Column("found", "µm", ".1f", name)]
    return Table("gaps", "Gaps and offsets, with 95 % intervals.", tuple(columns), tuple(cells))


def _family_section(
    fit: Identified, families: Sequence[FamilyFit], forces: Sequence[RestoringForce], writer: ReportWriter
) -> str:
    writer.csv("families", [family.to_dict() for family in families])
    best = {family.bushing: family for family in reversed(families)}
    rows = tuple(
        (str(j + 1), f.contact, f.grease, f.weight, f.log_evidence - best[j].log_evidence, f.misfit, f.held_out)
        for f in families
        for j in [f.bushing]
    )
    sentence = " ".join(
        f"Likeliest of bushing {j + 1}: {f.name}, with {100 * f.weight:.3g} % of the weight of its families. What its "
        f"force misses of the piece that no fit saw is {f.held_out / f.misfit:.2g} times what it misses of the rest."
        for j, f in sorted(best.items())
    )
    columns = (
        Column("Bushing"), Column("Contact"), Column("Grease"), Column("Weight", "", ".3g"),
        Column("Log evidence", "less best", ".1f"), Column("Misfit", "", ".3g"), Column("Held-out misfit", "", ".3g"),
    )  # fmt: skip
    caption = (
        "Families of laws of each bushing, likeliest first. Weight: probability among these, from the evidence in "
        "Laplace’s approximation. Misfit: of the restoring force, over 5 % of its local RMS, robust mean; held out: of "
        "the piece of each record that no fit saw."
    )
    note = "The law is the likeliest; draws of rigs and laws take families by their weights."
    table = html.table(Table("families", caption, columns, rows))
    return html.paragraph(sentence) + table + html.paragraph(note, "note")


def _parameter_section(fit: Identified, writer: ReportWriter) -> str:
    assert fit.estimates is not None
    table_rows = fit.estimates.beside_priors()
    writer.csv("parameters", table_rows)
    values = [Interval(r["value"], r["low"], r["high"]) for r in table_rows]
    rows = tuple(
        (parameter_words(r["name"]), r["unit"], r["before"], value, r["posterior_over_prior"])
        for r, value in zip(table_rows, values)
    )
    columns = (
        Column("Parameter"), Column("Unit"), Column("Before", "", ".4g"), Column("Found", "95 %", ".4g"),
        Column("Std / prior std", "", ".2f"),
    )  # fmt: skip
    caption = "Parameters of the rig, then of every bushing’s law, SI units."
    only = fit.estimates.only_prior
    note = f"{unsaid_words(only, PRIOR_WORDS)}." if only else "the records say something about every parameter."
    table = html.table(Table("parameters", caption, columns, rows))
    return (
        writer.figure(draw_parameters(fit.estimates))
        + html.paragraph(str(escape(note[0].upper() + note[1:])))
        + f'<details id="values"><summary>All {len(rows)} parameters</summary>\n{table}</details>\n'
        + _correlation_table(fit.estimates)
    )


def _correlation_table(estimates: Estimates) -> str:
    names, matrix = estimates.names, estimates.correlation
    pairs = [(i, j) for i in range(len(names)) for j in range(i) if abs(matrix[i, j]) > CORRELATED]
    pairs.sort(key=lambda pair: -abs(matrix[pair]))
    if not pairs:
        return ""
    rows = tuple((parameter_words(names[j]), parameter_words(names[i]), float(matrix[i, j])) for i, j in pairs[:LISTED])
    caption = (
        f"The strongest correlations, of {len(pairs)} beyond ±{CORRELATED:g}: the records identify combinations of "
        "such pairs."
    )
    columns = (Column("Parameter"), Column("With"), Column("Correlation", "", "+.2f"))
    table = html.table(Table("correlations", caption, columns, rows))
    return f'<details id="correlations"><summary>Correlations</summary>\n{table}</details>\n'


def _update_section(fit: Identified, update: RigUpdate, forces: Sequence[RestoringForce], writer: ReportWriter) -> str:
    return writer.figure(draw_spectra(update)) + structure_section(update, writer)


def _contact(fit: Identified, records: Sequence[Record], forces: Sequence[RestoringForce], writer: ReportWriter) -> str:
    return "".join(
        html.paragraph(f"Not drawn: {html.formula(drawn)}.", "note") if isinstance(drawn, str) else writer.figure(drawn)
        for drawn in contact_drawings(fit, records, forces)
    )


def _misfit_section(fit: Identified, misfit: LawMisfit, forces: Sequence[RestoringForce], writer: ReportWriter) -> str:
    frfs, decays = misfit.rows(), misfit.decay_rows()
    missed = [np.nanmedian(s.missed) for s in misfit.stretches]
    met = f"FRFs of the records are met within {min(missed):.2g} to {max(missed):.2g} dB, by level. " if missed else ""
    widened = (
        f"Standard deviations of gaps, offsets and laws are widened by {misfit.widening:.2f}, the RMS of what rig and "
        "law miss over its random error (Birge’s ratio)."
    )
    parts = [html.paragraph(met + widened), writer.figure(draw_misfit(misfit))]
    if frfs:
        writer.csv("misfit", frfs)
    parts += [html.paragraph(f"{words}.") for words in misfit.warnings]
    if decays:
        writer.csv("decays", decays)
        parts.append(html.table(_decay_table(misfit)))
    return "".join(parts)


def _decay_table(misfit: LawMisfit) -> Table:
    hits = misfit.decays
    columns = [Column("Record"), Column("Hit at", "s", ".2f"), Column("Peak", misfit.unit, ".3g")]
    columns += [Column(sensor, "dB", "+.1f", "Sensor") for sensor in misfit.sensors]
    halves = [[[float(v) if np.isfinite(v) else None for v in row] for row in d.missed.T] for d in hits]
    rows = [(d.record, d.start, d.peak, *first) for d, (first, _) in zip(hits, halves)]
    late = [(d.record, d.start + d.duration / 2, None, *second) for d, (_, second) in zip(hits, halves)]
    caption = (
        "Decays after hits: RMS of the model over that of the record, in the first and in the second half of each; "
        "what changes between them is the decay. Noise of the sensors counts in the record alone."
    )
    return Table("decays", caption, tuple(columns), tuple(row for pair in zip(rows, late) for row in pair))


Write = Callable[[Identified, Any, Sequence[RestoringForce], ReportWriter], str]
PAGES: Mapping[str, tuple[str, Write]] = {
    "update": ("The linear rig", _update_section),
    "families": ("Which law", _family_section),
    "misfit": ("What rig and law miss", _misfit_section),
    "contact": ("What the records show of contact", _contact),
}  # Headings, and what writes the sections, by the names in `Identified.pages`
