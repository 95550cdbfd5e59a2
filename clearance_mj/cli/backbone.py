"""clearance-mj backbone: frequency and damping of nonlinear modes over amplitude."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, results_of, settings, write_results
from .options import PERIODIC, add_periodic, add_plugin, length, listed, load_model, periodic_settings

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..periodic import Backbone


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_periodic(parser)
    modes = listed(int, "of modes such as 1,2")
    option("--mode", type=modes, default=[1], metavar="MODE,...", help="modes in the gap, 1 the lowest (default: 1)")
    option("--from", dest="start", type=length, metavar="M", help="amplitude, m or such as 1mil (default: 0.1 gap)")
    option("--to", dest="stop", type=length, metavar="M", help="amplitude, m (default: 5 times the gap)")
    option("--workers", type=int, help="threads (default: one for each core)")
    add_plugin(parser, "a contact or a grease")


@command(
    "backbone", "follow nonlinear modes: frequency and damping over amplitude", _options,
    **results_of("backbone"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.tasks import run_tasks
    from ..periodic import follow_backbone
    from ..periodic.summaries import of_backbone
    from ..report.backbones import draw, rows, words

    if (options.start is None) != (options.stop is None):
        raise ClearanceError("--from and --to are the ends of the amplitudes: give both or none")
    model = load_model(options)
    modes = list(dict.fromkeys(options.mode))
    amplitudes = None if options.start is None else (options.start, options.stop)
    shared = periodic_settings(options)
    progress = "" if options.quiet else "modes"

    def follow(mode: int) -> Backbone:
        return follow_backbone(model, mode, amplitudes, **shared)

    by_mode = dict(run_tasks(follow, modes, options.workers, progress=progress))
    found = [by_mode[mode] for mode in modes]
    result = settings(model) | {name: getattr(options, name) for name in PERIODIC}
    result |= {"backbones": [of_backbone(each) for each in found]}
    for each in found:
        print("\n".join(words(each)))
    print(f"backbone: {options.out / 'backbone.csv'}")
    return write_results(options, "backbone", result, rows(found), draw(found))
