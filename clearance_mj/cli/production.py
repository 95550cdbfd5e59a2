"""clearance-mj production: how many of a production rattle, what that depends on, which tolerance to tighten."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, provenance
from .options import (
    MAX_NUMBERS,
    add_periodic,
    add_periodic_kind,
    add_plugin,
    add_psd,
    load_model,
    load_plugin,
    numbers,
    periodic_settings,
    psd_of,
)

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..model import Model
    from ..report.random_production import Hours
    from ..tolerance import Limit, Scatter


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_periodic(parser, None)
    add_periodic_kind(parser)
    option(
        "--scatter", metavar="FILE", help="file (TOML) of what scatters, or \"posterior\" of an identified model "
        "(default: the rig file's tolerances)",
    )  # fmt: skip
    option(
        "--limit", metavar="LIMIT", help='what must not be, such as "contact_force > 20 N" or "acceleration@3 > 5 g"'
    )
    option("--designs", type=int, default=1000, help="how many are drawn (default: %(default)s)")
    option("--seed", type=int, default=0, help="of the draws (default: %(default)s)")
    option(
        "--levels", type=numbers, default="0.5:10:20", metavar="A,...",
        help="amplitudes of a sine, m/s² of the base or N, or factors of the unbalances: a list, or a range "
        "FROM:TO:COUNT (default: %(default)s)",
    )  # fmt: skip
    option("--from", dest="start", type=float, default=5.0, metavar="HZ", help="(default: %(default)s)")
    option("--to", dest="stop", type=float, default=220.0, metavar="HZ", help="(default: %(default)s)")
    option("--steps", type=int, default=400, help="frequencies, evenly spaced (default: %(default)s)")
    option(
        "--sobol", type=int, metavar="SAMPLES",
        help="Sobol indices at the largest level: a power of 2; SAMPLES times (numbers + 2) more designs",
    )  # fmt: skip
    option(
        "--allowed", type=float, metavar="SHARE",
        help="say which tolerance to tighten so that at most this share, such as 0.01, touches (or exceeds --limit) up "
        "to the level of --up-to",
    )  # fmt: skip
    option("--up-to", type=float, metavar="LEVEL", help="level of --allowed (default: the largest of --levels)")
    add_psd(parser)
    option(
        "--rms", type=numbers, metavar="A,...",
        help="RMS to which the PSD is scaled, m/s² or N: a list, or a range FROM:TO:COUNT (default: as it is)",
    )  # fmt: skip
    option("--hours", type=float, default=1.0, help="of random excitation that are predicted, h (default: %(default)s)")
    option(
        "--duration", type=float, default=60.0, help="s of it that are marched of each design (default: %(default)s)"
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, help="processes (default: one for each core)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, such as tcp://10.0.0.1:8786")
    add_plugin(parser, "a contact or a grease")


@command(
    "production", "how many of a production rattle, exceed a limit or may jump; which tolerance to tighten", _options,
    out=Path("results/production"),
    out_help="folder for index.html, figures, production.csv and .json; a stopped run goes on (default: %(default)s)",
    writes=("index.html", "production.csv", "production.json"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    import numpy as np

    from ..report.production import words, write_production
    from ..report.tightening import tightening_words
    from ..tolerance import Scatter, production, rattle_sensitivity, tighten

    load_plugin(options.plugin)
    if not 1 <= options.steps <= MAX_NUMBERS:
        raise ClearanceError(f"--steps must be between 1 and {MAX_NUMBERS}, got {options.steps}")
    if options.up_to is not None and options.allowed is None:
        raise ClearanceError("--up-to is the level of --allowed: give both")
    model = load_model(options)
    scatter = options.scatter if options.scatter in (None, "posterior") else Scatter.load(options.scatter)
    if scatter == "posterior" and (options.sobol or options.allowed):
        raise ClearanceError("--sobol and --allowed need numbers that scatter, not a posterior")
    frequencies = np.linspace(options.start, options.stop, options.steps)
    kept = options.out / ".clearance-mj" / "designs" if options.out else None
    shared: dict[str, Any] = {
        "kind": options.kind, "workers": options.workers, "progress": not options.quiet,
        "kept": kept, "seed": options.seed,
    }  # fmt: skip
    found = production(
        model, scatter, options.limit, options.levels, frequencies, options.designs, scheduler=options.scheduler,
        **shared, **periodic_settings(options),
    )  # fmt: skip
    sensitivity = tightening = None
    numbers_of = scatter if isinstance(scatter, Scatter) else None
    if options.sobol:
        sensitivity = rattle_sensitivity(
            model, numbers_of, options.limit, max(options.levels), frequencies, options.sobol, **shared
        )
    if options.allowed is not None:
        at = max(options.levels) if options.up_to is None else options.up_to
        tightening = tighten(
            model, numbers_of, options.limit, at, frequencies, options.allowed, min(options.designs, 500), **shared
        )
    hours = _random(options, model, found.limit, scatter, kept)
    result = write_production(found, options.new, provenance(options), sensitivity, tightening, hours)
    print("\n  ".join(words(found)))
    if isinstance(numbers_of, Scatter) or model.rig.tolerances:
        for left in (numbers_of or Scatter.of_rig(model.rig)).left_out:
            print(f"note: {left} is left out: a production does not scatter by it")
    if hours:
        print("\n".join(hours.words()))
    if tightening:
        print("\n".join(tightening_words(tightening)))
    print(f"production: {options.out / 'index.html'}")
    return result | {"out": str(options.out)}


def _random(
    options: argparse.Namespace, model: Model, limit: Limit | None, scatter: Scatter | str | None, kept: Path | None
) -> Hours | None:
    """What random excitation does, if some was given."""
    from ..report.random_production import Hours
    from ..tolerance import drawn, random_production
    from ..tolerance.peaks import QUANTITIES

    psd = psd_of(options, options.kind or model.rig.shaker.kind)
    if psd is None:
        return None
    if limit and (limit.quantity not in QUANTITIES or limit.at):
        raise ClearanceError(f"--limit under random excitation is the largest of one of {', '.join(QUANTITIES)}")
    quantity, value = (limit.quantity, limit.value) if limit else ("contact_force", None)
    levels = options.rms or (psd.rms,)
    found = random_production(
        drawn(model, scatter, options.designs, options.seed), psd, levels, options.duration, options.seed, quantity,
        options.hours, value, options.workers, not options.quiet, kept,
    )  # fmt: skip
    names = model.rig.sensor_labels if quantity == "acceleration" else model.rig.clearance_labels
    return Hours(
        tuple(found), quantity, value, options.hours, psd.kind, tuple(model.rig.clearance_labels), tuple(names)
    )
