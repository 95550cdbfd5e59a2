"""Periodic vibrations of the identified law under sines: amplitudes over frequency, folds, jumps, rattle map."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from ...periodic import Branch
from ...periodic.coverage import not_covered
from ...periodic.summaries import jumps, unit
from ...signals.stepped_sines import SineSteps
from ...study import Study
from ...study.periodic import amplitude_error
from .. import rattle_maps, responses
from ..html import render
from ..tables import Column, Table
from ..writer import ReportWriter
from . import section

ONE_POINT = 1e-3
"""of a frequency, within which special points of a kind are one on the page: so few harmonics tell no more apart"""
CAPTION = (
    "Where the branches fold or their stability changes; points within 0.1 % of each other are one row, which says how "
    "many they are. A sweep in the direction named jumps at a fold, from the one "
    "amplitude to the other, those of the clearance that moves most there."
)


@section("sines", "Sines: jumps and rattle", 62)
def sines(study: Study, writer: ReportWriter) -> str:
    """Return the law's response over frequency and its rattle map; writes response.csv and rattle_map.csv."""
    periodic = study.periodic
    if periodic.map is None:
        return render("sines.html.j2", study=study, periodic=periodic)
    writer.csv("response", responses.rows(periodic.branches))
    writer.csv("rattle_map", rattle_maps.rows(periodic.map))
    steps, test = study.sine_steps, "synthetic test" if study.is_synthetic else "test"
    return render(
        "sines.html.j2", study=study, periodic=periodic, special=special_points(periodic.branches),
        response=writer.figure(responses.draw(periodic.branches, measured=list(steps.values()), test=test)),
        beside=[_misfit_words(name, periodic.branches, of_record) for name, of_record in steps.items()],
        unknown=unknown(periodic.branches), map=writer.figure(rattle_maps.draw(periodic.map)),
        lines=list(rattle_maps.summary_lines(periodic.map)),
    )  # fmt: skip


def _misfit_words(name: str, branches: tuple[Branch, ...], steps: SineSteps) -> str:
    """Return a sentence on the law's misfit to a stepped sine."""
    error = np.abs(amplitude_error(branches, steps))
    known = error[np.isfinite(error)]
    if not known.size:
        return f"record {name} has no step within the law’s branches"
    return (
        f"record {name}, {steps.frequency.size} steps of {np.median(steps.level):.3g} {unit(branches[0])}: the law’s "
        f"amplitudes at the sensors miss those measured by {100 * np.median(known):.2g} % in the median, nine tenths "
        f"by less than {100 * np.quantile(known, 0.9):.2g} %"
    )


def unknown(branches: tuple[Branch, ...]) -> list[str]:
    """Return, for each level whose branches do not cover the band, the frequencies without a solution."""
    said = []
    for level, of_level in groupby(branches, key=lambda branch: abs(branch.level[0, 0])):
        if ends := not_covered(list(of_level)):
            said.append(f"{level:g} {unit(branches[0])} {responses.frequency_range_words(*ends)}")
    return said


def special_points(branches: tuple[Branch, ...]) -> Table:
    """Return the special points of branches, with the jumps of their folds; those within `ONE_POINT` are a row.

    Few harmonics wind a branch into loops where contact begins: their folds are thousandths of a hertz apart.
    """
    body = list[_Row]()
    for branch in branches:
        leaves = {jump.at: jump for jump in jumps(branch)}
        for point in branch.special:
            jump = leaves.get(point.frequency) if point.kind == "fold" else None
            after = 1e3 * jump.after[0] if jump and jump.after else None
            direction = ("upwards" if jump.upwards else "downwards") if jump else ""
            at = branch.clearances[jump.clearance] if jump else ""
            before = 1e3 * jump.before if jump else None
            body.append((point.level, point.kind, 1, point.frequency, direction, at, before, after))
    of_jump = (("Direction", "", ""), ("Clearance", "", ""), ("from", "mm", ".3f"), ("to", "mm", ".3f"))
    columns = (
        Column("Level", unit(branches[0]), "g"), Column("Point"), Column("Number", "", "d"),
        Column("Frequency", "Hz", ".3f"), *(Column(*each, "Jump of a sweep") for each in of_jump),
    )  # fmt: skip
    return Table("special_points", CAPTION, columns, tuple(_merge(body)))


_Row = tuple[float, str, int, float, str, str, float | None, float | None]
"""Level, kind, number of points, frequency, and a jump's direction, clearance and amplitudes."""


def _merge(rows: list[_Row]) -> list[_Row]:
    """Return rows, merged with the largest jump where level and kind agree within the resolution."""
    merged = list[_Row]()
    last = 0.0
    for row in sorted(rows, key=lambda row: (row[0], row[1], row[3])):
        if merged and merged[-1][:2] == row[:2] and row[3] - last <= ONE_POINT * row[3]:
            merged[-1] = (*row[:2], merged[-1][2] + 1, *max(merged[-1], row, key=_jump_size)[3:])
        else:
            merged.append(row)
        last = row[3]
    return sorted(merged, key=lambda row: (row[0], row[3]))


def _jump_size(row: _Row) -> float:
    """Return the change of amplitude in a jump, mm."""
    return abs(row[7] - row[6]) if row[6] is not None and row[7] is not None else -1.0
