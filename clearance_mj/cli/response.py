"""clearance-mj response: periodic vibrations over frequency, level, loads, gaps or spin, the unstable ones too."""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, results_of, say, settings, warn_of_depths, write_results
from .options import add_forced, add_plugin, frequencies, levels, listed, load_model, periodic_settings

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..model import Model
    from ..periodic import Branch
    from ..rig import Rig

START, STOP = 5.0, 220.0  # Hz, where branches begin and end by default
PERIOD_DOUBLING_TOLERANCE = 1e-3
"""Of frequency or level: distance from a doubled branch's end at which a doubling is its own."""


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_forced(parser)
    words = "amplitudes of a sine, m/s² of the base or N, or factors of the unbalances: a list, such as 0.1g,1g, or "
    words += "a range FROM:TO:COUNT; follows over frequency"
    option("--level", type=levels, metavar="A,...", help=words)
    option("--frequency", type=frequencies, metavar="HZ,...", help="Hz, a list or range; follows over level")
    words = "at --level and --frequency follow over shares of all constant loads or gaps, or the spin, rad/s"
    option("--over", choices=("load", "gap", "spin"), help=words)
    option(
        "--from", dest="start", type=float, metavar="X", help="first frequency, Hz (default: 5), level, share or spin"
    )
    option("--to", dest="stop", type=float, metavar="X", help="last frequency, Hz (default: 220), level, share or spin")
    nodes = listed(int, "of sensors' nodes such as 6,7")
    option("--sensors", type=nodes, metavar="NODE,...", help="to draw (default: those in the bushings)")
    option("--period-doublings", action="store_true", help="leave branches where the period doubles, and follow on")
    words = "random starts at each of nine frequencies, from which vibrations on no known branch are followed"
    option("--isolas", type=int, default=0, metavar="N", help=words)
    option("--workers", type=int, help="threads (default: one for each core)")
    add_plugin(parser, "a contact or a grease")


@command(
    "response", "follow periodic vibrations over frequency, level, loads, gaps or spin, around folds", _options,
    **results_of("response"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    import numpy as np

    from ..periodic.summaries import of_branch
    from ..report.responses import between, draw, rows, words

    model = load_model(options)
    sensors = _rows_of(model.rig, options.sensors)
    by_level = _branches(options, model)
    left_out = [] if options.frequency else list(_left_out(by_level))
    basins = [_with_isolas(options, known) for known in by_level] if options.isolas else []
    branches = [branch for known in by_level for branch in known]
    result = settings(model) | {"branches": [of_branch(branch) for branch in branches]}
    result |= {"isolas": basins} if basins else {}
    for branch in branches:
        print("\n  ".join(words(branch)))
    for of_level, ends in left_out:
        print(f"{of_level}: no vibration was found {between(*ends)}")
    largest = np.max([branch.excursion().max(axis=0) for branch in branches], axis=0)
    warn_of_depths(model, largest - [bushing.gap for bushing in model.rig.bushings])
    for level in basins:
        lost = 100 * sum(shares[-1] for shares in level["shares"]) / len(level["shares"])
        print(f"{level['new']} more branches from random starts, of which {lost:.0f} % came to none that repeats")
    print(f"response: {options.out / 'response.csv'}")
    return write_results(options, "response", result, rows(branches), draw(branches, sensors))


def _rows_of(rig: Rig, nodes: list[int] | None) -> list[int] | None:
    known = [sensor.node for sensor in rig.sensors]
    for node in nodes or ():
        if node not in known:
            raise ClearanceError(f"--sensors: the rig has no sensor {node}; it has {', '.join(map(str, known))}")
    return None if nodes is None else [known.index(node) for node in nodes]


def _branches(options: argparse.Namespace, model: Model) -> list[list[Branch]]:
    """The branches of each level, or frequency, or of both."""
    from ..core.tasks import run_tasks
    from ..periodic import follow_response_over, follow_response_over_level
    from ..periodic.excitation import excited_by
    from ..study.periodic import from_both_ends

    ends, kind = _ends(options), excited_by(model, options.kind)
    shared = periodic_settings(options) | {"kind": kind}

    def follow(at: tuple[float, float]) -> list[Branch]:
        level, frequency = at
        if options.over:
            found = [follow_response_over(model, options.over, ends, frequency, level, **shared)]
        elif options.frequency:
            found = [follow_response_over_level(model, frequency, ends, **shared)]
        else:
            found = list(from_both_ends(model, level, ends, **shared))
        return found + [new for branch in found for new in _doubled(branch)] if options.period_doublings else found

    given = options.level(kind) if options.level else (0.0,)
    wanted = list(itertools.product(given, options.frequency or (0.0,)))
    found = dict(run_tasks(follow, wanted, options.workers, progress="" if options.quiet else "branches"))
    return [found[value] for value in wanted]


def _left_out(by_level: list[list[Branch]]) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield each level of which no branch leads through a part of the frequencies, and that part, Hz."""
    from ..periodic.coverage import not_covered
    from ..periodic.summaries import unit

    for known in by_level:
        if ends := not_covered([branch for branch in known if branch.periods == 1]):
            yield f"{abs(known[0].level[0, 0]):g} {unit(known[0])}", ends


def _ends(options: argparse.Namespace) -> tuple[float, float]:
    """Frequencies, levels, shares or spins, from and to."""
    if options.over and not (options.level and options.frequency):
        raise ClearanceError(f"--over {options.over} is at one --level and --frequency: give both")
    if not options.over and bool(options.level) == bool(options.frequency):
        raise ClearanceError("give --level to follow over frequency, or --frequency over level; both with --over")
    if options.frequency and (options.start is None or options.stop is None):
        what = options.over or "level"
        raise ClearanceError(f"--frequency follows over {what}, from --from to --to: give both")
    if options.frequency and options.isolas:
        raise ClearanceError("--isolas are looked for over frequency: give --level")
    return START if options.start is None else options.start, STOP if options.stop is None else options.stop


def _doubled(branch: Branch) -> Iterator[Branch]:
    """What leaves a branch where its period doubles; where one comes back to the branch, it is not left again."""
    from ..periodic import follow_doubled

    met: list[float] = []
    for point in branch.special:
        at = float(branch.parameter[point.index])
        if point.kind == "period doubling" and all(abs(at / end - 1) > PERIOD_DOUBLING_TOLERANCE for end in met):
            try:
                new = follow_doubled(branch, point)
            except ClearanceError as error:
                say(str(error))
                continue
            met.append(float(new.parameter[-1]))
            yield new


def _with_isolas(options: argparse.Namespace, known: list[Branch]) -> dict[str, Any]:
    """Add to the branches of a level those that random starts find; return the shares of the starts."""
    from ..periodic import find_isolas

    found = find_isolas(known, options.isolas, workers=options.workers, progress=not options.quiet)
    known += found.branches
    level = float(abs(known[0].level[0, 0]))
    new = len(found.branches)
    return {"level": level, "new": new, "frequency": found.frequency.tolist(), "shares": found.basins.tolist()}
