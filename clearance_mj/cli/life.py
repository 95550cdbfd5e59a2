"""clearance-mj life: how gaps grow by wear over hours, and when they reach a limit."""

from __future__ import annotations

from pathlib import Path

from .. import wear
from ..core.errors import ClearanceError
from ..core.runner import Runner
from ..model import Model
from ..report.life import draw, rows, summary
from ..signals.excitation import random, still
from .command import RESULTS, Options, Result, command, option, settings
from .options import RIG, WORKERS, by_bushing, hertz, kind, level, load_model, noise, plugin


@command(
    "life", *RIG,
    option("--gap-limit", "gap at which life ends: m, with a unit such as 0.5mm, or a factor of the gap such as x2; of "
           "every bushing that wears, or of one, such as bushings[0]=0.5mm", action="append", required=True,
           metavar="[BUSHING=]VALUE"),
    option("--level", "amplitude of a sine, RMS of noise, m/s² of the base or N, or such as 0.1g; 0: none, of what "
           "turns", level, required=True, metavar="A"),
    option("--frequency", "drive with a sine (default: with noise)", hertz, metavar="HZ"),
    option("--swept-from", "from which the sine was swept (default: raised from rest)", hertz, metavar="HZ"),
    kind(), *noise(10.0, 2048.0, "s of noise at each gap"),
    option("--hours", "at which the prediction ends (default: %(default)g)", float, 1e6),
    option("--history", "CSV with hours, bushing, gap_m and std_m: predict what is left", Path, metavar="FILE"),
    option("--draws", "machines drawn within tolerances or posterior (default: none)", int, 0),
    WORKERS, plugin("a contact or a grease"), writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Predict how gaps grow by wear over hours, and when they reach a limit; also from a history."""
    if options.history and options.draws:
        raise ClearanceError("--draws is of what tolerances say, and with --history that says it; leave --draws out")
    model = load_model(options)
    life = _predict(options, model, _operation(options, model))
    return Result(settings(model) | summary(life), life.words(), rows(life), [draw(life)])


def _operation(options: Options, model: Model) -> wear.Operation:
    kind = options.kind or model.rig.shaker.kind
    level = options.level(kind)
    if options.frequency is not None:
        return wear.Sine(options.frequency, level, options.kind, options.swept_from)
    if options.swept_from is not None:
        raise ClearanceError("--swept-from is of a sine; give its --frequency")
    if level == 0:
        return wear.Marched(still(options.duration, options.fs, kind))
    return wear.Marched(random(options.duration, options.fs, options.band, level, options.seed, kind))


def _predict(options: Options, model: Model, operation: wear.Operation) -> wear.Life | wear.Lives | wear.Remaining:
    limit, progress = by_bushing(options.gap_limit, "--gap-limit"), not options.quiet
    if options.history:
        history = wear.GapHistory.load(options.history, len(model.rig.bushings))
        return wear.predict_remaining(model, operation, history, limit, seed=options.seed, progress=progress)
    if not options.draws:
        return wear.predict_life(model, operation, limit, options.hours, progress=progress)
    runner = Runner(options.workers, progress=progress, kept=options.out / "draws")
    return wear.predict_lives(model, operation, limit, options.draws, options.seed, options.hours, runner=runner)
