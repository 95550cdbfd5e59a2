"""clearance-mj peaks: impacts per second and the largest values of an hour under random excitation."""

from __future__ import annotations

import argparse
from typing import Any

from ..core.errors import ClearanceError
from .command import command, results_of, settings, warn_of_depths, write_results
from .options import add_plugin, add_psd, add_rig, level, load_model, psd_of, seconds


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_rig(parser)
    add_psd(parser)
    option("--rms", type=level, help="m/s² or N, or such as 0.1g, to which the PSD is scaled (default: as it is)")
    option("--kind", choices=("base", "force"), help="what a PSD file excites (default: as the rig's shaker)")
    words = "contact_force, penetration or acceleration (default: %(default)s)"
    option("--quantity", default="contact_force", metavar="NAME", help=words)
    words = "such as 3N, 10um or 5g (SI without a unit): how likely it is exceeded"
    option("--limit", metavar="VALUE", help=words)
    option("--hours", type=float, default=1.0, help="time that is predicted, h (default: %(default)s)")
    option("--duration", type=seconds, default=60.0, help="s that are marched (default: %(default)s)")
    option("--seed", type=int, default=0, help="of the noise (default: %(default)s)")
    option("--engine", default="modal", help="links or modal (default: %(default)s)")
    add_plugin(parser, "an engine, a contact or a grease")


@command(
    "peaks", "predict impacts per second and the largest values of an hour under random excitation", _options,
    **results_of("peaks"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.units import si_value
    from ..report.peaks import draw, plain, rows, words
    from ..tolerance.limits import KINDS
    from ..tolerance.peaks import peaks_over_an_hour

    model = load_model(options)
    if (psd := psd_of(options, options.kind or model.rig.shaker.kind)) is None:
        raise ClearanceError("give --psd FILE or --road CLASS, one of them")
    psd = psd if options.rms is None else psd.scaled(options.rms(psd.kind))
    quantity = KINDS.get(options.quantity, options.quantity)
    limit = None if options.limit is None else si_value(options.limit, quantity)
    found = peaks_over_an_hour(
        model, psd, options.duration, options.seed, options.quantity, options.hours, limit,
        engine=options.engine,
    )  # fmt: skip
    result = settings(model) | {"psd": psd.to_dict(), "seed": options.seed, "engine": options.engine} | plain(found)
    print("\n".join(words(found)))
    warn_of_depths(model, found.median, found.quantity)
    print(f"peaks: {options.out / 'peaks.png'}")
    return write_results(options, "peaks", result, rows(found), draw(found))
