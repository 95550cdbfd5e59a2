"""clearance-mj backbone: frequency and damping of nonlinear modes over amplitude."""

from __future__ import annotations

from ..core.errors import ClearanceError
from ..core.tasks import run_tasks
from ..periodic import Backbone, follow_backbone
from ..periodic.summaries import of_backbone
from ..report.backbones import draw, rows, summary_lines
from .command import RESULTS, Options, Result, command, option, settings
from .options import PERIODIC, WORKERS, length, load_model, number_list_parser, periodic, periodic_settings, plugin


@command(
    "backbone", *periodic(),
    option("--mode", "modes in the gap, 1 the lowest (default: 1)", number_list_parser(int, "of modes such as 1,2"),
           [1], metavar="MODE,..."),
    option("--from", "amplitude, m or such as 1mil (default: 0.1 gap)", length, dest="start", metavar="M"),
    option("--to", "amplitude, m (default: 5 times the gap)", length, dest="stop", metavar="M"),
    WORKERS, plugin("a contact or a grease"), writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Follow nonlinear modes: frequency and damping over amplitude."""
    if (options.start is None) != (options.stop is None):
        raise ClearanceError("--from and --to are the ends of the amplitudes: give both or none")
    model = load_model(options)
    modes = list(dict.fromkeys(options.mode))
    amplitudes = None if options.start is None else (options.start, options.stop)
    shared = periodic_settings(options)

    def follow(mode: int) -> Backbone:
        return follow_backbone(model, mode, amplitudes, **shared)

    by_mode = dict(run_tasks(follow, modes, options.workers, progress="" if options.quiet else "modes"))
    curves = [by_mode[mode] for mode in modes]
    data = settings(model) | {name: getattr(options, name) for name in PERIODIC}
    said = [line for each in curves for line in summary_lines(each)]
    return Result(data | {"backbones": [of_backbone(each) for each in curves]}, said, rows(curves), [draw(curves)])
