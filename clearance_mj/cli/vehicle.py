"""clearance-mj vehicle: run a manoeuvre with clearance in the steering."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .command import command, provenance
from .options import add_plugin, kmh


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("--manoeuvre", help="lane-change, slalom, obstacle-40, ... (default: a double lane change)")
    option("--speed", type=kmh, help="km/h, or such as 50mph (default: the manoeuvre's, 120 of the double lane change)")
    option("--controller", default="smc,mpc,smc-cm", help="comma-separated, or all (default: %(default)s)")
    add_plugin(parser, "a controller")
    option("--gap", default="0.2deg", help="half-gap: 0.2deg, 3.5mrad at the road wheel, or 0.15mm of the shaft")
    option("--assumed-gap", help="half-gap that controllers with a clearance model assume (default: --gap)")
    option("--regime", default="torque", help="torque or friction (default: %(default)s)")
    option("--plant", default="multi-body", help="multi-body or single-track (default: %(default)s)")
    option("--sensors", default="ideal", help="ideal, or car: those of a car, on its bus (default: %(default)s)")
    option("--length-factor", type=float, help="of the lane change (default: 1.75 to 96 km/h, then 2.5)")
    option("--seed", type=int, default=0, help="of the noise of sensors and road (default: %(default)s)")


@command(
    "vehicle", "run a manoeuvre with clearance in the steering", _options,
    out=Path("results/vehicle"), out_help="folder of the report (default: %(default)s)",
    writes=("report.html", "metrics.csv", "summary.json"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..report.vehicle import write_report
    from ..vehicle.controllers import CONTROLLERS
    from ..vehicle.experiment import Case, check, run_all
    from ..vehicle.manoeuvres import get_manoeuvre
    from ..vehicle.steering import parse_gap

    names = ("regime", "plant", "length_factor", "seed", "sensors", "manoeuvre")
    settings: dict[str, Any] = {name: getattr(options, name) for name in names}
    settings |= {"half_gap": parse_gap(options.gap)}
    settings |= {"assumed_gap": parse_gap(options.assumed_gap)} if options.assumed_gap else {}
    usual = get_manoeuvre(options.manoeuvre).speed if options.manoeuvre else 120.0
    speed = usual if options.speed is None else options.speed
    chosen = CONTROLLERS if options.controller == "all" else dict.fromkeys(options.controller.split(","))
    cases = [Case(name.strip(), speed, **settings) for name in chosen]
    for case in cases:
        check(case)
    outcomes = run_all(cases, progress=not options.quiet)
    found = write_report(outcomes, options.new, provenance(options))
    print(f"report: {options.out / 'report.html'}")
    return {"out": str(options.out), **found}
