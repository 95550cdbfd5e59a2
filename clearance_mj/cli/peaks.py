"""clearance-mj peaks: impacts per second and the largest values of an hour under random excitation."""

from __future__ import annotations

from ..core.errors import ClearanceError
from ..core.units import si_value
from ..report.peaks import draw, rows, summary_lines, to_dict
from ..tolerance.limits import KINDS
from ..tolerance.peaks import peaks_over_an_hour
from .command import RESULTS, Options, Result, command, option, settings, warn_of_depths
from .options import POWER_SPECTRUM, RIG, SEED, kind, level, load_model, plugin, psd_of, seconds


@command(
    "peaks", *RIG, *POWER_SPECTRUM,
    option("--rms", "m/s² or N, or such as 0.1g, to which the PSD is scaled (default: as it is)", level),
    kind(),
    option("--quantity", "contact_force, penetration or acceleration", default="contact_force", metavar="NAME"),
    option("--limit", "such as 3N, 10um or 5g (SI without a unit): how likely it is exceeded", metavar="VALUE"),
    option("--hours", "time that is predicted, h", float, 1.0),
    option("--duration", "s that are marched", seconds, 60.0),
    SEED,
    option("--engine", "links, modal or mjx", default="modal"),
    plugin("an engine, a contact or a grease"),
    writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Predict impacts per second and the largest values of an hour under random excitation."""
    model = load_model(options)
    if (psd := psd_of(options, options.kind or model.rig.shaker.kind)) is None:
        raise ClearanceError("give --psd FILE or --road CLASS, one of them")
    psd = psd if options.rms is None else psd.scaled(options.rms(psd.kind))
    quantity = KINDS.get(options.quantity, options.quantity)
    limit = None if options.limit is None else si_value(options.limit, quantity)
    peaks = peaks_over_an_hour(
        model, psd, options.duration, options.seed, options.quantity, options.hours, limit,
        engine=options.engine,
    )  # fmt: skip
    warn_of_depths(model, peaks.median, peaks.quantity)
    data = settings(model) | {"psd": psd.to_dict(), "seed": options.seed, "engine": options.engine} | to_dict(peaks)
    return Result(data, summary_lines(peaks), rows(peaks), [draw(peaks)])
