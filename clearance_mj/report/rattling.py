"""Rattle map of an identified model: onset level, forces, and the same with half the gap."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..clearance.law import ConstantLaw, ContactLaw
from ..core.errors import ClearanceError
from ..identify.records.checks import reached
from ..identify.records.prepared import prepare
from ..identify.registry import Identified
from ..io.dataset import Dataset
from ..model import Model
from ..periodic import RattleMap, find_first_contact, map_rattle
from ..periodic.summaries import unit
from . import html
from .rattle_maps import draw, rows, summary_lines
from .tables import Column, Table
from .writer import ReportWriter

__all__ = ["rattling_section"]

LEVELS, LEVEL_RATIO, FREQUENCIES = 5, 3.0, 80  # each level is so many times the one before
HARMONICS = 7  # folds of the Table-1 rig stay where 21 harmonics have them, amplitudes within 3 %
GAP_RATIOS = (1.0, 0.5)  # over the identified gaps
BAND = (0.002, 0.4)  # of the samples per second, where a record does not say its band


def rattling_section(identified: Identified, dataset: Dataset, writer: ReportWriter, workers: int | None = 1) -> str:
    """Return the figure, the sentences and the table of a rattle map over the records' levels and band.

    There is none where no record shows a gap: what the rig file says of it is no result.

    Parameters
    ----------
    identified : Identified
        The identified model.
    dataset : Dataset
        Its records to identify say levels, band and what excites.
    writer : ReportWriter
        Takes figure and numbers.
    workers : int, optional
        Processes of the map; None: one for each core.
    """
    model, unseen = identified.model, _unseen_gap_words(identified, dataset)
    said = html.sentences(unseen, "note")
    if unseen and len(unseen) == len(model.rig.bushings):
        return said
    if not isinstance(model.law, ConstantLaw | ContactLaw):
        return html.paragraph("A law over time or amplitude has no periodic vibrations, so no rattle map.", "note")
    try:
        rattle = _compute_map(model, dataset, workers)
    except ClearanceError as error:
        return said + html.sentences([f"No rattle map: {error}"], "note")
    writer.csv("rattle_map", rows(rattle))
    sentences = html.sentences(line[0].upper() + line[1:] for line in summary_lines(rattle))
    return said + sentences + writer.figure(draw(rattle)) + html.table(_rattle_table(rattle))


def _unseen_gap_words(identified: Identified, dataset: Dataset) -> list[str]:
    """Return sentences on unseen gaps: by the probes, without them where records add nothing to the prior."""
    rig = identified.model.rig
    far = reached(prepare(dataset), rig) if rig.bushings else None
    said = []
    for j, bushing in enumerate(rig.bushings):
        if far is not None and far[j] <= bushing.gap:
            larger = f"it is larger than {1e3 * far[j]:.2g} mm, as far as the shaft came from its middle"
        elif far is None and j in identified.unseen_gaps:
            larger = "the records add nothing to what was known of it"
        else:
            continue
        said.append(
            f"The gap of bushings[{j}] was not seen: {larger}; {1e3 * bushing.gap:.3g} mm is the rig file’s number"
        )
    return said


def _compute_map(model: Model, dataset: Dataset, workers: int | None) -> RattleMap:
    loudest = max(dataset.to_identify(), key=lambda record: float(np.std(record.response().excitation)))
    top = 2 * float(np.std(loudest.response().excitation))  # a ramp ends at about twice its RMS
    low, high = loudest.band or (ratio * loudest.fs for ratio in BAND)
    gaps = [[ratio * bushing.gap for bushing in model.rig.bushings] for ratio in GAP_RATIOS]
    rattle = map_rattle(
        model, top * LEVEL_RATIO ** np.arange(1.0 - LEVELS, 1.0), np.geomspace(low, high, FREQUENCIES), gaps=gaps,
        kind=loudest.excitation_kind, n_harmonics=HARMONICS, workers=workers,
    )  # fmt: skip
    first = rattle.first_contact.copy()
    for gap, over_frequency in zip(rattle.gap, first):
        if np.isfinite(over_frequency).any():
            # The map's levels are far apart: where it touches first, the level itself is followed.
            lines = over_frequency == np.nanmin(over_frequency)
            exact = find_first_contact(model.with_gap(gap), rattle.frequency[lines], rattle.kind, n_harmonics=HARMONICS)
            over_frequency[lines] = np.fmin(over_frequency[lines], exact.value)
    return dataclasses.replace(rattle, first_contact=first)


def _rattle_cells(rattle: RattleMap, gap: int, level: int) -> tuple[float | None, float, float, float]:
    """Return lowest frequency (Hz) that rattles, fraction that does, largest force (N) and penetration (µm)."""
    rattles = rattle.rattles[gap, level]
    first = float(rattle.frequency[np.argmax(rattles)]) if rattles.any() else None
    force, depth = (np.nanmax(np.nan_to_num(v[:, gap, level])) for v in (rattle.contact_force, rattle.penetration))
    return first, float(rattles.mean()), float(force), 1e6 * float(depth)


def _rattle_table(rattle: RattleMap) -> Table:
    groups = ["gap found", "half the gap"]
    columns = [Column("Amplitude", unit(rattle), ".3g")]
    for group in groups:
        columns += [
            Column("rattles from", "Hz", ".1f", group), Column("of the band", "", ".0%", group),
            Column("contact force", "N", ".3g", group), Column("penetration", "µm", ".1f", group),
        ]  # fmt: skip
    cells = []
    for i, level in enumerate(rattle.level):
        cells.append((float(level), *(cell for gap in range(len(groups)) for cell in _rattle_cells(rattle, gap, i))))
    caption = (
        "Under a sine of each amplitude: lowest frequency at which a wall is touched, share of the band in which one "
        "is, and the largest contact force and penetration over the band; for the gaps found, and for half of them."
    )
    return Table("rattling", caption, tuple(columns), tuple(cells))
