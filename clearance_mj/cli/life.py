"""clearance-mj life: how gaps grow by wear over hours, and when they reach a limit."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, results_of, settings, write_results
from .options import add_kind, add_plugin, add_rig, by_bushing, hertz, level, load_model, seconds

if TYPE_CHECKING:
    from ..model import Model
    from ..wear import Life, Lives, Operation, Remaining


def _options(parser: argparse.ArgumentParser) -> None:
    add_rig(parser)
    option = parser.add_argument
    option(
        "--gap-limit", action="append", required=True, metavar="[BUSHING=]VALUE",
        help="gap at which life ends: m, with a unit such as 0.5mm, or a factor of the gap such as x2; of every "
        "bushing that wears, or of one, such as bushings[0]=0.5mm, which may be repeated",
    )  # fmt: skip
    words = "amplitude of a sine, RMS of noise, m/s² of the base or N, or such as 0.1g; 0: none, of what turns"
    option("--level", type=level, required=True, metavar="A", help=words)
    option("--frequency", type=hertz, metavar="HZ", help="drive with a sine (default: with noise)")
    option("--swept-from", type=hertz, metavar="HZ", help="from which the sine was swept (default: raised from rest)")
    add_kind(parser)
    option("--band", type=hertz, nargs=2, default=(5.0, 220.0), metavar=("LOW", "HIGH"), help="of noise, Hz (5 220)")
    option("--duration", type=seconds, default=10.0, help="s of noise at each gap (default: %(default)s)")
    option("--fs", type=hertz, default=2048.0, help="samples per second of noise (default: %(default)s)")
    option("--hours", type=float, default=1e6, help="at which the prediction ends (default: %(default)g)")
    option(
        "--history", type=Path, metavar="FILE", help="CSV with hours, bushing, gap_m and std_m: predict what is left"
    )
    option("--draws", type=int, default=0, help="machines drawn within tolerances or posterior (default: none)")
    option("--seed", type=int, default=0, help="of noise and draws (default: %(default)s)")
    option("--workers", type=int, help="processes (default: one for each core)")
    add_plugin(parser, "a contact or a grease")


@command(
    "life", "predict how gaps grow by wear over hours, and when they reach a limit; also from a history", _options,
    **results_of("life"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..report.life import draw, rows, summary

    if options.history and options.draws:
        raise ClearanceError("--draws is of what tolerances say, and with --history that says it; leave --draws out")
    model = load_model(options)
    found = _predicted(options, model, _operation(options, model))
    print("\n".join(found.words()))
    print(f"life: {options.out / 'life.png'}")
    return write_results(options, "life", settings(model) | summary(found), rows(found), draw(found))


def _operation(options: argparse.Namespace, model: Model) -> Operation:
    from ..signals.excitation import random, still
    from ..wear import Marched, Sine

    kind = options.kind or model.rig.shaker.kind
    level = options.level(kind)
    if options.frequency is not None:
        return Sine(options.frequency, level, options.kind, options.swept_from)
    if options.swept_from is not None:
        raise ClearanceError("--swept-from is of a sine; give its --frequency")
    if level == 0:
        return Marched(still(options.duration, options.fs, kind))
    return Marched(random(options.duration, options.fs, tuple(options.band), level, options.seed, kind))


def _predicted(options: argparse.Namespace, model: Model, operation: Operation) -> Life | Lives | Remaining:
    from ..core.runner import Runner
    from ..wear import GapHistory, predict_life, predict_lives, predict_remaining

    limit, progress = by_bushing(options.gap_limit, "--gap-limit"), not options.quiet
    if options.history:
        history = GapHistory.load(options.history, len(model.rig.bushings))
        return predict_remaining(model, operation, history, limit, seed=options.seed, progress=progress)
    if not options.draws:
        return predict_life(model, operation, limit, options.hours, progress=progress)
    runner = Runner(options.workers, progress=progress, kept=options.out / "draws")
    return predict_lives(model, operation, limit, options.draws, options.seed, options.hours, runner=runner)
