"""clearance-mj rattle-map: where a rig rattles and jumps, over level, frequency and gap."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, results_of, settings, warn_of_depths, write_results
from .options import PERIODIC, add_forced, add_grid, add_plugin, grid, lengths, load_model, numbers, periodic_settings

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..model import Model


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_forced(parser)
    add_grid(parser)
    option("--gaps", type=lengths, metavar="M,...", help="of all bushings, m or such as 0.1mm,5mil; list or range")
    words = "what constant loads are multiplied by: a list or range; maps which walls are hit, over loads and levels "
    words += "at --from with --steps 1, else over levels and frequencies at each"
    option("--loads", type=numbers, metavar="X,...", help=words)
    words = "map contacts a standard deviation softer and stiffer too, as the rig file's tolerance of them says"
    option("--contact-spread", action="store_true", help=words)
    option("--workers", type=int, help="processes (default: one for each core)")
    add_plugin(parser, "a contact or a grease")


@command(
    "rattle-map", "map where a rig rattles and jumps, over level and frequency, for several gaps", _options,
    **results_of("rattle_map"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..periodic import map_rattle
    from ..periodic.excitation import excited_by
    from ..periodic.summaries import of_map
    from ..report.rattle_maps import draw, rows, words
    from ..tolerance.scatter import softer_and_stiffer

    model = load_model(options)
    if options.loads:
        return _impacts(options, model)
    levels, frequencies = grid(options, excited_by(model, options.kind), 2)
    shared = {name: getattr(options, name) for name in ("kind", "workers", "gaps")} | periodic_settings(options)
    found = map_rattle(model, levels, frequencies, **shared, progress=not options.quiet)
    ends = softer_and_stiffer(model) if options.contact_spread else ()
    spread = {name: map_rattle(each, levels, frequencies, **shared) for name, each in zip(("softer", "stiffer"), ends)}
    result = settings(model) | {name: getattr(options, name) for name in PERIODIC} | of_map(found)
    result |= {name: of_map(each) for name, each in spread.items()}
    result = write_results(options, "rattle_map", result, rows(found), draw(found))
    print("\n  ".join(words(found)))
    for name, each in spread.items():
        print(f"contacts a standard deviation {name}: " + "\n  ".join(words(each)))
    for gaps, depth in zip(found.gap, result["largest_depth"]):
        warn_of_depths(model.with_gap(gaps.tolist()), depth)
    print(f"rattle map: {options.out / 'rattle_map.png'}")
    return result


def _impacts(options: argparse.Namespace, model: Model) -> dict[str, Any]:
    """Map which walls are hit over constant loads, levels and frequencies."""
    from ..periodic import map_impacts
    from ..periodic.excitation import excited_by
    from ..periodic.summaries import of_impacts
    from ..report.impact_maps import draw, rows, words

    if options.gaps or options.contact_spread:
        raise ClearanceError("--loads maps the rig's gaps and contacts: leave out --gaps and --contact-spread")
    levels, frequencies = grid(options, excited_by(model, options.kind), 1)
    shared = {name: getattr(options, name) for name in ("kind", "workers")} | periodic_settings(options)
    found = map_impacts(model, levels, frequencies, options.loads, **shared, progress=not options.quiet)
    result = settings(model) | {name: getattr(options, name) for name in PERIODIC} | of_impacts(found)
    result = write_results(options, "rattle_map", result, rows(found), draw(found))
    print("\n".join(words(found)))
    print(f"rattle map: {options.out / 'rattle_map.png'}")
    return result
