"""clearance-mj response: periodic vibrations over frequency, level, loads, gaps or spin, the unstable ones too."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..core.errors import ClearanceError
from ..core.tasks import run_tasks
from ..model import Model
from ..periodic import Branch, find_isolas, follow_doubled, follow_response_over, follow_response_over_level
from ..periodic.coverage import not_covered
from ..periodic.excitation import excited_by
from ..periodic.summaries import of_branch, unit
from ..report.responses import draw, frequency_range_words, rows, summary_lines
from ..rig import Rig
from ..study.periodic import from_both_ends
from . import options as shared
from .command import RESULTS, Options, Result, command, flag, inform, option, settings, warn_of_depths

START, STOP = 5.0, 220.0  # Hz, where branches begin and end by default
PERIOD_DOUBLING_TOLERANCE = 1e-3
"""Relative distance, in frequency or level, within which a doubling belongs to the end of a doubled branch."""


@command(
    "response", *shared.forced(),
    option("--level", f"{shared.SINES}; follows over frequency", shared.levels, metavar="A,..."),
    option("--frequency", "Hz, a list or range; follows over level", shared.frequencies, metavar="HZ,..."),
    option("--over", "at --level and --frequency follow over shares of all constant loads or gaps, or the spin, rad/s",
           choices=("load", "gap", "spin")),
    option("--from", "first frequency, Hz (default: 5), level, share or spin", float, dest="start", metavar="X"),
    option("--to", "last frequency, Hz (default: 220), level, share or spin", float, dest="stop", metavar="X"),
    option("--sensors", "to draw (default: those in the bushings)",
           shared.number_list_parser(int, "of sensors' nodes such as 6,7"), metavar="NODE,..."),
    flag("--period-doublings", "leave branches where the period doubles, and follow on"),
    option("--isolas", "random starts at each of nine frequencies, from which vibrations on no known branch are "
           "followed", int, 0, metavar="N"),
    shared.WORKERS, shared.plugin("a contact or a grease"), writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Follow periodic vibrations over frequency, level, loads, gaps or spin, around folds."""
    model = shared.load_model(options)
    sensors = _rows_of(model.rig, options.sensors)
    by_level = _follow_branches(options, model)
    left_out = [] if options.frequency else list(_uncovered(by_level))
    basins = [_with_isolas(options, known) for known in by_level] if options.isolas else []
    branches = [branch for known in by_level for branch in known]
    data = settings(model) | {"branches": [of_branch(branch) for branch in branches]}
    data |= {"isolas": basins} if basins else {}
    said = ["\n  ".join(summary_lines(branch)) for branch in branches]
    said += [f"{of_level}: no vibration was found {frequency_range_words(*ends)}" for of_level, ends in left_out]
    largest = np.max([branch.excursion().max(axis=0) for branch in branches], axis=0)
    warn_of_depths(model, largest - [bushing.gap for bushing in model.rig.bushings])
    for level in basins:
        lost = 100 * sum(shares[-1] for shares in level["shares"]) / len(level["shares"])
        said += [f"{level['new']} more branches from random starts, of which {lost:.0f} % came to none that repeats"]
    return Result(data, said, rows(branches), [draw(branches, sensors)])


def _rows_of(rig: Rig, nodes: list[int] | None) -> list[int] | None:
    known = [sensor.node for sensor in rig.sensors]
    for node in nodes or ():
        if node not in known:
            raise ClearanceError(f"--sensors: the rig has no sensor {node}; it has {', '.join(map(str, known))}")
    return None if nodes is None else [known.index(node) for node in nodes]


def _follow_branches(options: Options, model: Model) -> list[list[Branch]]:
    """Return the branches of each level, or frequency, or of both."""
    ends, kind = _range_ends(options), excited_by(model, options.kind)
    solver = shared.periodic_settings(options) | {"kind": kind}

    def follow(at: tuple[float, float]) -> list[Branch]:
        level, frequency = at
        if options.over:
            curves = [follow_response_over(model, options.over, ends, frequency, level, **solver)]
        elif options.frequency:
            curves = [follow_response_over_level(model, frequency, ends, **solver)]
        else:
            curves = list(from_both_ends(model, level, ends, **solver))
        return curves + [new for branch in curves for new in _doublings(branch)] if options.period_doublings else curves

    given = options.level(kind) if options.level else (0.0,)
    wanted = list(itertools.product(given, options.frequency or (0.0,)))
    branches = dict(run_tasks(follow, wanted, options.workers, progress="" if options.quiet else "branches"))
    return [branches[value] for value in wanted]


def _uncovered(by_level: list[list[Branch]]) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield each level of which no branch leads through a part of the frequencies, and that part, Hz."""
    for known in by_level:
        if ends := not_covered([branch for branch in known if branch.periods == 1]):
            yield f"{abs(known[0].level[0, 0]):g} {unit(known[0])}", ends


def _range_ends(options: Options) -> tuple[float, float]:
    """Return the ends of the range of frequencies, levels, ratios or spins."""
    if options.over and not (options.level and options.frequency):
        raise ClearanceError(f"--over {options.over} is at one --level and --frequency: give both")
    if not options.over and bool(options.level) == bool(options.frequency):
        raise ClearanceError("give --level to follow over frequency, or --frequency over level; both with --over")
    if options.frequency and (options.start is None or options.stop is None):
        raise ClearanceError(f"--frequency follows over {options.over or 'level'}, from --from to --to: give both")
    if options.frequency and options.isolas:
        raise ClearanceError("--isolas are looked for over frequency: give --level")
    return START if options.start is None else options.start, STOP if options.stop is None else options.stop


def _doublings(branch: Branch) -> Iterator[Branch]:
    """Yield the branches from period doublings of a branch, one for each pair that it connects."""
    met: list[float] = []
    for point in branch.special:
        at = float(branch.parameter[point.index])
        if point.kind == "period doubling" and all(abs(at / end - 1) > PERIOD_DOUBLING_TOLERANCE for end in met):
            try:
                new = follow_doubled(branch, point)
            except ClearanceError as error:
                inform(str(error))
                continue
            met.append(float(new.parameter[-1]))
            yield new


def _with_isolas(options: Options, known: list[Branch]) -> dict[str, Any]:
    """Add isolas from random starts to the branches of a level; return the fractions of starts that reach each."""
    isolas = find_isolas(known, options.isolas, workers=options.workers, progress=not options.quiet)
    known += isolas.branches
    level = float(abs(known[0].level[0, 0]))
    new = len(isolas.branches)
    return {"level": level, "new": new, "frequency": isolas.frequency.tolist(), "shares": isolas.basins.tolist()}
