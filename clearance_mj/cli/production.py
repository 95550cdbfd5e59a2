"""clearance-mj production: how many of a production rattle, what that depends on, which tolerance to tighten."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .. import tolerance
from ..core.errors import ClearanceError
from ..periodic.excitation import excited_by
from ..report.production import rows, summary_lines, write_production
from ..report.random_production import RandomProduction
from ..report.tightening import tightening_words
from ..tolerance.peaks import QUANTITIES
from . import options as shared
from .command import Options, Result, command, option, settings, warn_of_depths

MOST_LEARNT_FROM = 500  # designs, of which it is learnt which tolerance to tighten


@command(
    "production", *shared.forced(None),
    option("--scatter", 'file (TOML) of what scatters, or "posterior" of an identified model (default: the rig '
           "file's tolerances)", metavar="FILE"),
    option("--limit", 'what must not be, such as "contact_force > 20 N" or "acceleration@3 > 5 g"', metavar="LIMIT"),
    option("--designs", "how many are drawn", int, 1000),
    shared.SEED, *shared.OVER_GRID,
    option("--sobol", "Sobol indices at the largest level: a power of 2; SAMPLES times (numbers + 2) more designs", int,
           metavar="SAMPLES"),
    option("--allowed", "say which tolerance to tighten so that at most this share, such as 0.01, touches (or exceeds "
           "--limit) up to the level of --up-to, and under random excitation; or what nominal gap does where none does",
           float, metavar="SHARE"),
    option("--up-to", "level of --allowed, of sines (default: the largest)", shared.level, metavar="LEVEL"),
    *shared.POWER_SPECTRUM,
    option("--rms", "RMS to which the PSD is scaled, m/s² or N: a list, such as 0.1g,1g, or FROM:TO:COUNT (default: as "
           "it is)", shared.levels, metavar="A,..."),
    option("--hours", "of random excitation that are predicted, h", float, 1.0),
    option("--duration", "s of it that are marched of each design", shared.seconds, 60.0),
    shared.WHERE, shared.plugin("a contact or a grease"),
    out="results/production",
    out_help="folder for index.html, figures, production.csv and .json; a stopped run goes on",
    writes=("index.html", "*.csv", "*.json", "tightened.toml", "tightened_random.toml"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Tell how many of a production rattle, exceed a limit or may jump; which tolerance to tighten."""
    if options.sobol is not None and (options.sobol < 2 or options.sobol & (options.sobol - 1)):
        raise ClearanceError(f"--sobol {options.sobol}: is no power of 2, such as 64, which Sobol' points need")
    if options.allowed is not None and not 0 < options.allowed < 1:
        raise ClearanceError(f"--allowed {options.allowed:g}: is no share between 0 and 1, such as 0.01")
    if options.up_to is not None and options.allowed is None:
        raise ClearanceError("--up-to is the level of --allowed: give both")
    posterior = options.scatter == "posterior"
    if posterior and (options.sobol or options.allowed):
        raise ClearanceError("--sobol and --allowed need numbers that scatter, not a posterior")
    model = shared.load_model(options)
    kind = excited_by(model, options.kind)
    levels, frequencies = shared.grid(options, kind, 1)
    limit = tolerance.Limit.parse(options.limit) if options.limit else None
    noise = shared.psd_of(options, options.kind or model.rig.shaker.kind)
    if options.rms and not noise:
        raise ClearanceError("--rms is of random excitation: give --psd FILE or --road CLASS")
    if noise and limit and (limit.quantity not in QUANTITIES or limit.at):
        raise ClearanceError(f"--limit under random excitation is the largest of one of {', '.join(QUANTITIES)}")
    of_sines = not noise or any(getattr(options, name) is not None for name in (*shared.GRID, "sobol", "up_to"))
    scatter = None
    if not posterior:
        scatter = tolerance.Scatter.load(options.scatter) if options.scatter else tolerance.Scatter.of_rig(model.rig)
    designs = tolerance.draw_designs(model, scatter or "posterior", options.designs, options.seed)
    kept = options.out / ".clearance-mj" / "designs"
    runner = tolerance.Runner(options.workers, options.scheduler, None, not options.quiet, kept)
    production = sensitivity = hours = None
    tightenings: dict[str, tolerance.Tightening] = {}
    tighter = options.allowed, min(options.designs, MOST_LEARNT_FROM), options.seed, runner
    if noise:
        quantity_limit = (limit.quantity, limit.value) if limit else ("contact_force", None)
        rms = options.rms(noise.kind) if options.rms else (noise.rms,)
        random = tolerance.Noise(noise, rms, options.duration, options.hours, *quantity_limit)
        hours = _compute_hours(designs, random, options.seed, runner)
        if options.allowed:
            tightenings["tightening_random"] = tolerance.random_tightening(model, scatter, random, *tighter)
    sines = tolerance.Sines(levels, frequencies, limit, options.kind, **shared.periodic_settings(options))
    if of_sines:
        production = tolerance.production(model, scatter or "posterior", sines, options.designs, options.seed, runner)
    if options.sobol:
        sensitivity = tolerance.rattle_sensitivity(model, scatter, sines, options.sobol, options.seed, runner)
    if of_sines and options.allowed:
        up_to = replace(sines, levels=[options.up_to(kind)]) if options.up_to else sines
        tightenings["tightening"] = tolerance.tighten(model, scatter, up_to, *tighter)
    runner.drop_unused()
    data = settings(model) | {"scatter": scatter.to_dict() if scatter else "posterior", "seed": options.seed}
    data |= {"frequency": frequencies.tolist()} if of_sines else {}
    data |= write_production(designs, options.new, production, sensitivity, tightenings, hours)
    for name, tightening in tightenings.items():
        if tightening.cheapest:
            tightening.scatter.save(options.new / f"{name.replace('ening', 'ened')}.toml")
    return Result(data, _report(production, scatter, hours, tightenings), rows(production) if production else None)


def _report(
    production: tolerance.Production | None, scatter: tolerance.Scatter | None, hours: RandomProduction | None,
    tightenings: dict[str, tolerance.Tightening],
) -> Iterator[str]:  # fmt: skip
    if production:
        yield "\n  ".join(summary_lines(production))
    for reason in scatter.left_out if scatter else ():
        yield f"note: {reason} is left out: a production does not scatter by it"
    yield from hours.words() if hours else ()
    for tightening in tightenings.values():
        yield from tightening_words(tightening)


def _compute_hours(
    designs: tolerance.Designs, noise: tolerance.Noise, seed: int, runner: tolerance.Runner
) -> RandomProduction:
    """Return the production's behaviour within hours of random excitation."""
    peaks, rig = tolerance.random_production(designs, noise, seed, runner), designs.nominal.rig
    warn_of_depths(designs.nominal, peaks[-1].largest[:, 1], noise.quantity)
    places = rig.sensor_labels if noise.quantity == "acceleration" else rig.clearance_labels
    return RandomProduction(tuple(peaks), noise, tuple(rig.clearance_labels), tuple(places))
